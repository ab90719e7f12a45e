//! Who is nobody, and what is no order.

use crate::client::{ANSWER, Client, SILENCE};
use crate::race::sticks;
use crate::system::{System, now_s};
use crate::{Board, accepted, connect};
use bridge::keys::Direction;
use ipc_types::Verb;
use serde_json::{Value, json};
use std::time::Duration;

/// Somebody without a certificate, with one of another authority, or one that is on no list.
pub(crate) fn strangers_get_nothing(system: &System) {
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
pub(crate) fn bad_input_changes_nothing(system: &System) {
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
