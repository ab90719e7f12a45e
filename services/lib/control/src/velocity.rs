//! Velocity to tilt.

use crate::GRAVITY_M_S2;
use crate::check::{RangeError, within};
use crate::planar::Vector;

/// Settings of the velocity loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VelocityConfig {
    /// Acceleration for each m/s of error, 1/s. The tilt answers in 0.15 s behind about 0.1 s of link and
    /// localization; less gain lets gusts of 0.3 m/s2, which blow near walls, make it miss the wished velocity by
    /// 0.2 m/s.
    pub gain_per_s: f32,
    /// Growth of the disturbance estimate for each m/s of error, 1/s2. The integral of the velocity error is
    /// the way that a gust has carried the body off: it is flown back.
    pub integral_per_s2: f32,
    /// Time in which the velocity follows the reference when nothing disturbs, seconds: the error is taken
    /// against what could have been reached, so that the integral learns no lag.
    pub response_s: f32,
    /// Most disturbance that is believed, m/s2: 5 degrees of level error or a strong draught.
    pub max_disturbance_m_s2: f32,
    /// Most tilt from level, degrees: FACTS 1 asks to stay under about 10, where the controller's attitude
    /// still is the truth.
    pub max_tilt_deg: f32,
    /// Most change of the commanded tilt, degrees a second.
    pub max_tilt_rate_deg_s: f32,
    /// Growth of the wished speed, m/s2.
    pub acceleration_m_s2: f32,
    /// Fall of the wished speed, m/s2: more than 10 degrees of tilt give: nothing holds it back.
    pub braking_m_s2: f32,
    /// Share of the change of the wished speed that goes straight to the tilt.
    pub feed_forward: f32,
}

impl Default for VelocityConfig {
    fn default() -> Self {
        Self {
            gain_per_s: 4.0,
            integral_per_s2: 1.5,
            response_s: 0.2,
            max_disturbance_m_s2: 0.8,
            max_tilt_deg: 10.0,
            max_tilt_rate_deg_s: 100.0,
            acceleration_m_s2: 0.8,
            braking_m_s2: 2.5,
            feed_forward: 1.0,
        }
    }
}

impl VelocityConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("velocity.gain_per_s", self.gain_per_s, 0.3, 8.0)?;
        within("velocity.integral_per_s2", self.integral_per_s2, 0.0, 12.0)?;
        within("velocity.response_s", self.response_s, 0.02, 0.5)?;
        within("velocity.max_disturbance_m_s2", self.max_disturbance_m_s2, 0.0, 1.5)?;
        within("velocity.max_tilt_deg", self.max_tilt_deg, 3.0, 15.0)?;
        within("velocity.max_tilt_rate_deg_s", self.max_tilt_rate_deg_s, 10.0, 200.0)?;
        within("velocity.acceleration_m_s2", self.acceleration_m_s2, 0.2, 2.0)?;
        within("velocity.braking_m_s2", self.braking_m_s2, 0.3, 4.0)?;
        within("velocity.feed_forward", self.feed_forward, 0.0, 1.0)
    }
}

/// A tilt from level, radians: roll right side down, pitch nose down positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tilt {
    /// Right side down.
    pub roll: f32,
    /// Nose down.
    pub pitch: f32,
}

impl Tilt {
    /// The horizontal acceleration, plan frame, that this tilt gives a body of this heading.
    #[must_use]
    pub fn acceleration(self, heading: f32) -> Vector {
        let (roll, pitch) = (self.roll.clamp(-1.2, 1.2), self.pitch.clamp(-1.2, 1.2));
        Vector::new(GRAVITY_M_S2 * pitch.tan(), -GRAVITY_M_S2 * roll.tan()).rotated(heading)
    }

    /// The tilt that gives a horizontal acceleration (plan frame) to a body of this heading.
    #[must_use]
    pub fn of_acceleration(acceleration: Vector, heading: f32) -> Self {
        let body = acceleration.rotated(-heading);
        Self { roll: -(body.y / GRAVITY_M_S2).atan(), pitch: (body.x / GRAVITY_M_S2).atan() }
    }

    /// Angle from the vertical for tilts this small.
    #[must_use]
    pub fn magnitude(self) -> f32 {
        self.roll.hypot(self.pitch)
    }

    fn limited(self, most: f32) -> Self {
        let v = Vector::new(self.roll, self.pitch).limited(most);
        Self { roll: v.x, pitch: v.y }
    }
}

