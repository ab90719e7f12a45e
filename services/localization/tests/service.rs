//! The service on the lockstep bus, in a drawn hall, with a drone that flies circles.
//!
//! The ranges come from the plan's own cone, without clutter: what is tested here is the service (times,
//! restarts, refusals), not the filter, which has a world of its own in `mcl`.
#![allow(clippy::unwrap_used, reason = "tests")]

use floorplan::{ConeModel, Plan, cast_cone};
use ipc_types::{
    Attitude, FlowMotion, LocalizationState, PilotState, Pose, SonarRanges, SonarReading, SonarStatus,
};
use localization::{FilterKind, Localization, LocalizationConfig, StartFrom};
use runtime::{Cache, Input, Lockstep, Output, StartError};
use std::f32::consts::{FRAC_PI_4, PI};

const MANIFEST: &str = r#"
[system]
name = "test"
plan = "hall.yaml"
vehicle = "vehicle.toml"
simulated = true
[service.localization]
run = "sereno-localization"
criticality = "mission"
tick_hz = 50
publishes.'localization/pose' = { hz = 20 }
publishes.'localization/particles' = { hz = 20, retained = true }
subscribes.'sonar/ranges' = { depth = 8, wake = true }
subscribes.'flight/attitude' = { depth = 16 }
subscribes.'flow/motion' = { depth = 16 }
subscribes.'pilot/state' = { depth = 4 }
subscribes.'localization/particles' = { depth = 1 }
[service.world]
run = "world"
criticality = "flight"
tick_hz = 200
publishes.'sonar/ranges' = { hz = 16.7 }
publishes.'flight/attitude' = { hz = 30 }
publishes.'flow/motion' = { hz = 25 }
publishes.'pilot/state' = { hz = 5 }
subscribes.'localization/pose' = { depth = 16 }
"#;

/// A quarter of a metre a character.
const HALL: &[&str] = &[
    "########################",
    "#                      #",
    "#                      #",
    "#                   ####",
    "#                   #  #",
    "#                      #",
    "#                      #",
    "#         ##           #",
    "#         ##           #",
    "#                      #",
    "#                      #",
    "###                    #",
    "# #                    #",
    "#                      #",
    "#                   #  #",
    "########################",
];
const FINER: usize = 5;
const MS: u64 = 1_000_000;
/// Plan heading minus compass yaw.
const OFFSET: f32 = 0.9;
/// The circle around the pillar.
const CENTRE: (f32, f32) = (2.75, 2.0);
const RADIUS: f32 = 1.1;
const SPEED: f32 = 0.4;

struct Bench {
    system: Lockstep,
    plan: Plan,
    ranges: Output<SonarRanges>,
    attitude: Output<Attitude>,
    flow: Output<FlowMotion>,
    pilot: Output<PilotState>,
    poses: Input<Pose>,
    group: u32,
    took_off_ns: u64,
    _directory: tempfile::TempDir,
}

/// What the controller's roll and pitch read when the body is level.
const LEVEL: (f32, f32) = (0.01, -0.012);

struct Truth {
    x: f32,
    y: f32,
    vx: f32,
    vy: f32,
    heading: f32,
    roll: f32,
    pitch: f32,
}

impl Bench {
    fn new(sidecar: &str) -> Result<Self, StartError> {
        Self::with(sidecar, LocalizationConfig::default())
    }

    fn with(sidecar: &str, config: LocalizationConfig) -> Result<Self, StartError> {
        let rows: Vec<String> = HALL
            .iter()
            .flat_map(|row| {
                let wide: String = row.chars().flat_map(|c| std::iter::repeat_n(c, FINER)).collect();
                std::iter::repeat_n(wide, FINER)
            })
            .collect();
        let directory = tempfile::tempdir().unwrap();
        let file = |name: &str, bytes: &[u8]| std::fs::write(directory.path().join(name), bytes).unwrap();
        let mut image = format!("P5\n{} {}\n255\n", rows[0].len(), rows.len()).into_bytes();
        image.extend(rows.iter().flat_map(|r| r.bytes()).map(|c| if c == b'#' { 0 } else { 254 }));
        file("hall.pgm", &image);
        file(
            "hall.yaml",
            b"image: hall.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n",
        );
        file("hall.rooms.yaml", sidecar.as_bytes());
        file("vehicle.toml", include_bytes!("../../../deploy/vehicles/watchman.toml"));
        let manifest = manifest::Manifest::parse("test.toml", MANIFEST).unwrap();
        let mut system = Lockstep::new(manifest, directory.path(), 11, Cache::default());
        let mut world = system.tool("world");
        let mut bench = Self {
            ranges: world.output().unwrap(),
            attitude: world.output().unwrap(),
            flow: world.output().unwrap(),
            pilot: world.output().unwrap(),
            poses: world.input().unwrap(),
            system,
            plan: Plan::from_ascii(&rows.iter().map(String::as_str).collect::<Vec<_>>(), 0.05),
            group: 0,
            took_off_ns: u64::MAX,
            _directory: directory,
        };
        bench.system.add_with::<Localization>(config)?;
        Ok(bench)
    }

