//! The building is edited and plans are made of pictures: what the drone is given, and what is refused before.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::Bench;
use common::client::{Client, Reply};
use common::drawing::{self, HEIGHT, SCALE, WIDTH};
use common::drone::Drone;
use console::Role;
use floorplan::{Cell, Plan, PlanHeader};
use serde_json::{Value, json};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Of what a drone has, as it says itself.
const REVISION: &str = "0123456789abcdef";

fn building() -> Value {
    json!({
        "pad": { "x": 2.5, "y": 2.0, "heading_deg": 90.0 },
        "doors": [{ "name": "Between", "a": [5.0, 2.75], "b": [5.0, 4.0] }],
        "rooms": [
            { "name": "West", "rectangle": [1.0, 1.0, 5.0, 6.0] },
            { "name": "East", "polygon": [[5.0, 1.0], [9.0, 1.0], [9.0, 6.0], [5.0, 6.0]] },
        ],
        "no_fly": [{ "name": "Rack", "rectangle": [8.0, 5.0, 8.5, 5.5] }],
        "privacy": [{ "name": "Desk", "rectangle": [1.5, 4.5, 2.5, 5.5] }],
        "round": { "order": ["East"], "leave_out": [], "points": [{ "name": "Safe", "x": 7.0, "y": 2.0 }] },
    })
}

async fn ready(bench: &Bench) -> (Client, Drone) {
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    (eva, drone)
}

fn refused(reply: &Reply, status: u16) -> String {
    assert_eq!(reply.status, status, "{}", reply.text);
    let sentence = reply.json()["error"].as_str().unwrap().to_owned();
    assert!(!sentence.is_empty() && sentence.len() < 400 && !sentence.contains('\n'), "{sentence}");
    sentence
}

async fn upload(client: &Client, bytes: Vec<u8>) -> Reply {
    client.send("POST", "/api/drones/north/drafts", bytes).await
}

