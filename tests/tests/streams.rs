//! The shield against a few hostile command streams; `cargo xtask streams` flies ten thousand.
#![allow(clippy::unwrap_used, reason = "tests")]

use sereno_tests::streams::{Settings, run};

/// 200 streams of ten seconds, seeds fixed; with every service that flies in lockstep they are the same each time on one
/// machine. Of 4 000 the shield lets 1 in 50 touch something, so some 4 are expected here, and 12 would be four standard
/// deviations more. Without braking and retreat it was 1 in 8, 25 here.
#[test]
fn hostile_commands_and_broken_sonars_seldom_end_in_a_contact() {
    let settings = Settings {
        threads: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        streams: 200,
        seed: 1,
        world: "demo".to_owned(),
        vehicle: "watchman".to_owned(),
        clutter: "light".to_owned(),
    };
    let report = run(&settings, |_, _| {}).unwrap();
    assert!(report.streams >= 200);
    // A shield that lets nothing move would touch nothing.
    let per_stream_m = report.distance_m / report.streams as f64;
    assert!(per_stream_m > 1.2, "{per_stream_m} m a stream");
    let touched: Vec<String> = report
        .contacts
        .iter()
        .map(|t| format!("seed {} stream {:?}: {}", t.seed, t.stream, t.what))
        .collect();
    assert!(touched.len() <= 12, "{} contacts: {touched:#?}", touched.len());
}
