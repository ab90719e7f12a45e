//! A round is rehearsed from the page: by the program itself, one rehearsal at a time, and none outlives the console.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::client::Client;
use common::drawing::{self, HEIGHT, SCALE, WIDTH};
use common::{Bench, until};
use console::RehearsalConfig;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A debug build of everything else runs beside it.
const FLIGHT: Duration = Duration::from_secs(240);
const ROUTE: &str = "/api/drones/north/rehearsals";

/// What `cargo xtask test` builds before it runs the tests.
fn program() -> PathBuf {
    let program =
        Path::new(env!("CARGO_BIN_EXE_sereno-console")).ancestors().nth(2).unwrap().join("release/sereno");
    assert!(program.is_file(), "{} is missing: `cargo xtask test` builds it", program.display());
    program
}

async fn rehearsing() -> (Bench, Client, common::drone::Drone) {
    let mut bench = Bench::new(1).await;
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    bench.config.rehearsal = RehearsalConfig { program: Some(program()), deploy: Some(deploy.clone()) };
    bench.restart().await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    *drone.plan.lock().unwrap() = std::fs::read(deploy.join("plans/two-rooms.png")).unwrap();
    let side = std::fs::read(deploy.join("plans/two-rooms.rooms.yaml")).unwrap();
    let side = floorplan::Sidecar::parse("two-rooms", &side).unwrap();
    let header = std::fs::read(deploy.join("plans/two-rooms.yaml")).unwrap();
    let header = floorplan::PlanHeader::parse("two-rooms", &header).unwrap();
    {
        let mut about = drone.about.lock().unwrap();
        about["vehicle"] = json!({ "name": "watchman", "radius_m": 0.225 });
        about["building"] = serde_json::to_value(&side).unwrap();
        about["plan"] = json!({ "hash": "2", "resolution_m": header.resolution, "origin_x_m": header.origin[0], "origin_y_m": header.origin[1] });
    }
    (bench, eva, drone)
}

