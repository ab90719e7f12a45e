//! What is asked and answered on the control socket: one JSON object a line.

use serde::{Deserialize, Serialize};

/// A request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// Is anybody there?
    Ping,
    /// How are the services?
    Ps,
    /// End a service and start it again, from its executable as it is now.
    Restart {
        /// Its name.
        service: String,
        /// Also when something flies and the service is critical for it.
        #[serde(default)]
        in_flight: bool,
    },
    /// End every service and start it again as after the system's start, to read plan and configurations anew. Nothing
    /// that was retained is kept. On the ground only.
    Reload,
    /// End a service and do not start it until it is released.
    Hold {
        /// Its name.
        service: String,
        /// Also when something flies and the service is critical for it.
        #[serde(default)]
        in_flight: bool,
    },
    /// Start a held service.
    Release {
        /// Its name.
        service: String,
    },
    /// The newest lines of a service's log (`supervisor` for this process's own).
    Logs {
        /// Its name.
        service: String,
        /// How many.
        #[serde(default = "hundred")]
        lines: usize,
    },
    /// Land what flies, then stop everything. The connection closes when nothing is left.
    Stop {
        /// Without landing.
        #[serde(default)]
        now: bool,
    },
}

fn hundred() -> usize {
    100
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "answer", rename_all = "kebab-case")]
pub enum Response {
    /// To a ping.
    Pong {
        /// The supervisor's process id.
        pid: u32,
        /// Name of the system.
        system: String,
        /// Its run directory, as it names things in shared memory by.
        run_dir: String,
        /// Manifest and overlays it runs.
        manifests: Vec<String>,
        /// Whether the world is simulated.
        simulated: bool,
    },
    /// How the services are.
    Services {
        /// Whether something flies.
        airborne: bool,
        /// What the supervisor is doing: running, landing or stopping.
        phase: String,
        /// Process id of the warden, when there is one.
        #[serde(default)]
        warden: Option<u32>,
        /// In the order of start.
        services: Vec<ServiceRow>,
    },
    /// Lines of a log, oldest first.
    Logs {
        /// Seconds since the supervisor's start, then the text.
        lines: Vec<String>,
    },
    /// It is being done.
    Done {
        /// One sentence.
        text: String,
    },
    /// It is not done.
    Refused {
        /// One sentence.
        reason: String,
    },
}

/// How one service is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ServiceRow {
    /// Its name.
    pub name: String,
    /// waiting, failing, starting, running, stopping, held or ended.
    pub state: String,
    /// Process id, when there is a process.
    pub pid: Option<u32>,
    /// Which start the present or last process is, from 0; absent before the first.
    pub incarnation: Option<u32>,
    /// Starts after the first.
    pub restarts: u32,
    /// Seconds since the last start.
    pub age_s: Option<f64>,
    /// Seconds since the last heartbeat.
    pub heartbeat_age_s: Option<f64>,
    /// Silences longer than the manifest allows on the topics it publishes, since the last start.
    pub missed_deadlines: u64,
    /// flight, mission or comfort.
    pub criticality: String,
    /// What it last said of itself.
    pub status: String,
    /// How its last process ended and what it printed last; empty before that.
    pub last_end: String,
}
