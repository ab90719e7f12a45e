//! The simulator process.

fn main() -> std::process::ExitCode {
    runtime::main::<simulator::Simulator>(simulator::PtyDevices)
}
