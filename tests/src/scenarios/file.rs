//! The files.

use super::guard::Guard;
use airframe::controller::Firmware;
use airframe::simulation::faults::Fault;
use anyhow::{Context, Result, bail, ensure};
use ipc_types::{FailsafeAction, FailsafeCause, Verb};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// One flight with its faults and what must come of it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// The file's name without its ending.
    #[serde(skip)]
    pub name: String,
    /// The comment at the top of the file: what life looks like when this happens.
    #[serde(skip)]
    pub about: String,
    /// Plan and world of `deploy`, by their common name.
    #[serde(default = "two_rooms")]
    pub world: String,
    /// Vehicle of `deploy/vehicles`.
    #[serde(default = "watchman")]
    pub vehicle: String,
    /// Firmware that the flight controller plays.
    #[serde(default = "firmware")]
    pub firmware: String,
    /// How the firmware's own failsafe is set: `factory` or `level-descent`.
    #[serde(default = "factory")]
    pub controller_failsafe: String,
    /// Whether the flight controller has a magnetometer.
    #[serde(default = "yes")]
    pub magnetometer: bool,
    /// Of everything that is drawn.
    #[serde(default = "one")]
    pub seed: u64,
    /// What the plan does not show: `none`, `light` or `full`.
    #[serde(default = "none")]
    pub clutter: String,
    /// Share of the battery's charge at the start.
    #[serde(default = "full")]
    pub charge: f64,
    /// The flight is watched for so long after the take-off, seconds.
    #[serde(default = "minute")]
    pub flight_s: f64,
    /// What is ordered; the first order begins the flight.
    pub orders: Vec<OrderAt>,
    /// What breaks.
    #[serde(default)]
    pub faults: Vec<Fault>,
    /// Who takes the sticks, if anybody does.
    pub guard: Option<Guard>,
    /// What must come of it.
    pub expect: Expectation,
}

/// An order and its time.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrderAt {
    /// Seconds after the take-off; without it the order is given at the beginning.
    pub at_s: Option<f64>,
    /// What is ordered.
    pub order: Order,
    /// Where to, of `goto`: plan frame, metres.
    pub to: Option<[f32; 2]>,
}

/// What may be ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Take off and hover.
    TakeOff,
    /// Fly somewhere.
    Goto,
    /// Fly the round.
    Patrol,
    /// Stop and hover.
    Hold,
    /// Fly home and land.
    Home,
    /// Land here.
    Land,
    /// Brake, hover, and land if nobody answers.
    Stop,
    /// Nothing automatic begins any more.
    AutomaticOff,
}

impl Order {
    /// The word on the bus.
    #[must_use]
    pub fn verb(self) -> Verb {
        match self {
            Self::TakeOff => Verb::TakeOff,
            Self::Goto => Verb::GoTo,
            Self::Patrol => Verb::PatrolStart,
            Self::Hold => Verb::Hold,
            Self::Home => Verb::Home,
            Self::Land => Verb::Land,
            Self::Stop => Verb::Stop,
            Self::AutomaticOff => Verb::AutomaticOff,
        }
    }
}

/// What must come of a flight. What is left out is not looked at.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Most touches: the airframe with anything solid, or the floor too hard.
    pub contacts: Option<u32>,
    /// Least distance to anything solid in flight, metres.
    pub clearance_m: Option<f32>,
    /// Whether it leaves the ground.
    pub flies: Option<bool>,
    /// Words of the pilot's answer to an order that it refuses.
    pub refused: Option<String>,
    /// Whether it stands disarmed on the ground at the end, after a flight.
    pub landed: Option<bool>,
    /// It stands on the pad at the end (within 0.35 m of its middle), or does not.
    pub on_pad: Option<bool>,
    /// Most distance between the ends of the flight, metres.
    pub within_m_of_start: Option<f32>,
    /// Phase of the pilot at the end.
    pub phase: Option<String>,
    /// Failsafes that must act, each as `cause: action`.
    #[serde(default)]
    pub failsafes: Vec<String>,
    /// The first of them, at most so long after the first fault begins, seconds.
    pub failsafe_within_s: Option<f64>,
    /// The most severe action that a failsafe may take; the operator's order to land is none.
    pub no_failsafe_worse_than: Option<String>,
    /// It stands in the air or on the ground at most so long after the first fault begins, seconds.
    pub stopped_within_s: Option<f64>,
    /// Fastest touch-down, m/s.
    pub touch_down_m_s: Option<f32>,
    /// It is down and disarmed at most so long after the take-off, seconds.
    pub ends_by_s: Option<f64>,
    /// From so long after the first fault begins on, it knows its place to 0.5 m.
    pub found_again_within_s: Option<f64>,
    /// Most error of its place in flight, metres.
    pub error_m: Option<f32>,
    /// It comes within so much of where the last `goto` leads, metres.
    pub reaches_m: Option<f32>,
    /// Never higher above the floor, metres.
    pub height_m: Option<f32>,
    /// It follows the sticks for at least so long, seconds.
    pub by_hand_s: Option<f64>,
    /// And at most so long.
    pub by_hand_at_most_s: Option<f64>,
    /// It flies at least so far by them, metres.
    pub by_hand_m: Option<f64>,
    /// Whether somebody holds the sticks at the end.
    pub held: Option<bool>,
    /// Most times that the motors are armed.
    pub armings: Option<u32>,
}

