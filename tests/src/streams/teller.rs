//! In localization's place: tells the truth, and is off by what is drawn.

use super::{STREAMS, stream_at};
use control::{Tilt, Vector, wrap_angle};
use ipc_types::{Attitude, LocalizationState, Pose, Truth};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use runtime::{ConfigError, Input, Output, Ports, Service, Start, StartError, Validate};

/// As often as localization, nanoseconds.
const PERIOD_NS: u64 = 50_000_000;
/// Error of the velocity that a filter with a flow sensor has, m/s (FACTS 8: 0.065), and for how long it stays, seconds.
const VELOCITY_M_S: f32 = 0.05;
const STAYS_S: f32 = 1.0;
/// A place slips away so fast, m/s, and farther than this it jumps, metres.
const SLIPS_M_S: f32 = 0.3;
const JUMPS_M: f32 = 0.6;
/// Between two streams.
const SURE: Offset = Offset { x_m: 0.0, y_m: 0.0, heading_rad: 0.0, sigma_m: 0.04 };
/// Time over which the level error is learned, seconds, and over which the moving air is.
const LEVEL_S: f32 = 3.0;
const AIR_S: f32 = 0.5;
/// Air drag, 1/s, as localization and pilot have it.
const DRAG_PER_S: f32 = 0.25;

/// What it is off by in one stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Offset {
    /// Plan frame, metres.
    pub x_m: f32,
    /// Plan frame, metres.
    pub y_m: f32,
    /// Radians.
    pub heading_rad: f32,
    /// What it says of itself, metres.
    pub sigma_m: f32,
}

/// Offsets, one a stream.
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// In the order of the streams.
    pub offsets: Vec<Offset>,
}

impl Validate for Config {
    fn validate(&self) -> Result<(), ConfigError> {
        if self.offsets.len() == STREAMS {
            Ok(())
        } else {
            Err(ConfigError::range("offsets", self.offsets.len(), STREAMS.to_string()))
        }
    }
}

/// The service.
pub struct Teller {
    offsets: Vec<Offset>,
    truth: Input<Truth>,
    attitude: Input<Attitude>,
    pose: Output<Pose>,
    random: Xoshiro256PlusPlus,
    took_off_s: Option<f64>,
    yaw_rad: Option<f32>,
    seen: Option<Truth>,
    tilt: (f32, f32),
    level: (f32, f32),
    slip: Vector,
    air: Vector,
    velocity: Option<(f64, Vector)>,
    off: Offset,
    told_ns: Option<u64>,
}

impl Service for Teller {
    const NAME: &'static str = "localization";
    type Config = Config;

    fn start(config: Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        Ok(Self {
            offsets: config.offsets,
            truth: ports.input()?,
            attitude: ports.input()?,
            pose: ports.output()?,
            random: Xoshiro256PlusPlus::seed_from_u64(start.seed),
            took_off_s: None,
            yaw_rad: None,
            seen: None,
            tilt: (0.0, 0.0),
            level: (0.0, 0.0),
            slip: Vector::ZERO,
            air: Vector::ZERO,
            velocity: None,
            off: SURE,
            told_ns: None,
        })
    }

    fn step(&mut self, now: u64) {
        while let Some(attitude) = self.attitude.receive() {
            self.yaw_rad = Some(attitude.yaw_rad);
            self.tilt = (attitude.roll_rad, attitude.pitch_rad);
        }
        while let Some(truth) = self.truth.receive() {
            self.feel(&truth);
            if truth.armed != 0 && truth.on_ground == 0 {
                self.took_off_s.get_or_insert(truth.time_s);
            }
            self.seen = Some(*truth);
        }
        let due = self.told_ns.is_none_or(|told| now.saturating_sub(told) >= PERIOD_NS);
        let (true, Some(truth), Some(yaw_rad)) = (due, self.seen, self.yaw_rad) else { return };
        let dt = self.told_ns.map_or(0.0, |told| now.saturating_sub(told) as f32 * 1e-9);
        self.told_ns = Some(now);
        self.learn(dt, &truth);
        self.slip_off(dt, &truth);
        self.pose.publish(&self.told(&truth, yaw_rad));
    }
}

