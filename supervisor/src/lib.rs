//! Creates and holds all shared memory, keeps retained state, spawns, watches, reaps, restarts.
//!
//! One process, one thread, one loop over `poll`: child ends, heartbeats, requests, log pipes and timers. It
//! depends on no service and on no async runtime. Every service is a child process:
//!
//! - it is started in the order of its criticality and speaks plain `sd_notify` (`READY=1`, `WATCHDOG=1`,
//!   `STATUS=...`, `STOPPING=1`) to the supervisor's socket;
//! - when it ends, what it retained is saved, what it left in shared memory is cleaned up, and it is started
//!   again by its policy: at once the first time, then with a delay that doubles to a cap ([`life::Life`]);
//! - when it is silent for longer than its heartbeat it is killed, which is an end like any other;
//! - what it prints is kept, bounded, and shown by `sereno logs`.
//!
//! The first SIGTERM or Ctrl-C lands what flies, then stops the services in reverse order and removes
//! everything from shared memory and the run directory; the second one stops at once. Should this process die instead,
//! its warden does the same.

mod above;
mod child;
pub mod client;
mod control;
mod error;
mod landing;
pub mod life;
mod log;
mod notify;
mod options;
mod place;
pub mod protocol;
mod shared;
mod show;
mod signals;
mod supervisor;
mod warden;

pub use client::{Client, ClientError};
pub use error::SupervisorError;
pub use options::{Echo, Options, default_run_dir, parse_arguments};
pub use shared::{NoSharedMemory, Part, SharedMemory};

use runtime::shm::RunDir;

/// Starts the system and watches it until it is told to stop; returns when nothing of it is left.
///
/// Starts this executable once more with the same arguments, which must lead here again: in that process this does not
/// return but is the warden.
///
/// # Errors
/// A manifest that does not hold together, a run directory that another supervisor holds or that is not
/// private, shared memory, sockets or a warden that cannot be made. A service that fails is not an error: it is
/// restarted, and shown.
pub fn run(options: &Options) -> Result<(), SupervisorError> {
    run_with(options, shared::Held::of)
}

/// [`run`] with other shared memory: made by `open` under the lock with no child alive, and once more in the warden.
///
/// # Errors
/// As [`run`].
pub fn run_with<S: SharedMemory>(
    options: &Options,
    open: impl FnOnce(Part, &manifest::Manifest, &RunDir) -> Result<S, SupervisorError>,
) -> Result<(), SupervisorError> {
    if warden::is_wanted() {
        let code = warden::serve(options, |manifest, run_dir| open(Part::Warden, manifest, run_dir));
        // What the caller does after its system has stopped is not the warden's to do.
        std::process::exit(code);
    }
    let create = |manifest: &_, run_dir: &_| open(Part::Supervisor, manifest, run_dir);
    supervisor::Supervisor::start(options, create)?.run()
}
