//! All services in one process on a simulated clock.

pub(crate) mod bus;
mod feed;
mod replay;

pub use replay::Replay;

use crate::config::read_config;
use crate::device::NoDevices;
use crate::port::StepContext;
use crate::ports::BusKind;
use crate::{Cache, Instance, Ports, Service, Start, StartError, mix_seed, name_hash};
use bus::Bus;
use manifest::Manifest;
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// A service with its type forgotten.
trait AnyService {
    fn step(&mut self, now: u64);
    fn refused(&self) -> u64;
    fn status(&self, text: &mut ipc_types::Text<96>);
}

impl<S: Service> AnyService for Instance<S> {
    fn step(&mut self, now: u64) {
        Instance::step(self, now);
    }
    fn refused(&self) -> u64 {
        self.service().refused()
    }
    fn status(&self, text: &mut ipc_types::Text<96>) {
        self.service().status(text);
    }
}

struct Running {
    name: &'static str,
    service: Box<dyn AnyService>,
    period_ns: u64,
    next_tick: u64,
    next_wake: u64,
}

/// Latest start of a tick after its due time: the timer slack of a loaded machine.
const TICK_LATENESS_NS: u64 = 300_000;

/// A whole system in one process: the services of the manifest, stepped in the order of time, each
/// message visible after a seeded delay. The same seed gives the same flight, byte for byte.
pub struct Lockstep {
    manifest: Rc<Manifest>,
    root: PathBuf,
    seed: u64,
    cache: Cache,
    bus: Rc<Bus>,
    services: Vec<Running>,
    tools: Vec<Rc<StepContext>>,
    incarnations: Vec<(&'static str, u32)>,
    now: u64,
    ticks: u64,
    steps: u64,
    watch: fn(Option<&'static str>),
}

impl Lockstep {
    /// An empty system. `root` is the directory that the manifest's paths start from.
    #[must_use]
    pub fn new(manifest: Manifest, root: &Path, seed: u64, cache: Cache) -> Self {
        Self {
            manifest: Rc::new(manifest),
            root: root.to_owned(),
            seed,
            cache,
            bus: Bus::new(mix_seed(seed, 0x0062_7573)),
            services: Vec::new(),
            tools: Vec::new(),
            incarnations: Vec::new(),
            now: 0,
            ticks: 0,
            steps: 0,
            watch: |_| {},
        }
    }

    /// Has `watch` called with a service's name just before each of its steps and with `None` just after, for
    /// tests that ask what a step does to the process. It is shown no service and no message, so that nothing
    /// measured can change a flight.
    pub fn watch_steps(&mut self, watch: fn(Option<&'static str>)) {
        self.watch = watch;
    }

    /// The simulated clock, nanoseconds.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Steps made so far by all services together.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Starts a service with the configuration file that the manifest names.
    ///
    /// # Errors
    /// As the service's own start.
    pub fn add<S: Service + 'static>(&mut self) -> Result<(), StartError> {
        let (config, hash) = read_config(&self.root, &self.entry(S::NAME)?.config)?;
        self.launch::<S>(config, hash)
    }

    /// The configuration of a service as the manifest's file gives it.
    ///
    /// # Errors
    /// When the file is missing or wrong.
    pub fn config<S: Service>(&self) -> Result<S::Config, StartError> {
        Ok(read_config(&self.root, &self.entry(S::NAME)?.config)?.0)
    }

    fn entry(&self, name: &str) -> Result<&manifest::ServiceEntry, StartError> {
        self.manifest
            .services
            .get(name)
            .ok_or_else(|| StartError::Manifest(format!("the manifest has no service {name}")))
    }

    /// Starts a service with a configuration of the caller's.
    ///
    /// # Errors
    /// As the service's own start.
    pub fn add_with<S: Service + 'static>(&mut self, config: S::Config) -> Result<(), StartError> {
        self.launch::<S>(config, 0)
    }

    fn launch<S: Service + 'static>(
        &mut self,
        config: S::Config,
        config_hash: u64,
    ) -> Result<(), StartError> {
        let entry = self.entry(S::NAME)?;
        let period_ns = if entry.tick_hz > 0.0 { (1e9 / entry.tick_hz) as u64 } else { u64::MAX };
        let incarnation = match self.incarnations.iter_mut().find(|(name, _)| *name == S::NAME) {
            Some((_, incarnation)) => {
                *incarnation += 1;
                *incarnation
            }
            None => {
                self.incarnations.push((S::NAME, 0));
                0
            }
        };
        let start = Start::new(
            self.manifest.system.clone(),
            &self.root,
            Start::service_seed(self.seed, S::NAME),
            incarnation,
            true,
            self.cache.clone(),
        )?;
        let ports = self.ports(S::NAME, incarnation);
        let instance = Instance::<S>::start(config, config_hash, ports, &start)?;
        // The first tick of each service falls somewhere within its first period.
        let phase = if period_ns == u64::MAX {
            u64::MAX
        } else {
            self.now + 1 + mix_seed(start.seed, u64::from(incarnation)) % period_ns
        };
        self.services.push(Running {
            name: S::NAME,
            service: Box::new(instance),
            period_ns,
            next_tick: phase,
            next_wake: u64::MAX,
        });
        Ok(())
    }

