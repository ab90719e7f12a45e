//! The flow process.

fn main() -> std::process::ExitCode {
    runtime::main::<flow::Flow>(flow::SerialPorts)
}
