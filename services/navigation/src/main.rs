//! The navigation process.

fn main() -> std::process::ExitCode {
    runtime::main::<navigation::Navigation>(runtime::NoDevices)
}
