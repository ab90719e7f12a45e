//! One start of a service: what both buses step.

use crate::journal::Journal;
use crate::{Ports, Service, Start, StartError};

/// A service that runs, with its ports and its journal. The process of a service, the lockstep bus and a replay all
/// step it through this, so that none of them can journal in a way of its own.
pub struct Instance<S: Service> {
    service: S,
    ports: Ports,
    journal: Journal,
}

impl<S: Service> Instance<S> {
    /// Starts a service on its ports and journals the start. `config_hash` is the hash of the configuration file, 0
    /// without one.
    ///
    /// # Errors
    /// As the service's own start; also when it does not open what the manifest lists for it.
    pub fn start(
        config: S::Config,
        config_hash: u64,
        mut ports: Ports,
        start: &Start,
    ) -> Result<Self, StartError> {
        let mut journal = Journal::open(&mut ports)?;
        let service = S::start(config, &mut ports, start)?;
        ports.check_all_opened()?;
        journal.begin(&ports, start, config_hash);
        Ok(Self { service, ports, journal })
    }

    /// One step at `now`, nanoseconds of the bus's clock, and its entry in the journal.
    pub fn step(&mut self, now: u64) {
        self.ports.context.now.set(now);
        self.service.step(now);
        self.journal.step();
    }

    /// The service itself.
    #[must_use]
    pub fn service(&self) -> &S {
        &self.service
    }

    pub(crate) fn ports(&self) -> &Ports {
        &self.ports
    }

    /// Steps since start.
    pub(crate) fn steps(&self) -> u64 {
        self.journal.steps()
    }
}
