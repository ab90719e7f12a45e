//! The process that renders the simulated camera's picture.

fn main() -> std::process::ExitCode {
    runtime::main::<simulator::Scenery>(runtime::NoDevices)
}
