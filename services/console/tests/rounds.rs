//! A round that is flown leaves a report, with what was marked on the way.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::client::{answer, hear, say};
use common::{Bench, until};
use console::Role;
use serde_json::json;

fn pilot(phase: u8, cause: u8, holder: &str) -> serde_json::Value {
    json!({ "phase": phase, "cause": cause, "action": u8::from(cause > 0), "holder": holder })
}

#[tokio::test(flavor = "multi_thread")]
async fn a_round_is_reported_with_rooms_failsafes_incidents_and_who_flew() {
    let mut bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let (guard, _, email) = bench.account(&eva, Role::Guard, &["north"]).await;
    let mut page = guard.open("/ws/telemetry?drone=north").await.unwrap();
    let patrol = |state: u8, kitchen: u8, store: u8| {
        json!({ "started_ns": 77, "state": state, "pad_x_m": 1.0, "pad_y_m": 1.0, "coverage": 0.8, "text": "on the way",
            "rooms": [{ "name": "Kitchen", "reason": "", "seen": 0.9, "state": kitchen },
                      { "name": "Store", "reason": "door closed", "seen": 0.0, "state": store }] })
    };
    // A change of phase is heard once the console is subscribed.
    let event = |kind: &'static str, text: &'static str| {
        move |value: &serde_json::Value| {
            (value["event"]["kind"] == kind && value["event"]["text"] == text).then_some(())
        }
    };
    let mut every = tokio::time::interval(std::time::Duration::from_millis(50));
    {
        let heard = hear(&mut page, event("round", "started"));
        tokio::pin!(heard);
        loop {
            tokio::select! {
                () = &mut heard => break,
                _ = every.tick() => {
                    drone.say("pilot/state", &pilot(2, 0, "")).await;
                    drone.say("navigation/patrol", &patrol(2, 1, 0)).await;
                }
            }
        }
    }
    drone
        .say("localization/pose", &json!({ "x_m": 4.0, "y_m": 2.0, "heading_rad": 1.0, "searching": 0 }))
        .await;
    drone.say("pilot/state", &pilot(4, 6, "")).await;
    hear(&mut page, event("failsafe", "battery: return")).await;
    bench.pass(std::time::Duration::from_secs(20));
    drone.say("pilot/state", &pilot(5, 0, "ana@example.org")).await;
    hear(&mut page, event("phase", "manual")).await;
    say(&mut page, &json!({ "order": { "id": 3, "verb": "home" } })).await;
    answer(&mut page, 3).await;
    hear(&mut page, |value| (value["event"]["verb"] == "home").then_some(())).await;
    let marked = guard.post("/api/drones/north/incidents", &json!({ "text": " a window is open " })).await;
    assert_eq!(marked.status, 201, "{}", marked.text);
    let incident = marked.json();
    assert_eq!(incident["text"], "a window is open");
    assert_eq!((incident["x_m"].as_f64(), incident["y_m"].as_f64()), (Some(4.0), Some(2.0)));
    assert_eq!((&incident["account"], &incident["holder"]), (&json!(email), &json!("ana@example.org")));
    hear(&mut page, event("incident", "a window is open")).await;
    assert_eq!(
        guard.post("/api/drones/north/incidents", &json!({ "text": "x".repeat(2001) })).await.status,
        400
    );
    drone.say("navigation/patrol", &patrol(5, 2, 3)).await;
    drone
        .say("localization/pose", &json!({ "x_m": 1.2, "y_m": 1.1, "heading_rad": 1.0, "searching": 0 }))
        .await;
    drone.say("pilot/state", &pilot(6, 0, "")).await;
    hear(&mut page, event("phase", "landing")).await;
    bench.pass(std::time::Duration::from_secs(10));
    drone.say("pilot/state", &pilot(0, 0, "")).await;
    hear(&mut page, event("phase", "grounded")).await;
    drone.say("navigation/patrol", &patrol(6, 2, 3)).await;
    let id = hear(&mut page, |value| value["event"]["report"].as_i64()).await;
    let list = guard.get("/api/reports?drone=north").await.json();
    assert_eq!(list.as_array().unwrap().len(), 1);
    assert_eq!((&list[0]["id"], &list[0]["outcome"]), (&json!(id), &json!("landed_on_pad")));
    let report = guard.get(&format!("/api/reports/{id}")).await.json();
    assert_eq!(report["coverage"], 0.8);
    assert_eq!(report["landed_ms"].as_u64().unwrap() - report["started_ms"].as_u64().unwrap(), 30_000);
    assert_eq!(report["rooms"][0]["state"], "seen");
    assert_eq!(
        report["rooms"][0]["left_ms"].as_u64().unwrap() - report["rooms"][0]["entered_ms"].as_u64().unwrap(),
        20_000
    );
    assert_eq!(
        (&report["rooms"][1]["state"], &report["rooms"][1]["reason"]),
        (&json!("skipped"), &json!("door closed"))
    );
    assert_eq!(report["failsafes"][0]["text"], "battery: return");
    assert_eq!(report["flown_by"][0]["text"], "ana@example.org");
    assert_eq!(report["incidents"][0]["text"], "a window is open");
    assert_eq!(report["orders"][0]["account"], email.as_str());
    // Others' drones are others' reports.
    let (other, _, _) = bench.account(&eva, Role::Guard, &["south"]).await;
    assert_eq!(other.get("/api/reports").await.json(), json!([]));
    assert_eq!(other.get("/api/reports?drone=north").await.json(), json!([]));
    assert_eq!(other.get(&format!("/api/reports/{id}")).await.status, 404);
    bench.restart().await;
    let (after, _, _) = bench.account(&bench.log_in("eva@example.org").await, Role::Viewer, &["north"]).await;
    until("kept", async || after.get("/api/reports").await.json().as_array().unwrap().len() == 1).await;
    assert_eq!(after.get("/api/drones/north/incidents").await.json()[0]["text"], "a window is open");
}
