//! The sticks over the network: one holder, whoever asks at the same time, and only he steers.

use crate::client::{ANSWER, Client, SILENCE};
use crate::system::{System, wait_until};
use crate::{Board, accepted, connect};
use ipc_types::{PilotState, Verb};
use runtime::monotonic_ns;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often two guards ask at once, unless `SERENO_RACES` says otherwise: the drone gives orders 60 ms apart, so a thousand take
/// more than three minutes.
const ROUNDS: usize = 200;
/// A lease that is never used ends after a second: what a machine needs longer for tells nothing of a race.
const LEASE_NS: u64 = 900_000_000;
/// Of fifty rounds at most one may be so slow, or left without an answer.
const SLOW_ONE_IN: usize = 50;

/// Sticks in the middle.
pub(crate) fn sticks(client: &Client, lease: u64, sequence: u64) -> Value {
    json!({ "lease": lease, "socket": 7, "input_sequence": sequence, "beacon_ns": client.beacon(), "since_ms": 0.0,
        "forward": 0.0, "left": 0.0, "up": 0.0, "turn": 0.0, "held": false, "height_hold": true, "heading_hold": true,
        "arm": "absent" })
}

/// Only the certificate that took the lease steers, and its inputs are on board at once.
pub(crate) fn sticks_need_the_lease_and_are_quick(system: &System) {
    let (mut guard, other) = (connect(system, "guard"), connect(system, "other"));
    let mut board = Board::join(system);
    accepted(&mut guard, Verb::SticksTake);
    let mut state = None;
    wait_until("a lease", || {
        board.tool.tick();
        state = board.pilot().or(state);
        state.is_some_and(|state| state.lease != 0)
    });
    let lease = state.unwrap().lease;
    board.forget();
    other.put(&other.keys.sticks("other"), sticks(&other, lease, 1).to_string());
    guard.put(&guard.keys.sticks("guard"), sticks(&guard, lease + 1, 1).to_string());
    let mut wrong_socket = sticks(&guard, lease, 1);
    wrong_socket["socket"] = json!(8);
    guard.put(&guard.keys.sticks("guard"), wrong_socket.to_string());
    std::thread::sleep(SILENCE);
    assert_eq!(board.heard(), Vec::<String>::new(), "forged");
    let mut took = Vec::new();
    for sequence in 2..202 {
        let before = monotonic_ns();
        guard.put(&guard.keys.sticks("guard"), sticks(&guard, lease, sequence).to_string());
        let deadline = Instant::now() + ANSWER;
        loop {
            if let Some(heard) = board.sticks.receive()
                && heard.input_sequence == sequence
            {
                took.push((monotonic_ns() - before) as f64 * 1e-6);
                assert!((0.0..200.0).contains(&heard.age_ms), "{} ms old", heard.age_ms);
                break;
            }
            assert!(Instant::now() < deadline, "input {sequence} has not come");
            std::hint::spin_loop();
        }
        std::thread::sleep(Duration::from_millis(13));
    }
    took.sort_by(f64::total_cmp);
    let (p50, p99) = (took[took.len() / 2], took[took.len() * 99 / 100]);
    println!("sticks, zenoh client to operator/sticks: p50 {p50:.2} ms, p99 {p99:.2} ms of {}", took.len());
    let release = {
        let mut order = guard.order(Verb::SticksRelease);
        (order["lease"], order["socket"]) = (json!(lease), json!(7));
        order.to_string().into_bytes()
    };
    let answer = guard.give_as("guard", Verb::SticksRelease, release, ANSWER).unwrap();
    assert_eq!(answer["accepted"], true, "{answer}");
}

/// Who asks for the sticks.
struct Guard {
    client: Client,
    account: &'static str,
    socket: u64,
}

impl Guard {
    /// Null when nobody answers: a machine that stands still for two seconds loses its connections.
    fn give(&mut self, verb: Verb) -> Value {
        let mut order = self.client.order(verb);
        (order["account"], order["socket"]) = (json!(self.account), json!(self.socket));
        self.client.give_order(verb, &order).unwrap_or_default()
    }

    /// Whether the drone says that nobody holds the sticks.
    fn sees_them_free(&self) -> bool {
        let state = self.client.ask(&self.client.keys.telemetry("pilot/state"), None, ANSWER);
        let state: Value = serde_json::from_slice(&state.unwrap_or_default()).unwrap_or_default();
        state["lease"] == 0
    }
}

/// One time at which both asked.
struct Round {
    began_ns: u64,
    ended_ns: u64,
    /// Who was told that the sticks are his: indices of the guards.
    told: Vec<usize>,
    /// Whether everybody was answered.
    answered: bool,
}

impl Round {
    /// Whether it tells anything: a connection may be lost, and a lease outlasted.
    fn counts(&self) -> bool {
        self.answered && self.ended_ns - self.began_ns <= LEASE_NS
    }
}

