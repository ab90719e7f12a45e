//! The same commands from another machine, over zenoh: what is printed is what would be printed on board.

use crate::arguments::TopicOrder;
use crate::operate::Order;
use anyhow::{Context, Result, bail};
use bridge::remote::{Followed, Heard, Remote, to_json};
use cli::interrupt::Interrupt;
use serde_json::{Value, json};
use std::io::Write;
use std::process::ExitCode;
use std::sync::mpsc::RecvTimeoutError;
use std::time::{Duration, Instant};

/// Between two looks whether somebody pressed Ctrl-C.
const GLANCE: Duration = Duration::from_millis(100);

/// Gives an order.
pub(crate) fn give(remote: &Remote, order: Order, json: bool) -> Result<ExitCode> {
    let (verb, x, y) = order.verb();
    let place = (verb == ipc_types::Verb::GoTo).then_some((x, y));
    let answer = remote.order(verb, place).map_err(anyhow::Error::msg).with_context(|| verb.word())?;
    let accepted = answer["accepted"] == Value::Bool(true);
    let text = answer["text"].as_str().unwrap_or("the answer says nothing");
    if json {
        println!("{}", json!({ "order": verb.word(), "accepted": accepted, "answers": answer["answers"] }));
    } else if accepted {
        println!("{verb}: {text}");
    }
    if !accepted {
        bail!("{verb}: {text}");
    }
    Ok(ExitCode::SUCCESS)
}

/// Looks at what flows.
pub(crate) fn topic(remote: &Remote, order: &TopicOrder, json: bool) -> Result<ExitCode> {
    match order {
        TopicOrder::List { .. } => list(remote, json),
        TopicOrder::Echo { topic, count } => echo(&follow(remote, topic)?, topic, *count),
        TopicOrder::Hz { topic, seconds } => rate(&follow(remote, topic)?, topic, *seconds, json),
    }
}

fn list(remote: &Remote, json: bool) -> Result<ExitCode> {
    let about = remote.about().map_err(anyhow::Error::msg)?;
    for row in about["topics"].as_array().into_iter().flatten() {
        if json {
            println!("{row}");
        } else {
            let word = |key: &str| row[key].as_str().unwrap_or("?").to_owned();
            let hz = row["hz"].as_f64().unwrap_or(0.0);
            println!("{:<24} {hz:>6.1} Hz  {} as {}", word("topic"), word("type"), word("form"));
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn follow(remote: &Remote, topic: &str) -> Result<Followed> {
    let about = remote.about().map_err(anyhow::Error::msg)?;
    let known = about["topics"].as_array().into_iter().flatten().any(|row| row["topic"] == topic);
    if !known {
        bail!("{} sends no topic {topic}: see `sereno topic list`", remote.drone());
    }
    remote.follow(topic).map_err(anyhow::Error::msg)
}

/// The next message; `None` when it is time to look around.
fn next(followed: &Followed) -> Result<Option<Heard>> {
    match followed.recv_timeout(GLANCE) {
        Ok(heard) => Ok(Some(heard)),
        Err(RecvTimeoutError::Timeout) => Ok(None),
        Err(RecvTimeoutError::Disconnected) => bail!("the connection has ended"),
    }
}

fn echo(followed: &Followed, topic: &str, count: Option<u64>) -> Result<ExitCode> {
    let stop = Interrupt::catch()?;
    let mut shown = 0;
    while !stop.came() && count.is_none_or(|count| shown < count) {
        let Some(heard) = next(followed)? else { continue };
        let Some(mut text) = to_json(topic, &heard) else {
            bail!("{topic}: {} bytes that are no message of this topic in this version", heard.payload.len());
        };
        text.push('\n');
        match std::io::stdout().write_all(text.as_bytes()) {
            Ok(()) => shown += 1,
            // Whoever reads has seen enough: `| head`.
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => break,
            Err(error) => return Err(error).context("cannot print"),
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Stamp and sequence of a message.
fn header(heard: &Heard) -> Option<(u64, u64)> {
    if heard.is_json {
        let message: Value = serde_json::from_slice(&heard.payload).ok()?;
        return Some((message["header"]["stamp_ns"].as_u64()?, message["header"]["sequence"].as_u64()?));
    }
    let number = |at: usize| Some(u64::from_le_bytes(heard.payload.get(at..at + 8)?.try_into().ok()?));
    Some((number(0)?, number(8)?))
}

fn rate(followed: &Followed, topic: &str, seconds: f64, json: bool) -> Result<ExitCode> {
    let stop = Interrupt::catch()?;
    let began = Instant::now();
    let mut headers = Vec::new();
    while !stop.came() && began.elapsed().as_secs_f64() < seconds {
        headers.extend(next(followed)?.as_ref().and_then(header));
    }
    let pairs = headers.windows(2).filter_map(|pair| Some((*pair.first()?, *pair.get(1)?)));
    let (mut gaps, mut left_out) = (Vec::new(), 0);
    for ((before_ns, before), (after_ns, after)) in pairs {
        gaps.push(ipc_types::seconds_between(before_ns, after_ns) * 1e3);
        left_out += after.saturating_sub(before.saturating_add(1));
    }
    let longest = gaps.iter().copied().fold(0.0, f64::max);
    let hz = if gaps.is_empty() { 0.0 } else { 1e3 * gaps.len() as f64 / gaps.iter().sum::<f64>() };
    let messages = headers.len();
    if json {
        println!(
            "{}",
            json!({ "topic": topic, "messages": messages, "hz": hz, "longest_gap_ms": longest, "lost": left_out })
        );
    } else {
        println!(
            "{topic}: {hz:.1} Hz over {messages} messages, longest gap {longest:.1} ms, {left_out} left out or lost"
        );
    }
    Ok(ExitCode::SUCCESS)
}
