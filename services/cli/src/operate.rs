//! Orders to the drone. Every order is acknowledged by the service that obeys it, or refused in words.

use anyhow::{Result, bail};
use cli::place::Place;
use cli::witness::{Orders, next_order_number};
use ipc_types::Verb;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Pilot and navigation publish their state at least twice a second.
const PATIENCE: Duration = Duration::from_secs(3);
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
}

impl Order {
    fn verb(self) -> (Verb, f32, f32) {
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
        }
    }
}

pub(crate) fn give(place: &Place, order: Order, json: bool) -> Result<ExitCode> {
    let (manifest, _, run_dir) = place.running()?;
    let mut tool = runtime::Tool::join("cli", manifest, &run_dir)?;
    let mut orders = Orders::open(&mut tool.ports)?;
    let (verb, x, y) = order.verb();
    if matches!(order, Order::GoTo(..)) && !(x.is_finite() && y.is_finite()) {
        bail!("a place is two finite numbers of metres on the plan, not {x} {y}");
    }
    let number = next_order_number();
    orders.give(verb, x, y, number);
    let began = Instant::now();
    while began.elapsed() < PATIENCE {
        tool.tick();
        if let Some(text) = orders.answer(number) {
            if json {
                println!("{}", serde_json::json!({ "order": verb.word(), "answer": text }));
            } else {
                println!("{verb}: {text}");
            }
            return Ok(ExitCode::SUCCESS);
        }
        std::thread::sleep(GLANCE);
    }
    bail!("{verb}: the pilot did not answer within {} s: see `sereno ps`", PATIENCE.as_secs());
}
