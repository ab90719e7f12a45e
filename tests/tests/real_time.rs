//! A flight of real processes on shared memory in real time, beside the same services in lockstep.
//!
//! Scheduling, pseudo-terminals and wake-ups differ, so the two are not the same flight bit for bit: gusts and people meet the
//! drone elsewhere. What must agree is how it ended and how well it knew its place.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use serde_json::Value;
use sereno_tests::{lightly_cluttered, sereno};

/// The small test building: a round of about a minute with light clutter.
const BUILDING: &str = "two-rooms";
const SEED: &str = "1";
/// How far apart the two may be: the median and the 95th percentile of the position error (metres), what was seen of what
/// can be seen, the ratio of the times. Twelve flights in lockstep, seeds 1 to 12, had medians of 0.025 to 0.038 m, 95th
/// percentiles of 0.065 to 0.135 m and times of 43 to 76 s.
const MEDIAN_M: f64 = 0.02;
const P95_M: f64 = 0.08;
const SEEN: f64 = 0.04;
const TIMES: f64 = 1.6;

fn number(report: &Value, path: &str) -> f64 {
    report.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {report}"))
}

#[test]
fn processes_in_real_time_end_as_lockstep_does_and_know_their_place_as_well() {
    let directory = tempfile::tempdir().unwrap();
    let deploy = lightly_cluttered(directory.path(), BUILDING).unwrap();
    let run_dir = directory.path().join("run");
    let picture = directory.path().join("flight.svg");
    let picture = picture.to_str().unwrap();

    // Exits zero only on the pad and without a contact.
    let lines =
        sereno(&deploy, &run_dir, &["demo", "--once", "--json", "--seed", SEED, "--picture", picture]);
    let real: Value = serde_json::from_str(lines.lines().last().unwrap()).unwrap();
    let text = sereno(&deploy, &run_dir, &["rehearse", "--clutter", "light", "--seed", SEED, "--json"]);
    let lockstep: Value = serde_json::from_str(&text).unwrap();
    let lockstep = &lockstep["flights"][0];

    let said = format!("real time {real}\nlockstep {lockstep}");
    assert_eq!(real["outcome"], lockstep["outcome"], "{said}");
    assert_eq!((number(&real, "/contacts"), number(lockstep, "/contacts")), (0.0, 0.0), "{said}");
    assert!((number(&real, "/coverage") - number(lockstep, "/coverage")).abs() < SEEN, "{said}");
    for (path, bound) in [("/loc_error_m/median", MEDIAN_M), ("/loc_error_m/p95", P95_M)] {
        assert!((number(&real, path) - number(lockstep, path)).abs() < bound, "{path}: {said}");
    }
    let ratio = number(&real, "/time_s") / number(lockstep, "/time_s");
    assert!((1.0 / TIMES..TIMES).contains(&ratio), "{ratio}: {said}");
    assert!(std::fs::metadata(picture).unwrap().len() > 1000);
}
