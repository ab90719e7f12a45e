//! Whether the parts fit together.

use crate::error::{ManifestError, plain};
use crate::model::Manifest;
use std::collections::BTreeMap;

/// The simulator's truth: whoever steers by it has not navigated.
pub(crate) const TRUTH: &str = "sim/truth";
/// What people send: published by tools and gateways, possibly by none at a given moment.
const OPERATOR: &str = "operator/";
/// Who watches says so, and several may: the stream, a recorder, a program.
const WISH: &str = "camera/wish";
/// What viewers say, by way of the bridge or of a program on the drone.
const SIGNAL: &str = "signal/in";

/// What people say, through whichever program: such a topic has any number of publishers.
fn is_said_by_people(topic: &str) -> bool {
    topic.starts_with(OPERATOR) || [WISH, SIGNAL].contains(&topic)
}

impl Manifest {
    /// Checks that every topic is known, published once and read by whom it may be, and that no device is
    /// shared or, in a simulation, real.
    ///
    /// `known_topics` are the topics for which a message exists; one without a slash (`health`) stands for a
    /// family.
    ///
    /// # Errors
    /// The first of [`Manifest::problems`].
    pub fn check(&self, known_topics: &[&str]) -> Result<(), ManifestError> {
        self.problems(known_topics).into_iter().next().map_or(Ok(()), Err)
    }

    /// Everything that does not fit together; see [`Manifest::check`].
    #[must_use]
    pub fn problems(&self, known_topics: &[&str]) -> Vec<ManifestError> {
        let mut found = Vec::new();
        let mut problem = |field: String, message: String| {
            found.push(ManifestError::Wiring {
                file: self.file.clone(),
                field: plain(&field),
                message: plain(&message),
            });
        };
        let known = |topic: &str| {
            known_topics.iter().any(|k| {
                *k == topic
                    || (!k.contains('/')
                        && topic.strip_prefix(k).is_some_and(|r| r.len() > 1 && r.starts_with('/')))
            })
        };
        let unknown = |topic: &str| {
            let nearest = known_topics.iter().min_by_key(|k| distance(k, topic));
            match nearest {
                Some(near) if distance(near, topic) <= 3 => format!("no such topic; did you mean {near}?"),
                _ => "no such topic".to_owned(),
            }
        };

        let mut publisher: BTreeMap<&str, &str> = BTreeMap::new();
        let mut device: BTreeMap<&str, String> = BTreeMap::new();
        for service in self.services.values() {
            for topic in service.publishes.keys() {
                let field = format!("service.{}.publishes.\"{topic}\"", service.name);
                if !known(topic) {
                    problem(field.clone(), unknown(topic));
                } else if topic.starts_with("health/") || topic.starts_with("trace/") {
                    problem(
                        field.clone(),
                        "every service has its own health and trace without saying so".into(),
                    );
                }
                if let Some(other) = publisher.insert(topic, &service.name)
                    && !is_said_by_people(topic)
                {
                    problem(field, format!("already published by {other}; a topic has one publisher"));
                }
            }
            for (name, path) in &service.devices {
                let field = format!("service.{}.devices.{name}", service.name);
                let in_run = path.starts_with("@run/");
                if self.system.simulated && !in_run {
                    problem(
                        field.clone(),
                        format!("{path} is a real device; in simulation only @run/NAME is allowed"),
                    );
                }
                // The simulator creates what others open, so its own paths may be named twice.
                if !in_run && let Some(other) = device.insert(path, field.clone()) {
                    problem(field, format!("{path} is already given to {other}; a device has one owner"));
                }
            }
        }
        for service in self.services.values() {
            for topic in service.subscribes.keys() {
                let field = format!("service.{}.subscribes.\"{topic}\"", service.name);
                if !known(topic) {
                    problem(field, unknown(topic));
                    continue;
                }
                if topic == TRUTH && !service.scorer {
                    problem(field, "only scorers may read the truth (scorer = true)".into());
                    continue;
                }
                let implicit = topic
                    .strip_prefix("health/")
                    .or_else(|| topic.strip_prefix("trace/"))
                    .is_some_and(|who| self.services.contains_key(who));
                if !implicit && !is_said_by_people(topic) && !publisher.contains_key(topic.as_str()) {
                    problem(field, "no service publishes it".into());
                }
            }
        }
        for tool in self.tools.values() {
            for topic in &tool.publishes {
                let field = format!("tool.{}.publishes", tool.name);
                if !known(topic) {
                    problem(field, format!("{topic}: {}", unknown(topic)));
                } else if !is_said_by_people(topic) {
                    problem(
                        field,
                        format!(
                            "{topic}: tools may publish only what people say (operator/*, camera/wish, signal/in)"
                        ),
                    );
                }
            }
        }
        found
    }
}

/// Levenshtein's distance: how many letters to change, add or drop.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = i;
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let changed = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}
