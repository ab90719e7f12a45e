//! Why there is no system.

use std::path::PathBuf;

/// One sentence on why the supervisor cannot run.
#[derive(Debug, thiserror::Error)]
pub enum SupervisorError {
    /// The manifest is missing, wrong or does not hold together.
    #[error("{0}")]
    Manifest(String),
    /// Another supervisor is at work, or the warden of one that died.
    #[error("{}: already in use by {holder}", .run_dir.display())]
    AlreadyRunning {
        /// The contested run directory.
        run_dir: PathBuf,
        /// Who, with the process id and what goes on, as the holder wrote it.
        holder: String,
    },
    /// Nobody would land the aircraft if the supervisor died.
    #[error("cannot start the warden, which is to land the aircraft should the supervisor die: {0}")]
    Warden(String),
    /// A run directory that others can read or that is somebody else's.
    #[error("{}: {reason}", .run_dir.display())]
    RunDir {
        /// The run directory.
        run_dir: PathBuf,
        /// What is wrong and what to do.
        reason: String,
    },
    /// Children of an earlier supervisor do not end.
    #[error("{}: processes {pids} of an earlier supervisor cannot be ended", .run_dir.display())]
    Orphans {
        /// The run directory.
        run_dir: PathBuf,
        /// Their process ids.
        pids: String,
    },
    /// Shared memory cannot be made.
    #[error("shared memory: {0}")]
    SharedMemory(String),
    /// The operating system refuses something.
    #[error("{doing}: {source}")]
    System {
        /// What was tried.
        doing: String,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The command line makes no sense.
    #[error("{0}")]
    Usage(String),
}

/// Adds what was being tried to an error of the operating system.
pub(crate) fn while_doing<E: Into<std::io::Error>>(
    doing: impl Into<String>,
) -> impl FnOnce(E) -> SupervisorError {
    move |source| SupervisorError::System { doing: doing.into(), source: source.into() }
}
