//! How long a guard's hand takes to the serial line: a stick moved in the page, a press of "stop", and the end of the cut's hold,
//! each to the SET_RAW_RC that carries the pilot's answer to it. Real browser, console, bridge, pilot and flight; the line is
//! listened to between `flight` and the simulated controller.
//!
//! ```sh
//! cargo build --release --workspace --bins --example latency
//! target/release/examples/latency 100 40 10    # sticks, stops, cuts: each cut takes a system of its own
//! ```
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "as in tests"
)]

#[path = "../../tests/watch_room/browser.rs"]
#[allow(dead_code, unreachable_pub, reason = "the browser of the tests, of which this uses a part")]
mod browser;
#[path = "../../tests/watch_room/hand.rs"]
#[allow(dead_code, reason = "the hand of the tests, of which this uses a part")]
mod hand;
#[path = "../../tests/watch_room/rig.rs"]
#[allow(dead_code, reason = "the system of the tests, of which this uses a part")]
mod rig;
mod tap;
mod topics;

use browser::Guard;
use hand::{Witness, claim, fly_by_hand, start_round};
use ipc_types::{ChannelSource, Phase};
use rig::{LONG, Rig};
use std::time::{Duration, Instant};
use tap::Tap;
use topics::{Topics, Wanted};

/// Yaw in SET_RAW_RC (AETR, FACTS 1) and the arm switch.
const YAW: usize = 3;
const AUX1: usize = 4;
/// How long the button that cuts the motors is held (`watch/dock.js`), milliseconds.
const HOLD_MS: f64 = 1000.0;
/// A stick at two fifths turns by more; the heading hold of a hover changes by less from one message to the next.
const MOVED_US: u16 = 12;
/// Most of each kind: the drone flies on one battery.
const MOST_TRIALS: usize = 200;
/// A browser, a console and a system that have all been started a moment ago are still at it; a guard's page is open for hours.
const SETTLED: Duration = Duration::from_secs(10);
/// Now in the page, milliseconds since 1970.
const NOW: &str = "performance.timeOrigin + performance.now()";

/// A system with a listener on its serial line, and a guard who has logged in.
struct Bench {
    guard: Guard,
    drone: Witness,
    topics: Topics,
    tap: Tap,
    _rig: Rig,
}

impl Bench {
    async fn start() -> Self {
        let mut line = None;
        let mut rig = Rig::start_with(|deploy, run_dir| {
            let overlay = deploy.join("sim.toml");
            let text = std::fs::read_to_string(&overlay).unwrap();
            let flight = "[service.flight]\ndevices = { controller = \"@run/controller\" }";
            assert!(text.contains(flight), "sim.toml has another flight");
            let tapped = flight.replace("@run/controller", "@run/tapped");
            std::fs::write(&overlay, text.replace(flight, &tapped)).unwrap();
            line = Some((run_dir.join("controller"), run_dir.join("tapped")));
        });
        let (controller, tapped) = line.unwrap();
        let tap = Tap::between(controller, tapped);
        rig.wait_running();
        rig.open();
        let (drone, topics) = (Witness::open(&rig), Topics::begin(&rig));
        let guard = Guard::open(&rig.address).await;
        claim(&guard, &rig).await;
        Self { guard, drone, topics, tap, _rig: rig }
    }

    async fn end(self) {
        self.guard.close().await;
    }

    /// The first frame that carries one of `wanted`, which came in this order.
    fn carried(&self, wanted: &[Wanted]) -> Option<f64> {
        let since_ms = wanted.first()?.at_ms;
        let frames = self.tap.since(since_ms);
        let carries = |channels: &[u16]| wanted.iter().any(|one| channels.get(..4) == Some(&one.us[..]));
        frames.iter().find(|frame| carries(&frame.channels)).map(|frame| frame.at_ms)
    }

    /// A stick moved: when in the page, in the bridge, in the pilot, and on the line.
    async fn stick(&mut self, to: f64) -> Option<[f64; 4]> {
        fly_by_hand(&self.guard, &mut self.drone, "[0, 0, 0, 0]", |_| true).await;
        tokio::time::sleep(Duration::from_millis(500)).await;
        let moved = format!("(sereno.axes = [{to}, 0, 0, 0], {NOW})");
        let page_ms = self.guard.look(&moved).await.as_f64()?;
        tokio::time::sleep(Duration::from_millis(250)).await;
        self.guard.look("(sereno.axes = [0, 0, 0, 0])").await;
        let bridge_ms = self.topics.stick(page_ms, |stick| stick.turn.abs() > 0.1)?.at_ms;
        let before = self.topics.before(bridge_ms)?;
        let turns =
            |one: &Wanted| one.us.get(YAW).zip(before.us.get(YAW)).map(|(new, old)| new.abs_diff(*old));
        let mut wanted = self.topics.wanted(bridge_ms);
        let first = wanted.iter().position(|one| turns(one).is_some_and(|us| us >= MOVED_US))?;
        wanted.drain(..first);
        Some([page_ms, bridge_ms, wanted.first()?.at_ms, self.carried(&wanted)?])
    }

    /// Stop pressed in flight: when in the page, in the pilot, and on the line.
    async fn stop(&mut self) -> Option<[f64; 3]> {
        resume(&self.guard, &mut self.drone).await;
        tokio::time::sleep(Duration::from_millis(1500)).await;
        let flies = |wanted: Option<Wanted>| wanted?.source.filter(|by| *by == ChannelSource::Navigation);
        let pressed =
            format!("(sereno.pressed = {NOW}, document.querySelector('.stop').click(), sereno.pressed)");
        let page_ms = self.guard.look(&pressed).await.as_f64()?;
        tokio::time::sleep(Duration::from_millis(250)).await;
        flies(self.topics.before(page_ms))?;
        let mut wanted = self.topics.wanted(page_ms);
        let first = wanted.iter().position(|one| one.source != Some(ChannelSource::Navigation))?;
        wanted.drain(..first);
        Some([page_ms, wanted.first()?.at_ms, self.carried(&wanted)?])
    }

