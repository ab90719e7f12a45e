//! Equal seeds are equal flights, to the last bit of every truth and pose, however many are flown at once.
#![allow(clippy::unwrap_used, reason = "tests")]

use serde_json::Value;
use std::path::Path;
use std::process::Command;

fn rehearse(threads: &str, seed: &str) -> Value {
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    let output = Command::new(env!("CARGO_BIN_EXE_sereno"))
        .arg("--deploy")
        .arg(&deploy)
        .args([
            "rehearse",
            "--clutter",
            "light",
            "--flights",
            "3",
            "--seed",
            seed,
            "--threads",
            threads,
            "--json",
        ])
        .arg("--plan")
        .arg(deploy.join("plans/two-rooms.yaml"))
        .arg("--world")
        .arg(deploy.join("worlds/two-rooms.toml"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut report: Value = serde_json::from_slice(&output.stdout).unwrap();
    // The one figure that may differ.
    let factor = report["total"].as_object_mut().unwrap().remove("real_time_factor").unwrap();
    assert!(factor.as_f64().unwrap() > 0.0);
    report
}

#[test]
fn one_thread_and_two_fly_the_same_flights() {
    let (one, two) = (rehearse("1", "1"), rehearse("2", "1"));
    assert_eq!(one, two);
    let flights = one["flights"].as_array().unwrap();
    let digests: Vec<&str> = flights.iter().map(|flight| flight["digest"].as_str().unwrap()).collect();
    assert_eq!(digests.len(), 3);
    assert!(digests.iter().all(|digest| digest.len() == 16));
    assert!(
        digests[0] != digests[1] && digests[1] != digests[2],
        "different seeds, equal flights: {digests:?}"
    );
    for flight in flights {
        // Whole rounds, in a world that never stands still.
        assert!(flight["time_s"].as_f64().unwrap() > 20.0, "{flight}");
        assert_eq!(flight["stalled_s"], 0.0, "{flight}");
    }
    // Flight k of seed s is flight 0 of seed s + k: nothing of an earlier flight is left in the cache.
    assert_eq!(rehearse("2", "2")["flights"][0], flights[1]);
}
