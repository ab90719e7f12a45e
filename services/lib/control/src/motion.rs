//! Velocity and place between two poses.

use crate::check::{RangeError, within};
use crate::held::seconds;
use crate::planar::Vector;

/// Settings of the motion predictor.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionConfig {
    /// Air drag, 1/s: an indoor quadrotor of a kilogram loses about a quarter of its speed a second.
    pub drag_per_s: f32,
    /// Time from the newest pose after which the predicted velocity fades, seconds.
    pub coast_s: f32,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self { drag_per_s: 0.25, coast_s: 0.6 }
    }
}

impl MotionConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("motion.drag_per_s", self.drag_per_s, 0.0, 2.0)?;
        within("motion.coast_s", self.coast_s, 0.1, 3.0)
    }
}

/// Steps remembered: at 50 Hz 0.64 s, several times the age of the oldest pose that is used.
const MEMORY: usize = 32;
/// How fast a velocity that nothing has confirmed fades, 1/s.
const FADE_PER_S: f32 = 2.0;

/// Carries place and velocity from the time of the newest pose to now by the measured tilt: what the
/// localization says is 50 to 80 ms old, a third of the velocity loop's phase margin.
#[derive(Clone, Debug)]
pub struct Motion {
    config: MotionConfig,
    place: Vector,
    velocity: Vector,
    pose_ns: u64,
    known: bool,
    now_ns: u64,
    memory: [(u64, Vector); MEMORY],
    newest: usize,
}

impl Motion {
    /// Nothing is known yet.
    #[must_use]
    pub fn new(config: MotionConfig) -> Self {
        Self {
            config,
            place: Vector::ZERO,
            velocity: Vector::ZERO,
            pose_ns: 0,
            known: false,
            now_ns: 0,
            memory: [(0, Vector::ZERO); MEMORY],
            newest: 0,
        }
    }

    fn advance(&mut self, dt: f32, acceleration: Vector) {
        let a = acceleration - self.velocity * self.config.drag_per_s;
        self.place += self.velocity * dt + a * (0.5 * dt * dt);
        self.velocity = (self.velocity + a * dt).limited(3.0);
    }

    /// Advances to `now` under this horizontal acceleration by tilt (plan frame).
    pub fn predict(&mut self, now: u64, acceleration: Vector) {
        let dt = seconds(self.now_ns, now).min(0.1);
        self.now_ns = self.now_ns.max(now);
        if dt <= 0.0 {
            return;
        }
        let a = acceleration.known().unwrap_or(Vector::ZERO);
        self.newest = (self.newest + 1) % MEMORY;
        self.memory[self.newest] = (now, a);
        self.advance(dt, a);
        if self.age_s(now) > self.config.coast_s {
            self.velocity = self.velocity * (1.0 - FADE_PER_S * dt).max(0.0);
        }
    }

    /// Takes a pose that was true at `at_ns` (plan frame) and replays what happened since.
    pub fn correct(&mut self, at_ns: u64, place: Vector, velocity: Vector) {
        let (Some(place), Some(velocity)) = (place.known(), velocity.known()) else { return };
        self.place = place;
        self.velocity = velocity.limited(3.0);
        self.pose_ns = at_ns;
        self.known = true;
        let mut from = at_ns;
        for back in (0..MEMORY).rev() {
            let (until, a) = self.memory[(self.newest + MEMORY - back) % MEMORY];
            if until > from {
                self.advance(seconds(from, until).min(0.1), a);
                from = until;
            }
        }
    }

    /// Forgets the pose: a place that is no longer believed.
    pub fn forget(&mut self) {
        self.known = false;
    }

    /// Seconds since the time of the newest pose; infinite when there is none.
    #[must_use]
    pub fn age_s(&self, now: u64) -> f32 {
        if self.known { seconds(self.pose_ns, now) } else { f32::INFINITY }
    }

    /// Place now, plan frame; meaningless when the age is infinite.
    #[must_use]
    pub fn place(&self) -> Vector {
        self.place
    }

    /// Velocity now, plan frame.
    #[must_use]
    pub fn velocity(&self) -> Vector {
        self.velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_pose_is_brought_up_to_date() {
        let config = MotionConfig { drag_per_s: 0.0, ..Default::default() };
        let mut motion = Motion::new(config);
        let (mut v, mut x) = (0.0f32, 0.0f32);
        let mut history = vec![];
        for k in 1..=100u64 {
            let a = 1.0f32;
            x += v * 0.02 + 0.5 * a * 0.0004;
            v += a * 0.02;
            motion.predict(k * 20_000_000, Vector::new(a, 0.0));
            history.push((k * 20_000_000, x, v));
            if k % 3 == 0 && k > 4 {
                let (t, x, v) = history[k as usize - 5];
                motion.correct(t, Vector::new(x, 0.0), Vector::new(v, 0.0));
            }
        }
        assert!((motion.velocity().x - v).abs() < 1e-3, "{} {v}", motion.velocity().x);
        assert!((motion.place().x - x).abs() < 1e-3);
    }

    #[test]
    fn what_nothing_confirms_fades() {
        let mut motion = Motion::new(MotionConfig::default());
        motion.correct(0, Vector::ZERO, Vector::new(0.5, 0.0));
        for k in 1..=150u64 {
            motion.predict(k * 20_000_000, Vector::ZERO);
        }
        assert!(motion.velocity().norm() < 0.02);
        assert!((motion.age_s(3_000_000_000) - 3.0).abs() < 1e-3);
    }
}
