//! Orders to the drone. Every order is acknowledged by all services that must obey it, or refused in words.

use anyhow::{Result, bail};
use cli::interrupt::Interrupt;
use cli::orders::{Orders, Replies, Reply, next_order_number};
use cli::place::Place;
use ipc_types::Verb;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// An order is obeyed within two seconds or not at all, and is answered in the same step.
const PATIENCE: Duration = Duration::from_secs(3);
/// For as long a route to one place is waited for; navigation works at it in slices, 20 a second.
const PLANNING: Duration = Duration::from_secs(10);
const GLANCE: Duration = Duration::from_millis(10);

/// What an operator may order.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Order {
    TakeOff,
    Land,
    Hold,
    Home,
    GoTo(f32, f32),
    PatrolStart,
    PatrolPause,
    PatrolStop,
    Stop,
    Cut,
    AutomaticOn,
    AutomaticOff,
}

impl Order {
    /// To a place on the plan.
    pub(crate) fn goto(x: f32, y: f32) -> Result<Self> {
        if !(x.is_finite() && y.is_finite()) {
            bail!("a place is two finite numbers of metres on the plan, not {x} {y}");
        }
        Ok(Self::GoTo(x, y))
    }

    /// Cuts the motors, when it is said that the drone falls.
    pub(crate) fn cut(yes_it_falls: bool) -> Result<Self> {
        if !yes_it_falls {
            bail!(
                "cut: stops the motors at once, and in the air the drone falls; say --yes-it-falls if that is meant"
            );
        }
        Ok(Self::Cut)
    }

    pub(crate) fn verb(self) -> (Verb, f32, f32) {
        let nowhere = f32::NAN;
        match self {
            Self::TakeOff => (Verb::TakeOff, nowhere, nowhere),
            Self::Land => (Verb::Land, nowhere, nowhere),
            Self::Hold => (Verb::Hold, nowhere, nowhere),
            Self::Home => (Verb::Home, nowhere, nowhere),
            Self::GoTo(x, y) => (Verb::GoTo, x, y),
            Self::PatrolStart => (Verb::PatrolStart, nowhere, nowhere),
            Self::PatrolPause => (Verb::PatrolPause, nowhere, nowhere),
            Self::PatrolStop => (Verb::PatrolStop, nowhere, nowhere),
            Self::Stop => (Verb::Stop, nowhere, nowhere),
            Self::Cut => (Verb::Cut, nowhere, nowhere),
            Self::AutomaticOn => (Verb::AutomaticOn, nowhere, nowhere),
            Self::AutomaticOff => (Verb::AutomaticOff, nowhere, nowhere),
        }
    }
}

pub(crate) fn give(place: &Place, order: Order, json: bool) -> Result<ExitCode> {
    let (verb, x, y) = order.verb();
    let stop = Interrupt::catch()?;
    let (manifest, _, run_dir) = place.running()?;
    let mut tool = runtime::Tool::join("cli", manifest, &run_dir)?;
    let number = next_order_number();
    let mut replies = Replies::open(&mut tool.ports, verb, number)?;
    let mut orders = Orders::open(&mut tool.ports)?;
    tool.tick();
    if !orders.give(verb, x, y, number) {
        bail!("{verb}: shared memory has no place for the order");
    }
    let began = Instant::now();
    while !replies.look() {
        let silent = replies.iter().any(|(_, reply)| *reply == Reply::Silent);
        if began.elapsed() > if silent { PATIENCE } else { PLANNING } {
            break;
        }
        if stop.came() {
            bail!("{verb}: interrupted; whether it is obeyed is not known: see `sereno ps`");
        }
        std::thread::sleep(GLANCE);
        tool.tick();
    }
    report(verb, &replies, json)
}

/// Says what came of it: one line, or one sentence and a failure.
fn report(verb: Verb, replies: &Replies, json: bool) -> Result<ExitCode> {
    let mut trouble = Vec::new();
    for (who, reply) in replies.iter() {
        match reply {
            Reply::Accepted(_) => {}
            Reply::Refused(text) => trouble.push(format!("{who} {text}")),
            Reply::Working(_) => trouble.push(format!(
                "{who} has not worked out a route within {} s and is still at it",
                PLANNING.as_secs()
            )),
            Reply::Silent => trouble.push(format!("{who} did not answer within {} s", PATIENCE.as_secs())),
        }
    }
    let trouble = trouble.join("; ");
    if json {
        let said: serde_json::Map<_, _> = replies
            .iter()
            .map(|(who, reply)| {
                let said = serde_json::json!({ "answer": reply.word(), "text": reply.sentence() });
                (who.to_owned(), said)
            })
            .collect();
        let accepted = trouble.is_empty();
        println!("{}", serde_json::json!({ "order": verb.word(), "accepted": accepted, "answers": said }));
    } else if trouble.is_empty() {
        let said: Vec<_> = replies.iter().map(|(who, reply)| format!("{who} {}", reply.sentence())).collect();
        println!("{verb}: {}", said.join("; "));
    }
    if !trouble.is_empty() {
        bail!("{verb}: {trouble}");
    }
    Ok(ExitCode::SUCCESS)
}
