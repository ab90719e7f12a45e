//! Sticks to angles, angles to rates, rates to torques, torques to motors; a thousand times a second.

use super::attitude::AttitudeFilter;
use super::personality::Personality;
use super::receiver::{PITCH, ROLL, THROTTLE, YAW};
use nalgebra::Vector3;

/// Gains of a PID number on a rate in radians a second, motor share out: the firmware's own scales are
/// 0.032029, 0.244381 and 0.000529 on degrees a second, thousandths out.
const P_SCALE: f64 = 0.032_029e-3 * 57.295_78;
const I_SCALE: f64 = 0.244_381e-3 * 57.295_78;
const D_SCALE: f64 = 0.000_529e-3 * 57.295_78;
/// Largest share of the integral and of the whole sum (`iterm_limit`, `pidsum_limit`, `pidsum_limit_yaw`).
const INTEGRAL_LIMIT: f64 = 0.4;
const SUM_LIMIT: [f64; 3] = [0.5, 0.5, 0.4];
/// Low-pass of the gyro and of the derivative, 1/s (about 100 and 75 Hz).
const GYRO_PER_S: f64 = 628.0;
const DERIVATIVE_PER_S: f64 = 470.0;
/// Smoothing of the sticks between 50 Hz frames, 1/s (time constant 20 ms).
const STICK_PER_S: f64 = 50.0;
/// Feed-forward of a moving angle target (`angle_feedforward` 50) and its smoothing (80 ms).
const FEEDFORWARD: f64 = 0.5;
const FEEDFORWARD_PER_S: f64 = 12.5;
/// Throttle share at which the integrals stay on at low throttle from then on (air mode).
const AIRMODE_START: f64 = 0.25;

/// Roll (+ right down), pitch (+ nose down), yaw (+ counter-clockwise) of each motor: rear right, front
/// right, rear left, front left.
const MIX: [[f64; 3]; 4] = [[-1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0]];

/// State of the loops.
#[derive(Clone, Debug)]
pub(crate) struct Loops {
    sticks: [f64; 4],
    targets: [f64; 2],
    feedforward: [f64; 2],
    gyro: Vector3<f64>,
    derivative: [f64; 3],
    integral: [f64; 3],
    airmode: bool,
    idle: f64,
    /// Factor on the personality's PID numbers.
    scale: f64,
}

impl Loops {
    pub(crate) fn new(idle: f64) -> Self {
        Self {
            sticks: [1500.0, 1500.0, 1500.0, 885.0],
            targets: [0.0; 2],
            feedforward: [0.0; 2],
            gyro: Vector3::zeros(),
            derivative: [0.0; 3],
            integral: [0.0; 3],
            airmode: false,
            idle,
            scale: 1.0,
        }
    }

    /// Multiplies the PID numbers.
    pub(crate) fn tune(&mut self, scale: f64) {
        self.scale = scale;
    }

    /// Disarmed: forget.
    pub(crate) fn rest(&mut self) {
        *self = Self { scale: self.scale, ..Self::new(self.idle) };
    }

