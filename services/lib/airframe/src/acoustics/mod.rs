//! What an HC-SR04 class sonar hears in the world (DESIGN 6, FACTS 2).
//!
//! One ping of one sensor: rays over a 3-D cone meet solids, each answers with a strength ([`beam`] says
//! how), and the *nearest* answer that is loud enough ends the pulse. Then come the sensor's own faults:
//! quantum, noise, lost periods, drop-outs, wash noise.
//!
//! **Cross-talk**, decided by geometry and not by chance. A sensor's ping is in the air for
//! [`AIR_TIME_NS`]; whoever is fired within that time, at once or later, listens to it too. Sensor `j`
//! takes the ping of `i` for its own when the axes are less than [`APART_RAD`] apart, or the place from
//! which `i` was answered lies within [`HEARS_RAD`] of `j`'s axis (two sensors that see one pole), and the
//! sound arrives before `j`'s own echo. What `j` then reads is half the way from `i` over that place to
//! `j`, plus the time between the two pings.
//!
//! **Pinged too fast** (less than [`CYCLE_NS`] after its last ping) a sensor answers with its last result:
//! the old echo is still ringing.

pub mod beam;
mod pose;
#[cfg(test)]
mod tests;

pub use pose::{Mount, Pose6};

use crate::world::World;
use crate::world::draw::{chance, normal, uniform};
use beam::Cone;
use rand::Rng;

/// Most sensors of a vehicle.
pub const MAX_SENSORS: usize = 16;
/// Speed of sound that drivers assume, metres a second (20 C, FACTS 2).
pub const SOUND_M_S: f32 = 343.0;
/// Least time between two pings of one sensor (datasheet).
pub const CYCLE_NS: u64 = 60_000_000;
/// A caller's tick may come this much early.
const CYCLE_SLACK_NS: u64 = 1_000_000;
/// How long a ping can be heard by others: twice 4 m at the speed of sound, and the ringing.
pub const AIR_TIME_NS: u64 = 30_000_000;
/// After this time the sensor gives up waiting for an echo, seconds.
pub const GIVE_UP_S: f32 = 0.038;
/// Axes at least this far apart do not hear each other's walls.
pub const APART_RAD: f32 = 75.0 * std::f32::consts::PI / 180.0;
/// A sensor hears what answers from within this angle of its axis.
pub const HEARS_RAD: f32 = 25.0 * std::f32::consts::PI / 180.0;
/// Reach of the sensor, metres.
pub const RANGE_M: (f32, f32) = (0.02, 4.0);

/// Time resolution, as metres (FACTS 2).
const QUANTUM_M: f32 = 0.003;
/// Noise of one reading, metres.
const SIGMA_M: f32 = 0.004;
/// One lost 40 kHz period, as metres there and back; two are lost now and then (FACTS 2: +4 to +9 mm).
const PERIOD_M: f32 = 0.0043;
/// Share of readings that lost a period.
const PERIOD_SHARE: f32 = 0.08;
/// Share of readings that are propeller wash instead of an echo, and their ranges, metres.
const WASH_SHARE: f32 = 0.01;
const WASH_M: (f32, f32) = (0.05, 1.2);
/// Share of pings without an answer though there was an echo (FACTS 8: 5 % in all).
const DROP_SHARE: f32 = 0.04;
/// Range scale, half common (temperature), a little of each sensor (crystal): 1 % in all (DESIGN 6).
const SCALE_COMMON: f32 = 0.008;
const SCALE_OWN: f32 = 0.002;
/// Largest error of a mount in azimuth and in elevation (DESIGN 6).
const MOUNT_RAD: f32 = 3.0 * std::f32::consts::PI / 180.0;

/// What one sensor answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Index of the sensor.
    pub sensor: u8,
    /// Width of the echo pulse, seconds there and back; NaN when nothing came back.
    pub pulse_s: f32,
}

/// What a group of sensors answers.
#[derive(Clone, Copy, Debug)]
pub struct Echoes {
    count: usize,
    echoes: [Echo; MAX_SENSORS],
}

impl Echoes {
    /// One entry for each sensor that was fired, in ascending order.
    #[must_use]
    pub fn as_slice(&self) -> &[Echo] {
        &self.echoes[..self.count.min(MAX_SENSORS)]
    }

    /// The same, to be spoilt by faults.
    pub(crate) fn as_mut_slice(&mut self) -> &mut [Echo] {
        &mut self.echoes[..self.count.min(MAX_SENSORS)]
    }
}

/// A sensor as it was built in, and what it did last.
#[derive(Clone, Copy, Debug)]
struct Sensor {
    mount: Mount,
    scale: f32,
    fired: bool,
    pinged_ns: u64,
    /// Its own echo: place and distance, unscaled and without noise.
    answer: Option<([f32; 3], f32)>,
    face: [f32; 3],
    axis: [f32; 3],
    last_pulse_s: f32,
}

/// The sonars of one vehicle on one flight.
#[derive(Clone, Debug)]
pub struct Acoustics {
    sensors: Vec<Sensor>,
    cone: Cone,
}

impl Acoustics {
    /// Sonars with the errors of this flight: mounts off by up to 3 degrees, range scale up to 1 %. Mounts
    /// beyond [`MAX_SENSORS`] are not fitted.
    pub fn new<R: Rng + ?Sized>(mounts: &[Mount], rng: &mut R) -> Self {
        let common = uniform(rng, -SCALE_COMMON, SCALE_COMMON);
        let sensors = mounts.iter().take(MAX_SENSORS).map(|mount| {
            let scale = 1.0 + common + uniform(rng, -SCALE_OWN, SCALE_OWN);
            let bearing_rad = mount.bearing_rad + uniform(rng, -MOUNT_RAD, MOUNT_RAD);
            let elevation_rad = mount.elevation_rad + uniform(rng, -MOUNT_RAD, MOUNT_RAD);
            Sensor::fitted(Mount { bearing_rad, elevation_rad, ..*mount }, scale)
        });
        Self { sensors: sensors.collect(), cone: Cone::new() }
    }

