//! A service as its own process.

use crate::config::read_config;
use crate::device::Devices;
use crate::health::HealthReport;
use crate::notify::Notifier;
use crate::ports::BusKind;
use crate::shm::{RunDir, SharedNode, woken_within};
use crate::{Cache, Input, Instance, Ports, Service, Start, StartError};
use ipc_types::{Message, Text};
use manifest::Manifest;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The environment in which the supervisor starts a service.
pub mod env {
    /// Manifest and overlays, separated by `:`.
    pub const MANIFEST: &str = "SERENO_MANIFEST";
    /// The run directory of the system.
    pub const RUN_DIR: &str = "SERENO_RUN_DIR";
    /// Seed of the system; services derive their own from it.
    pub const SEED: &str = "SERENO_SEED";
    /// Which start of this service, from 0.
    pub const INCARNATION: &str = "SERENO_INCARNATION";
    /// Retained topics that the keeper offers to this start, separated by `,`.
    pub const RETAINED: &str = "SERENO_RETAINED";
    /// The run directory, for every service and whatever it starts: by this they are found again when their
    /// supervisor has died. They live on then: its warden lands what flies, and ends them after that.
    pub const SUPERVISED: &str = "SERENO_SUPERVISED";
    /// The service's name in the manifest.
    pub const SERVICE: &str = "SERENO_SERVICE";
}

/// Now, nanoseconds of `CLOCK_MONOTONIC`.
#[must_use]
pub fn monotonic_ns() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec.cast_unsigned() * 1_000_000_000 + time.tv_nsec.cast_unsigned()
}

/// Runs a service as this process until SIGTERM; the whole `main` of a service.
pub fn main<S: Service>(devices: impl Devices + 'static) -> ExitCode {
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_target(false)
        .without_time()
        // It would complain with `eprintln!`, which panics when the supervisor, who read the pipe, has died: in the air.
        .log_internal_errors(false)
        .init();
    let notifier = Notifier::from_environment();
    match run::<S>(Box::new(devices), &notifier) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{}: {error}", S::NAME);
            notifier.say(&format!("STATUS=cannot start: {error}"));
            ExitCode::FAILURE
        }
    }
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok().filter(|value| !value.is_empty())
}

fn number<N: std::str::FromStr>(name: &str, absent: N) -> Result<N, StartError> {
    match variable(name) {
        None => Ok(absent),
        Some(text) => {
            text.parse().map_err(|_| StartError::Invalid(format!("{name}={text} is not a number in range")))
        }
    }
}

/// Reads the manifest and its overlays, given as paths separated by `:`.
///
/// # Errors
/// When a file is missing or wrong, or the wiring does not hold together.
pub fn load_manifest(paths: &str) -> Result<(Manifest, PathBuf), StartError> {
    let mut loaded: Option<(Manifest, PathBuf)> = None;
    for path in paths.split(':').filter(|path| !path.is_empty()) {
        let text = std::fs::read_to_string(path)
            .map_err(|reason| StartError::Read { path: path.to_owned(), reason })?;
        loaded = Some(match loaded {
            None => {
                let root = Path::new(path).parent().unwrap_or(Path::new(".")).to_owned();
                (Manifest::parse(path, &text).map_err(|error| StartError::Manifest(error.to_string()))?, root)
            }
            Some((manifest, root)) => (
                manifest.overlay(path, &text).map_err(|error| StartError::Manifest(error.to_string()))?,
                root,
            ),
        });
    }
    let (manifest, root) =
        loaded.ok_or_else(|| StartError::Manifest(format!("{} names no manifest", env::MANIFEST)))?;
    manifest.check(&known_topics()).map_err(|error| StartError::Manifest(error.to_string()))?;
    Ok((manifest, root))
}

/// Every topic that a message type is known for; families by their first part.
#[must_use]
pub fn known_topics() -> Vec<&'static str> {
    struct Names(Vec<&'static str>);
    impl ipc_types::TopicVisitor for Names {
        type Output = ();
        fn visit<T: Message>(&mut self) {
            self.0.push(T::TOPIC);
        }
    }
    let mut names = Names(Vec::new());
    ipc_types::visit_all(&mut names);
    names.0
}

