//! What drones say reaches pages, and what pages say reaches drones.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::client::{answer, closed, hear, say};
use common::{Bench, until};
use console::Role;
use futures_util::StreamExt;
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::Message;

/// Says it until the page hears it: a subscription takes a moment to reach the drone.
async fn hear_pose(drone: &common::drone::Drone, socket: &mut common::client::Socket, x_m: f64) {
    let pose = json!({ "x_m": x_m, "y_m": 2.0, "heading_rad": 0.5, "searching": 0 });
    let heard = hear(socket, |value| {
        (value["topic"] == "localization/pose" && value["data"]["x_m"] == x_m).then(|| value["data"].clone())
    });
    tokio::pin!(heard);
    let mut every = tokio::time::interval(std::time::Duration::from_millis(50));
    loop {
        tokio::select! {
            heard = &mut heard => {
                assert_eq!(heard, pose);
                return;
            }
            _ = every.tick() => drone.say("localization/pose", &pose).await,
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_follows_a_drone_and_gives_an_order() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut socket = eva.open("/ws/telemetry?drone=north").await.unwrap();
    assert!(hear(&mut socket, |value| value["alive"].as_bool()).await);
    say(&mut socket, &json!({ "subscribe": ["localization/pose", "navigation/grid"] })).await;
    hear_pose(&drone, &mut socket, 1.5).await;
    drone.say_bytes("navigation/grid", vec![1, 2, 3]).await;
    let bytes = loop {
        if let Message::Binary(bytes) = socket.next().await.unwrap().unwrap() {
            break bytes;
        }
    };
    assert_eq!(&bytes[..], b"\x0fnavigation/grid\x01\x02\x03");

    say(&mut socket, &json!({ "order": { "id": 7, "verb": "goto", "x_m": 4.0, "y_m": 2.5 } })).await;
    assert_eq!(answer(&mut socket, 7).await, json!({ "id": 7, "accepted": true, "text": "goto: heard" }));
    say(&mut socket, &json!({ "order": { "id": 8, "verb": "land" } })).await;
    assert_eq!(answer(&mut socket, 8).await, json!({ "id": 8, "accepted": false, "text": "land: heard" }));
    let orders = drone.orders();
    assert_eq!(orders.len(), 2);
    let (key, order) = &orders[0];
    assert_eq!(key, "sereno/north/command/goto/console");
    assert_eq!(order["account"], "eva@example.org");
    assert_eq!(order["role"], "administrator");
    assert_eq!((order["x_m"].as_f64(), order["y_m"].as_f64()), (Some(4.0), Some(2.5)));
    assert!(order["socket"].as_u64().unwrap() > 0);
    assert_ne!(order["id"], orders[1].1["id"]);
    let event =
        hear(&mut socket, |value| (value["event"]["verb"] == "land").then(|| value["event"].clone())).await;
    assert_eq!((&event["account"], &event["accepted"]), (&json!("eva@example.org"), &json!(false)));
    until("orders are in the log with their answers", async || {
        let log = bench.log(&eva).await;
        let said =
            |verb: &str| log.iter().find(|line| line["verb"] == verb).map(|line| line["answer"].clone());
        said("goto") == Some(json!("accepted: goto: heard"))
            && said("land") == Some(json!("refused: land: heard"))
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn orders_that_make_no_sense_do_not_reach_the_drone() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut socket = eva.open("/ws/telemetry?drone=north").await.unwrap();
    for (id, order, says) in [
        (1, json!({ "verb": "goto", "x_m": 4.0 }), "x_m and y_m"),
        (2, json!({ "verb": "land", "x_m": 4.0, "y_m": 1.0 }), "x_m and y_m"),
        (3, json!({ "verb": "explode" }), "no such order"),
        (4, json!({ "verb": "sticks-take" }), "no such order here"),
        (5, json!({ "verb": "../../south/command/land" }), "no such order"),
    ] {
        let mut order = order;
        order["id"] = json!(id);
        say(&mut socket, &json!({ "order": order })).await;
        let answer = answer(&mut socket, id).await;
        assert_eq!(answer["accepted"], false);
        assert!(answer["text"].as_str().unwrap().contains(says), "{answer}");
    }
    assert!(drone.orders().is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn sticks_go_out_once_for_each_frame_with_the_sockets_number() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut socket = eva.open("/ws/sticks?drone=north").await.unwrap();
    let beacon = hear(&mut socket, |value| value["beacon_ns"].as_u64().map(|_| value.clone())).await;
    let number = beacon["socket"].as_u64().unwrap();
    say(&mut socket, &json!({ "order": { "id": 1, "verb": "sticks-take" } })).await;
    assert_eq!(answer(&mut socket, 1).await["accepted"], true);
    assert_eq!(drone.orders()[0].1["socket"], number);
    let frame = |sequence: u64| {
        json!({ "lease": 3, "input_sequence": sequence, "beacon_ns": beacon["beacon_ns"], "since_ms": 1.5,
            "forward": 0.5, "left": 0.0, "up": -1.0, "turn": 0.25, "held": true, "height_hold": true,
            "heading_hold": false, "arm": "absent" })
    };
    for sequence in 1..=20 {
        say(&mut socket, &frame(sequence)).await;
    }
    until("all frames", async || drone.heard.lock().unwrap().sticks.len() >= 20).await;
    // The console falls silent with the page: nothing is repeated.
    tokio::time::sleep(std::time::Duration::from_millis(300)).await;
    let heard = drone.heard.lock().unwrap().sticks.clone();
    assert_eq!(heard.len(), 20);
    for (k, (key, value)) in heard.iter().enumerate() {
        assert_eq!(key, "sereno/north/sticks/console");
        let mut expected = frame(k as u64 + 1);
        expected["socket"] = json!(number);
        assert_eq!(*value, expected);
    }
    let mut other = eva.open("/ws/sticks?drone=north").await.unwrap();
    let second = hear(&mut other, |value| value["socket"].as_u64()).await;
    assert_ne!(second, number, "a lease belongs to one socket");
}

#[tokio::test(flavor = "multi_thread")]
async fn signalling_goes_both_ways_in_a_session_of_its_own() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut socket = eva.open("/ws/signal?drone=north").await.unwrap();
    let mut other = eva.open("/ws/signal?drone=north").await.unwrap();
    say(&mut socket, &json!({ "type": "call", "width": 640 })).await;
    until("the call", async || !drone.heard.lock().unwrap().signals.is_empty()).await;
    let (key, text) = drone.heard.lock().unwrap().signals[0].clone();
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), json!({ "type": "call", "width": 640 }));
    let session = key.strip_suffix("/in").unwrap();
    let answer = json!({ "type": "offer", "sdp": "v=0" });
    drone.session.put(format!("{session}/out"), answer.to_string()).await.unwrap();
    assert_eq!(hear(&mut socket, |value| Some(value.clone())).await, answer);
    say(&mut other, &json!({ "type": "call" })).await;
    until("the other call", async || drone.heard.lock().unwrap().signals.len() == 2).await;
    let (second, _) = drone.heard.lock().unwrap().signals[1].clone();
    assert_ne!(second, key);
    assert!(second.starts_with("sereno/north/signal/console/"));
}

#[tokio::test(flavor = "multi_thread")]
async fn drones_come_and_go_and_a_second_one_is_found_by_a_running_console() {
    let bench = Bench::new(2).await;
    let eva = bench.claim().await;
    assert_eq!(eva.get("/api/drones").await.json(), json!([]));
    let mut north = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let mut socket = eva.open("/ws/telemetry?drone=north").await.unwrap();
    let south = bench.drone(1, "south").await;
    bench.sees(&eva, "south", true).await;
    assert_eq!(eva.get("/api/session").await.json()["drones"], json!(["north", "south"]));
    north.disappear().await;
    bench.sees(&eva, "north", false).await;
    hear(&mut socket, |value| (value["alive"] == false).then_some(())).await;
    hear(&mut socket, |value| (value["event"]["text"] == "connection lost").then_some(())).await;
    say(&mut socket, &json!({ "order": { "id": 1, "verb": "land" } })).await;
    assert_eq!(answer(&mut socket, 1).await["text"], "the drone is not reached");
    north.appear().await;
    hear(&mut socket, |value| (value["alive"] == true).then_some(())).await;
    hear_pose(&north, &mut { subscribed(&eva, "north").await }, 3.0).await;
    hear_pose(&south, &mut { subscribed(&eva, "south").await }, 4.0).await;
    let about = eva.get("/api/drones/north/about").await;
    assert_eq!(about.json()["simulated"], true);
    let plan = eva.get("/api/drones/south/plan.png").await;
    assert_eq!(plan.bytes, south.png);
    assert_eq!(plan.headers["content-type"], "image/png");
    until("simulated is known", async || eva.get("/api/drones").await.json()[0]["simulated"] == true).await;
    drop(south);
}

async fn subscribed(client: &common::client::Client, drone: &str) -> common::client::Socket {
    let mut socket = client.open(&format!("/ws/telemetry?drone={drone}")).await.unwrap();
    say(&mut socket, &json!({ "subscribe": ["localization/pose"] })).await;
    socket
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_taken_away_ends_open_sockets() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let _drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    for (change, code) in [
        (json!({ "role": "viewer" }), 4403),
        (json!({ "drones": ["south"] }), 4403),
        (json!({ "disabled": true }), 4401),
        (json!({ "password": "another long password" }), 4401),
    ] {
        let (guard, id, _) = bench.account(&eva, Role::Guard, &["north"]).await;
        let mut sticks = guard.open("/ws/sticks?drone=north").await.unwrap();
        assert_eq!(eva.patch(&format!("/api/accounts/{id}"), &change).await.status, 200);
        assert_eq!(closed(&mut sticks).await, Some(code), "{change}");
    }
    let (guard, _, _) = bench.account(&eva, Role::Guard, &["north"]).await;
    let mut sticks = guard.open("/ws/sticks?drone=north").await.unwrap();
    assert_eq!(guard.post("/api/logout", &json!({})).await.status, 200);
    assert_eq!(closed(&mut sticks).await, Some(4401));
    let (guard, _, _) = bench.account(&eva, Role::Guard, &["north"]).await;
    let mut sticks = guard.open("/ws/sticks?drone=north").await.unwrap();
    bench.pass(std::time::Duration::from_secs(3601));
    assert_eq!(closed(&mut sticks).await, Some(4401), "idle for too long");
}
