//! The service on the lockstep bus, in a drawn hall, with a drone that flies circles.
//!
//! The ranges come from the plan's own cone, without clutter: what is tested here is the service (times,
//! restarts, refusals), not the filter, which has a world of its own in `mcl`.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;
mod thesis;

use bench::{Bench, MS, OFFSET, PAD, SPEED, worst};
use ipc_types::{Attitude, FlowMotion, LocalizationState, SonarRanges, SonarReading};
use localization::{FilterKind, Localization, LocalizationConfig, StartFrom};
#[test]
fn on_the_ground_it_stands_on_the_pad() {
    let mut bench = Bench::new(PAD).unwrap();
    let poses = bench.run(3_000);
    assert!(
        poses.len() > 20 * 2,
        "{} poses in 3 s, a quarter of which is waiting for the attitude",
        poses.len()
    );
    let (last, error) = poses.last().unwrap();
    assert!(*error < 0.03, "{error}");
    assert!((last.heading_offset_rad - OFFSET).abs() < 0.02);
    assert!((last.level_roll_rad - 0.01).abs() < 0.003 && (last.level_pitch_rad + 0.012).abs() < 0.003);
    assert_eq!((last.velocity_x_m_s, last.velocity_y_m_s), (0.0, 0.0));
    assert_eq!(last.state as u8, LocalizationState::Tracking.code());
}

#[test]
fn in_flight_it_follows_at_the_time_of_the_pose() {
    let mut bench = Bench::new(PAD).unwrap();
    bench.run(1_000);
    bench.take_off();
    bench.run(500);
    let poses = bench.run(20_000);
    assert!(poses.len() > 20 * 20, "{} poses in 20 s", poses.len());
    let mut errors: Vec<f32> = poses.iter().map(|p| p.1).collect();
    errors.sort_by(f32::total_cmp);
    assert!(errors[errors.len() / 2] < 0.06, "median {}", errors[errors.len() / 2]);
    assert!(worst(&poses) < 0.25, "{}", worst(&poses));
    let last = poses.last().unwrap().0;
    assert!(last.walls_in_echo >= 3, "{}", last.walls_in_echo);
    assert!(last.p_lost < 0.05 && last.sigma_m() < 0.2);
    // At 0.4 m/s a pose for the time of the ping, 60 to 120 ms ago, would trail by 2 to 5 cm along the way.
    let trail: f32 = poses
        .iter()
        .map(|(p, _)| {
            let t = bench.truth(p.estimated_ns);
            ((t.x - p.x_m) * t.vx + (t.y - p.y_m) * t.vy) / SPEED
        })
        .sum::<f32>()
        / poses.len() as f32;
    assert!(trail.abs() < 0.02, "trails by {trail} m on average");
}

#[test]
fn killed_in_flight_it_is_back_within_two_seconds() {
    let mut bench = Bench::new(PAD).unwrap();
    bench.run(1_000);
    bench.take_off();
    bench.run(5_000);
    for dead_ms in [150, 400, 900] {
        bench.system.kill("localization");
        bench.run(dead_ms);
        bench.system.add::<Localization>().unwrap();
        let poses = bench.run(2_000);
        let (_, error) = poses.last().unwrap();
        assert!(*error < 0.3, "dead for {dead_ms} ms, then {error} m off");
        let after = bench.run(3_000);
        assert!(worst(&after) < 0.3, "dead for {dead_ms} ms: {}", worst(&after));
    }
}

/// What was found a moment ago is not believed before it was checked, and a restart does not make it so.
#[test]
fn killed_before_the_place_is_checked_it_is_checked_all_the_same() {
    let mut config = LocalizationConfig::default();
    config.start.from = StartFrom::Unknown;
    let mut bench = Bench::with(PAD, config.clone()).unwrap();
    bench.run(1_000);
    bench.take_off();
    let mut seconds = 0;
    while bench.run(1_000).last().is_none_or(|(pose, _)| pose.searching != 0) {
        seconds += 1;
        assert!(seconds < 120, "not found");
    }
    bench.system.kill("localization");
    bench.run(200);
    bench.system.add_with::<Localization>(config).unwrap();
    bench.run(1_000);
    for (pose, error) in bench.run(3_000) {
        assert!(pose.p_lost > 0.019, "believed without a check: P(lost) {}, {error} m off", pose.p_lost);
        assert_eq!(pose.searching, 0);
    }
}

#[test]
fn silent_sonars_leave_it_guessing_and_saying_so() {
    let mut bench = Bench::new(PAD).unwrap();
    bench.run(1_000);
    bench.take_off();
    let before = bench.run(5_000).last().unwrap().0;
    // Nothing but the attitude and the pilot from here on.
    let mut poses = Vec::new();
    for _ in 0..3_000 {
        let next = (bench.system.now() / MS + 1) * MS;
        bench.system.run_until(next);
        if ![40, 60].iter().any(|period| (next / MS).is_multiple_of(*period)) {
            bench.sense(next);
        }
        while let Some(pose) = bench.poses.receive() {
            poses.push(*pose);
        }
    }
    let last = poses.last().unwrap();
    assert!(poses.len() > 60, "poses go on: {}", poses.len());
    assert!(
        last.sigma_m() > 4.0 * before.sigma_m().max(0.03),
        "{} after {}",
        last.sigma_m(),
        before.sigma_m()
    );
    assert_eq!(last.walls_in_echo, 0);
}

