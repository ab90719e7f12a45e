//! Looking at what flows.

use crate::arguments::TopicOrder;
use anyhow::{Context, Result};
use cli::interrupt::Interrupt;
use cli::place::Place;
use ipc_types::{Message, TopicVisitor, visit_topic};
use runtime::{Input, Ports, Tool};
use std::io::Write;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Short against the fastest topic (200 Hz).
const GLANCE: Duration = Duration::from_millis(2);

pub(crate) fn run(place: &Place, order: &TopicOrder, json: bool) -> Result<ExitCode> {
    match order {
        TopicOrder::List { sim } => list(place, *sim, json),
        TopicOrder::Echo { topic, count } => watch(place, topic, What::Echo(*count)),
        TopicOrder::Hz { topic, seconds } => watch(place, topic, What::Rate(*seconds, json)),
    }
}

fn list(place: &Place, sim: bool, json: bool) -> Result<ExitCode> {
    // What runs, and where nothing does, what would: the simulator's topics are there in a simulation only.
    let manifest = match place.running() {
        Ok((manifest, ..)) => manifest,
        Err(_) => place.manifest(sim)?.0,
    };
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
    let stop = Interrupt::catch()?;
    let (manifest, _, run_dir) = place.running()?;
    let mut tool = Tool::join("cli", manifest, &run_dir)?;
    let mut watch = Watch { ports: &mut tool.ports, topic, what, stop: &stop };
    visit_topic(topic, &mut watch)
        .with_context(|| format!("there is no topic {topic}: see `sereno topic list`"))?
}

struct Watch<'a> {
    ports: &'a mut Ports,
    topic: &'a str,
    what: What,
    stop: &'a Interrupt,
}

impl TopicVisitor for Watch<'_> {
    type Output = Result<ExitCode>;
    fn visit<T: Message>(&mut self) -> Self::Output {
        let mut input = self.ports.input_of::<T>(self.topic)?;
        match self.what {
            What::Echo(count) => echo(&mut input, count, self.stop)?,
            What::Rate(seconds, json) => rate(&mut input, self.topic, seconds, json, self.stop),
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn echo<T: Message>(input: &mut Input<T>, count: Option<u64>, stop: &Interrupt) -> Result<()> {
    let mut shown = 0;
    let mut text = String::new();
    while !stop.came() && count.is_none_or(|count| shown < count) {
        let Some(message) = input.receive() else {
            std::thread::sleep(GLANCE);
            continue;
        };
        text.clear();
        // Writing into a String cannot fail.
        let _ = message.write_json(&mut text);
        text.push('\n');
        match std::io::stdout().write_all(text.as_bytes()) {
            Ok(()) => shown += 1,
            // Whoever reads has seen enough: `| head`.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => break,
            Err(error) => return Err(error).context("cannot print"),
        }
    }
    Ok(())
}

fn rate<T: Message>(input: &mut Input<T>, topic: &str, seconds: f64, json: bool, stop: &Interrupt) {
    let began = Instant::now();
    let mut stamps = Vec::new();
    while !stop.came() && began.elapsed().as_secs_f64() < seconds {
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
