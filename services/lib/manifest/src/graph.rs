//! The wiring as a picture.

use crate::model::Manifest;
use std::collections::BTreeSet;
use std::fmt::Write;

impl Manifest {
    /// The wiring as a Mermaid flow chart: services are boxes, an arrow is a topic, a thick arrow wakes its
    /// reader, a dotted line hands a retained topic back to its own publisher. `health/*` and `trace/*` are
    /// left out, since every service has them.
    #[must_use]
    pub fn graph(&self) -> String {
        let mut text = String::from("flowchart LR\n");
        let _ = self.write_mermaid(&mut text);
        text
    }

    fn write_mermaid(&self, out: &mut String) -> std::fmt::Result {
        for service in self.start_order() {
            writeln!(out, "    {0}[\"{0}<br/>{1}\"]", service.name, service.criticality.word())?;
        }
        let mut people = BTreeSet::new();
        for topic in self.topics() {
            // Every service has these; drawn, they would hide the rest.
            if topic.name.starts_with("health/") || topic.name.starts_with("trace/") {
                continue;
            }
            let outside = topic.name.starts_with("operator/");
            let publishers: Vec<&str> = if outside {
                vec!["operator"]
            } else {
                topic.publishers.iter().map(String::as_str).collect()
            };
            if outside && people.insert("operator") {
                writeln!(out, "    operator([operator])")?;
            }
            for from in publishers {
                for to in &topic.subscribers {
                    let wake = self
                        .services
                        .get(to)
                        .and_then(|s| s.subscribes.get(&topic.name))
                        .is_some_and(|s| s.wake);
                    let arrow = if from == to {
                        "-.->"
                    } else if wake {
                        "==>"
                    } else {
                        "-->"
                    };
                    writeln!(out, "    {from} {arrow}|{}| {to}", topic.name)?;
                }
            }
        }
        Ok(())
    }

    /// The wiring as a table for a terminal: one line a topic, then one line a service.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = String::new();
        let _ = self.write_table(&mut text);
        text
    }

    fn write_table(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{:<24} {:>6} {:>9}  {:<24} readers", "topic", "Hz", "deadline", "publisher")?;
        for topic in self.topics() {
            if topic.name.starts_with("health/") || topic.name.starts_with("trace/") {
                continue;
            }
            let hz = if topic.hz > 0.0 { format!("{}", topic.hz) } else { "-".to_owned() };
            let deadline =
                if topic.deadline_ms > 0 { format!("{} ms", topic.deadline_ms) } else { "-".to_owned() };
            let kept = if topic.retained { " (kept)" } else { "" };
            let publishers =
                if topic.publishers.is_empty() { "-".to_owned() } else { topic.publishers.join(", ") };
            let readers: Vec<String> = topic
                .subscribers
                .iter()
                .map(|s| {
                    let wakes = self.services[s].subscribes.get(&topic.name).is_some_and(|x| x.wake);
                    if wakes { format!("{s}!") } else { s.clone() }
                })
                .collect();
            writeln!(
                out,
                "{:<24} {hz:>6} {deadline:>9}  {:<24} {}",
                topic.name,
                format!("{publishers}{kept}"),
                readers.join(", ")
            )?;
        }
        writeln!(out)?;
        writeln!(
            out,
            "{:<14} {:<8} {:<10} {:>8} {:>8} {:>10}  devices",
            "service", "failure", "restart", "priority", "tick Hz", "heartbeat"
        )?;
        for s in self.start_order() {
            let devices: Vec<String> = s.devices.iter().map(|(n, p)| format!("{n}={p}")).collect();
            writeln!(
                out,
                "{:<14} {:<8} {:<10} {:>8} {:>8} {:>7} ms  {}",
                s.name,
                s.criticality.word(),
                s.restart.word(),
                s.priority,
                s.tick_hz,
                s.heartbeat_ms,
                devices.join(" ")
            )?;
        }
        Ok(())
    }
}
