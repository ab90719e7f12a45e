//! One thread for all that zenoh reads and writes over TLS: as `bridge/src/threads.rs`, which says why.

use std::os::unix::process::CommandExt;
use std::process::Command;

const VARIABLE: &str = "ZENOH_RUNTIME";
const ONE_THREAD: &str = "(rx: (handover: tx), tx: (worker_threads: 1))";

/// Starts this process's own executable again in its place when zenoh would have more. To be called before anything else.
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
