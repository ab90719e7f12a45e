//! A down-looking optical-flow sensor with its own range finder (PMW3901 class) on a one-way serial line.
//!
//! **Frames.** Once a period it sends two MSP v2 requests (`$X<`), nobody answers:
//! - `0x1F02` {u8 quality, i32 x, i32 y}, little endian. x and y are counts over the whole period since the
//!   frame before; the angle of one count is `flow.count_deg` of the vehicle file.
//! - `0x1F01` {u8 quality, i32 distance in mm}; negative when out of range. Distance along the sensor's axis.
//!
//! **Signs.** The counts tell how *the craft* seems to move over the ground, in the sensor's frame, which is
//! the body frame (x forward, y left) turned counter-clockwise by `flow.yaw_deg`. With v the velocity in the
//! body frame, w the body rates (positive: right side down, nose down) and D the distance along the axis,
//! ```text
//! x = sum of (v_x / D - w_pitch) dt / count,     y = sum of (v_y / D + w_roll) dt / count
//! ```
//! so a nose that goes down looks like flying backwards, a right side that goes down like flying left, and
//! v_x = D (x count / period + w_pitch), v_y = D (y count / period - w_roll).

use super::Motion;
use super::noise::{normal, within};
use crate::controller::{Wire, encode_v2};
use nalgebra::Vector3;
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

/// MSP v2 code of an optical-flow frame.
pub const MSP2_SENSOR_OPTIC_FLOW: u16 = 0x1F02;
/// MSP v2 code of a range-finder frame.
pub const MSP2_SENSOR_RANGEFINDER: u16 = 0x1F01;

/// Noise of the mean image motion of one frame, rad/s: 0.06 m/s at 1.2 m, the level of FACTS 8.
const NOISE_RAD_S: f64 = 0.05;
/// Share of the turning rate that smears into noise.
const SMEAR: f64 = 0.05;
/// Largest error of the scale and of the mounting angle of one flight.
const SCALE_SHARE: f64 = 0.02;
const MOUNT_RAD: f64 = 0.026;
/// Fastest image motion that the sensor follows, rad/s (datasheet of the PMW3901: 7.4).
const FASTEST_RAD_S: f64 = 7.4;
/// Range-finder noise: a share of the distance and a floor, metres (VL53L0X class).
const RANGE_SHARE: f64 = 0.01;
const RANGE_FLOOR_M: f64 = 0.006;
/// The shortest distance that the range finder tells apart.
const RANGE_LEAST_M: f64 = 0.02;
/// Quality over a good floor and its scatter, of 255.
const QUALITY: f64 = 120.0;
const QUALITY_SCATTER: f64 = 14.0;
/// Contrast of a carpet: it has texture, and its pile blurs it.
const SOFT_CONTRAST: f64 = 0.6;
/// Bare floor without texture begins where the sum of waves exceeds this share: about one part in forty.
const BARE_ABOVE: f64 = 0.80;

/// What the sensor is, from the vehicle file.
#[derive(Clone, Copy, Debug)]
pub struct FlowSettings {
    /// Frames a second.
    pub rate_hz: f64,
    /// Angle of one count, radians.
    pub count_rad: f64,
    /// Mounting angle about body z, counter-clockwise, radians.
    pub yaw_rad: f64,
    /// Nearer to the ground than this it sees nothing, metres.
    pub min_height_m: f64,
    /// Farther from the ground than this it sees nothing, metres.
    pub max_height_m: f64,
}

impl From<&manifest::FlowSensor> for FlowSettings {
    fn from(sensor: &manifest::FlowSensor) -> Self {
        Self {
            rate_hz: f64::from(sensor.rate_hz),
            count_rad: f64::from(sensor.count_rad),
            yaw_rad: f64::from(sensor.yaw_rad),
            min_height_m: f64::from(sensor.min_height_m),
            max_height_m: f64::from(sensor.max_height_m),
        }
    }
}

/// The ground under the sensor.
#[derive(Clone, Copy, Debug)]
pub struct Ground {
    /// World height of what it looks at.
    pub surface_m: f64,
    /// Cloth, carpet, foam: the image has little contrast and the range is uncertain.
    pub soft: bool,
    /// Something walks through the picture.
    pub moving: bool,
    /// What a dirty lens or a dark floor leaves of the contrast, 1: all.
    pub contrast: f64,
}

/// The sensor in flight.
#[derive(Clone, Debug)]
pub struct FlowSensor {
    settings: FlowSettings,
    scale: f64,
    mount: (f64, f64),
    texture: [(f64, f64, f64); 3],
    sum: [f64; 2],
    rest: [f64; 2],
    turned: f64,
    elapsed_s: f64,
    wire: Wire,
}

impl FlowSensor {
    /// One flight's draw.
    pub fn draw(settings: FlowSettings, random: &mut impl Rng) -> Self {
        let mut sensor = Self::exact(settings);
        sensor.scale += within(random, SCALE_SHARE);
        sensor.mount = (settings.yaw_rad + within(random, MOUNT_RAD)).sin_cos();
        sensor.texture = std::array::from_fn(|_| {
            let number = TAU / (1.5 + 3.5 * random.random::<f64>());
            let (sin, cos) = within(random, PI).sin_cos();
            (number * cos, number * sin, within(random, PI))
        });
        sensor
    }