fn two_rooms() -> String {
    "two-rooms".to_owned()
}
fn watchman() -> String {
    "watchman".to_owned()
}
fn firmware() -> String {
    Firmware::default().name().to_owned()
}
fn factory() -> String {
    "factory".to_owned()
}
fn none() -> String {
    "none".to_owned()
}
fn yes() -> bool {
    true
}
fn one() -> u64 {
    1
}
fn full() -> f64 {
    1.0
}
fn minute() -> f64 {
    60.0
}

/// The file in which known shortfalls stand.
const KNOWN: &str = "known.toml";
/// A scenario is short.
const LONGEST_S: f64 = 600.0;

impl Scenario {
    /// Reads a file's text.
    ///
    /// # Errors
    /// Names the file, and what is wrong in it.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let mut scenario: Self = toml::from_str(text).with_context(|| format!("{name}.toml"))?;
        name.clone_into(&mut scenario.name);
        let comment = text.lines().map_while(|line| line.strip_prefix('#')).map(str::trim);
        scenario.about = comment.collect::<Vec<_>>().join(" ");
        scenario.check().with_context(|| format!("{name}.toml"))?;
        Ok(scenario)
    }

    fn check(&self) -> Result<()> {
        ensure!(
            !self.about.is_empty(),
            "it begins with no comment: what does life look like when this happens?"
        );
        ensure!(
            (1.0..=LONGEST_S).contains(&self.flight_s),
            "flight_s is {}; allowed: 1..={LONGEST_S}",
            self.flight_s
        );
        let Some(first) = self.orders.first() else { bail!("orders is empty: nothing begins the flight") };
        ensure!(first.at_s.is_none(), "the first order begins the flight: it has no at_s");
        for order in self.orders.iter().skip(1) {
            let at_s = order.at_s.context("orders after the first need at_s, seconds after the take-off")?;
            ensure!((0.0..=LONGEST_S).contains(&at_s), "at_s is {at_s}; allowed: 0..={LONGEST_S}");
        }
        let times = self.orders.iter().map(|order| order.at_s.unwrap_or(0.0));
        ensure!(times.is_sorted(), "orders do not stand in the order of their times");
        for order in &self.orders {
            ensure!(
                (order.order == Order::Goto) == order.to.is_some(),
                "`to` belongs to goto, and goto needs it"
            );
        }
        if let Some(guard) = &self.guard {
            guard.check()?;
        }
        ensure!(self.expect != Expectation::default(), "expect is empty: the scenario cannot fail");
        self.expect.check()
    }

    /// The simulator's configuration.
    #[must_use]
    pub fn simulator(&self) -> simulator::Config {
        simulator::Config {
            clutter: self.clutter.clone(),
            firmware: self.firmware.clone(),
            failsafe: self.controller_failsafe.clone(),
            magnetometer: self.magnetometer,
            charge: self.charge,
            faults: self.faults.clone(),
            ..simulator::Config::default()
        }
    }

    /// When the first fault begins, of the drone or of the guard's link, seconds after the take-off; 0 when one is there
    /// from the start, or there is none.
    #[must_use]
    pub fn trouble_s(&self) -> f64 {
        let links = self.guard.iter().flat_map(|guard| guard.link.iter().map(|link| link.from_s));
        let faults = self.faults.iter().map(|fault| fault.from_s.unwrap_or(0.0));
        let first = faults.chain(links).fold(f64::INFINITY, f64::min);
        if first.is_finite() { first } else { 0.0 }
    }

    /// Where the last `goto` leads.
    #[must_use]
    pub fn goal(&self) -> Option<[f32; 2]> {
        self.orders.iter().rev().find_map(|order| order.to)
    }
}

impl Expectation {
    fn check(&self) -> Result<()> {
        for failsafe in &self.failsafes {
            let known = failsafe.rsplit_once(": ").is_some_and(|(cause, action)| {
                FailsafeCause::ALL.iter().any(|known| known.word() == cause) && action_of(action).is_some()
            });
            ensure!(known, "failsafes: there is no \"{failsafe}\"; one is \"height unknown: descend\"");
        }
        if let Some(action) = &self.no_failsafe_worse_than {
            ensure!(
                action_of(action).is_some(),
                "no_failsafe_worse_than is \"{action}\"; allowed: none, hover, return, land, descend, cut"
            );
        }
        ensure!(
            self.failsafe_within_s.is_none() || !self.failsafes.is_empty(),
            "failsafe_within_s needs failsafes"
        );
        Ok(())
    }
}

/// The action of a word.
pub(super) fn action_of(word: &str) -> Option<FailsafeAction> {
    FailsafeAction::ALL.iter().copied().find(|action| action.word() == word)
}

/// All scenarios of a directory, by name.
///
/// # Errors
/// The first file that is wrong.
pub fn load_all(directory: &Path) -> Result<Vec<Scenario>> {
    let mut scenarios = Vec::new();
    for entry in std::fs::read_dir(directory).with_context(|| directory.display().to_string())? {
        let path = entry?.path();
        if path.extension().is_none_or(|ending| ending != "toml") || path.ends_with(KNOWN) {
            continue;
        }
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        scenarios.push(Scenario::parse(&name, &text)?);
    }
    scenarios.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(scenarios)
}

/// Known shortfalls: names of scenarios, and what happens instead.
///
/// # Errors
/// When the file is wrong, or names a scenario that there is not.
pub fn load_known(directory: &Path, scenarios: &[Scenario]) -> Result<BTreeMap<String, String>> {
    let path = directory.join(KNOWN);
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let known: BTreeMap<String, String> =
        toml::from_str(&text).with_context(|| path.display().to_string())?;
    for name in known.keys() {
        ensure!(
            scenarios.iter().any(|scenario| scenario.name == *name),
            "{}: there is no scenario {name}",
            path.display()
        );
    }
    Ok(known)
}
