//! The bridge over real TLS, as a process of a flying system: who may what, what nobody may, and how quick it is.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod building;
mod client;
mod race;
mod refused;
mod system;

use bridge::keys::{Direction, verb_word};
use client::{ANSWER, Client, SILENCE};
use ipc_types::{Channels, Command, PilotState, Sticks, Verb};
use race::sticks;
use runtime::{Input, Tool};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use system::{System, Way, free_endpoint, now_s, wait_until};

/// Commands and sticks that were published on board since the last look.
struct Board {
    tool: Tool,
    commands: Input<Command>,
    sticks: Input<Sticks>,
    pilot: Input<PilotState>,
    /// What was given before is history, which reaches who joins late within a second.
    since_ns: u64,
}

impl Board {
    fn join(system: &System) -> Self {
        let mut tool = system.tool();
        let (commands, sticks, pilot) =
            (tool.ports.input().unwrap(), tool.ports.input().unwrap(), tool.ports.input().unwrap());
        let mut board = Self { tool, commands, sticks, pilot, since_ns: runtime::monotonic_ns() };
        board.forget();
        board
    }

    fn forget(&mut self) {
        self.since_ns = runtime::monotonic_ns();
        while self.commands.receive().is_some() || self.sticks.receive().is_some() {}
    }

    /// What came from whom.
    fn heard(&mut self) -> Vec<String> {
        self.tool.tick();
        let mut heard = Vec::new();
        while let Some(command) = self.commands.receive() {
            if command.header.stamp_ns < self.since_ns {
                continue;
            }
            heard.push(format!("order {} by {}", command.verb, command.certificate));
        }
        while let Some(sticks) = self.sticks.receive() {
            if sticks.header.stamp_ns < self.since_ns {
                continue;
            }
            heard.push(format!("sticks under lease {}", sticks.lease));
        }
        heard
    }

    fn pilot(&mut self) -> Option<PilotState> {
        self.pilot.latest().map(|state| *state)
    }
}

fn connect(system: &System, name: &str) -> Client {
    let client = Client::open(&system.authority.client_config(name), |_| {}).unwrap();
    client.wait_beacon();
    client
}

/// Takes off, repeating the order while the pilot is not yet ready.
fn accepted(client: &mut Client, verb: Verb) {
    let mut said = None;
    wait_until(verb.word(), || {
        said = client.give(verb);
        said.as_ref().is_some_and(|answer| answer["accepted"] == true)
    });
}

/// What everybody may and nobody may, by whichever way.
fn roles_hold(system: &System) {
    let (mut guard, mut viewer) = (connect(system, "guard"), connect(system, "viewer"));
    let mut board = Board::join(system);
    for client in [&guard, &viewer] {
        assert!(client.sees_alive(ANSWER));
        assert!(client.hears(&client.keys.telemetry("localization/pose"), ANSWER));
        let about = client.ask(&client.keys.about(), None, ANSWER).unwrap();
        let about: Value = serde_json::from_slice(&about).unwrap();
        assert_eq!((&about["name"], &about["simulated"]), (&json!("sereno-1"), &json!(true)));
        assert!(client.ask(&client.keys.plan(), None, ANSWER).unwrap().starts_with(b"\x89PNG"));
        let newest = client.ask(&client.keys.telemetry("pilot/state"), None, ANSWER).unwrap();
        assert!(serde_json::from_slice::<Value>(&newest).unwrap()["phase"].is_u64());
    }
    board.forget();
    for verb in Verb::ALL.iter().copied() {
        // At the pace that the drone allows.
        std::thread::sleep(Duration::from_millis(120));
        let answer = viewer.give(verb).unwrap_or_else(|| panic!("{verb}: a viewer is refused in words"));
        assert_eq!(answer["accepted"], false, "{verb}");
        assert!(answer["text"].as_str().unwrap().contains("a viewer may not order"), "{answer}");
        // Under somebody else's name nothing arrives at all, not even a refusal.
        let forged = viewer.order(verb).to_string().into_bytes();
        assert_eq!(viewer.give_as("guard", verb, forged, SILENCE), None, "{verb}");
        let forged = guard.order(verb).to_string().into_bytes();
        assert_eq!(guard.give_as("other", verb, forged, SILENCE), None, "{verb}");
    }
    viewer.put(&viewer.keys.sticks("viewer"), sticks(&viewer, 1, 1).to_string());
    viewer.put(&viewer.keys.sticks("guard"), sticks(&viewer, 1, 1).to_string());
    // A client cannot play the drone, nor hear what is said to another.
    let fake = viewer.session.clone();
    zenoh::Wait::wait(fake.put(viewer.keys.telemetry("localization/pose"), "{}")).unwrap();
    assert!(!guard.hears(&guard.keys.signal("viewer", "*", Direction::Out), SILENCE));
    assert_eq!(board.heard(), Vec::<String>::new());
    accepted(&mut guard, Verb::AutomaticOn);
    assert!(!board.heard().is_empty(), "and this is how it looks when something comes");
    wishes_wake_the_camera(&viewer);
}

