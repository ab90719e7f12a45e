//! The thesis's filter on the same topics.

use crate::bench::{Bench, LEVEL, MS, PAD, SPEED, worst};
use ipc_types::LocalizationState;
use localization::{FilterKind, Localization, LocalizationConfig};

fn thesis() -> LocalizationConfig {
    LocalizationConfig { filter: FilterKind::Thesis, ..LocalizationConfig::default() }
}

/// One flight; the bounds leave as much again as was seen (median 9 cm, worst 21 cm).
#[test]
fn the_thesis_filter_follows_on_the_same_topics() {
    let mut bench = Bench::with(PAD, thesis()).unwrap();
    let (pose, error) = bench.run(1_000).pop().unwrap();
    assert!(error < 0.03 && pose.state as u8 == LocalizationState::Tracking.code(), "{error}");
    assert_eq!(pose.particles, 5_000, "on the ground nothing is weighed");
    assert!((pose.level_roll_rad - LEVEL.0).abs() < 0.003);
    bench.take_off();
    bench.run(500);
    let poses = bench.run(20_000);
    let mut errors: Vec<f32> = poses.iter().map(|p| p.1).collect();
    errors.sort_by(f32::total_cmp);
    assert!(errors[errors.len() / 2] < 0.18, "median {}", errors[errors.len() / 2]);
    assert!(worst(&poses) < 0.42, "{}", worst(&poses));
    let last = poses.last().unwrap().0;
    assert_eq!(last.particles, 1_000, "down by quarters to the least number");
    assert!(last.walls_in_echo >= 3 && last.p_lost < 0.05, "{} {}", last.walls_in_echo, last.p_lost);
    let speed = last.velocity_x_m_s.hypot(last.velocity_y_m_s);
    assert!((speed - SPEED).abs() < 0.15, "a velocity from beside the filter: {speed}");
    // Killed, it goes on from the set that the keeper holds.
    bench.system.kill("localization");
    bench.run(300);
    bench.system.add_with::<Localization>(thesis()).unwrap();
    let (pose, error) = bench.run(1_000).pop().unwrap();
    assert_eq!(pose.particles, 1_000);
    assert!(error < 0.42, "{error}");
}

/// Without sonars nothing is weighed, and in the end that is said.
#[test]
fn the_thesis_filter_without_sonars_grows_doubtful() {
    let mut bench = Bench::with(PAD, thesis()).unwrap();
    bench.run(1_000);
    bench.take_off();
    let before = bench.run(5_000).last().unwrap().0;
    let mut last = before;
    for _ in 0..20_000 {
        let next = (bench.system.now() / MS + 1) * MS;
        bench.system.run_until(next);
        if ![40, 60].iter().any(|period| (next / MS).is_multiple_of(*period)) {
            bench.sense(next);
        }
        while let Some(pose) = bench.poses.receive() {
            last = *pose;
        }
    }
    assert!(last.p_lost > before.p_lost.max(0.05), "{} after {}", last.p_lost, before.p_lost);
    assert_eq!(last.walls_in_echo, 0);
}
