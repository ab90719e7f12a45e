//! A still picture a second, for a browser that cannot decode the drone's video.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod common;

use common::{Bench, until};
use console::Role;
use ipc_types::{Field, Still};
use serde_json::{Value, json};
use std::mem::offset_of;
use std::sync::{Arc, Mutex};
use std::time::Instant;

const JPEG: [u8; 6] = [0xff, 0xd8, 1, 2, 0xff, 0xd9];

/// As the bridge sends it.
fn message(capture_ns: u64, length: u32, jpeg: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0; offset_of!(Still, bytes)];
    bytes[offset_of!(Still, capture_ns)..][..8].copy_from_slice(&capture_ns.to_le_bytes());
    bytes[offset_of!(Still, length)..][..4].copy_from_slice(&length.to_le_bytes());
    bytes.extend(jpeg);
    bytes
}

fn encoding() -> String {
    format!("application/octet-stream;schema=sereno/Still/{:016x}", Still::LAYOUT)
}

#[tokio::test(flavor = "multi_thread")]
async fn stills_are_wished_for_while_somebody_asks_and_served_with_their_age() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    let (viewer, _, _) = bench.account(&eva, Role::Viewer, &["north"]).await;

    // A camera that makes nothing.
    let none = viewer.get("/api/drones/north/still.jpg").await;
    assert_eq!((none.status, none.json()), (503, json!({ "error": "north sends no picture" })));
    assert_eq!(none.headers["retry-after"], "1");

    // One that makes a picture at every wish, after some that are none.
    let wishes: Arc<Mutex<Vec<(Instant, String, Value)>>> = Arc::default();
    let (session, to) = (drone.session.clone(), wishes.clone());
    let heard = drone.session.declare_subscriber("sereno/north/wish/*").callback(move |sample| {
        let wish = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
        to.lock().unwrap().push((Instant::now(), sample.key_expr().as_str().to_owned(), wish));
        let put = |bytes: Vec<u8>, encoding: String| {
            let put = session.put("sereno/north/telemetry/camera/still", bytes).encoding(encoding);
            zenoh::Wait::wait(put).unwrap();
        };
        put(message(5, 60_000, &JPEG), encoding());
        put(message(6, 3, b"GIF"), encoding());
        put(b"short".to_vec(), encoding());
        put(message(7, 6, &JPEG), "application/octet-stream;schema=sereno/Still/0".to_owned());
        put(message(1_000_000_000, 6, &JPEG), encoding());
    });
    heard.background().await.unwrap();
    let mut reply = viewer.get("/api/drones/north/still.jpg").await;
    while reply.status == 503 {
        reply = viewer.get("/api/drones/north/still.jpg").await;
    }
    assert_eq!((reply.status, &reply.bytes[..]), (200, &JPEG[..]));
    assert_eq!(reply.headers["content-type"], "image/jpeg");
    assert_eq!(reply.headers["cache-control"], "no-store");
    // The rig's clock began at one second.
    let age: u64 = reply.headers["x-sereno-age-ms"].to_str().unwrap().parse().unwrap();
    assert!((50..600_000).contains(&age), "{age}");
    let (_, key, wish) = wishes.lock().unwrap()[0].clone();
    assert_eq!((key.as_str(), wish), ("sereno/north/wish/console", json!({ "video": null, "still": true })));

    // Nobody asks: the wishes end, and the next question begins them again.
    let last = || wishes.lock().unwrap().last().unwrap().0;
    until("the wishes end", async || last().elapsed().as_millis() > 2500).await;
    let before = wishes.lock().unwrap().len();
    assert!(before <= 12, "{before} wishes");
    assert_eq!(viewer.get("/api/drones/north/still.jpg").await.status, 200);
    until("they begin again", async || wishes.lock().unwrap().len() > before).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drone_that_is_not_reached_has_no_picture() {
    let bench = Bench::new(1).await;
    let eva = bench.claim().await;
    let mut drone = bench.drone(0, "north").await;
    bench.sees(&eva, "north", true).await;
    drone.disappear().await;
    bench.sees(&eva, "north", false).await;
    let gone = eva.get("/api/drones/north/still.jpg").await;
    assert_eq!((gone.status, gone.json()), (503, json!({ "error": "north is not reached" })));
    assert_eq!(eva.get("/api/drones/nobody/still.jpg").await.status, 404);
}
