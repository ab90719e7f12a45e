//! Looking at what flows.

use crate::arguments::TopicOrder;
use anyhow::{Context, Result};
use cli::place::Place;
use ipc_types::{Message, TopicVisitor, visit_topic};
use runtime::{Input, Ports, Tool};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Short against the fastest topic (200 Hz).
const GLANCE: Duration = Duration::from_millis(2);

pub(crate) fn run(place: &Place, order: &TopicOrder, json: bool) -> Result<ExitCode> {
    match order {
        TopicOrder::List => list(place, json),
        TopicOrder::Echo { topic, count } => watch(place, topic, What::Echo(*count)),
        TopicOrder::Hz { topic, seconds } => watch(place, topic, What::Rate(*seconds, json)),
    }
}

fn list(place: &Place, json: bool) -> Result<ExitCode> {
    let (manifest, _) = place.manifest(true)?;
    for topic in manifest.topics() {
        if json {
            let row = serde_json::json!({ "topic": topic.name, "hz": topic.hz, "publishers": topic.publishers,
                "subscribers": topic.subscribers, "retained": topic.retained });
            println!("{row}");
        } else {
            let readers =
                if topic.subscribers.is_empty() { "-".to_owned() } else { topic.subscribers.join(", ") };
            println!("{:<24} {:>6.1} Hz  {} -> {readers}", topic.name, topic.hz, topic.publishers.join(", "));
        }
    }
    Ok(ExitCode::SUCCESS)
}

enum What {
    Echo(Option<u64>),
    Rate(f64, bool),
}

fn watch(place: &Place, topic: &str, what: What) -> Result<ExitCode> {
    let (manifest, _, run_dir) = place.running()?;
    let mut tool = Tool::join("cli", manifest, &run_dir)?;
    let mut watch = Watch { ports: &mut tool.ports, topic, what };
    visit_topic(topic, &mut watch)
        .with_context(|| format!("there is no topic {topic}: see `sereno topic list`"))?
}

struct Watch<'a> {
    ports: &'a mut Ports,
    topic: &'a str,
    what: What,
}

impl TopicVisitor for Watch<'_> {
    type Output = Result<ExitCode>;
    fn visit<T: Message>(&mut self) -> Self::Output {
        let mut input = self.ports.input_of::<T>(self.topic, 16)?;
        match self.what {
            What::Echo(count) => echo(&mut input, count),
            What::Rate(seconds, json) => rate(&mut input, self.topic, seconds, json),
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn echo<T: Message>(input: &mut Input<T>, count: Option<u64>) {
    let mut shown = 0;
    let mut text = String::new();
    while count.is_none_or(|count| shown < count) {
        match input.receive() {
            Some(message) => {
                text.clear();
                // Writing into a String cannot fail.
                let _ = message.write_json(&mut text);
                println!("{text}");
                shown += 1;
            }
            None => std::thread::sleep(GLANCE),
        }
    }
}

fn rate<T: Message>(input: &mut Input<T>, topic: &str, seconds: f64, json: bool) {
    let began = Instant::now();
    let mut stamps = Vec::new();
    while began.elapsed().as_secs_f64() < seconds {
        match input.receive() {
            Some(message) => stamps.push(message.header().stamp_ns),
            None => std::thread::sleep(GLANCE),
        }
    }
    let gaps: Vec<f64> =
        stamps.windows(2).map(|pair| ipc_types::seconds_between(pair[0], pair[1]) * 1e3).collect();
    let longest = gaps.iter().copied().fold(0.0, f64::max);
    let hz = if gaps.is_empty() { 0.0 } else { 1e3 * gaps.len() as f64 / gaps.iter().sum::<f64>() };
    if json {
        println!(
            "{}",
            serde_json::json!({ "topic": topic, "messages": stamps.len(), "hz": hz, "longest_gap_ms": longest,
                "lost": input.lost() })
        );
    } else {
        println!(
            "{topic}: {hz:.1} Hz over {} messages, longest gap {longest:.1} ms, {} lost",
            stamps.len(),
            input.lost()
        );
    }
}
