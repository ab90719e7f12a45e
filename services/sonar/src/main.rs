//! The sonar process.

fn main() -> std::process::ExitCode {
    runtime::main::<sonar::Sonar>(runtime::NoDevices)
}
