//! The pilot process.

fn main() -> std::process::ExitCode {
    runtime::main::<pilot::Pilot>(runtime::NoDevices)
}
