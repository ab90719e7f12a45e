//! The bridge over real TLS, as a process of a flying system: who may what, what nobody may, and how quick it is.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod building;
mod client;
mod system;

use bridge::keys::{Direction, verb_word};
use client::{ANSWER, Client, SILENCE};
use ipc_types::{Channels, Command, PilotState, Sticks, Verb};
use runtime::{Input, Tool};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};
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

fn sticks(client: &Client, lease: u64, sequence: u64) -> Value {
    json!({ "lease": lease, "socket": 7, "input_sequence": sequence, "beacon_ns": client.beacon(), "since_ms": 0.0,
        "forward": 0.0, "left": 0.0, "up": 0.0, "turn": 0.0, "held": false, "height_hold": true, "heading_hold": true,
        "arm": "absent" })
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
    strangers_get_nothing(&system);
    bad_input_changes_nothing(&system);
    the_command_line_does_the_same(&system);
    sticks_need_the_lease_and_are_quick(&system);
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

/// Somebody without a certificate, with one of another authority, or one that is on no list.
fn strangers_get_nothing(system: &System) {
    let own = system.authority.client_config("guard");
    let elsewhere = tempfile::tempdir().unwrap();
    let other = bridge::Authority::at(elsewhere.path().join("certs"));
    let text = std::fs::read_to_string(&own).unwrap();
    let endpoint = bridge::zenoh_config::endpoints_of(&text).unwrap();
    other.init(&["sereno-1".into()], &[], &endpoint, now_s()).unwrap();
    other
        .client("guard", bridge::roles::Standing::Client(bridge::roles::Role::Guard), &endpoint, now_s())
        .unwrap();
    // It trusts the drone as the true guard does: the drone is who refuses.
    let encoded = {
        use base64::Engine;
        let pem = std::fs::read(system.authority.directory().join("ca.pem")).unwrap();
        base64::engine::general_purpose::STANDARD.encode(pem)
    };
    let tls = |config: &mut zenoh::Config, key: &str, value: Value| {
        config.insert_json5(&format!("transport/link/tls/{key}"), &value.to_string()).unwrap();
    };
    let strangers: [(&str, zenoh::Result<Client>); 4] = [
        ("no certificate", Client::open(&own, |config| tls(config, "enable_mtls", json!(false)))),
        (
            "another authority",
            Client::open(&other.client_config("guard"), |config| {
                tls(config, "root_ca_certificate_base64", json!(encoded));
            }),
        ),
        (
            "no TLS",
            Client::open(&own, |config| {
                config.insert_json5("transport/link/protocols", "[\"tcp\"]").unwrap();
                let plain = vec![endpoint[0].replace("tls/", "tcp/")];
                config.insert_json5("connect/endpoints", &json!(plain).to_string()).unwrap();
            }),
        ),
        ("on no list", Client::open(&system.authority.client_config("revoked"), |_| {})),
    ];
    let guard = connect(system, "guard");
    let mut board = Board::join(system);
    for (what, stranger) in strangers {
        let Ok(mut stranger) = stranger else { continue };
        for key in [
            stranger.keys.beacon(),
            stranger.keys.telemetry("localization/pose"),
            stranger.keys.telemetry("**"),
            "sereno/**".to_owned(),
            "**".to_owned(),
        ] {
            assert!(!stranger.hears(&key, SILENCE), "{what} hears {key}");
        }
        for key in [
            stranger.keys.about(),
            stranger.keys.plan(),
            stranger.keys.telemetry("pilot/state"),
            "sereno/**".to_owned(),
        ] {
            assert_eq!(stranger.ask(&key, None, SILENCE), None, "{what} asks {key}");
        }
        assert!(!stranger.sees_alive(SILENCE), "{what}");
        for verb in Verb::ALL.iter().copied() {
            for name in ["revoked", "guard"] {
                let order = {
                    let mut order = stranger.order(verb);
                    order["beacon_ns"] = json!(guard.beacon());
                    order.to_string().into_bytes()
                };
                let patience = Duration::from_millis(200);
                assert_eq!(stranger.give_as(name, verb, order, patience), None, "{what}: {verb} as {name}");
            }
        }
        stranger.put(&stranger.keys.sticks("guard"), sticks(&guard, 1, 1).to_string());
        assert_eq!(board.heard(), Vec::<String>::new(), "{what}");
    }
}

/// Replayed, stale, oversized, junk: refused in a sentence or not heard at all, and the bridge lives on.
fn bad_input_changes_nothing(system: &System) {
    let mut guard = connect(system, "guard");
    let before = system.ps("bridge");
    accepted(&mut guard, Verb::AutomaticOn);
    let replayed = guard.order(Verb::AutomaticOn).to_string().into_bytes();
    assert!(guard.give_as("guard", Verb::AutomaticOn, replayed.clone(), ANSWER).is_some());
    let mut board = Board::join(system);
    for verb in Verb::ALL.iter().copied() {
        // At the pace that the drone allows: seven in a row, ten a second.
        std::thread::sleep(Duration::from_millis(800));
        let stale = json!({ "beacon_ns": guard.beacon().saturating_sub(2_500_000_000) });
        let future = json!({ "beacon_ns": guard.beacon() + 10_000_000_000 });
        let changed = |with: &Value, guard: &mut Client| {
            let mut order = guard.order(verb);
            for (key, value) in with.as_object().unwrap() {
                order[key] = value.clone();
            }
            order.to_string().into_bytes()
        };
        let bad = [
            ("stale", changed(&stale, &mut guard)),
            ("from the future", changed(&future, &mut guard)),
            ("unknown field", changed(&json!({ "sudo": true }), &mut guard)),
            ("bad id", changed(&json!({ "id": "7" }), &mut guard)),
            ("king", changed(&json!({ "role": "king" }), &mut guard)),
            ("junk", b"\xff\xfe{{{".to_vec()),
            ("nothing", Vec::new()),
        ];
        for (what, payload) in bad {
            let answer = guard.give_as("guard", verb, payload, ANSWER);
            let answer = answer.unwrap_or_else(|| panic!("{verb}, {what}: no answer"));
            let text = answer["text"].as_str().unwrap();
            assert!(answer["accepted"] == false && !text.is_empty(), "{verb}, {what}: {answer}");
            assert!(
                !text.contains("not so fast"),
                "{verb}, {what}: refused for its pace, not for what it is"
            );
        }
    }
    std::thread::sleep(Duration::from_millis(600));
    if let Some(answer) = guard.give_as("guard", Verb::AutomaticOn, replayed, ANSWER) {
        assert_eq!(answer["accepted"], false, "{answer}");
    }
    for size in [5_000, 100_000, 8_000_000] {
        let large = vec![b'x'; size];
        assert_eq!(guard.give_as("guard", Verb::Land, large.clone(), SILENCE), None, "{size} bytes");
        guard.put(&guard.keys.sticks("guard"), large.clone());
        guard.put(&guard.keys.signal("guard", "s", Direction::In), large);
    }
    for junk in [&b""[..], b"{}", b"\xff\xff", b"[[[[[[[[[["] {
        guard.put(&guard.keys.sticks("guard"), junk.to_vec());
        guard.put(&guard.keys.signal("guard", "s", Direction::In), junk.to_vec());
    }
    assert_eq!(board.heard(), Vec::<String>::new());
    let mut guard = connect(system, "guard");
    accepted(&mut guard, Verb::AutomaticOn);
    let after = system.ps("bridge");
    assert_eq!(
        (&before["pid"], &before["restarts"]),
        (&after["pid"], &after["restarts"]),
        "the bridge lives on"
    );
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

/// Only the certificate that took the lease steers, and its inputs are on board at once.
fn sticks_need_the_lease_and_are_quick(system: &System) {
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
        let before = runtime::monotonic_ns();
        guard.put(&guard.keys.sticks("guard"), sticks(&guard, lease, sequence).to_string());
        let deadline = Instant::now() + ANSWER;
        loop {
            if let Some(heard) = board.sticks.receive()
                && heard.input_sequence == sequence
            {
                took.push((runtime::monotonic_ns() - before) as f64 * 1e-6);
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

/// Frames of the channels that were heard until it was over, and those between them that were not.
fn count_frames(system: &System, over: &AtomicBool) -> (u64, u64) {
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
    let over = AtomicBool::new(false);
    let ((flooded, answered, stop), (frames, gaps)) = std::thread::scope(|scope| {
        // A reader that does nothing else: what it misses was not sent.
        let reader = scope.spawn(|| count_frames(system, &over));
        for payload in payloads {
            zenoh::Wait::wait(guard.session.get(&key).payload(payload).callback(|_| {}).timeout(ANSWER))
                .unwrap();
        }
        let flooded = began.elapsed();
        let asked = Instant::now();
        let stop = other.give(Verb::Stop).expect("stop is answered");
        let answered = asked.elapsed();
        over.store(true, Ordering::Relaxed);
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
