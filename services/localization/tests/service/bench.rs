//! A drawn hall, and a drone that flies circles in it.

use floorplan::{ConeModel, Plan, cast_cone};
use ipc_types::{Attitude, FlowMotion, PilotState, Pose, SonarRanges, SonarReading, SonarStatus};
use localization::{Localization, LocalizationConfig};
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
pub(crate) const MS: u64 = 1_000_000;
/// Plan heading minus compass yaw.
pub(crate) const OFFSET: f32 = 0.9;
/// The circle around the pillar.
const CENTRE: (f32, f32) = (2.75, 2.0);
const RADIUS: f32 = 1.1;
pub(crate) const SPEED: f32 = 0.4;

pub(crate) struct Bench {
    pub(crate) system: Lockstep,
    pub(crate) plan: Plan,
    pub(crate) ranges: Output<SonarRanges>,
    pub(crate) attitude: Output<Attitude>,
    pub(crate) flow: Output<FlowMotion>,
    pub(crate) pilot: Output<PilotState>,
    pub(crate) poses: Input<Pose>,
    pub(crate) group: u32,
    pub(crate) took_off_ns: u64,
    _directory: tempfile::TempDir,
}

/// What the controller's roll and pitch read when the body is level.
pub(crate) const LEVEL: (f32, f32) = (0.01, -0.012);

pub(crate) struct Truth {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) vx: f32,
    pub(crate) vy: f32,
    pub(crate) heading: f32,
    pub(crate) roll: f32,
    pub(crate) pitch: f32,
}

impl Bench {
    pub(crate) fn new(sidecar: &str) -> Result<Self, StartError> {
        Self::with(sidecar, LocalizationConfig::default())
    }

    pub(crate) fn with(sidecar: &str, config: LocalizationConfig) -> Result<Self, StartError> {
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
        file("vehicle.toml", include_bytes!("../../../../deploy/vehicles/watchman.toml"));
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
    pub(crate) fn truth(&self, now: u64) -> Truth {
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

    pub(crate) fn sense(&mut self, now: u64) {
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
    pub(crate) fn run(&mut self, ms: u64) -> Vec<(Pose, f32)> {
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

    pub(crate) fn take_off(&mut self) {
        self.took_off_ns = (self.system.now() / (200 * MS) + 1) * 200 * MS;
    }
}

pub(crate) const PAD: &str = "pad: {x: 2.75, y: 0.9, heading_deg: 0}\n";

pub(crate) fn worst(poses: &[(Pose, f32)]) -> f32 {
    poses.iter().map(|p| p.1).fold(0.0, f32::max)
}
