//! The bridge as a process.
use std::process::ExitCode;

fn main() -> ExitCode {
    if let Err(sentence) = bridge::threads::ensure() {
        use std::io::Write;
        // Whoever read this may have gone.
        let _ = writeln!(std::io::stderr(), "bridge: {sentence}");
        return ExitCode::FAILURE;
    }
    runtime::main::<bridge::Bridge>(runtime::NoDevices)
}
