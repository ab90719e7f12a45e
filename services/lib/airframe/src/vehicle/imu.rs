//! Gyroscope and accelerometer of the flight controller.

use super::Motion;
use super::noise::{normal, within};
use nalgebra::{UnitQuaternion, Vector3};
use rand::Rng;

/// Noise of one gyro sample at 1 kHz, rad/s: motor vibration through soft mounts.
const GYRO_NOISE_RAD_S: f64 = 0.01;
/// Bias that the calibration at power-up leaves, rad/s (about 0.05 degree a second).
const GYRO_BIAS_RAD_S: f64 = 0.0008;
/// Noise of one accelerometer sample at 1 kHz with motors at full speed, m/s^2; it grows with motor speed.
const ACCELEROMETER_VIBRATION_M_S2: f64 = 1.5;
/// Noise at rest, m/s^2.
const ACCELEROMETER_NOISE_M_S2: f64 = 0.04;
/// Scale error of the accelerometer along each axis, as a share.
const ACCELEROMETER_SCALE: f64 = 0.005;
/// Error of the board's level about roll and pitch, radians: 1.5 degrees (DESIGN 6).
pub(crate) const LEVEL_RAD: f64 = 0.026_18;

/// The two sensors, as one flight finds them.
#[derive(Clone, Debug)]
pub struct Inertial {
    bias: Vector3<f64>,
    scale: Vector3<f64>,
    /// Body to the frame in which the accelerometer was levelled.
    level: UnitQuaternion<f64>,
    level_rad: [f64; 2],
}

impl Inertial {
    /// One flight's draw.
    pub fn draw(random: &mut impl Rng) -> Self {
        let level = [within(random, LEVEL_RAD), within(random, LEVEL_RAD)];
        let mut sensors = Self::levelled(level);
        sensors.bias = Vector3::from_fn(|_, _| within(random, GYRO_BIAS_RAD_S));
        sensors.scale = Vector3::from_fn(|_, _| 1.0 + within(random, ACCELEROMETER_SCALE));
        sensors
    }

    /// Without bias, with the given level error (roll, pitch): the attitude that the controller believes
    /// when the craft is level.
    #[must_use]
    pub fn levelled(level_rad: [f64; 2]) -> Self {
        Self {
            bias: Vector3::zeros(),
            scale: Vector3::from_element(1.0),
            level: UnitQuaternion::from_euler_angles(level_rad[0], level_rad[1], 0.0).inverse(),
            level_rad,
        }
    }

    /// The level error (roll, pitch), radians: for scorers.
    #[must_use]
    pub fn level_rad(&self) -> [f64; 2] {
        self.level_rad
    }

    /// One sample of gyro (rad/s) and accelerometer (m/s^2), body frame; `shake` is the mean motor speed
    /// over full speed.
    pub(crate) fn sample(
        &self,
        motion: &Motion,
        shake: f64,
        random: &mut impl Rng,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let gyro_noise = GYRO_NOISE_RAD_S * (0.1 + shake);
        let noise = ACCELEROMETER_NOISE_M_S2 + ACCELEROMETER_VIBRATION_M_S2 * shake * shake;
        let mut gyro = motion.rates + self.bias;
        let mut accelerometer = (self.level * motion.specific_force).component_mul(&self.scale);
        for i in 0..3 {
            gyro[i] += gyro_noise * normal(random);
            accelerometer[i] += noise * normal(random);
        }
        (gyro, accelerometer)
    }
}