/// A floor that shows half of the motion, and no sonar: what the set gains by it in three seconds.
#[test]
fn a_poor_floor_holds_the_set_together() {
    let sigma_after = |dim: bool| {
        let mut bench = Bench::new(PAD).unwrap();
        bench.run(1_000);
        bench.take_off();
        bench.run(5_000);
        for _ in 0..3_000 {
            let next = (bench.system.now() / MS + 1) * MS;
            bench.system.run_until(next);
            if ![40, 60].iter().any(|period| (next / MS).is_multiple_of(*period)) {
                bench.sense(next);
            }
            if dim && (next / MS).is_multiple_of(40) {
                bench.flow.publish(&FlowMotion {
                    sampled_ns: next - 10 * MS,
                    velocity_x_m_s: f32::NAN,
                    velocity_y_m_s: f32::NAN,
                    dim_x_m_s: 0.5 * SPEED,
                    dim_y_m_s: 0.0,
                    sigma_m_s: 0.15,
                    ..FlowMotion::default()
                });
            }
        }
        let mut poses = Vec::new();
        while let Some(pose) = bench.poses.receive() {
            poses.push(*pose);
        }
        let last = poses.last().unwrap();
        let t = bench.truth(last.estimated_ns);
        assert!((last.x_m - t.x).hypot(last.y_m - t.y) < 0.4, "dim {dim}");
        last.sigma_m()
    };
    let (blind, dim) = (sigma_after(false), sigma_after(true));
    assert!(dim < 0.7 * blind, "{dim} over a poor floor, {blind} over one that shows nothing");
}

#[test]
fn nonsense_is_refused_and_changes_nothing() {
    let mut bench = Bench::new(PAD).unwrap();
    bench.run(1_000);
    bench.take_off();
    bench.run(3_000);
    let spoil = |bench: &mut Bench| {
        let now = bench.system.now();
        bench.attitude.publish(&Attitude { sampled_ns: now, roll_rad: f32::NAN, ..Attitude::default() });
        bench.attitude.publish(&Attitude { sampled_ns: now + 10_000 * MS, ..Attitude::default() });
        bench.ranges.publish(&SonarRanges { count: 4_000_000, ..SonarRanges::default() });
        let mut future = SonarRanges { count: 1, ..SonarRanges::default() };
        future.readings[0] =
            SonarReading { ping_ns: now + 5_000 * MS, status: 1, range_m: 1.0, ..SonarReading::default() };
        bench.ranges.publish(&future);
        let wild = FlowMotion {
            sampled_ns: now,
            velocity_x_m_s: 1e9,
            velocity_y_m_s: 0.0,
            sigma_m_s: 0.1,
            ..FlowMotion::default()
        };
        bench.flow.publish(&wild);
    };
    for _ in 0..20 {
        spoil(&mut bench);
        bench.run(50);
    }
    assert!(bench.system.refused("localization") >= 90, "{}", bench.system.refused("localization"));
    assert!(worst(&bench.run(1_000)) < 0.25);
}

#[test]
fn a_start_without_a_place_is_refused_in_words() {
    let error = |sidecar: &str| Bench::new(sidecar).err().unwrap().to_string();
    assert!(error("rooms: []\n").contains("names no pad"), "{}", error("rooms: []\n"));
    let wall = error("pad: {x: 0.1, y: 0.1, heading_deg: 0}\n");
    assert!(wall.contains("inside a wall"), "{wall}");
    assert!(error("pad: {x: 99.0, y: 0.1}\n").contains("outside"), "outside the plan");
}

#[test]
fn the_shipped_configuration_is_the_default() {
    let text = include_str!("../../../../deploy/config/localization.toml");
    let config: LocalizationConfig = runtime::parse_config("localization.toml", text).unwrap();
    assert_eq!(config, LocalizationConfig::default());
    let error =
        |text: &str| runtime::parse_config::<LocalizationConfig>("l.toml", text).unwrap_err().to_string();
    let low = error("[motion]\nvelocity_noise = 0.0");
    assert_eq!(low, "l.toml: motion.velocity_noise = 0 is out of range: allowed is 0.01..=3");
    assert!(error("[start]\nx_m = 1.0").contains("all three"));
    assert!(error("[sonr]\n").contains("sonr"));
    let unknown = error("filter = \"kalman\"");
    assert!(
        unknown.contains("kalman") && unknown.contains("`sereno`") && unknown.contains("`thesis`"),
        "{unknown}"
    );
    let thesis: LocalizationConfig = runtime::parse_config("l.toml", "filter = \"thesis\"").unwrap();
    assert_eq!(thesis.filter, FilterKind::Thesis);
}
