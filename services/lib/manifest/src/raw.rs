//! The manifest as written: every key optional, so that a file and its overlay are read alike.

use crate::error::{ManifestError, line_of, one_line, plain};
use crate::model::{
    Criticality, Manifest, Publication, Restart, ServiceEntry, Subscription, System, ToolEntry,
};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RawManifest {
    system: RawSystem,
    service: BTreeMap<String, RawService>,
    tool: BTreeMap<String, RawTool>,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawSystem {
    name: Option<String>,
    plan: Option<String>,
    vehicle: Option<String>,
    world: Option<String>,
    simulated: Option<bool>,
    pad: Option<[f32; 3]>,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawService {
    run: Option<String>,
    config: Option<String>,
    criticality: Option<Criticality>,
    restart: Option<Restart>,
    priority: Option<i64>,
    tick_hz: Option<f64>,
    heartbeat_ms: Option<i64>,
    devices: BTreeMap<String, String>,
    publishes: BTreeMap<String, RawPublication>,
    subscribes: BTreeMap<String, RawSubscription>,
    scorer: Option<bool>,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawPublication {
    hz: Option<f64>,
    deadline_ms: Option<i64>,
    retained: Option<bool>,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawSubscription {
    depth: Option<i64>,
    wake: Option<bool>,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawTool {
    publishes: BTreeSet<String>,
    scorer: Option<bool>,
}

/// Farthest coordinate of a pad, metres, as in a plan's side file.
const PAD_M: f64 = 10_000.0;

fn over<T>(below: &mut Option<T>, above: Option<T>) {
    if above.is_some() {
        *below = above;
    }
}

impl RawManifest {
    pub(crate) fn parse(file: &str, text: &str) -> Result<Self, ManifestError> {
        toml::from_str(text).map_err(|e| ManifestError::Syntax {
            file: file.to_owned(),
            line: line_of(text, e.span()),
            message: one_line(e.message()),
        })
    }

    pub(crate) fn merge(&mut self, above: Self) {
        over(&mut self.system.name, above.system.name);
        over(&mut self.system.plan, above.system.plan);
        over(&mut self.system.vehicle, above.system.vehicle);
        over(&mut self.system.world, above.system.world);
        over(&mut self.system.simulated, above.system.simulated);
        over(&mut self.system.pad, above.system.pad);
        for (name, service) in above.service {
            self.service.entry(name).or_default().merge(service);
        }
        for (name, tool) in above.tool {
            let below = self.tool.entry(name).or_default();
            below.publishes.extend(tool.publishes);
            over(&mut below.scorer, tool.scorer);
        }
    }

    pub(crate) fn resolve(self, file: &str) -> Result<Manifest, ManifestError> {
        let source = Source { file };
        let system = System {
            name: source.required("system.name", self.system.name.clone(), "a name for the drone")?,
            plan: source.required("system.plan", self.system.plan.clone(), "the floor plan's YAML file")?,
            vehicle: source.required("system.vehicle", self.system.vehicle.clone(), "a vehicle file")?,
            world: self.system.world.clone().unwrap_or_default(),
            simulated: self.system.simulated.unwrap_or(false),
            pad: self.system.pad,
        };
        if let Some([x, y, degrees]) = system.pad {
            source.real("system.pad: x", x.into(), -PAD_M, PAD_M)?;
            source.real("system.pad: y", y.into(), -PAD_M, PAD_M)?;
            source.real("system.pad: heading", degrees.into(), -360.0, 360.0)?;
        }
        source.name("system.name", &system.name)?;
        for (field, path) in [
            ("system.plan", &system.plan),
            ("system.vehicle", &system.vehicle),
            ("system.world", &system.world),
        ] {
            source.path(field, path)?;
        }
        if self.service.is_empty() {
            return Err(source.missing("service", "a system without services does nothing"));
        }
        let mut services = BTreeMap::new();
        for (name, raw) in &self.service {
            services.insert(name.clone(), raw.clone().resolve(name, &source)?);
        }
        let mut tools = BTreeMap::new();
        for (name, raw) in &self.tool {
            source.name(&format!("tool.{name}"), name)?;
            let tool = ToolEntry {
                name: name.clone(),
                publishes: raw.publishes.clone(),
                scorer: raw.scorer.unwrap_or(false),
            };
            tools.insert(name.clone(), tool);
        }
        Ok(Manifest { file: file.to_owned(), system, services, tools, raw: self })
    }
}

impl RawService {
    fn merge(&mut self, above: Self) {
        over(&mut self.run, above.run);
        over(&mut self.config, above.config);
        over(&mut self.criticality, above.criticality);
        over(&mut self.restart, above.restart);
        over(&mut self.priority, above.priority);
        over(&mut self.tick_hz, above.tick_hz);
        over(&mut self.heartbeat_ms, above.heartbeat_ms);
        over(&mut self.scorer, above.scorer);
        self.devices.extend(above.devices);
        for (topic, p) in above.publishes {
            let below = self.publishes.entry(topic).or_default();
            over(&mut below.hz, p.hz);
            over(&mut below.deadline_ms, p.deadline_ms);
            over(&mut below.retained, p.retained);
        }
        for (topic, s) in above.subscribes {
            let below = self.subscribes.entry(topic).or_default();
            over(&mut below.depth, s.depth);
            over(&mut below.wake, s.wake);
        }
    }

    fn resolve(self, name: &str, source: &Source<'_>) -> Result<ServiceEntry, ManifestError> {
        let key = |field: &str| format!("service.{name}.{field}");
        source.name(&format!("service.{name}"), name)?;
        let run = source.required(&key("run"), self.run, "the service's executable")?;
        if run.is_empty() || (run.contains('/') && !run.starts_with('/')) {
            return Err(source.range(
                &key("run"),
                &run,
                "a file name without directory, or an absolute path",
            ));
        }
        let config = self.config.unwrap_or_default();
        source.path(&key("config"), &config)?;
        let mut publishes = BTreeMap::new();
        for (topic, raw) in self.publishes {
            let at = |field: &str| key(&format!("publishes.\"{topic}\".{field}"));
            let publication = Publication {
                // 1 kHz is the most that a tick allows.
                hz: source.real(&at("hz"), raw.hz.unwrap_or(0.0), 0.0, 1000.0)?,
                deadline_ms: source.integer(&at("deadline_ms"), raw.deadline_ms.unwrap_or(0), 0, 60_000)?,
                retained: raw.retained.unwrap_or(false),
            };
            publishes.insert(topic, publication);
        }
        let mut subscribes = BTreeMap::new();
        for (topic, raw) in self.subscribes {
            let at = |field: &str| key(&format!("subscribes.\"{topic}\".{field}"));
            let subscription = Subscription {
                depth: source.integer::<u16>(&at("depth"), raw.depth.unwrap_or(4), 1, 64)?.into(),
                wake: raw.wake.unwrap_or(false),
            };
            subscribes.insert(topic, subscription);
        }
        for (device, path) in &self.devices {
            if !path.starts_with('/') && !path.starts_with("@run/") || path.contains("..") {
                let field = key(&format!("devices.{device}"));
                return Err(source.range(
                    &field,
                    path,
                    "an absolute path, or @run/NAME in the run directory",
                ));
            }
        }
        let wakes = subscribes.values().any(|s| s.wake);
        let tick_hz = source.real(&key("tick_hz"), self.tick_hz.unwrap_or(0.0), 0.0, 1000.0)?;
        if tick_hz == 0.0 && !wakes {
            return Err(source.missing(&key("tick_hz"), "nothing wakes this service, so it needs a tick"));
        }
        Ok(ServiceEntry {
            name: name.to_owned(),
            run,
            config,
            criticality: self.criticality.unwrap_or(Criticality::Mission),
            restart: self.restart.unwrap_or(Restart::Always),
            priority: source.integer(&key("priority"), self.priority.unwrap_or(0), 0, 99)?,
            tick_hz,
            // Below 50 ms a loaded machine's scheduler alone would look like a hang.
            heartbeat_ms: source.integer(
                &key("heartbeat_ms"),
                self.heartbeat_ms.unwrap_or(500),
                50,
                60_000,
            )?,
            devices: self.devices,
            publishes,
            subscribes,
            scorer: self.scorer.unwrap_or(false),
        })
    }
}

struct Source<'a> {
    file: &'a str,
}

impl Source<'_> {
    fn missing(&self, field: &str, hint: &str) -> ManifestError {
        ManifestError::Missing { file: self.file.to_owned(), field: plain(field), hint: hint.to_owned() }
    }

    fn range(&self, field: &str, value: impl Display, allowed: impl Into<String>) -> ManifestError {
        ManifestError::Range {
            file: self.file.to_owned(),
            field: plain(field),
            value: plain(&value.to_string()),
            allowed: allowed.into(),
        }
    }

    fn required<T>(&self, field: &str, value: Option<T>, hint: &str) -> Result<T, ManifestError> {
        value.ok_or_else(|| self.missing(field, hint))
    }

    fn name(&self, field: &str, name: &str) -> Result<(), ManifestError> {
        let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        // Names become parts of topics, file names and socket paths.
        if name.is_empty() || name.len() > 32 || !name.chars().all(fits) {
            return Err(self.range(field, name, "1 to 32 of a-z, 0-9 and -"));
        }
        Ok(())
    }

    fn path(&self, field: &str, path: &str) -> Result<(), ManifestError> {
        if path.contains('\0') {
            return Err(self.range(field, path.escape_default(), "a path"));
        }
        Ok(())
    }

    fn real(&self, field: &str, value: f64, least: f64, most: f64) -> Result<f64, ManifestError> {
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        Err(self.range(field, value, format!("{least} to {most}")))
    }

    fn integer<T: TryFrom<i64>>(
        &self,
        field: &str,
        value: i64,
        least: i64,
        most: i64,
    ) -> Result<T, ManifestError> {
        let error = || self.range(field, value, format!("{least} to {most}"));
        if !(least..=most).contains(&value) {
            return Err(error());
        }
        T::try_from(value).map_err(|_| error())
    }
}