async fn ended(eva: &Client, id: &Value) -> Value {
    let began = Instant::now();
    loop {
        let now = eva.get(&format!("{ROUTE}/{}", id.as_str().unwrap())).await.json();
        if now["state"] != "running" {
            return now;
        }
        assert!(began.elapsed() < FLIGHT, "{now}");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_plan_in_use_and_a_draft_are_flown_and_what_came_of_it_is_told() {
    let (bench, eva, drone) = rehearsing().await;
    assert_eq!(eva.get(ROUTE).await.json(), json!({ "available": true, "text": "", "rehearsals": [] }));
    let begun = eva.post(ROUTE, &json!({ "draft": null, "building": null, "flights": 2 })).await;
    assert_eq!(begun.status, 201, "{}", begun.text);
    let begun = begun.json();
    // One at a time.
    let second = eva.post(ROUTE, &json!({ "flights": 1 })).await;
    assert_eq!(second.status, 503);
    assert!(second.json()["error"].as_str().unwrap().contains("another rehearsal"), "{}", second.text);
    let done = ended(&eva, &begun["id"]).await;
    assert_eq!(done["state"], "done", "{done}");
    let flown = done["flown"].as_array().unwrap();
    assert_eq!(flown.len(), 2);
    for (k, flight) in flown.iter().enumerate() {
        assert_eq!(flight["seed"].as_u64(), Some(k as u64 + 1));
        assert!(
            flight["time_s"].as_f64().unwrap() > 10.0 && flight["coverage"].as_f64().unwrap() > 0.3,
            "{flight}"
        );
        assert!(flight["outcome"].is_string() && flight["skipped"].is_array() && flight["contacts"].is_u64());
    }
    assert_eq!(eva.get(ROUTE).await.json()["rehearsals"][0], done);
    // The round as it was edited is flown, not the drone's.
    let mut building = drone.about.lock().unwrap()["building"].clone();
    let first = building["rooms"][0]["name"].clone();
    building["round"]["leave_out"] = json!([first]);
    let begun = eva.post(ROUTE, &json!({ "building": building, "flights": 1 })).await.json();
    let done = ended(&eva, &begun["id"]).await;
    assert_eq!(done["state"], "done", "{done}");
    let left_out = format!("{}: left out of the round", first.as_str().unwrap());
    assert_eq!(done["flown"][0]["skipped"], json!([left_out]));
    // A draft of which a plan was made.
    let picture = drawing::png(WIDTH, HEIGHT, &drawing::house(false));
    let id =
        eva.send("POST", "/api/drones/north/drafts", picture).await.json()["id"].as_str().unwrap().to_owned();
    let unmade = eva.post(ROUTE, &json!({ "draft": id, "flights": 1 })).await;
    assert_eq!((unmade.status, unmade.json()["error"].as_str()), (400, Some("this draft has no plan yet")));
    let making = json!({ "metres_per_pixel": SCALE, "dark_below": 128, "building": { "pad": { "x": 2.5, "y": 2.0 } } });
    assert_eq!(eva.post(&format!("/api/drones/north/drafts/{id}"), &making).await.status, 200);
    let begun = eva.post(ROUTE, &json!({ "draft": id, "flights": 1 })).await.json();
    let done = ended(&eva, &begun["id"]).await;
    assert_eq!((done["state"].as_str(), done["draft"].as_str()), (Some("done"), Some(id.as_str())), "{done}");
    let log = bench.log(&eva).await;
    assert_eq!(log.iter().filter(|line| line["verb"] == "rehearse").count(), 3);
    // What the program refuses is told in its own words.
    drone.about.lock().unwrap()["vehicle"]["name"] = json!("no-such-vehicle");
    let begun = eva.post(ROUTE, &json!({ "flights": 1 })).await.json();
    let failed = ended(&eva, &begun["id"]).await;
    assert_eq!(failed["state"], "failed");
    assert!(failed["text"].as_str().unwrap().contains("no vehicle no-such-vehicle"), "{failed}");
    for vehicle in ["../x", "--help", "a b", ""] {
        drone.about.lock().unwrap()["vehicle"]["name"] = json!(vehicle);
        assert_eq!(eva.post(ROUTE, &json!({ "flights": 1 })).await.status, 400, "{vehicle}");
    }
}

/// Processes that have this folder among their words.
fn processes(folder: &Path) -> usize {
    let folder = folder.display().to_string();
    std::fs::read_dir("/proc")
        .unwrap()
        .flatten()
        .filter_map(|entry| std::fs::read(entry.path().join("cmdline")).ok())
        .filter(|words| String::from_utf8_lossy(words).contains(&folder))
        .count()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rehearsal_ends_with_the_console() {
    let (mut bench, eva, _drone) = rehearsing().await;
    let begun = eva.post(ROUTE, &json!({ "flights": 5 })).await;
    assert_eq!(begun.status, 201, "{}", begun.text);
    let folder = bench.config.data.clone();
    until("the rehearsal", async || processes(&folder) == 1).await;
    bench.console = None;
    until("its end", async || processes(&folder) == 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_the_program_it_is_said_so_and_wrong_wishes_are_named() {
    let (mut bench, mut eva, _drone) = rehearsing().await;
    for (wish, says) in [
        (json!({ "flights": 0 }), "`flights` is 0, allowed is 1 to 5"),
        (json!({ "flights": 6 }), "`flights` is 6, allowed is 1 to 5"),
        (json!({ "flights": -1 }), "the request is not understood"),
        (json!({ "flights": 1, "seed": 3 }), "the request is not understood"),
        (json!({ "flights": 1, "building": { "pad": { "x": 1e9, "y": 0 } } }), "`pad.x`"),
    ] {
        let reply = eva.post(ROUTE, &wish).await;
        assert_eq!(reply.status, 400, "{}", reply.text);
        assert!(reply.json()["error"].as_str().unwrap().contains(says), "{}", reply.text);
    }
    assert_eq!(eva.post(ROUTE, &json!({ "flights": 1, "draft": "0123456789abcdef" })).await.status, 404);
    assert_eq!(eva.get(&format!("{ROUTE}/0123456789abcdef")).await.status, 404);
    bench.config.rehearsal.program = Some("/nowhere/sereno".into());
    bench.restart().await;
    eva.address = bench.console().address;
    eva.origin = Some(format!("https://localhost:{}", eva.address.port()));
    bench.sees(&eva, "north", true).await;
    let told = eva.get(ROUTE).await.json();
    assert_eq!(told["available"], false);
    assert!(told["text"].as_str().unwrap().contains("there is no program /nowhere/sereno"), "{told}");
    assert_eq!(eva.post(ROUTE, &json!({ "flights": 1 })).await.status, 503);
}