    fn ports(&self, name: &str, incarnation: u32) -> Ports {
        let retained = match self.manifest.services.get(name) {
            Some(entry) if incarnation > 0 => entry.retained().map(str::to_owned).collect(),
            _ => Vec::new(),
        };
        Ports::new(
            BusKind::Lockstep(Rc::clone(&self.bus)),
            Rc::clone(&self.manifest),
            name,
            (incarnation, self.now),
            retained,
            Box::new(NoDevices),
        )
    }

    /// Ports for a program beside the services: a scorer, a test, the command line.
    pub fn tool(&mut self, name: &str) -> Ports {
        let ports = self.ports(name, 0);
        self.tools.push(Rc::clone(&ports.context));
        ports
    }

    /// Ends a service at once, as SIGKILL would. It may be added again: the keeper then gives it what it
    /// published last on its retained topics.
    pub fn kill(&mut self, name: &str) {
        self.services.retain(|running| running.name != name);
        self.bus.died(name_hash(name));
    }

    /// Messages refused by a service because they made no sense; 0 for one that does not run.
    #[must_use]
    pub fn refused(&self, name: &str) -> u64 {
        self.services
            .iter()
            .find(|running| running.name == name)
            .map_or(0, |running| running.service.refused())
    }

    /// What a service says of itself.
    #[must_use]
    pub fn status(&self, name: &str) -> String {
        let mut text = ipc_types::Text::default();
        if let Some(running) = self.services.iter().find(|running| running.name == name) {
            running.service.status(&mut text);
        }
        text.as_str().to_owned()
    }

    /// Runs until the simulated clock reaches `until`.
    pub fn run_until(&mut self, until: u64) {
        while let Some((index, due)) = self.next_due() {
            if due > until {
                break;
            }
            self.step(index, due);
        }
        self.set_now(until);
    }

    fn next_due(&self) -> Option<(usize, u64)> {
        self.services
            .iter()
            .enumerate()
            .map(|(index, running)| (index, running.next_tick.min(running.next_wake)))
            .filter(|(_, due)| *due < u64::MAX)
            .min_by_key(|(_, due)| *due)
    }

    fn set_now(&mut self, now: u64) {
        self.now = self.now.max(now);
        self.bus.set_now(self.now);
        for tool in &self.tools {
            tool.now.set(self.now);
        }
    }

    fn step(&mut self, index: usize, due: u64) {
        self.set_now(due);
        let lateness = mix_seed(self.seed, self.ticks) % TICK_LATENESS_NS;
        let Some(running) = self.services.get_mut(index) else { return };
        if running.next_tick <= due {
            self.ticks += 1;
            // Ticks keep their raster; only this one is late.
            let raster = running.next_tick - running.next_tick % running.period_ns + running.period_ns;
            running.next_tick = raster + lateness.min(running.period_ns / 4);
        }
        (self.watch)(Some(running.name));
        running.service.step(self.now);
        (self.watch)(None);
        self.steps += 1;
        for running in &mut self.services {
            running.next_wake = self.bus.next_wake(running.name, self.now);
        }
    }
}
