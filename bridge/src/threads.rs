//! One thread for all that zenoh reads and writes over TLS.
//!
//! Zenoh 1.10 lets one thread read a TLS connection while another writes it, and rustls allows neither: under load the
//! process ends in corrupted memory (<https://github.com/eclipse-zenoh/zenoh/issues/2557>; seen here in each flood of ten
//! thousand orders). With one worker for both directions the two take turns.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// Where zenoh reads how many threads it may have. It does so once, so this must stand before the process begins.
pub const VARIABLE: &str = "ZENOH_RUNTIME";
/// Reading is handed over to the one thread that writes.
pub const ONE_THREAD: &str = "(rx: (handover: tx), tx: (worker_threads: 1))";

/// Makes sure that zenoh has one thread for both: starts this process's own executable again in its place, with the same
/// arguments, when that is not yet said. To be called before anything else.
///
/// # Errors
/// One sentence when the executable cannot be started again; then nothing must be opened.
pub fn ensure() -> Result<(), String> {
    if std::env::var(VARIABLE).is_ok_and(|value| value == ONE_THREAD) {
        return Ok(());
    }
    let failed = |error: std::io::Error| format!("cannot start again with {VARIABLE}={ONE_THREAD}: {error}");
    let program = std::env::current_exe().map_err(failed)?;
    let mut words = std::env::args_os();
    let mut command = Command::new(program);
    if let Some(name) = words.next() {
        command.arg0(name);
    }
    Err(failed(command.args(words).env(VARIABLE, ONE_THREAD).exec()))
}
