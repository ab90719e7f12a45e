//! How soon the drone hovers when a hand falls silent, and when nobody holds the sticks any more: a gamepad whose time stamps stop
//! while its stick is deflected and its button held, and a browser that is killed while it flies. Real browser, console, bridge
//! and pilot; times are those of the pilot's own messages.
//!
//! ```sh
//! cargo build --release --workspace --bins --example frozen && target/release/examples/frozen 10
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
mod listener;
#[path = "../../tests/watch_room/rig.rs"]
#[allow(dead_code, reason = "the system of the tests, of which this uses a part")]
mod rig;

use browser::Guard;
use hand::{Witness, claim, fly_by_hand, log_in};
use ipc_types::Phase;
use listener::{Listener, Silence, clock_ms};
use rig::{LONG, Rig};
use std::time::{Duration, Instant};

/// Most trials of each kind: the drone flies on one battery.
const MOST_TRIALS: usize = 50;
/// Between two looks at two clocks of one machine more may not pass, milliseconds.
const CLOCKS_MS: f64 = 5.0;
/// The stick is deflected, so that something would go on if nobody minded: a turn, which is free wherever the drone stands.
const DEFLECTED: &str = "[0.4, 0, 0, 0]";

#[derive(Default)]
struct Figures {
    hovers_ms: Vec<f64>,
    free_ms: Vec<f64>,
    /// By another clock: the page's own last input, or the death of the browser.
    other_ms: Vec<f64>,
}

impl Figures {
    fn add(&mut self, silence: &Silence, other_ms: f64) {
        self.hovers_ms.push(silence.hovers_ms - silence.last_input_ms);
        self.free_ms.push(silence.free_ms - silence.last_input_ms);
        self.other_ms.push(silence.hovers_ms - other_ms);
    }
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() {
    let trials: usize = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(10);
    assert!((1..=MOST_TRIALS).contains(&trials), "{trials} trials: allowed are 1 to {MOST_TRIALS}");
    let rig = Rig::start();
    let mut drone = Witness::open(&rig);
    let listener = Listener::begin(&rig);

    let guard = Guard::open(&rig.address).await;
    claim(&guard, &rig).await;
    let frozen = frozen_pads(&guard, &mut drone, &listener, trials).await;
    guard.close().await;
    let killed = killed_browsers(&rig, &mut drone, &listener, trials).await;

    println!("a pad whose time stamps stop, the stick deflected and the button held:");
    say("  last input taken to sticks not followed", &frozen.hovers_ms);
    say("  last time stamp at the page to the same", &frozen.other_ms);
    say("  last input taken to nobody's sticks", &frozen.free_ms);
    println!("a browser that is killed while it flies, the stick deflected and the button held:");
    say("  last input taken to sticks not followed", &killed.hovers_ms);
    say("  kill to the same", &killed.other_ms);
    say("  last input taken to nobody's sticks", &killed.free_ms);
}

async fn frozen_pads(guard: &Guard, drone: &mut Witness, listener: &Listener, trials: usize) -> Figures {
    in_the_air(guard, drone).await;
    guard.press_words("Sticks").await;
    let mut figures = Figures::default();
    while figures.hovers_ms.len() < trials {
        in_the_air(guard, drone).await;
        turn(guard, drone).await;
        let since_ms = clock_ms();
        let stopped = "(sereno.alive = false, performance.timeOrigin + sereno.frozen)";
        let last_ms = guard.look(stopped).await.as_f64().unwrap();
        let now_ms = guard.look("performance.timeOrigin + performance.now()").await.as_f64().unwrap();
        let clocks = clock_ms();
        assert!(
            now_ms > since_ms - CLOCKS_MS && now_ms < clocks + CLOCKS_MS,
            "the page's clock says {now_ms}, between {since_ms} and {clocks}"
        );
        figures.add(&heard(listener, since_ms).await, last_ms);
        guard.look("(sereno.alive = true, sereno.hold = false, sereno.axes = [0, 0, 0, 0])").await;
    }
    figures
}

async fn killed_browsers(rig: &Rig, drone: &mut Witness, listener: &Listener, trials: usize) -> Figures {
    let mut figures = Figures::default();
    while figures.hovers_ms.len() < trials {
        let guard = Guard::open(&rig.address).await;
        log_in(&guard).await;
        in_the_air(&guard, drone).await;
        guard.press_words("Sticks").await;
        turn(&guard, drone).await;
        let since_ms = clock_ms();
        guard.kill().await;
        figures.add(&heard(listener, since_ms).await, since_ms);
    }
    figures
}

/// Flies by hand with a deflected stick until the drone turns.
async fn turn(guard: &Guard, drone: &mut Witness) {
    let before = drone.look_yaw();
    fly_by_hand(guard, drone, DEFLECTED, |drone| (drone.at.yaw_rad - before).sin().abs() > 0.1).await;
}

/// Starts the round by the page until the drone flies, whatever it does then: sticks are taken from a round, too.
async fn in_the_air(guard: &Guard, drone: &mut Witness) {
    let began = Instant::now();
    while !matches!(drone.look().0, Some(Phase::Autonomous | Phase::Hover | Phase::Manual)) {
        assert!(began.elapsed() < LONG, "it does not fly");
        if drone.look().0 == Some(Phase::Grounded) {
            guard.look("document.querySelector('.dock-primary').click()").await;
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Waits for the silence that began after `since_ms` to end the lease.
async fn heard(listener: &Listener, since_ms: f64) -> Silence {
    let began = Instant::now();
    loop {
        if let Some(silence) = listener.silence(since_ms) {
            return silence;
        }
        assert!(began.elapsed() < LONG, "the sticks were not given up");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn say(what: &str, values: &[f64]) {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| {
        let index = ((values.len() as f64 - 1.0) * share).round() as usize;
        values.get(index).copied().unwrap_or(f64::NAN)
    };
    println!("{what}: n {}, p50 {:.0}, p95 {:.0}, most {:.0} ms", values.len(), at(0.5), at(0.95), at(1.0));
}