#[tokio::test(flavor = "multi_thread")]
async fn an_edit_reaches_the_drone_whole_and_is_kept_in_the_log() {
    let bench = Bench::new(1).await;
    let (eva, drone) = ready(&bench).await;
    let (installer, _, email) = bench.account(&eva, Role::Installer, &["north"]).await;
    let route = "/api/drones/north/building";
    let answer = installer.post(route, &json!({ "building": building(), "made_from": REVISION })).await;
    assert_eq!(answer.status, 200, "{}", answer.text);
    assert_eq!(answer.json(), json!({ "accepted": true, "text": "written; starting anew with it" }));
    // Once more: another order, not the same one again.
    assert_eq!(
        installer.post(route, &json!({ "building": building(), "made_from": REVISION })).await.json()["accepted"],
        true
    );
    let edits = drone.heard.lock().unwrap().edits.clone();
    assert_eq!(edits.len(), 2);
    assert_ne!(edits[0].payload["id"], edits[1].payload["id"]);
    for edit in &edits {
        assert_eq!(edit.key, "sereno/north/edit/console");
        assert_eq!(edit.payload["building"], building());
        assert_eq!(edit.payload["plan"], Value::Null);
        assert_eq!(edit.payload["made_from"], REVISION);
        assert_eq!(edit.payload["account"].as_str(), Some(email.as_str()));
        assert_eq!(edit.payload["role"], "installer");
        assert!(edit.picture.is_none());
    }
    let about = eva.get("/api/drones/north/about").await.json();
    assert_eq!(about["building"], building(), "what the drone has now");
    // What the drone refuses is an answer, too.
    let mut without = building();
    without["pad"] = Value::Null;
    let answer = installer.post(route, &json!({ "building": without, "made_from": REVISION })).await.json();
    assert_eq!(answer, json!({ "accepted": false, "text": "not in the air" }));
    let log: Vec<Value> = bench.log(&eva).await.into_iter().filter(|line| line["kind"] == "plan").collect();
    assert_eq!(log.len(), 3);
    assert_eq!(log[0]["answer"], "refused: not in the air");
    assert_eq!(log[2]["answer"], "accepted: written; starting anew with it");
    assert!(log.iter().all(|line| line["account"] == email.as_str() && line["drone"] == "north"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wrong_building_is_refused_by_name_and_reaches_no_drone() {
    let bench = Bench::new(1).await;
    let (eva, mut drone) = ready(&bench).await;
    let long = "x".repeat(32);
    let many: Vec<Value> =
        (0..65).map(|k| json!({ "name": format!("{k}"), "rectangle": [0, 0, 1, 1] })).collect();
    let cases: [(&str, Value, &str); 9] = [
        ("/pad/x", json!(1e6), "`pad.x` is 1000000, allowed is -10000 to 10000 m"),
        ("/pad/heading_deg", json!(400), "`pad.heading_deg` is 400, allowed is -360 to 360 degrees"),
        ("/doors/0/b", json!([5.0, 2.8]), "`doors: Between` is 0.05 m wide, allowed is 0.3 to 10 m"),
        ("/rooms/1/name", json!("West"), "`rooms: West` is used twice, allowed is one area a name"),
        ("/no_fly", json!(many), "`no_fly` is 65 areas, allowed is at most 64"),
        ("/privacy/0/name", json!(long), "allowed is 1 to 31 bytes of text"),
        (
            "/round/order",
            json!(["Attic"]),
            "`round.order` is \"Attic\", allowed is names that stand in rooms",
        ),
        ("/round/points/0", json!({ "name": "Safe", "x": 8.2, "y": 5.2 }), "in the no-fly zone Rack"),
        ("/rooms/0/rectangle", json!([1, 2, 3]), "the request is not understood"),
    ];
    for (place, value, says) in cases {
        let mut wrong = building();
        *wrong.pointer_mut(place).unwrap() = value;
        let reply = eva
            .post("/api/drones/north/building", &json!({ "building": wrong, "made_from": REVISION }))
            .await;
        let sentence = refused(&reply, 400);
        assert!(sentence.contains(says), "{place}: {sentence}");
    }
    let mut huge = building();
    huge["note"] = json!("x".repeat(300_000));
    refused(
        &eva.post("/api/drones/north/building", &json!({ "building": huge, "made_from": REVISION })).await,
        413,
    );
    for made_from in [json!(""), json!("0123456789abcdeg"), json!("0".repeat(1000))] {
        let edit = json!({ "building": building(), "made_from": made_from });
        let sentence = refused(&eva.post("/api/drones/north/building", &edit).await, 400);
        assert!(sentence.contains("`made_from`"), "{sentence}");
    }
    refused(&eva.post("/api/drones/north/building", &json!({ "building": building() })).await, 400);
    assert!(drone.heard.lock().unwrap().edits.is_empty());
    // A drone that is gone hears nothing, and that is said.
    drone.disappear().await;
    bench.sees(&eva, "north", false).await;
    let answer = eva
        .post("/api/drones/north/building", &json!({ "building": building(), "made_from": REVISION }))
        .await
        .json();
    assert_eq!(answer, json!({ "accepted": false, "text": "the drone is not reached" }));
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_picture_is_refused_in_a_sentence_and_nothing_else_suffers() {
    let bench = Bench::new(1).await;
    let (eva, _drone) = ready(&bench).await;
    let good = drawing::png(WIDTH, HEIGHT, &drawing::house(false));
    let good_jpeg = drawing::jpeg(WIDTH, HEIGHT, &drawing::house(false));
    let none = "this is no PNG or JPEG picture";
    let large = "allowed is 16 to 20000 a side and 40 megapixels in all";
    let mut flipped = good.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 0xff;
    let cases: Vec<(&str, Vec<u8>, u16, &str)> = vec![
        ("nothing", Vec::new(), 400, none),
        ("junk", (0..50_000_u32).map(|k| ((k * k) >> 7) as u8).collect(), 400, none),
        ("text", b"{\"picture\":true}".to_vec(), 400, none),
        ("another format", b"GIF89a\x10\x00\x10\x00\x00\x00\x00;".to_vec(), 400, none),
        ("half a PNG", good[..good.len() / 2].to_vec(), 400, none),
        ("a PNG's first bytes", good[..20].to_vec(), 400, none),
        ("a damaged PNG", flipped, 400, none),
        ("a JPEG's first bytes", good_jpeg[..30].to_vec(), 400, none),
        ("100 megapixels", drawing::claiming(10_000, 10_000), 413, large),
        ("a size of no machine", drawing::claiming(u32::MAX >> 1, u32::MAX >> 1), 400, none),
        ("a strip", drawing::claiming(20_001, 16), 413, large),
        ("nobody's house", drawing::png(15, 15, &[255; 225]), 413, large),
        ("17 MiB", vec![0; 17 * 1024 * 1024], 413, "longer than 16777216 bytes"),
    ];
    for (what, bytes, status, says) in cases {
        let sentence = refused(&upload(&eva, bytes).await, status);
        assert!(sentence.contains(says), "{what}: {sentence}");
        assert_eq!(eva.get("/api/session").await.status, 200);
    }
    assert_eq!(eva.get("/api/drones/north/drafts").await.json(), json!([]));
    // Nothing is left of them, and a good one is taken.
    let folder = bench.config.data.join("drafts/of-north");
    assert!(std::fs::read_dir(&folder).map_or(0, Iterator::count) == 0);
    assert_eq!(upload(&eva, good).await.status, 201);
    assert_eq!(upload(&eva, good_jpeg).await.status, 201);
    // A drone that nobody has heard of has no drafts.
    refused(&eva.send("POST", "/api/drones/south/drafts", vec![1]).await, 404);
    refused(&eva.send("POST", "/api/drones/../drafts", vec![1]).await, 404);
}

fn private(path: &Path) {
    for entry in std::fs::read_dir(path).unwrap() {
        let entry = entry.unwrap();
        let mode = entry.metadata().unwrap().permissions().mode() & 0o777;
        if entry.file_type().unwrap().is_dir() {
            assert_eq!(mode, 0o700, "{}", entry.path().display());
            private(&entry.path());
        } else {
            assert_eq!(mode, 0o600, "{}", entry.path().display());
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_newest_four_drafts_are_kept_for_their_owner_alone() {
    let bench = Bench::new(1).await;
    let (eva, _drone) = ready(&bench).await;
    let picture = drawing::png(WIDTH, HEIGHT, &drawing::house(false));
    let mut ids = Vec::new();
    for _ in 0..5 {
        bench.pass(std::time::Duration::from_secs(1));
        let draft = upload(&eva, picture.clone()).await.json();
        assert_eq!((draft["width"].as_u64(), draft["height"].as_u64()), (Some(400), Some(280)));
        ids.push(draft["id"].as_str().unwrap().to_owned());
    }
    let kept = eva.get("/api/drones/north/drafts").await.json();
    let kept: Vec<&str> = kept.as_array().unwrap().iter().map(|one| one["id"].as_str().unwrap()).collect();
    assert_eq!(kept, ids.iter().rev().take(4).map(String::as_str).collect::<Vec<_>>());
    refused(&eva.get(&format!("/api/drones/north/drafts/{}/picture", ids[0])).await, 404);
    let preview = eva.get(&format!("/api/drones/north/drafts/{}/picture", ids[4])).await;
    let preview = image::load_from_memory(&preview.bytes).unwrap().into_luma8();
    assert_eq!(preview.into_raw(), drawing::house(false));
    private(&bench.config.data);
    for id in ["..", "..%2f..%2fconsole.sqlite", "0123456789abcdeg", "0123456789abcdef"] {
        refused(&eva.get(&format!("/api/drones/north/drafts/{id}/picture")).await, 404);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_large_drawing_is_shown_small_with_its_thin_lines() {
    let bench = Bench::new(1).await;
    let (eva, _drone) = ready(&bench).await;
    let (width, height) = (4100_u32, 64_u32);
    let mut shades = vec![255; (width * height) as usize];
    shades.iter_mut().skip(1001).step_by(width as usize).for_each(|shade| *shade = 0);
    let id =
        upload(&eva, drawing::png(width, height, &shades)).await.json()["id"].as_str().unwrap().to_owned();
    let preview = eva.get(&format!("/api/drones/north/drafts/{id}/picture")).await;
    let preview = image::load_from_memory(&preview.bytes).unwrap().into_luma8();
    assert_eq!(preview.dimensions(), (1367, 22));
    assert!(preview.enumerate_pixels().all(|(x, _, shade)| (shade.0[0] == 0) == (x == 333)));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_becomes_a_plan_and_the_drone_gets_it() {
    let bench = Bench::new(1).await;
    let (eva, drone) = ready(&bench).await;
    drone.about.lock().unwrap()["vehicle"] = json!({ "name": "watchman", "radius_m": 0.225 });
    let reading = |more: Value| {
        let mut body = json!({ "metres_per_pixel": SCALE, "dark_below": 128, "building": building() });
        for (key, value) in more.as_object().unwrap() {
            body[key] = value.clone();
        }
        body
    };
    let at = |id: &Value, tail: &str| format!("/api/drones/north/drafts/{}{tail}", id.as_str().unwrap());
    for picture in [
        drawing::png(WIDTH, HEIGHT, &drawing::house(false)),
        drawing::jpeg(WIDTH, HEIGHT, &drawing::house(false)),
    ] {
        let id = upload(&eva, picture).await.json()["id"].clone();
        refused(&eva.get(&at(&id, "/plan.png")).await, 404);
        refused(&eva.post(&at(&id, "/install"), &json!({})).await, 400);
        let made = eva
            .post(
                &at(&id, ""),
                &reading(json!({ "origin": [-1.0, 2.0], "building": moved(building(), -1.0, 2.0) })),
            )
            .await;
        assert_eq!(made.status, 200, "{}", made.text);
        let made = made.json();
        assert_eq!((made["width"].as_u64(), made["height"].as_u64()), (Some(200), Some(140)));
        let png = eva.get(&at(&id, "/plan.png")).await.bytes;
        let header = PlanHeader::parse("p", b"image: p\nresolution: 0.05\norigin: [-1, 2, 0]\n").unwrap();
        let plan = Plan::load("p", &header, &png).unwrap();
        assert_eq!(plan.cell_at(1.5, 4.0), Cell::Free);
        assert_eq!(plan.cell_at(0.03, 5.0), Cell::Occupied);
        assert_eq!(plan.cell_at(-0.9, 2.1), Cell::Unknown);
        assert!((f64::from(plan.free_area()) - made["free_m2"].as_f64().unwrap()).abs() < 0.01);
        let answer = eva.post(&at(&id, "/install"), &json!({ "made_from": REVISION })).await.json();
        assert_eq!(answer["accepted"], true, "{answer}");
        let edit = drone.heard.lock().unwrap().edits.pop().unwrap();
        assert_eq!(edit.picture.as_deref(), Some(png.as_slice()));
        assert_eq!(edit.payload["made_from"], REVISION);
        assert_eq!(edit.payload["building"], moved(building(), -1.0, 2.0));
        let place = &edit.payload["plan"];
        assert!((place["resolution_m"].as_f64().unwrap() - 0.05).abs() < 1e-6, "{place}");
        assert_eq!((place["origin_x_m"].as_f64(), place["origin_y_m"].as_f64()), (Some(-1.0), Some(2.0)));
        let again = eva.get(&at(&id, "")).await.json();
        assert_eq!(again["plan"]["building"], moved(building(), -1.0, 2.0));
        assert_eq!(again["plan"]["reading"]["dark_below"], 128);
    }
    let id = upload(&eva, drawing::png(WIDTH, HEIGHT, &drawing::house(true))).await.json()["id"].clone();
    let mut in_wall = building();
    in_wall["pad"]["x"] = json!(1.05);
    let mut nowhere = building();
    nowhere["rooms"][0]["rectangle"] = json!([0.1, 0.1, 0.4, 0.4]);
    nowhere["round"]["order"] = json!([]);
    let mut no_pad = building();
    no_pad["pad"] = Value::Null;
    for (more, says) in [
        (json!({}), "`walls` is open to the outside, most likely at (6."),
        (json!({ "building": in_wall }), "the pad at (1.05, 2.00) is inside a wall"),
        (json!({ "building": no_pad }), "building: `pad` is missing"),
        (json!({ "metres_per_pixel": 2.0 }), "`metres_per_pixel` is 2, allowed is 0.0005 to 0.5 m"),
        (json!({ "dark_below": 300 }), "the request is not understood"),
        (json!({ "walls": [[6.0, 1.05, 7.0, 1.05]], "building": nowhere }), "West"),
    ] {
        let reply = eva.post(&at(&id, ""), &reading(more)).await;
        let sentence = refused(&reply, 400);
        assert!(sentence.contains(says), "{sentence}");
    }
    let closed = eva.post(&at(&id, ""), &reading(json!({ "walls": [[6.0, 1.05, 7.0, 1.05]] }))).await;
    assert_eq!(closed.status, 200, "{}", closed.text);
}

/// The same building elsewhere.
fn moved(mut building: Value, dx: f64, dy: f64) -> Value {
    let shift = |value: &mut Value, by: f64| *value = json!(value.as_f64().unwrap() + by);
    for place in ["/pad", "/round/points/0"] {
        shift(building.pointer_mut(&format!("{place}/x")).unwrap(), dx);
        shift(building.pointer_mut(&format!("{place}/y")).unwrap(), dy);
    }
    let pairs =
        ["/doors/0/a", "/doors/0/b", "/rooms/0/rectangle", "/no_fly/0/rectangle", "/privacy/0/rectangle"];
    for place in pairs {
        for (k, value) in building.pointer_mut(place).unwrap().as_array_mut().unwrap().iter_mut().enumerate()
        {
            shift(value, if k % 2 == 0 { dx } else { dy });
        }
    }
    for corner in building.pointer_mut("/rooms/1/polygon").unwrap().as_array_mut().unwrap() {
        shift(&mut corner[0], dx);
        shift(&mut corner[1], dy);
    }
    building
}