    /// Motor commands 0..=1 for one step of `dt` seconds.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        sticks_us: [u16; 4],
        angle_mode: bool,
        gyro: &Vector3<f64>,
        attitude: &AttitudeFilter,
        personality: &Personality,
    ) -> [f64; 4] {
        for (smooth, raw) in self.sticks.iter_mut().zip(sticks_us) {
            *smooth += (f64::from(raw) - *smooth) * (STICK_PER_S * dt);
        }
        let throttle = self.throttle(personality);
        self.airmode |= throttle > AIRMODE_START;
        let wanted = self.wanted_rates(dt, angle_mode, attitude, personality);
        let torque = self.torques(dt, &wanted, gyro, throttle, personality);
        self.mix(throttle, &torque)
    }

    fn throttle(&self, personality: &Personality) -> f64 {
        let low = f64::from(personality.low_throttle_us);
        ((self.sticks[THROTTLE] - low) / (2000.0 - low)).clamp(0.0, 1.0)
    }

    fn wanted_rates(
        &mut self,
        dt: f64,
        angle_mode: bool,
        attitude: &AttitudeFilter,
        personality: &Personality,
    ) -> [f64; 3] {
        let law = &personality.stick;
        let largest = law.largest_rate_deg_s().to_radians();
        let limit = law.largest_angle_deg().to_radians();
        let sticks = [ROLL, PITCH, YAW].map(|stick| ((self.sticks[stick] - 1500.0) / 500.0).clamp(-1.0, 1.0));
        let rates = sticks.map(|x| law.rate_share(x));
        let mut wanted = [rates[0] * largest, rates[1] * largest, -rates[2] * largest];
        if angle_mode {
            let (roll, pitch) = attitude.tilt();
            for (axis, told) in [roll, pitch].into_iter().enumerate() {
                let target = law.angle_share(sticks[axis]) * limit;
                let speed = (target - self.targets[axis]) / dt;
                self.targets[axis] = target;
                self.feedforward[axis] += (speed - self.feedforward[axis]) * (FEEDFORWARD_PER_S * dt);
                wanted[axis] =
                    personality.angle_gain_per_s * (target - told) + FEEDFORWARD * self.feedforward[axis];
            }
        }
        wanted
    }

    fn torques(
        &mut self,
        dt: f64,
        wanted: &[f64; 3],
        gyro: &Vector3<f64>,
        throttle: f64,
        personality: &Personality,
    ) -> [f64; 3] {
        let before = self.gyro;
        self.gyro += (gyro - self.gyro) * (GYRO_PER_S * dt).min(1.0);
        // On the ground at idle an integral would only wind up against the feet.
        let grounded = throttle <= 0.0 && !self.airmode;
        let mut torque = [0.0; 3];
        for axis in 0..3 {
            let [p, i, d] = personality.pid[axis].map(|number| number * self.scale);
            let error = wanted[axis] - self.gyro[axis];
            let sum = &mut self.integral[axis];
            *sum = (*sum + I_SCALE * i * error * dt).clamp(-INTEGRAL_LIMIT, INTEGRAL_LIMIT);
            if grounded {
                *sum = 0.0;
            }
            let slope = (self.gyro[axis] - before[axis]) / dt;
            self.derivative[axis] += (slope - self.derivative[axis]) * (DERIVATIVE_PER_S * dt);
            let output = P_SCALE * p * error + *sum - D_SCALE * d * self.derivative[axis];
            torque[axis] = output.clamp(-SUM_LIMIT[axis], SUM_LIMIT[axis]);
        }
        torque
    }

    /// Air mode: torque first, the throttle gives way so that no motor leaves its range.
    fn mix(&self, throttle: f64, torque: &[f64; 3]) -> [f64; 4] {
        let mut mix = MIX.map(|row| row[0] * torque[0] + row[1] * torque[1] + row[2] * torque[2]);
        let high = mix.iter().copied().fold(f64::MIN, f64::max);
        let low = mix.iter().copied().fold(f64::MAX, f64::min);
        let range = (high - low).max(1.0);
        for share in &mut mix {
            *share /= range;
        }
        // Not `clamp`: at full range the two ends may cross by a rounding.
        let throttle = throttle.max(-low / range).min(1.0 - high / range);
        mix.map(|share| self.idle + (1.0 - self.idle) * (share + throttle).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_motor_leaves_its_range_and_torque_comes_before_throttle() {
        let loops = Loops::new(0.055);
        for throttle in [0.0, 0.5, 1.0] {
            let motors = loops.mix(throttle, &[0.3, -0.2, 0.1]);
            assert!(motors.iter().all(|m| (0.055..=1.0).contains(m)), "{motors:?}");
            let roll = motors[2] + motors[3] - motors[0] - motors[1];
            assert!(roll > 0.5, "{motors:?}");
        }
    }
}
