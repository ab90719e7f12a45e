//! The bridge as a process.
use std::process::ExitCode;

fn main() -> ExitCode {
    runtime::main::<bridge::Bridge>(runtime::NoDevices)
}
