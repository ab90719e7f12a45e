//! The manifest as the rest of the house sees it: complete and within range.

use crate::error::ManifestError;
use crate::raw::RawManifest;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// What the system as a whole is given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct System {
    /// Name of the drone, as in `sereno/<name>/telemetry/...`.
    pub name: String,
    /// Floor plan header (ROS `map_server` YAML), relative to the deploy directory.
    pub plan: String,
    /// Vehicle file, relative to the deploy directory.
    pub vehicle: String,
    /// World file of the simulator, relative to the deploy directory; empty without simulation.
    pub world: String,
    /// No real device may be opened.
    pub simulated: bool,
    /// Where the drone starts and lands, before what the plan's side file says: x and y in the plan frame, metres, and
    /// the heading, degrees counter-clockwise from plan x.
    pub pad: Option<[f32; 3]>,
}

/// What a failure of a service means, and with it the order of start: the most critical first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Criticality {
    /// The aircraft may be lost.
    Flight,
    /// The round stops, the aircraft hovers or lands.
    Mission,
    /// Somebody sees less.
    Comfort,
}

impl Criticality {
    /// The word of the manifest.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Flight => "flight",
            Self::Mission => "mission",
            Self::Comfort => "comfort",
        }
    }
}

/// When a service that ended is started again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Restart {
    /// Whatever its end was.
    Always,
    /// After a signal or a non-zero exit.
    OnFailure,
    /// Not at all.
    Never,
}

impl Restart {
    /// The word of the manifest.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Always => "always",
            Self::OnFailure => "on-failure",
            Self::Never => "never",
        }
    }
}

/// Delays between restarts.
///
/// The first restart is immediate: a flight controller without frames drops the aircraft after 0.32 s
/// (FACTS 1), and spawn to first data takes 31 to 84 ms (FACTS 6). From then on the delay doubles up to a cap,
/// so that a service that dies at every start costs one spawn every two seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RestartPolicy {
    /// Delay before the second restart in a row.
    pub first: Duration,
    /// Largest delay.
    pub most: Duration,
    /// A service that lived this long is healthy: the next restart is immediate again.
    pub healthy: Duration,
}

impl Default for RestartPolicy {
    fn default() -> Self {
        Self {
            first: Duration::from_millis(50),
            most: Duration::from_secs(2),
            healthy: Duration::from_secs(5),
        }
    }
}

impl RestartPolicy {
    /// Delay before the restart that follows `failures` short lives in a row (1 = the first).
    #[must_use]
    pub fn delay(&self, failures: u32) -> Duration {
        match failures {
            0 | 1 => Duration::ZERO,
            n => self.first.saturating_mul(1 << (n - 2).min(16)).min(self.most),
        }
    }
}

/// A topic that a service publishes.
#[derive(Debug, Clone, PartialEq)]
pub struct Publication {
    /// Usual rate; 0 when it is sent on demand.
    pub hz: f64,
    /// Silence longer than this is a fault; 0 for none.
    pub deadline_ms: u32,
    /// The keeper hands the last valid sample to a restarted service.
    pub retained: bool,
}

/// A topic that a service reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Subscription {
    /// Unread messages kept; the oldest are dropped and counted beyond it.
    pub depth: usize,
    /// A message wakes the service before its tick.
    pub wake: bool,
}

/// One service: one process.
#[derive(Debug, Clone, PartialEq)]
pub struct ServiceEntry {
    /// Name, as in `health/<name>`.
    pub name: String,
    /// Executable: a name beside the supervisor's own executable, or a path.
    pub run: String,
    /// Configuration file relative to the deploy directory; empty for defaults.
    pub config: String,
    /// What its failure means.
    pub criticality: Criticality,
    /// When it is started again.
    pub restart: Restart,
    /// 1..=99: the higher, the sooner it gets the processor (niceness -1..=-19 where permitted); 0 is ordinary.
    pub priority: u8,
    /// Steps a second when nothing wakes it; 0 when only messages do.
    pub tick_hz: f64,
    /// Longest healthy silence on the notification socket.
    pub heartbeat_ms: u32,
    /// Devices it may open: name to path. `@run/x` lies in the run directory.
    pub devices: BTreeMap<String, String>,
    /// Topics it publishes, without the implicit `health/<name>` and `trace/<name>`.
    pub publishes: BTreeMap<String, Publication>,
    /// Topics it reads.
    pub subscribes: BTreeMap<String, Subscription>,
    /// May read the simulator's truth.
    pub scorer: bool,
}

/// A program that people start beside the services. It may read every topic (truth only as a scorer).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ToolEntry {
    /// Name.
    pub name: String,
    /// Topics of the `operator` family it may publish.
    pub publishes: BTreeSet<String>,
    /// May read the simulator's truth.
    pub scorer: bool,
}