    /// Without errors of scale and mounting, over a floor that has texture everywhere.
    #[must_use]
    pub fn exact(settings: FlowSettings) -> Self {
        Self {
            settings,
            scale: 1.0,
            mount: settings.yaw_rad.sin_cos(),
            texture: [(0.0, 0.0, 0.0); 3],
            sum: [0.0; 2],
            rest: [0.0; 2],
            turned: 0.0,
            elapsed_s: 0.0,
            wire: Wire::new(),
        }
    }

    /// Looks for `dt` seconds and sends a frame when the period is over.
    pub fn step(&mut self, now_ns: u64, dt: f64, motion: &Motion, ground: &Ground, random: &mut impl Rng) {
        let distance = distance(motion, ground);
        let velocity: Vector3<f64> = motion.attitude.inverse_transform_vector(&motion.velocity);
        let near = distance.max(0.02);
        let forward = velocity.x / near - motion.rates.y;
        let left = velocity.y / near + motion.rates.x;
        self.sum[0] += forward.clamp(-FASTEST_RAD_S, FASTEST_RAD_S) * dt;
        self.sum[1] += left.clamp(-FASTEST_RAD_S, FASTEST_RAD_S) * dt;
        self.turned += motion.rates.x.hypot(motion.rates.y) * dt;
        self.elapsed_s += dt;
        let period = 1.0 / self.settings.rate_hz;
        // Half a step of tolerance: sums of steps are not exact.
        if self.elapsed_s + 0.5 * dt >= period {
            self.send(now_ns, motion, ground, distance, random);
            self.elapsed_s -= period;
            self.sum = [0.0; 2];
            self.turned = 0.0;
        }
    }

    fn send(&mut self, now_ns: u64, motion: &Motion, ground: &Ground, distance: f64, random: &mut impl Rng) {
        let period = 1.0 / self.settings.rate_hz;
        let seen = (self.settings.min_height_m..=self.settings.max_height_m).contains(&distance);
        let contrast = self.contrast(motion, ground);
        let mut quality = (QUALITY + QUALITY_SCATTER * normal(random)) * contrast;
        if !seen {
            quality = 0.0;
        }
        // What is not told apart is not counted: poor floors make the sensor under-report.
        let share = if quality < 0.5 * QUALITY { 0.3 + 0.7 * contrast } else { 1.0 };
        let shown = if seen { share * self.scale } else { 0.0 };
        let sigma = (NOISE_RAD_S * period + SMEAR * self.turned) / contrast.max(0.3);
        let (sin, cos) = self.mount;
        let turned = [cos * self.sum[0] + sin * self.sum[1], cos * self.sum[1] - sin * self.sum[0]];
        let mut counts = [0_i32; 2];
        for (axis, count) in counts.iter_mut().enumerate() {
            let noise = if seen { sigma * normal(random) } else { 0.0 };
            let exact = shown * turned[axis] / self.settings.count_rad + self.rest[axis];
            self.rest[axis] = exact - exact.round();
            *count = (exact + noise / self.settings.count_rad).round() as i32;
        }

        let mut payload = [0_u8; 9];
        payload[0] = quality.clamp(0.0, 255.0) as u8;
        payload[1..5].copy_from_slice(&counts[0].to_le_bytes());
        payload[5..9].copy_from_slice(&counts[1].to_le_bytes());
        self.push(now_ns, MSP2_SENSOR_OPTIC_FLOW, &payload);

        let spread = if ground.soft { 4.0 } else { 1.0 };
        let noise = (RANGE_FLOOR_M + RANGE_SHARE * distance) * spread * normal(random);
        let range = distance + noise;
        let inside = (RANGE_LEAST_M..=self.settings.max_height_m).contains(&range);
        let millimetres = if inside { (range * 1000.0).round() as i32 } else { -1 };
        let mut payload = [0_u8; 5];
        payload[0] = if inside { 255 } else { 0 };
        payload[1..5].copy_from_slice(&millimetres.to_le_bytes());
        self.push(now_ns, MSP2_SENSOR_RANGEFINDER, &payload);
    }

    /// 1 over a good floor, towards 0 where there is little to see.
    fn contrast(&self, motion: &Motion, ground: &Ground) -> f64 {
        let (x, y) = (motion.position.x, motion.position.y);
        let sum: f64 = self.texture.iter().map(|(kx, ky, phase)| (kx * x + ky * y + phase).sin()).sum();
        let mut contrast = if sum / 3.0 > BARE_ABOVE { 0.2 } else { 1.0 } * ground.contrast;
        if ground.soft {
            contrast *= SOFT_CONTRAST;
        }
        if ground.moving {
            contrast *= 0.25;
        }
        contrast
    }

    fn push(&mut self, now_ns: u64, code: u16, payload: &[u8]) {
        let mut frame = [0_u8; 32];
        let length = encode_v2(b'<', code, payload, &mut frame);
        self.wire.send(now_ns, &frame[..length]);
    }

    /// Takes the bytes that have left the line by `now_ns`.
    pub fn read(&mut self, now_ns: u64, out: &mut [u8]) -> usize {
        self.wire.receive(now_ns, out)
    }
}

/// To the ground along the sensor's axis; it sits at the bottom of the airframe, in the middle.
fn distance(motion: &Motion, ground: &Ground) -> f64 {
    let upright = motion.tilt().cos().max(0.1);
    (motion.position.z - ground.surface_m).max(0.0) / upright
}