    /// Around the pillar, nose along the way; standing on the pad before take-off.
    fn truth(&self, now: u64) -> Truth {
        let t = now.saturating_sub(self.took_off_ns) as f32 * 1e-9;
        let flying = now > self.took_off_ns;
        let angle = SPEED / RADIUS * t - PI / 2.0;
        let (sin, cos) = angle.sin_cos();
        let speed = if flying { SPEED } else { 0.0 };
        Truth {
            x: CENTRE.0 + RADIUS * cos,
            y: CENTRE.1 + RADIUS * sin,
            vx: -sin * speed,
            vy: cos * speed,
            heading: angle + PI / 2.0,
            // Inwards is left: the centripetal pull.
            roll: -(speed * speed / RADIUS / 9.81).atan(),
            // Against the drag.
            pitch: (0.25 * speed / 9.81).atan(),
        }
    }

    fn sense(&mut self, now: u64) {
        let t = self.truth(now);
        let ms = now / MS;
        if ms.is_multiple_of(33) {
            let mut m = Attitude { sampled_ns: now - 8 * MS, ..Attitude::default() };
            let then = self.truth(m.sampled_ns);
            (m.roll_rad, m.pitch_rad) = (then.roll + LEVEL.0, then.pitch + LEVEL.1);
            m.yaw_rad = mcl::wrap_angle(then.heading - OFFSET);
            // Drag, and gravity in a frame that is not level.
            m.force_x_m_s2 = -0.25 * then.vx.hypot(then.vy) - 9.81 * LEVEL.1.sin();
            m.force_y_m_s2 = 9.81 * LEVEL.0.sin();
            self.attitude.publish(&m);
        }
        if ms.is_multiple_of(40) {
            let (sin, cos) = t.heading.sin_cos();
            let m = FlowMotion {
                sampled_ns: now - 10 * MS,
                velocity_x_m_s: cos * t.vx + sin * t.vy,
                velocity_y_m_s: -sin * t.vx + cos * t.vy,
                sigma_m_s: 0.08,
                ..FlowMotion::default()
            };
            self.flow.publish(&m);
        }
        if ms.is_multiple_of(200) {
            self.pilot.publish(&PilotState {
                on_ground: u8::from(now <= self.took_off_ns),
                ..PilotState::default()
            });
        }
        if ms.is_multiple_of(60) {
            let ping_ns = now - 30 * MS;
            let then = self.truth(ping_ns);
            let mut m = SonarRanges { count: 2, sensors: 8, sweep_s: 0.24, ..SonarRanges::default() };
            for (i, sensor) in [self.group, self.group + 4].into_iter().enumerate() {
                let bearing = sensor as f32 * FRAC_PI_4;
                let (sin, cos) = (then.heading + bearing).sin_cos();
                let (x, y) = (then.x + 0.2 * cos, then.y + 0.2 * sin);
                let heard = cast_cone(&self.plan, &ConeModel::default(), x, y, then.heading + bearing);
                m.readings[i] = SonarReading {
                    ping_ns,
                    range_m: heard.unwrap_or(f32::NAN),
                    bearing_rad: bearing,
                    mount_x_m: 0.2 * bearing.cos(),
                    mount_y_m: 0.2 * bearing.sin(),
                    sensor: sensor as u8,
                    status: if heard.is_some() { SonarStatus::Ok.code() } else { SonarStatus::NoEcho.code() },
                    ..SonarReading::default()
                };
            }
            self.group = (self.group + 1) % 4;
            self.ranges.publish(&m);
        }
    }

    /// Runs for `ms`; returns every pose with the distance from the truth at its time.
    fn run(&mut self, ms: u64) -> Vec<(Pose, f32)> {
        let mut poses = Vec::new();
        for _ in 0..ms {
            self.system.run_until((self.system.now() / MS + 1) * MS);
            self.sense(self.system.now());
            while let Some(pose) = self.poses.receive() {
                let t = self.truth(pose.estimated_ns);
                poses.push((*pose, (pose.x_m - t.x).hypot(pose.y_m - t.y)));
            }
        }
        poses
    }

    fn take_off(&mut self) {
        self.took_off_ns = (self.system.now() / (200 * MS) + 1) * 200 * MS;
    }
}

const PAD: &str = "pad: {x: 2.75, y: 0.9, heading_deg: 0}\n";

fn worst(poses: &[(Pose, f32)]) -> f32 {
    poses.iter().map(|p| p.1).fold(0.0, f32::max)
}

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
    let text = include_str!("../../../deploy/config/localization.toml");
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