    /// The cut: when its hold ended, and when the page, the pilot and the line said that motors stop.
    async fn cut(&mut self) -> Option<[f64; 4]> {
        let button =
            "[...document.querySelectorAll('button')].find((b) => b.innerText.includes('Cut motors'))";
        let hold = format!(
            "(sereno.send = WebSocket.prototype.send, WebSocket.prototype.send = function (data) {{ \
             if (String(data).includes('\"cut\"')) sereno.cut = {NOW}; sereno.send.call(this, data); }}, \
             sereno.pressed = {NOW}, ({button}).dispatchEvent(new PointerEvent('pointerdown', \
             {{ bubbles: true, pointerId: 1, button: 0, isPrimary: true }})), sereno.pressed)"
        );
        let held_ms = self.guard.look(&hold).await.as_f64()?;
        let began = Instant::now();
        while self.drone.look().0 != Some(Phase::Cut) {
            if began.elapsed() > Duration::from_secs(5) {
                return None;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
        let stops = |channels: &[u16]| channels.get(AUX1).is_some_and(|us| *us < 1300);
        let frame = self.tap.since(held_ms).into_iter().find(|frame| stops(&frame.channels))?;
        let page_ms = self.guard.look("sereno.cut").await.as_f64()?;
        let pilot_ms = self.topics.wanted(held_ms).iter().find(|wanted| !wanted.arm)?.at_ms;
        Some([held_ms + HOLD_MS, page_ms, pilot_ms, frame.at_ms])
    }
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() {
    let asked: Vec<usize> = std::env::args()
        .skip(1)
        .map(|word| {
            let trials = word.parse().unwrap_or(usize::MAX);
            assert!(trials <= MOST_TRIALS, "{word} trials: allowed are 0 to {MOST_TRIALS}");
            trials
        })
        .collect();
    let trials = |index: usize, absent: usize| asked.get(index).copied().unwrap_or(absent);
    let mut bench = Bench::start().await;
    start_round(&bench.guard, &mut bench.drone).await;

    let mut stops = Vec::new();
    for _ in 0..trials(1, 40) {
        stops.push(bench.stop().await);
    }
    bench.guard.press_words("Sticks").await;
    let mut sticks = Vec::new();
    for trial in 0..trials(0, 100) {
        sticks.push(bench.stick(if trial % 2 == 0 { 0.4 } else { -0.4 }).await);
    }
    let mut cuts = Vec::new();
    for trial in 0..trials(2, 10) {
        if trial > 0 {
            bench.end().await;
            bench = Bench::start().await;
            start_round(&bench.guard, &mut bench.drone).await;
            tokio::time::sleep(SETTLED).await;
        }
        cuts.push(bench.cut().await);
    }
    bench.end().await;

    say("stick moved in the page to the SET_RAW_RC that follows it", &sticks, |[page, .., line]| line - page);
    say("  page to bridge", &sticks, |[page, bridge, ..]| bridge - page);
    say("  bridge to pilot", &sticks, |[_, bridge, pilot, _]| pilot - bridge);
    say("  pilot to the line", &sticks, |[_, _, pilot, line]| line - pilot);
    say("stop pressed in the page to the SET_RAW_RC that brakes", &stops, |[page, _, line]| line - page);
    say("  page to pilot", &stops, |[page, pilot, _]| pilot - page);
    say("  pilot to the line", &stops, |[_, pilot, line]| line - pilot);
    say("end of the cut's hold to the SET_RAW_RC that disarms", &cuts, |[held, .., line]| line - held);
    say("  end of the hold to its order in the page", &cuts, |[held, page, ..]| page - held);
    say("  page to pilot", &cuts, |[_, page, pilot, _]| pilot - page);
    say("  pilot to the line", &cuts, |[_, _, pilot, line]| line - pilot);
}

/// Starts the round, or goes on with it, until it flies.
async fn resume(guard: &Guard, drone: &mut Witness) {
    let began = Instant::now();
    let mut pressed: Option<Instant> = None;
    while drone.look().0 != Some(Phase::Autonomous) {
        assert!(began.elapsed() < LONG, "the round does not go on");
        if drone.look().0 == Some(Phase::Grounded) {
            start_round(guard, drone).await;
        } else if pressed.is_none_or(|at| at.elapsed() > Duration::from_secs(1)) {
            guard.look("document.querySelector('.dock-primary').click()").await;
            pressed = Some(Instant::now());
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Prints what the trials came to; those that could not be told are counted.
fn say<T>(what: &str, trials: &[Option<T>], value: impl Fn(&T) -> f64) {
    let mut values: Vec<f64> = trials.iter().flatten().map(value).collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = ((values.len() as f64 - 1.0) * share).round() as usize;
        values.get(index).copied().unwrap_or(f64::NAN)
    };
    let untold = trials.len() - values.len();
    println!(
        "{what}: n {}, p50 {:.1}, p95 {:.1}, p99 {:.1}, most {:.1} ms{}",
        values.len(),
        at(0.5),
        at(0.95),
        at(0.99),
        at(1.0),
        if untold == 0 { String::new() } else { format!("; {untold} more could not be told") }
    );
}
