//! A browser watches: simulator, scenery, camera and stream as processes on shared memory, a headless Chromium, and the bar
//! code in the picture read back where it is shown.
//!
//! Needs the programs of a release build (`cargo build --release -p simulator -p camera -p stream`) and `chromium`.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod drone;

use drone::{Drone, Watched, quantile};

/// How old a picture is where it is shown is printed, not asserted: each of the five processes on the way waits for its turn. No
/// picture is older than the queues on the way allow.
#[test]
fn a_browser_shows_pictures_whose_age_can_be_read() {
    let mut drone = Drone::start("");
    let watched = drone.watch("mode=pilot&frames=300");
    report("pilot", &watched);
    assert!(watched.errors().is_empty(), "{:?}", watched.0["errors"]);
    assert_eq!(watched.0["size"], serde_json::json!([640, 480]));
    let ages = watched.numbers("ages");
    assert!(ages.len() >= 250, "{} of {} frames could be read", ages.len(), watched.0["frames"]);
    assert!(ages.iter().all(|age| (-50.0..2000.0).contains(age)), "{ages:?}");
    let status = watched.0["statuses"].as_array().unwrap().last().unwrap().clone();
    assert_eq!((status["path"].as_str(), status["width"].as_u64()), (Some("udp"), Some(640)), "{status}");
    drone.stays_quiet();
}

#[test]
fn without_udp_the_picture_comes_by_tcp() {
    let mut drone = Drone::start("udp = false\n");
    let watched = drone.watch("mode=watch&frames=60");
    report("tcp", &watched);
    let status = watched.0["statuses"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(status["path"].as_str(), Some("tcp"), "{status}");
    assert!(watched.numbers("ages").len() >= 50);
}

#[test]
fn a_killed_camera_comes_back() {
    let mut drone = Drone::start("");
    drone.kill_during("camera", 2.0);
    let watched = drone.watch("mode=pilot&frames=180");
    report("camera killed", &watched);
    let longest = watched.numbers("gaps").into_iter().fold(0.0, f64::max);
    assert!(watched.0["frames"].as_u64() == Some(180) && longest < 3000.0, "{longest} ms without a picture");
}

fn report(name: &str, watched: &Watched) {
    let ages = watched.numbers("ages");
    println!(
        "{name}: {} frames in {:.1} s, age p50 {:.1} ms, p95 {:.1} ms, longest gap {:.0} ms, clock +-{:.2} ms, {}, path {}",
        watched.0["frames"],
        watched.0["seconds"].as_f64().unwrap_or(f64::NAN),
        quantile(&ages, 0.5),
        quantile(&ages, 0.95),
        watched.numbers("gaps").into_iter().fold(0.0, f64::max),
        watched.0["trip"].as_f64().unwrap_or(f64::NAN) / 2.0,
        watched.0["inbound"],
        watched.0["statuses"]
            .as_array()
            .and_then(|all| all.last())
            .map_or(&serde_json::Value::Null, |s| &s["path"]),
    );
}