/// Trust in the velocity below which no disturbance is learned.
const LEAST_TRUST: f32 = 0.4;

/// The controller: proportional and integral on what the velocity misses of a reference model, feed-forward
/// of the wished change.
#[derive(Clone, Debug)]
pub struct VelocityController {
    config: VelocityConfig,
    drag_per_s: f32,
    reference: Vector,
    /// The reference as the body can follow it.
    expected: Vector,
    compensation: Vector,
    tilt: Tilt,
}

impl VelocityController {
    /// At rest, with nothing learned. `drag_per_s` is paid for by the wished velocity: what the disturbance
    /// estimate learned of it in flight would push on when braking.
    #[must_use]
    pub fn new(config: VelocityConfig, drag_per_s: f32) -> Self {
        Self {
            config,
            drag_per_s,
            reference: Vector::ZERO,
            expected: Vector::ZERO,
            compensation: Vector::ZERO,
            tilt: Tilt::default(),
        }
    }

    /// The learned disturbance, an acceleration in the plan frame.
    #[must_use]
    pub fn disturbance(&self) -> Vector {
        -self.compensation
    }

    /// Sets the learned disturbance (from before a restart, or from the attitude on the ground).
    pub fn set_disturbance(&mut self, disturbance: Vector) {
        let most = self.config.max_disturbance_m_s2;
        self.compensation = -disturbance.known().unwrap_or(Vector::ZERO).limited(most);
    }

    /// The velocity asked for now: the wish, as fast as it may be approached.
    #[must_use]
    pub fn reference(&self) -> Vector {
        self.reference
    }

    /// Starts from a velocity that is flown already, so that nothing jumps.
    pub fn set_reference(&mut self, velocity: Vector) {
        self.reference = velocity.known().unwrap_or(Vector::ZERO);
        self.expected = self.reference;
    }

    /// The tilt, from level, for the next step: `wish` and `velocity` in the plan frame, `heading` of the
    /// body, at most `most_tilt_rad` (and never more than the configured limit). `trust` (0..=1) in the velocity
    /// scales the gains: what is not known is not chased. Without a velocity the body is held level under the
    /// learned disturbance.
    pub fn step(
        &mut self,
        dt: f32,
        wish: Vector,
        velocity: Option<Vector>,
        trust: f32,
        heading: f32,
        most_tilt_rad: f32,
    ) -> Tilt {
        let c = &self.config;
        let most = most_tilt_rad.min(c.max_tilt_deg.to_radians()).max(0.0);
        let trust = if trust.is_finite() { trust.clamp(0.2, 1.0) } else { 0.2 };
        let heading = if heading.is_finite() { heading } else { 0.0 };
        let wanted = match velocity.and_then(Vector::known) {
            Some(velocity) => {
                let wish = wish.known().unwrap_or(Vector::ZERO);
                let before = self.reference;
                let rate = if wish.norm() < before.norm() { c.braking_m_s2 } else { c.acceleration_m_s2 };
                self.reference = before.approached(wish, rate * dt);
                let change = (self.reference - before) * (c.feed_forward / dt.max(1e-3));
                self.expected += (self.reference - self.expected) * (dt / c.response_s).min(1.0);
                let error = self.expected - velocity;
                let drag = self.reference * self.drag_per_s;
                let wanted = error * (trust * c.gain_per_s) + change + drag + self.compensation;
                let saturated = wanted.norm() > GRAVITY_M_S2 * most.tan();
                if !saturated || error.dot(self.compensation) < 0.0 {
                    // A velocity that is only reckoned on teaches nothing: it follows what was learned.
                    let learn = if trust < LEAST_TRUST { 0.0 } else { trust };
                    let grown = self.compensation + error * (learn * c.integral_per_s2 * dt);
                    self.compensation = grown.limited(c.max_disturbance_m_s2);
                }
                wanted
            }
            None => {
                (self.reference, self.expected) = (Vector::ZERO, Vector::ZERO);
                self.compensation
            }
        };
        let wanted = Tilt::of_acceleration(wanted, heading).limited(most);
        let from = Vector::new(self.tilt.roll, self.tilt.pitch);
        let to = Vector::new(wanted.roll, wanted.pitch);
        let next = from.approached(to, c.max_tilt_rate_deg_s.to_radians() * dt);
        self.tilt = Tilt { roll: next.x, pitch: next.y }.limited(most);
        self.tilt
    }
}