impl Teller {
    /// What the tilt does not explain of the motion is the air's, as localization learns it.
    fn feel(&mut self, truth: &Truth) {
        let velocity = Vector::new(truth.velocity_x_m_s, truth.velocity_y_m_s);
        if let Some((before_s, before)) = self.velocity {
            let dt = (truth.time_s - before_s) as f32;
            let tilt = Tilt { roll: truth.roll_rad, pitch: truth.pitch_rad };
            if dt > 1e-3 && dt < 0.2 && truth.on_ground == 0 {
                let felt = (velocity - before) * (1.0 / dt);
                let unexplained = felt - tilt.acceleration(truth.yaw_rad) + velocity * DRAG_PER_S;
                self.air = self.air + (unexplained - self.air) * (dt / AIR_S).min(1.0);
            }
        }
        self.velocity = Some((truth.time_s, velocity));
    }

    /// Level error and the error of the velocity move on.
    fn learn(&mut self, dt: f32, truth: &Truth) {
        let share = (dt / LEVEL_S).min(1.0);
        self.level.0 += share * (self.tilt.0 - truth.roll_rad - self.level.0);
        self.level.1 += share * (self.tilt.1 - truth.pitch_rad - self.level.1);
        let keep = (-dt / STAYS_S).exp();
        // Uniform in a square of this half-side: its standard deviation is a third of the root of three.
        let half = VELOCITY_M_S * 3f32.sqrt() * (1.0 - keep * keep).sqrt();
        let mut draw = || if half > 0.0 { self.random.random_range(-half..half) } else { 0.0 };
        self.slip = self.slip * keep + Vector::new(draw(), draw());
    }

    /// A filter slips to a wrong place, unless it is altogether wrong: then it was there at once.
    fn slip_off(&mut self, dt: f32, truth: &Truth) {
        let flown_s = self.took_off_s.map_or(-1.0, |off| truth.time_s - off);
        let goal = stream_at(flown_s).and_then(|stream| self.offsets.get(stream)).copied().unwrap_or(SURE);
        let way = Vector::new(goal.x_m - self.off.x_m, goal.y_m - self.off.y_m);
        let step = if way.norm() > JUMPS_M { way } else { way.limited(SLIPS_M_S * dt) };
        self.off = Offset { x_m: self.off.x_m + step.x, y_m: self.off.y_m + step.y, ..goal };
    }

    fn told(&self, truth: &Truth, yaw_rad: f32) -> Pose {
        let offset = self.off;
        let heading = wrap_angle(truth.yaw_rad + offset.heading_rad);
        let velocity = Vector::new(truth.velocity_x_m_s, truth.velocity_y_m_s) + self.slip;
        Pose {
            estimated_ns: truth.header.stamp_ns,
            x_m: truth.x_m + offset.x_m,
            y_m: truth.y_m + offset.y_m,
            heading_rad: heading,
            velocity_x_m_s: velocity.x,
            velocity_y_m_s: velocity.y,
            variance_x_m2: offset.sigma_m * offset.sigma_m,
            variance_y_m2: offset.sigma_m * offset.sigma_m,
            heading_sigma_rad: 0.03,
            velocity_sigma_m_s: VELOCITY_M_S,
            air_x_m_s2: self.air.x,
            air_y_m_s2: self.air.y,
            heading_offset_rad: wrap_angle(heading - yaw_rad),
            level_roll_rad: self.level.0,
            level_pitch_rad: self.level.1,
            effective_particles: 1000.0,
            p_lost: 0.001,
            particles: 2000,
            state: LocalizationState::Tracking.code().into(),
            walls_in_echo: 4,
            ..Pose::default()
        }
    }
}