fn run<S: Service>(devices: Box<dyn Devices>, notifier: &Notifier) -> Result<(), StartError> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        signal_hook::flag::register(signal, Arc::clone(&stop)).map_err(StartError::invalid)?;
    }
    let paths = variable(env::MANIFEST)
        .ok_or_else(|| StartError::Manifest(format!("{} is not set: which manifest?", env::MANIFEST)))?;
    let (manifest, root) = load_manifest(&paths)?;
    let run_dir =
        RunDir::new(variable(env::RUN_DIR).ok_or_else(|| {
            StartError::Manifest(format!("{} is not set: which run directory?", env::RUN_DIR))
        })?);
    let incarnation = number(env::INCARNATION, 0_u32)?;
    let entry = manifest
        .services
        .get(S::NAME)
        .ok_or_else(|| StartError::Manifest(format!("{} has no service {}", manifest.file, S::NAME)))?;

    let (config, config_hash) = read_config(&root, &entry.config)?;
    let simulated = manifest.system.simulated;
    let start = Start::new(
        manifest.system.clone(),
        &root,
        Start::service_seed(number(env::SEED, 0)?, S::NAME),
        incarnation,
        simulated,
        Cache::default(),
    )?;

    let node = SharedNode::open(S::NAME, &run_dir, simulated)?;
    let listener = node.listener(S::NAME)?;
    let heartbeat = Duration::from_millis(u64::from(entry.heartbeat_ms.max(30))) / 3;
    let period_ns = if entry.tick_hz > 0.0 { (1e9 / entry.tick_hz) as u64 } else { u64::MAX };
    let mut ports = Ports::new(
        BusKind::Shared(Rc::clone(&node)),
        Rc::new(manifest),
        S::NAME,
        (incarnation, monotonic_ns()),
        variable(env::RETAINED).unwrap_or_default().split(',').map(str::to_owned).collect(),
        devices,
    );
    let mut health = HealthReport::open(&mut ports)?;
    let mut instance = Instance::<S>::start(config, config_hash, ports, &start)?;
    notifier.say("READY=1");
    tracing::info!("{} ready (start {incarnation})", S::NAME);
    for topic in &instance.ports().forgotten {
        tracing::warn!("{}: the keeper did not answer: started without its memory of {topic}", S::NAME);
    }

    let mut next_tick = monotonic_ns();
    let mut next_heartbeat = next_tick;
    while !stop.load(Ordering::Relaxed) {
        let now = monotonic_ns();
        let due = next_tick.min(next_heartbeat);
        let woken = woken_within(&listener, instance.ports().waker.as_ref(), due.saturating_sub(now));
        let now = monotonic_ns();
        let lateness = now.saturating_sub(next_tick);
        if woken || now >= next_tick {
            if now >= next_tick && period_ns != u64::MAX {
                // Missed ticks are not made up for: the next one keeps the raster.
                let missed = (now - next_tick) / period_ns;
                next_tick += (missed + 1) * period_ns;
            } else if period_ns == u64::MAX {
                next_tick = u64::MAX;
            }
            instance.step(now);
            health.step(monotonic_ns() - now, lateness);
        }
        if now >= next_heartbeat {
            next_heartbeat = now + heartbeat.as_nanos() as u64;
            let mut text = Text::<96>::default();
            if !instance.ports().forgotten.is_empty() {
                // What does not fit behind it is cut.
                let _ = text.write_str("WITHOUT ITS MEMORY: ");
            }
            instance.service().status(&mut text);
            let missed = health.publish(now, &text, &instance);
            notifier.beat(&text, missed);
            node.serve_late_joiners();
        }
    }
    notifier.say("STOPPING=1");
    tracing::info!("{} stopped", S::NAME);
    Ok(())
}

/// Ports of a program beside the services: the command line, a scorer, a test.
pub struct Tool {
    /// Its ports, checked against its entry among the manifest's tools.
    pub ports: Ports,
    node: Rc<SharedNode>,
}

impl Tool {
    /// Joins a running system.
    ///
    /// # Errors
    /// When the manifest or the shared memory refuses.
    pub fn join(name: &str, manifest: Manifest, run_dir: &RunDir) -> Result<Self, StartError> {
        let node = SharedNode::open(name, run_dir, true)?;
        let ports = Ports::new(
            BusKind::Shared(Rc::clone(&node)),
            Rc::new(manifest),
            name,
            (std::process::id(), monotonic_ns()),
            Vec::new(),
            Box::new(crate::NoDevices),
        );
        Ok(Self { ports, node })
    }

    /// Joins a running system as a service that is started again, which the keeper offers `topics`.
    ///
    /// # Errors
    /// As [`Tool::join`].
    pub fn restarted(
        name: &str,
        manifest: Manifest,
        run_dir: &RunDir,
        topics: Vec<String>,
    ) -> Result<Self, StartError> {
        let mut tool = Self::join(name, manifest, run_dir)?;
        tool.ports.retained = topics;
        Ok(tool)
    }

    /// Sets the time that messages sent from now on are stamped with.
    pub fn tick(&self) {
        self.ports.context.now.set(monotonic_ns());
        self.node.serve_late_joiners();
    }

    /// Whether an input has something: takes the newest message.
    pub fn latest<T: Message>(input: &mut Input<T>) -> Option<T> {
        input.latest().map(|guard| *guard)
    }
}
