//! A guard at the sticks of a scenario, and the link between him and the drone.

use anyhow::{Result, ensure};
use cli::flight::Flight;
use ipc_types::{
    COMMAND_LIFE_NS, Command, HEADING_HOLD, HEIGHT_HOLD, PilotState, Sticks, SticksState, Text, Verb,
};
use manifest::{Manifest, ToolEntry};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use runtime::Output;
use serde::Deserialize;
use std::collections::BTreeSet;

/// His name among the tools of the manifest.
const TOOL: &str = "guard";
/// His connection.
const SOCKET: u64 = 41;
/// Longest delay that a file may ask for, milliseconds.
const MOST_DELAY_MS: f64 = 5_000.0;

/// A guard who takes the sticks.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// He asks for them so long after the take-off, seconds.
    pub take_s: f64,
    /// He gives them back so long after the take-off, seconds.
    pub release_s: Option<f64>,
    /// He pushes the sticks whatever the drone says; otherwise he lets them go until it is ready.
    #[serde(default)]
    pub stubborn: bool,
    /// What he does, each until the next.
    #[serde(default)]
    pub moves: Vec<Move>,
    /// What is wrong with his link or his device; the last that fits counts.
    #[serde(default)]
    pub link: Vec<Link>,
}

/// Sticks from a time on, each -1..=1.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Move {
    /// Seconds after the take-off.
    pub from_s: f64,
    /// Forward.
    pub forward: f32,
    /// Left.
    pub left: f32,
    /// Up.
    pub up: f32,
    /// Counter-clockwise.
    pub turn: f32,
    /// The take-over button is not held.
    pub let_go: bool,
}

/// A time in which the link is not as it should be.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Link {
    /// Seconds after the take-off.
    pub from_s: f64,
    /// It ends; for ever without it.
    pub until_s: Option<f64>,
    /// Share of the messages that are lost.
    pub loss: f64,
    /// Each way, milliseconds.
    pub delay_ms: f64,
    /// Up to so much more, drawn for each message: they overtake each other.
    pub jitter_ms: f64,
    /// It works for so many seconds and is gone for so many, in turns.
    pub flaps_s: Option<[f64; 2]>,
    /// The device repeats its last input, and every layer above takes it for alive.
    pub frozen: bool,
}

impl Guard {
    pub(super) fn check(&self) -> Result<()> {
        ensure!((0.0..=600.0).contains(&self.take_s), "guard.take_s is {}; allowed: 0..=600", self.take_s);
        ensure!(self.moves.is_sorted_by_key(|one| one.from_s), "guard.moves do not stand in their order");
        for one in &self.moves {
            let fits = [one.forward, one.left, one.up, one.turn].iter().all(|axis| axis.abs() <= 1.0);
            ensure!(fits, "guard.moves: a stick is beyond -1..=1");
        }
        for link in &self.link {
            ensure!((0.0..=1.0).contains(&link.loss), "guard.link: loss is {}; allowed: 0..=1", link.loss);
            for (name, ms) in [("delay_ms", link.delay_ms), ("jitter_ms", link.jitter_ms)] {
                ensure!(
                    (0.0..=MOST_DELAY_MS).contains(&ms),
                    "guard.link: {name} is {ms}; allowed: 0..={MOST_DELAY_MS}"
                );
            }
            if let Some([on, off]) = link.flaps_s {
                ensure!(on > 0.0 && off > 0.0, "guard.link: flaps_s are two times, seconds");
            }
        }
        Ok(())
    }

    fn link_at(&self, at_s: f64) -> Link {
        let fits = |link: &&Link| at_s >= link.from_s && link.until_s.is_none_or(|until| at_s < until);
        self.link.iter().rev().find(fits).copied().unwrap_or_default()
    }
}

impl Link {
    fn is_gone(&self, at_s: f64) -> bool {
        self.flaps_s.is_some_and(|[on, off]| (at_s - self.from_s).rem_euclid(on + off) >= on)
    }
}

