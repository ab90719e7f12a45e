//! What the supervisor does with shared memory, behind a trait: process tests need none.

use crate::SupervisorError;
use ipc_types::{COMMAND_LIFE_NS, Command, Phase, Text, Verb};
use manifest::Manifest;
use runtime::shm::{Holder, RunDir};

/// Which process it is that needs shared memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Creates and holds everything.
    Supervisor,
    /// Opens what it takes to land.
    Warden,
}

/// Shared memory as the supervisor needs it, and its warden, who only looks and lands. Dropping it gives everything back.
pub trait SharedMemory {
    /// Takes what was published on retained topics and serves those who join. Called every few milliseconds.
    fn keep(&mut self);
    /// After `service` ended and was reaped: saves what it retained, cleans up what it left behind. Returns
    /// the retained topics that its next start will be offered.
    fn recover(&mut self, service: &str) -> Vec<String>;
    /// Cleans up after dead programs that are no services. Called about once a second.
    fn tidy(&mut self);
    /// Whether something flies, as the pilot last said.
    fn airborne(&self) -> bool;
    /// Tells the pilot to land; `sequence` is the same for repetitions of one order.
    fn land(&mut self, sequence: u32);
}

/// Nothing at all.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoSharedMemory;

impl SharedMemory for NoSharedMemory {
    fn keep(&mut self) {}
    fn recover(&mut self, _service: &str) -> Vec<String> {
        Vec::new()
    }
    fn tidy(&mut self) {}
    fn airborne(&self) -> bool {
        false
    }
    fn land(&mut self, _sequence: u32) {}
}

/// All topics, events and keeper channels of the manifest; of the warden, two topics.
pub(crate) struct Held(Holder);

impl Held {
    pub(crate) fn of(part: Part, manifest: &Manifest, run_dir: &RunDir) -> Result<Self, SupervisorError> {
        let holder = match part {
            Part::Supervisor => Holder::create(manifest, run_dir),
            Part::Warden => Holder::join("warden", manifest, run_dir),
        };
        holder.map(Self).map_err(|e| SupervisorError::SharedMemory(e.to_string()))
    }
}

impl SharedMemory for Held {
    fn keep(&mut self) {
        self.0.keep();
    }

    fn recover(&mut self, service: &str) -> Vec<String> {
        let topics = self.0.restore(service);
        self.0.cleanup_dead_nodes();
        topics
    }

    fn tidy(&mut self) {
        self.0.cleanup_dead_tools();
    }

    fn airborne(&self) -> bool {
        // A phase that this build does not know is no reason to cut the motors.
        self.0
            .pilot_state()
            .is_some_and(|state| !matches!(Phase::from_code(state.phase), Some(Phase::Grounded | Phase::Cut)))
    }

    fn land(&mut self, sequence: u32) {
        let now = runtime::monotonic_ns();
        let command = Command {
            expiry_ns: now.saturating_add(COMMAND_LIFE_NS),
            x_m: f32::NAN,
            y_m: f32::NAN,
            verb: u32::from(Verb::Land.code()),
            command_sequence: sequence,
            account: Text::new("supervisor"),
            role: Text::new("system"),
            ..Command::default()
        };
        // Not taken now: the order is repeated.
        let _ = self.0.publish_command(&command, now);
    }
}
