//! `kill -9` in the flying system: each service that a flight needs, at a random moment.
//!
//! The full campaign, ten kills each over the demo building, is `cargo xtask demo --once --kills 10`.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use serde_json::Value;
use sereno_tests::{lightly_cluttered, sereno};

/// Real processes in real time: which flight it becomes differs from run to run, what must hold does not. With `--once` the
/// command fails unless the drone lands on the pad untouched, every kill was done, the place is known to 0.3 m two seconds
/// after each, and no failsafe went beyond a hover.
#[test]
fn each_service_is_killed_in_flight_and_the_round_goes_on() {
    let directory = tempfile::tempdir().unwrap();
    let deploy = lightly_cluttered(directory.path(), "two-rooms").unwrap();
    let run_dir = directory.path().join("run");
    let picture = directory.path().join("flight.svg");
    let picture = picture.to_str().unwrap();
    let lines = sereno(
        &deploy,
        &run_dir,
        &["demo", "--once", "--json", "--seed", "2", "--kills", "1", "--picture", picture],
    );
    let report: Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    let kills = &report["kills"];
    assert_eq!(kills["done"], 5, "{report}");
    for service in ["localization", "navigation", "sonar", "pilot", "flight"] {
        assert_eq!(kills["by_service"][service], 1, "{service}: {report}");
    }
    assert_eq!((&report["outcome"], &report["contacts"]), (&"landed_on_pad".into(), &0.into()), "{report}");
    // The first kill falls into the take-off, which takes some seven seconds after the boot grace of five.
    assert!(kills["first_s"].as_f64().unwrap() < 20.0, "{report}");

    let run_dir = runtime::shm::RunDir::new(run_dir);
    assert_eq!(run_dir.leftovers(), Vec::<String>::new(), "in shared memory");
    let left = std::fs::read_dir(run_dir.path()).map_or(0, Iterator::count);
    assert_eq!(left, 0, "in {}", run_dir.path().display());
}