/// Two guards ask at the same time, again and again: never two holders, in whatever the pilot says of itself and in what each
/// of them is told.
pub(crate) fn two_guards_never_hold_the_sticks_both(system: &System) {
    let mut guards = [
        Guard { client: connect(system, "guard"), account: "ana@example.org", socket: 7 },
        Guard { client: connect(system, "other"), account: "luis@example.org", socket: 8 },
    ];
    let asked = std::env::var("SERENO_RACES").map_or(ROUNDS, |text| text.parse().expect("how many races"));
    let over = AtomicBool::new(false);
    let (rounds, (states, lost)) = std::thread::scope(|scope| {
        let listener = scope.spawn(|| all_states(system, &over));
        // Also when a race panics: otherwise the listener would be waited for without end.
        let listening = Listening(&over);
        let began = Instant::now();
        let rounds: Vec<Round> = (0..asked).map(|_| race(system, &mut guards)).collect();
        println!("{asked} races in {:.1} s", began.elapsed().as_secs_f64());
        drop(listening);
        (rounds, listener.join().unwrap())
    });
    assert_eq!(lost, 0, "every state that was published was heard");
    let mut holders: BTreeMap<u64, (String, u64)> = BTreeMap::new();
    let mut granted: Vec<(u64, usize)> = Vec::new();
    for state in &states {
        let holder = (state.holder.as_str().to_owned(), state.holder_socket);
        if state.lease == 0 {
            assert_eq!(holder, (String::new(), 0), "nobody holds them");
            continue;
        }
        let who = guards.iter().position(|guard| (guard.account, guard.socket) == (&holder.0, holder.1));
        let who = who.unwrap_or_else(|| panic!("held by {holder:?}"));
        let first = holders.entry(state.lease).or_insert_with(|| {
            granted.push((state.header.stamp_ns, who));
            holder.clone()
        });
        assert_eq!(*first, holder, "lease {} has one holder", state.lease);
    }
    let slow = rounds.iter().filter(|round| !round.counts()).count();
    let mut wins = [0_usize; 2];
    for (number, round) in rounds.iter().enumerate().filter(|(_, round)| round.counts()) {
        let within = |at: &u64| (round.began_ns..=round.ended_ns).contains(at);
        let held: Vec<usize> = granted.iter().filter(|(at, _)| within(at)).map(|(_, who)| *who).collect();
        assert_eq!(held, round.told, "round {number}: who held them and who was told so");
        assert_eq!(held.len(), 1, "round {number}");
        held.iter().for_each(|who| wins[*who] += 1);
    }
    println!(
        "{} states heard; won {} and {}, {slow} rounds too slow to count, or not answered",
        states.len(),
        wins[0],
        wins[1]
    );
    assert!(slow * SLOW_ONE_IN <= asked, "{slow} rounds outlasted a lease or were not answered");
    assert!(wins[0] > 0 && wins[1] > 0, "one of them never won: that was no race");
}

/// Ends the listening when it goes.
pub(crate) struct Listening<'a>(pub(crate) &'a AtomicBool);

impl Drop for Listening<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Both ask at once; who got the sticks gives them back.
fn race(system: &System, guards: &mut [Guard; 2]) -> Round {
    let start = Barrier::new(2);
    let began_ns = monotonic_ns();
    let answers: Vec<Value> = std::thread::scope(|scope| {
        let asking: Vec<_> = guards
            .iter_mut()
            .map(|guard| {
                let start = &start;
                scope.spawn(move || {
                    start.wait();
                    guard.give(Verb::SticksTake)
                })
            })
            .collect();
        asking.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let told: Vec<usize> = (0..2).filter(|who| answers[*who]["accepted"] == true).collect();
    let released: Vec<Value> = told.iter().map(|who| guards[*who].give(Verb::SticksRelease)).collect();
    let answered = answers.iter().chain(&released).all(|answer| !answer.is_null());
    let round = Round { began_ns, ended_ns: monotonic_ns(), told, answered };
    if !round.counts() {
        let lasted_ms = (round.ended_ns - began_ns) / 1_000_000;
        println!("{lasted_ms} ms: asked {answers:?}, released {released:?}; bridge {}", system.ps("bridge"));
        wait_until("nobody holds the sticks", || guards[0].sees_them_free());
        return round;
    }
    let [winner] = round.told[..] else { panic!("told {answers:?}") };
    let refused = answers[1 - winner]["text"].as_str().unwrap_or_default();
    let holds = format!("{} holds the sticks", guards[winner].account);
    assert!(refused.contains(&holds), "{refused}");
    assert_eq!(released[0]["accepted"], true, "{released:?}");
    round
}

/// Every state that the pilot publishes until it is over, and how many of them were missed.
fn all_states(system: &System, over: &AtomicBool) -> (Vec<PilotState>, u64) {
    let mut tool = system.tool();
    let mut states = tool.ports.input::<PilotState>().unwrap();
    let (mut heard, mut lost, mut last) = (Vec::new(), 0, None);
    while !over.load(Ordering::Relaxed) {
        tool.tick();
        while let Some(state) = states.receive() {
            let sequence = state.header.sequence;
            lost += last.map_or(0, |last: u64| sequence.saturating_sub(last + 1));
            last = Some(sequence);
            heard.push(*state);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    (heard, lost)
}
