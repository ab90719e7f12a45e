//! `health/<service>`: how a process is doing, by a real clock.

use crate::{Instance, Output, Ports, Service, StartError};
use ipc_types::{Health, Message, Text};

/// Times of steps since the last report. On shared memory only: in lockstep there is no real clock to tell of.
pub(crate) struct HealthReport {
    health: Output<Health>,
    longest: u64,
    total: u64,
    counted: u64,
    lateness: u64,
}

impl HealthReport {
    pub(crate) fn open(ports: &mut Ports) -> Result<Self, StartError> {
        let health = ports.output_of(&format!("{}/{}", Health::TOPIC, ports.service))?;
        Ok(Self { health, longest: 0, total: 0, counted: 0, lateness: 0 })
    }

    /// Notes a step: what it took and how late it was, nanoseconds.
    pub(crate) fn step(&mut self, took: u64, lateness: u64) {
        self.longest = self.longest.max(took);
        self.total += took;
        self.counted += 1;
        self.lateness = self.lateness.max(lateness);
    }

    /// Answers how many deadlines were missed.
    pub(crate) fn publish<S: Service>(&mut self, now: u64, text: &Text<96>, instance: &Instance<S>) -> u64 {
        let ports = instance.ports();
        for output in &ports.outputs {
            output.watch(now);
        }
        let missed = ports.outputs.iter().map(|output| output.missed()).sum();
        let health = Health {
            steps: instance.steps(),
            lost: ports.inputs.iter().map(|input| input.lost()).sum(),
            refused: instance.service().refused(),
            unheard: ports.inputs.iter().map(|input| input.failures()).sum(),
            unsent: ports.outputs.iter().map(|output| output.unsent()).sum(),
            missed,
            longest_step_ns: self.longest,
            mean_step_ns: self.total / self.counted.max(1),
            lateness_ns: self.lateness,
            pid: std::process::id(),
            status: *text,
            ..Health::default()
        };
        self.health.publish(&health);
        (self.longest, self.total, self.counted, self.lateness) = (0, 0, 0, 0);
        missed
    }
}