/// Whoever sees may wish for pictures, under the own name only, and for two seconds at a time.
fn wishes_wake_the_camera(viewer: &Client) {
    let wish = r#"{"video":{"width":320,"height":240,"fps":15},"still":false}"#;
    let video = viewer.keys.telemetry("camera/video");
    assert!(!viewer.hears(&video, SILENCE), "nobody wants any");
    for nonsense in ["", "{}", r#"{"video":{"width":321,"height":240,"fps":15}}"#, &"x".repeat(2000)] {
        viewer.put(&viewer.keys.wish("viewer"), nonsense);
    }
    viewer.put(&viewer.keys.wish("guard"), wish);
    assert!(!viewer.hears(&video, SILENCE), "junk, and a wish under another's name");
    wait_until("pictures that are wished for", || {
        viewer.put(&viewer.keys.wish("viewer"), wish);
        viewer.hears(&video, SILENCE)
    });
    wait_until("no pictures when nobody wishes any more", || !viewer.hears(&video, SILENCE));
}

#[test]
fn guards_order_viewers_see_and_nobody_speaks_for_another() {
    let endpoint = free_endpoint();
    let system = System::start(Way::Direct, &endpoint);
    system.wait_bridge(&endpoint);
    roles_hold(&system);
    refused::strangers_get_nothing(&system);
    refused::bad_input_changes_nothing(&system);
    the_command_line_does_the_same(&system);
    race::sticks_need_the_lease_and_are_quick(&system);
    a_flood_loses_no_frame(&system);
    lists_and_papers_are_read_again(&system);
}

#[test]
fn an_installer_changes_the_building_and_nobody_else() {
    let endpoint = free_endpoint();
    let system = System::start(Way::Direct, &endpoint);
    system.wait_bridge(&endpoint);
    building::who_may_not_changes_nothing(&system);
    building::a_round_is_taken_over(&system);
    building::a_plan_is_taken_over(&system);
    building::not_in_the_air(&system);
}

#[test]
fn two_guards_who_ask_at_once_are_never_holders_both() {
    let endpoint = free_endpoint();
    // Each of them gives up to two orders a race.
    let system = System::start_with(Way::Direct, &endpoint, "orders_hz = 100.0\n");
    system.wait_bridge(&endpoint);
    race::two_guards_never_hold_the_sticks_both(&system);
}

#[test]
fn a_router_between_changes_nothing() {
    let endpoint = free_endpoint();
    let system = System::start(Way::Router, &endpoint);
    system.wait_bridge("cannot reach the router");
    let config = std::fs::read_to_string(system.authority.client_config("hub")).unwrap();
    let router = zenoh::Wait::wait(zenoh::open(zenoh::Config::from_json5(&config).unwrap())).unwrap();
    system.wait_bridge("on 1 of 1 routers");
    roles_hold(&system);
    // A router that goes and comes again is found again.
    zenoh::Wait::wait(router.close()).unwrap();
    drop(router);
    let router = zenoh::Wait::wait(zenoh::open(zenoh::Config::from_json5(&config).unwrap())).unwrap();
    assert!(
        connect(&system, "guard")
            .hears("sereno/sereno-1/telemetry/localization/pose", Duration::from_secs(20))
    );
    drop(router);
}

/// `sereno --remote` prints what `sereno` prints on board.
fn the_command_line_does_the_same(system: &System) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let keys = |output: &std::process::Output| {
        let message: Value = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|error| panic!("{error}: {} {}", text(&output.stdout), text(&output.stderr)));
        message.as_object().unwrap().keys().cloned().collect::<Vec<_>>()
    };
    for topic in ["localization/pose", "pilot/state", "localization/particles", "navigation/grid"] {
        let near = system.sereno(&["topic", "echo", topic, "-n", "1"]);
        let far = system.remote("viewer", &["topic", "echo", topic, "-n", "1"]);
        assert_eq!(keys(&near), keys(&far), "{topic}");
    }
    let rate = system.remote("viewer", &["--json", "topic", "hz", "localization/pose", "--seconds", "3"]);
    let rate: Value = serde_json::from_slice(&rate.stdout).unwrap();
    assert!((10.0..=22.0).contains(&rate["hz"].as_f64().unwrap()), "{rate}");
    assert!(text(&system.remote("viewer", &["topic", "list"]).stdout).contains("localization/particles"));
    let near = text(&system.sereno(&["automatic", "on"]).stdout);
    let far = system.remote("guard", &["automatic", "on"]);
    assert_eq!((far.status.code(), text(&far.stdout)), (Some(0), near));
    let refused = system.remote("viewer", &["takeoff"]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("takeoff: a viewer may not order"), "{}", text(&refused.stderr));
    let stranger = system.remote("revoked", &["takeoff"]);
    assert_eq!(stranger.status.code(), Some(1));
    assert!(
        text(&stranger.stderr).contains("does not know the certificate revoked"),
        "{}",
        text(&stranger.stderr)
    );
    let local = system.remote("guard", &["ps"]);
    assert!(text(&local.stderr).contains("is for the machine of the drone"), "{}", text(&local.stderr));
}