/// Lets the guard publish what the bridge would publish for him.
pub(super) fn admit(manifest: &mut Manifest) {
    let publishes = BTreeSet::from(["operator/command".to_owned(), "operator/sticks".to_owned()]);
    manifest.tools.insert(TOOL.to_owned(), ToolEntry { name: TOOL.to_owned(), publishes, scorer: false });
}

/// The guard during a flight.
pub(super) struct AtTheSticks {
    guard: Guard,
    command: Output<Command>,
    sticks: Output<Sticks>,
    random: Xoshiro256PlusPlus,
    asked: bool,
    released: bool,
    sequence: u64,
    /// When it comes, when it was made, and what it says.
    on_the_way: Vec<(u64, u64, Sticks)>,
}

impl AtTheSticks {
    pub(super) fn open(guard: Guard, flight: &mut Flight, seed: u64) -> Result<Self> {
        let mut ports = flight.bus.tool(TOOL);
        Ok(Self {
            guard,
            command: ports.output()?,
            sticks: ports.output()?,
            random: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x9a1d),
            asked: false,
            released: false,
            sequence: 0,
            on_the_way: Vec::new(),
        })
    }

    /// 20 ms of him, `at_s` after the take-off; the device gives 50 inputs a second.
    pub(super) fn act(&mut self, at_s: f64, pilot: Option<&PilotState>) {
        let now = self.sticks.now_ns();
        if !self.asked && at_s >= self.guard.take_s {
            self.asked = true;
            self.order(Verb::SticksTake, now);
        }
        if !self.released && self.guard.release_s.is_some_and(|release| at_s >= release) {
            self.released = true;
            self.order(Verb::SticksRelease, now);
        }
        let link = self.guard.link_at(at_s);
        if let Some(pilot) = pilot.filter(|pilot| pilot.holder_socket == SOCKET) {
            self.push(at_s, now, pilot, &link);
        }
        let (come, waits): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.on_the_way).into_iter().partition(|(due, ..)| *due <= now);
        self.on_the_way = waits;
        for (_, made_ns, mut message) in come {
            // The page reckons from the newest beacon that it has, which was as long on its way.
            message.age_ms = (now - made_ns) as f32 * 1e-6 + link.delay_ms as f32;
            self.sticks.publish(&message);
        }
    }

    fn order(&mut self, verb: Verb, now: u64) {
        self.command.publish(&Command {
            expiry_ns: now + COMMAND_LIFE_NS,
            verb: verb.code().into(),
            // Other orders are odd.
            command_sequence: ((now / 1_000_000) as u32) & !1,
            socket: SOCKET,
            account: Text::new("guard"),
            role: Text::new("guard"),
            certificate: Text::new("desk"),
            x_m: f32::NAN,
            y_m: f32::NAN,
            ..Command::default()
        });
    }

    fn push(&mut self, at_s: f64, now: u64, pilot: &PilotState, link: &Link) {
        self.sequence += u64::from(!link.frozen);
        let ready = SticksState::from_code(pilot.sticks)
            .is_some_and(|state| matches!(state, SticksState::Ready | SticksState::Following));
        let pushed =
            self.guard.moves.iter().rev().find(|one| at_s >= one.from_s).copied().unwrap_or_default();
        let one = if ready || self.guard.stubborn {
            pushed
        } else {
            Move { let_go: pushed.let_go, ..Move::default() }
        };
        let message = Sticks {
            input_sequence: self.sequence,
            lease: pilot.lease,
            forward: one.forward,
            left: one.left,
            up: one.up,
            turn: one.turn,
            held: (!one.let_go).into(),
            switches: HEIGHT_HOLD | HEADING_HOLD,
            ..Sticks::default()
        };
        if link.is_gone(at_s) || self.random.random_bool(link.loss) {
            return;
        }
        let more_ms = if link.jitter_ms > 0.0 { self.random.random_range(0.0..link.jitter_ms) } else { 0.0 };
        let due = now + ipc_types::nanoseconds((link.delay_ms + more_ms) * 1e-3);
        self.on_the_way.push((due, now, message));
    }
}