    /// Sonars without errors of mounting and scale, for tests and measurements.
    #[must_use]
    pub fn exact(mounts: &[Mount]) -> Self {
        let sensors = mounts.iter().take(MAX_SENSORS).map(|mount| Sensor::fitted(*mount, 1.0));
        Self { sensors: sensors.collect(), cone: Cone::new() }
    }

    /// Fires the sensors whose bit is set in `mask`, at `now_ns`, and answers what they will report.
    /// `pose` is the body's true pose.
    pub fn ping<R: Rng + ?Sized>(
        &mut self,
        world: &World,
        pose: &Pose6,
        mask: u32,
        now_ns: u64,
        rng: &mut R,
    ) -> Echoes {
        let mut too_fast = 0u32;
        for (i, sensor) in self.sensors.iter_mut().enumerate() {
            if mask & (1 << i) == 0 {
                continue;
            }
            if sensor.fired && now_ns.saturating_sub(sensor.pinged_ns) + CYCLE_SLACK_NS < CYCLE_NS {
                too_fast |= 1 << i;
                continue;
            }
            sensor.fired = true;
            sensor.pinged_ns = now_ns;
            (sensor.face, sensor.axis) = pose.mounted(&sensor.mount);
            let range = self.cone.listen(world, sensor.face, sensor.axis, rng);
            sensor.answer = range.map(|heard| (heard.place, heard.range));
        }
        let mut echoes = Echoes { count: 0, echoes: [Echo { sensor: 0, pulse_s: f32::NAN }; MAX_SENSORS] };
        for i in 0..self.sensors.len() {
            if mask & (1 << i) == 0 {
                continue;
            }
            let pulse_s = if too_fast & (1 << i) != 0 {
                self.sensors[i].last_pulse_s
            } else {
                let pulse = pulse(self.range(i, now_ns), self.sensors[i].scale, rng);
                self.sensors[i].last_pulse_s = pulse;
                pulse
            };
            echoes.echoes[echoes.count] = Echo { sensor: i as u8, pulse_s };
            echoes.count += 1;
        }
        echoes
    }

    /// The range that sensor `j` measures: its own echo, or an earlier sound of another sensor.
    fn range(&self, j: usize, now_ns: u64) -> Option<f32> {
        let listener = &self.sensors[j];
        let mut range = listener.answer.map(|(_, range)| range);
        for (i, other) in self.sensors.iter().enumerate() {
            let age_ns = now_ns.saturating_sub(other.pinged_ns);
            if i == j || !other.fired || age_ns >= AIR_TIME_NS {
                continue;
            }
            let Some((place, distance)) = other.answer else { continue };
            let to_place = sub(place, listener.face);
            let away = dot(to_place, to_place).sqrt();
            let mixes = dot(listener.axis, other.axis) > APART_RAD.cos()
                || dot(to_place, listener.axis) > HEARS_RAD.cos() * away;
            // The sound left before this sensor began to count.
            let heard = (distance + away) * 0.5 - age_ns as f32 * 1e-9 * SOUND_M_S * 0.5;
            if mixes && heard > RANGE_M.0 && range.is_none_or(|own| heard < own) {
                range = Some(heard);
            }
        }
        range
    }

    /// Knocks a sensor: one that looks around turns about the vertical, one that looks down or up tilts forward, radians.
    pub(crate) fn turn(&mut self, sensor: usize, angle_rad: f32) {
        let Some(sensor) = self.sensors.get_mut(sensor) else { return };
        if sensor.mount.elevation_rad.abs() > std::f32::consts::FRAC_PI_4 {
            sensor.mount.elevation_rad += angle_rad;
        } else {
            sensor.mount.bearing_rad += angle_rad;
        }
    }

    /// Where the sensors really look, body frame: what the flight drew.
    #[must_use]
    pub fn true_mounts(&self) -> Vec<Mount> {
        self.sensors.iter().map(|sensor| sensor.mount).collect()
    }
}

impl Sensor {
    fn fitted(mount: Mount, scale: f32) -> Self {
        Self {
            mount,
            scale,
            fired: false,
            pinged_ns: 0,
            answer: None,
            face: [0.0; 3],
            axis: [1.0, 0.0, 0.0],
            last_pulse_s: f32::NAN,
        }
    }
}

/// The sensor's own faults: from a true range to the width of its pulse. The number of draws is fixed.
fn pulse<R: Rng + ?Sized>(range: Option<f32>, scale: f32, rng: &mut R) -> f32 {
    let noise = normal(rng) * SIGMA_M;
    let periods = if chance(rng, PERIOD_SHARE) { 1.0 } else { 0.0 };
    let second = if chance(rng, 0.3) { 2.0 } else { 1.0 };
    let washed = chance(rng, WASH_SHARE);
    let wash = uniform(rng, WASH_M.0, WASH_M.1);
    let dropped = chance(rng, DROP_SHARE);
    let mut range = range.filter(|_| !dropped);
    if washed && range.is_none_or(|range| wash < range) {
        range = Some(wash);
    }
    let Some(range) = range else { return f32::NAN };
    let read = range * scale + noise + periods * second * PERIOD_M;
    let read = (read / QUANTUM_M).round() * QUANTUM_M;
    if read < RANGE_M.0 || read > RANGE_M.1 {
        return f32::NAN;
    }
    2.0 * read / SOUND_M_S
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
