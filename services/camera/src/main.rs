//! The camera process.

fn main() -> std::process::ExitCode {
    runtime::main::<camera::Camera>(runtime::NoDevices)
}