/// Frames of the channels that were heard until it was over, and those between them that were not.
fn count_frames(system: &System, heard: &AtomicU64, over: &AtomicBool) -> (u64, u64) {
    let mut tool = system.tool();
    let mut channels = tool.ports.input::<Channels>().unwrap();
    let (mut last, mut frames, mut gaps) = (None, 0_u64, 0_u64);
    while !over.load(Ordering::Relaxed) {
        while let Some(frame) = channels.receive() {
            let sequence = frame.header.sequence;
            gaps += last.map_or(0, |last: u64| sequence.saturating_sub(last + 1));
            last = Some(sequence);
            frames += 1;
        }
        heard.store(frames, Ordering::Relaxed);
        std::thread::sleep(Duration::from_millis(2));
    }
    (frames, gaps)
}

/// Ten thousand orders at once: the pilot's channels keep their rhythm, and another guard's stop is heard.
fn a_flood_loses_no_frame(system: &System) {
    let (mut guard, mut other) = (connect(system, "guard"), connect(system, "other"));
    let missed = |service: &str| system.ps(service)["missed_deadlines"].as_u64().unwrap();
    let before = [missed("pilot"), missed("flight")];
    let payloads: Vec<Vec<u8>> =
        (0..10_000).map(|_| guard.order(Verb::Hold).to_string().into_bytes()).collect();
    let key = guard.keys.command(&verb_word(Verb::Hold), "guard");
    let began = Instant::now();
    let (heard, over) = (AtomicU64::new(0), AtomicBool::new(false));
    let ((flooded, answered, stop), (frames, gaps)) = std::thread::scope(|scope| {
        // A reader that does nothing else: what it misses was not sent.
        let listening = race::Listening(&over);
        let reader = scope.spawn(|| count_frames(system, &heard, &over));
        for payload in payloads {
            zenoh::Wait::wait(guard.session.get(&key).payload(payload).callback(|_| {}).timeout(ANSWER))
                .unwrap();
        }
        let flooded = began.elapsed();
        let asked = Instant::now();
        let stop = other.give(Verb::Stop).expect("stop is answered");
        let answered = asked.elapsed();
        // A flood that is over at once shows in what comes after it.
        wait_until("frames", || heard.load(Ordering::Relaxed) > 100);
        drop(listening);
        ((flooded, answered, stop), reader.join().unwrap())
    });
    println!(
        "10 000 orders in {:.1} s: {frames} frames, {gaps} lost; stop answered after {:.0} ms: {}",
        flooded.as_secs_f64(),
        answered.as_secs_f64() * 1e3,
        stop["text"]
    );
    assert!(frames > 20 && gaps == 0, "{gaps} of {frames} frames lost");
    assert_eq!([missed("pilot"), missed("flight")], before, "no deadline of channels or states was missed");
    assert!(answered < Duration::from_secs(3), "{answered:?}");
}

/// A client that is taken off the list is gone, one that is added is heard, without a restart.
fn lists_and_papers_are_read_again(system: &System) {
    let endpoints = {
        let text = std::fs::read_to_string(system.authority.client_config("guard")).unwrap();
        bridge::zenoh_config::endpoints_of(&text).unwrap()
    };
    let other = connect(system, "other");
    system.authority.revoke("other").unwrap();
    wait_until("the revoked client hears no more", || !other.hears(&other.keys.beacon(), SILENCE));
    let viewer = bridge::roles::Standing::Client(bridge::roles::Role::Viewer);
    system.authority.client("new", viewer, &endpoints, now_s()).unwrap();
    wait_until("the new client is heard", || {
        Client::open(&system.authority.client_config("new"), |_| {})
            .is_ok_and(|client| client.hears(&client.keys.beacon(), SILENCE))
    });
    let list = system.deploy().join("certs/clients.toml");
    std::fs::write(&list, "[client.guard]\nrole = \"king\"\n").unwrap();
    system.wait_bridge("closed: ");
    let status = system.ps("bridge")["status"].as_str().unwrap().to_owned();
    assert!(status.contains("clients.toml"), "{status}");
    assert!(
        Client::open(&system.authority.client_config("guard"), |_| {})
            .map_or(true, |client| !client.hears(&client.keys.beacon(), SILENCE)),
        "closed is closed"
    );
}
