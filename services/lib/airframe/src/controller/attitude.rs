//! The firmware's own idea of its attitude: gyro, pulled slowly towards accelerometer and compass.
//!
//! A complementary filter on the rotation (Mahony, Hamel, Pflimlin 2008, explicit form without integral),
//! as these firmwares have it. Under acceleration it is wrong: the accelerometer of a craft without drag
//! always points along its own z axis, and pulls a tilted estimate back to level at the filter's gain
//! (FACTS 1: -10.7 degrees told for a true -13.5 after 1.2 s).

use crate::vehicle::GRAVITY_M_S2;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Low-pass of the accelerometer, 1/s: 10 Hz, against vibration.
const ACCELEROMETER_PER_S: f64 = 63.0;
/// Outside this share of gravity the accelerometer is not believed.
const HEALTHY: core::ops::RangeInclusive<f64> = 0.9..=1.1;
/// Disarmed after power-up the filter settles this many times faster...
const SETTLING_FACTOR: f64 = 10.0;
/// ... for this long.
const SETTLING_S: f64 = 20.0;

/// The estimate.
#[derive(Clone, Debug)]
pub(crate) struct AttitudeFilter {
    body_to_earth: UnitQuaternion<f64>,
    accelerometer: Vector3<f64>,
    age_s: f64,
    started: bool,
}

impl AttitudeFilter {
    pub(crate) fn new() -> Self {
        Self {
            body_to_earth: UnitQuaternion::identity(),
            accelerometer: Vector3::new(0.0, 0.0, GRAVITY_M_S2),
            age_s: 0.0,
            started: false,
        }
    }

    /// One step of `dt` seconds. `heading`: the compass, counter-clockwise, radians, and whether there is one; without,
    /// the estimate begins there and then follows the gyro alone, bias and all.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        gyro: &Vector3<f64>,
        accelerometer: &Vector3<f64>,
        (heading, compass): (f64, bool),
        armed: bool,
        gain: f64,
    ) {
        self.age_s += dt;
        if !self.started {
            self.started = true;
            self.body_to_earth = UnitQuaternion::from_euler_angles(0.0, 0.0, heading);
        }
        let smooth = ACCELEROMETER_PER_S * dt;
        self.accelerometer += (accelerometer - self.accelerometer) * smooth;
        let gain = if !armed && self.age_s < SETTLING_S { gain * SETTLING_FACTOR } else { gain };

        let up = self.up();
        let mut rates = *gyro;
        let force = self.accelerometer.norm();
        if HEALTHY.contains(&(force / GRAVITY_M_S2)) {
            rates += (self.accelerometer / force).cross(&up) * gain;
        }
        if compass {
            let q = self.body_to_earth.as_ref();
            let ahead_x = 1.0 - 2.0 * (q.j * q.j + q.k * q.k);
            let ahead_y = 2.0 * (q.i * q.j + q.w * q.k);
            let (sin, cos) = heading.sin_cos();
            let length = ahead_x.hypot(ahead_y).max(1e-6);
            // Sine of the heading's error; behind it, full pull, so that it never rests a half turn off.
            let (across, along) = (ahead_x * sin - ahead_y * cos, ahead_x * cos + ahead_y * sin);
            let error = if along < 0.0 { across.signum() } else { across / length };
            rates += up * (gain * error);
        }

        let half = rates * (0.5 * dt);
        let turn = Quaternion::new(1.0, half.x, half.y, half.z);
        self.body_to_earth = UnitQuaternion::new_normalize(self.body_to_earth.quaternion() * turn);
    }

    /// The accelerometer behind its low-pass, body frame, m/s².
    pub(crate) fn accelerometer(&self) -> [f64; 3] {
        self.accelerometer.into()
    }

    /// The vertical in the body frame.
    pub(crate) fn up(&self) -> Vector3<f64> {
        let q = self.body_to_earth.as_ref();
        Vector3::new(
            2.0 * (q.i * q.k - q.w * q.j),
            2.0 * (q.j * q.k + q.w * q.i),
            1.0 - 2.0 * (q.i * q.i + q.j * q.j),
        )
    }

    /// Roll (right side down) and pitch (nose down).
    pub(crate) fn tilt(&self) -> (f64, f64) {
        let up = self.up();
        (up.y.atan2(up.z), (-up.x).clamp(-1.0, 1.0).asin())
    }

    /// Counter-clockwise from compass zero.
    pub(crate) fn heading(&self) -> f64 {
        let q = self.body_to_earth.as_ref();
        (2.0 * (q.i * q.j + q.w * q.k)).atan2(1.0 - 2.0 * (q.j * q.j + q.k * q.k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_it_finds_level_error_and_heading() {
        let mut filter = AttitudeFilter::new();
        let tilted = UnitQuaternion::from_euler_angles(0.1, -0.05, 0.0).inverse()
            * Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        for _ in 0..10_000 {
            filter.step(0.001, &Vector3::zeros(), &tilted, (2.5, true), false, 0.25);
        }
        let (roll, pitch) = filter.tilt();
        assert!((roll - 0.1).abs() < 1e-3 && (pitch + 0.05).abs() < 1e-3, "{roll} {pitch}");
        assert!((filter.heading() - 2.5).abs() < 1e-3, "{}", filter.heading());
    }

    #[test]
    fn without_a_compass_the_heading_drifts_with_the_gyro_and_level_does_not() {
        let mut filter = AttitudeFilter::new();
        let bias = Vector3::new(8e-4, -8e-4, 8e-4);
        for step in 0..60_000 {
            // What a compass would say is not listened to after the first moment.
            let heading = if step == 0 { 1.0 } else { -2.0 };
            filter.step(0.001, &bias, &Vector3::new(0.0, 0.0, GRAVITY_M_S2), (heading, false), false, 0.25);
        }
        // 8e-4 rad/s for a minute, from where it began: 2.75 degrees.
        assert!((filter.heading() - 1.0 - 0.048).abs() < 1e-3, "{}", filter.heading());
        let (roll, pitch) = filter.tilt();
        assert!(roll.abs() < 5e-3 && pitch.abs() < 5e-3, "{roll} {pitch}");
    }

    #[test]
    fn under_acceleration_it_reads_too_little_tilt() {
        // A craft held at 13.5 degrees nose down without drag feels its own z axis only. The firmware of
        // FACTS 1 told 10.7 after 1.2 s.
        let mut filter = AttitudeFilter::new();
        filter.age_s = 100.0;
        let truth = 13.5_f64.to_radians();
        filter.started = true;
        filter.body_to_earth = UnitQuaternion::from_euler_angles(0.0, truth, 0.0);
        for _ in 0..1200 {
            filter.step(0.001, &Vector3::zeros(), &Vector3::new(0.0, 0.0, 10.0), (0.0, true), true, 0.25);
        }
        let told = filter.tilt().1.to_degrees();
        assert!((told - 10.7).abs() < 1.0, "{told}");
    }
}