/// A topic seen from the middle.
#[derive(Debug, Clone, PartialEq)]
pub struct Topic {
    /// Name.
    pub name: String,
    /// Services, then tools that publish it.
    pub publishers: Vec<String>,
    /// Services that read it.
    pub subscribers: Vec<String>,
    /// Usual rate; 0 on demand.
    pub hz: f64,
    /// Silence longer than this is a fault; 0 for none.
    pub deadline_ms: u32,
    /// The keeper holds its last valid sample.
    pub retained: bool,
    /// Deepest subscription, at least 1.
    pub depth: usize,
}

/// The whole system.
#[derive(Debug, Clone, PartialEq)]
pub struct Manifest {
    /// Names of the files it was read from, joined by " + ".
    pub file: String,
    /// What the system as a whole is given.
    pub system: System,
    /// Services by name.
    pub services: BTreeMap<String, ServiceEntry>,
    /// Tools by name.
    pub tools: BTreeMap<String, ToolEntry>,
    pub(crate) raw: RawManifest,
}

impl Manifest {
    /// Reads a manifest.
    ///
    /// # Errors
    /// What is not TOML, unknown, missing or out of range. Wiring is checked by [`Manifest::check`], since an
    /// overlay may still complete it.
    pub fn parse(file: &str, text: &str) -> Result<Self, ManifestError> {
        RawManifest::parse(file, text)?.resolve(file)
    }

    /// This manifest with the keys of an overlay laid over it: single values replace, maps are joined, services
    /// that are new are added.
    ///
    /// # Errors
    /// As [`Manifest::parse`].
    pub fn overlay(&self, file: &str, text: &str) -> Result<Self, ManifestError> {
        let mut raw = self.raw.clone();
        raw.merge(RawManifest::parse(file, text)?);
        raw.resolve(&format!("{} + {file}", self.file))
    }

    /// The services in the order of start: by criticality, then priority, then name.
    #[must_use]
    pub fn start_order(&self) -> Vec<&ServiceEntry> {
        let mut order: Vec<_> = self.services.values().collect();
        order.sort_by(|a, b| {
            a.criticality
                .cmp(&b.criticality)
                .then(b.priority.cmp(&a.priority))
                .then_with(|| a.name.cmp(&b.name))
        });
        order
    }

    /// Every topic with its publishers and readers, implicit `health/*` and `trace/*` included, by name.
    #[must_use]
    pub fn topics(&self) -> Vec<Topic> {
        fn at<'a>(topics: &'a mut BTreeMap<String, Topic>, name: &str) -> &'a mut Topic {
            topics.entry(name.to_owned()).or_insert_with(|| Topic {
                name: name.to_owned(),
                publishers: Vec::new(),
                subscribers: Vec::new(),
                hz: 0.0,
                deadline_ms: 0,
                retained: false,
                depth: 1,
            })
        }
        let mut topics = BTreeMap::new();
        for service in self.services.values() {
            for (name, publication) in &service.publishes {
                let topic = at(&mut topics, name);
                topic.publishers.push(service.name.clone());
                topic.hz = publication.hz;
                topic.deadline_ms = publication.deadline_ms;
                topic.retained |= publication.retained;
            }
            for family in ["health", "trace"] {
                at(&mut topics, &format!("{family}/{}", service.name)).publishers.push(service.name.clone());
            }
            for (name, subscription) in &service.subscribes {
                let topic = at(&mut topics, name);
                topic.subscribers.push(service.name.clone());
                topic.depth = topic.depth.max(subscription.depth);
            }
        }
        for tool in self.tools.values() {
            for name in &tool.publishes {
                at(&mut topics, name).publishers.push(tool.name.clone());
            }
        }
        topics.into_values().collect()
    }
}

impl ServiceEntry {
    /// Whether this service may publish `topic`, implicit `health/<name>` and `trace/<name>` included.
    #[must_use]
    pub fn may_publish(&self, topic: &str) -> bool {
        self.publishes.contains_key(topic)
            || topic
                .split_once('/')
                .is_some_and(|(family, who)| matches!(family, "health" | "trace") && who == self.name)
    }

    /// Topics it publishes that the keeper hands back to it after a restart.
    pub fn retained(&self) -> impl Iterator<Item = &str> {
        self.publishes.iter().filter(|(_, p)| p.retained).map(|(name, _)| name.as_str())
    }
}

impl ToolEntry {
    /// Whether this tool may read `topic`.
    #[must_use]
    pub fn may_read(&self, topic: &str) -> bool {
        self.scorer || topic != crate::check::TRUTH
    }
}
