//! The flight process.

fn main() -> std::process::ExitCode {
    runtime::main::<flight::Flight>(flight::SerialPorts)
}
