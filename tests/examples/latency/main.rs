//! How long a guard's hand takes to the serial line: a stick moved in the page to the first SET_RAW_RC that follows it, and the
//! end of the cut's hold to the frame that disarms. Real browser, console, bridge, pilot and flight; the line is listened to
//! between `flight` and the simulated controller.
//!
//! ```sh
//! cargo build --release --workspace && cargo run --release --workspace --example latency -- 100
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
#[path = "../../tests/watch_room/rig.rs"]
#[allow(dead_code, reason = "the system of the tests, of which this uses a part")]
mod rig;
mod tap;

use browser::Guard;
use ipc_types::{Phase, PilotState, SticksState};
use rig::{LONG, Rig};
use runtime::{Input, Tool};
use std::time::{Duration, Instant};
use tap::{Tap, now_ms};

/// Yaw in SET_RAW_RC (AETR, FACTS 1) and the arm switch.
const YAW: usize = 3;
const AUX1: usize = 4;
/// How long the button that cuts the motors is held (`watch/dock.js`), milliseconds.
const HOLD_MS: f64 = 1000.0;
/// A stick at two fifths moves the yaw channel by more at once.
const MOVED_US: u16 = 30;

struct Pilot {
    tool: Tool,
    state: Input<PilotState>,
    newest: PilotState,
}

impl Pilot {
    fn look(&mut self) -> (Option<Phase>, Option<SticksState>) {
        self.tool.tick();
        while let Some(state) = self.state.receive() {
            self.newest = *state;
        }
        (Phase::from_code(self.newest.phase), SticksState::from_code(self.newest.sticks))
    }
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() {
    let trials: usize = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(100);
    let mut tap = None;
    let mut rig = Rig::start_with(|deploy, run_dir| {
        let overlay = deploy.join("sim.toml");
        let text = std::fs::read_to_string(&overlay).unwrap();
        let flight = "[service.flight]\ndevices = { controller = \"@run/controller\" }";
        assert!(text.contains(flight), "sim.toml has another flight");
        let tapped = flight.replace("@run/controller", "@run/tapped");
        std::fs::write(&overlay, text.replace(flight, &tapped)).unwrap();
        tap = Some((run_dir.join("controller"), run_dir.join("tapped")));
    });
    let (controller, tapped) = tap.unwrap();
    let tap = Tap::between(controller, tapped);
    rig.wait_running();
    rig.open();
    let (manifest, run_dir) = rig.manifest();
    let mut tool = Tool::join("cli", manifest, &run_dir).unwrap();
    let state = tool.ports.input().unwrap();
    let mut pilot = Pilot { tool, state, newest: PilotState::default() };

    let guard = Guard::open(&rig.address).await;
    guard.fill("code", &rig.claim).await;
    for (field, text) in [("name", "Ana"), ("surname", "Sereno"), ("email", "ana@example.org")] {
        guard.fill(field, text).await;
    }
    guard.fill("password", "a lamp and a bunch of keys").await;
    guard.press("form button[type=submit]").await;
    take_off(&guard, &mut pilot).await;
    guard.press_words("Sticks").await;

    let mut sticks = Vec::new();
    let mut lost = 0;
    while sticks.len() < trials && lost < trials {
        follow(&guard, &mut pilot).await;
        let to = if sticks.len() % 2 == 0 { 0.4 } else { -0.4 };
        let moved = format!("(sereno.axes = [{to}, 0, 0, 0], performance.timeOrigin + performance.now())");
        let at_ms = guard.look(&moved).await.as_f64().unwrap_or(f64::NAN);
        tokio::time::sleep(Duration::from_millis(250)).await;
        guard.look("(sereno.axes = [0, 0, 0, 0])").await;
        match first_move(&tap, at_ms) {
            Some(frame_ms) => sticks.push(frame_ms - at_ms),
            None => lost += 1,
        }
        tokio::time::sleep(Duration::from_millis(500)).await;
    }
    say("stick moved in the page to SET_RAW_RC", &mut sticks);
    println!("  {lost} more were not told from the noise of the channel");

    // The cut: the button is held for a second, and then the drone falls.
    let button = "[...document.querySelectorAll('button')].find((b) => b.innerText.includes('Cut motors'))";
    let hold = format!(
        "(sereno.pressed = performance.timeOrigin + performance.now(), ({button}).dispatchEvent(new PointerEvent('pointerdown', \
         {{ bubbles: true, pointerId: 1, button: 0, isPrimary: true }})), sereno.pressed)"
    );
    let held_ms = guard.look(&hold).await.as_f64().unwrap_or(f64::NAN);
    let began = Instant::now();
    while pilot.look().0 != Some(Phase::Cut) && began.elapsed() < LONG {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    tokio::time::sleep(Duration::from_millis(100)).await;
    let disarmed =
        tap.since(held_ms).into_iter().find(|frame| frame.channels.get(AUX1).is_some_and(|us| *us < 1300));
    match disarmed {
        Some(frame) => {
            let after = frame.at_ms - held_ms - HOLD_MS;
            println!("cut: end of the hold of 1 s to the frame that disarms {after:.1} ms");
        }
        None => println!("cut: no frame that disarms was seen"),
    }
    guard.close().await;
}

/// Starts the round by the page until it flies, then stops it: the drone hovers.
async fn take_off(guard: &Guard, pilot: &mut Pilot) {
    let began = Instant::now();
    while pilot.look().0 != Some(Phase::Autonomous) {
        assert!(began.elapsed() < LONG, "it does not fly");
        if pilot.look().0 == Some(Phase::Grounded) {
            guard.look("document.querySelector('.dock-primary').click()").await;
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Until the drone follows the sticks.
async fn follow(guard: &Guard, pilot: &mut Pilot) {
    let began = Instant::now();
    loop {
        match pilot.look().1 {
            Some(SticksState::Following) => return,
            Some(SticksState::Free) => {
                guard.look("(sereno.hold = false, sereno.axes = [0, 0, 0, 0])").await;
                let take = "document.querySelector('.sticks-take')";
                guard.look(&format!("!{take}.disabled && {take}.click()")).await;
            }
            _ => {
                guard.look("(sereno.hold = true, sereno.axes = [0, 0, 0, 0])").await;
            }
        }
        assert!(began.elapsed() < LONG, "the sticks are not followed");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// When the yaw channel first left where it had been before `at_ms`.
fn first_move(tap: &Tap, at_ms: f64) -> Option<f64> {
    let before: Vec<u16> = tap
        .since(at_ms - 200.0)
        .iter()
        .filter(|frame| frame.at_ms < at_ms)
        .filter_map(|frame| frame.channels.get(YAW).copied())
        .collect();
    let (least, most) = (before.iter().min()?, before.iter().max()?);
    if most - least > MOVED_US / 2 {
        return None;
    }
    let left = |us: u16| us + MOVED_US < *least || us > most + MOVED_US;
    let frame =
        tap.since(at_ms).into_iter().find(|frame| frame.channels.get(YAW).is_some_and(|us| left(*us)))?;
    (frame.at_ms <= now_ms()).then_some(frame.at_ms)
}

fn say(what: &str, values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = ((values.len() as f64 - 1.0) * share).round() as usize;
        values.get(index).copied().unwrap_or(f64::NAN)
    };
    println!(
        "{what}: n {}, p50 {:.1}, p95 {:.1}, p99 {:.1}, most {:.1} ms",
        values.len(),
        at(0.5),
        at(0.95),
        at(0.99),
        at(1.0)
    );
}
