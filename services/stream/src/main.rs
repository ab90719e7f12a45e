//! The stream process.

fn main() -> std::process::ExitCode {
    runtime::main::<stream::Stream>(runtime::NoDevices)
}
