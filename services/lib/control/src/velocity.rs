//! Velocity to tilt.

use crate::GRAVITY_M_S2;
use crate::check::{RangeError, within};
use crate::planar::Vector;

/// Settings of the velocity loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct VelocityConfig {
    /// Acceleration for each m/s that the velocity will miss the reference by, 1/s. The loop is closed around what
    /// the velocity will be when a tilt asked for now begins to act: the delay costs no phase, a wrong delay does.
    pub gain_per_s: f32,
    /// Growth of the disturbance estimate for each m/s of error, 1/s2: what the localization's own estimate of the
    /// air leaves over, slowly.
    pub integral_per_s2: f32,
    /// Time in which the reference follows the wish, seconds.
    pub response_s: f32,
    /// Time in which its acceleration does, seconds: a wish that jumps shakes the body, and what shakes the body
    /// blurs the flow sensor and the attitude (FACTS 1).
    pub smoothing_s: f32,
    /// From asking for a tilt to its beginning, seconds: link, the controller's serial task, its loops.
    pub delay_s: f32,
    /// First-order lag of the tilt from there on, seconds.
    pub tilt_lag_s: f32,
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
}

impl Default for VelocityConfig {
    fn default() -> Self {
        Self {
            gain_per_s: 5.0,
            integral_per_s2: 0.5,
            response_s: 0.2,
            smoothing_s: 0.06,
            delay_s: 0.085,
            tilt_lag_s: 0.04,
            max_disturbance_m_s2: 0.8,
            max_tilt_deg: 10.0,
            max_tilt_rate_deg_s: 100.0,
            acceleration_m_s2: 0.8,
            braking_m_s2: 2.5,
        }
    }
}

impl VelocityConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("velocity.gain_per_s", self.gain_per_s, 0.3, 8.0)?;
        within("velocity.integral_per_s2", self.integral_per_s2, 0.0, 12.0)?;
        within("velocity.response_s", self.response_s, 0.05, 1.0)?;
        within("velocity.smoothing_s", self.smoothing_s, 0.02, 0.5)?;
        within("velocity.delay_s", self.delay_s, 0.0, 0.15)?;
        within("velocity.tilt_lag_s", self.tilt_lag_s, 0.01, 0.3)?;
        within("velocity.max_disturbance_m_s2", self.max_disturbance_m_s2, 0.0, 1.5)?;
        within("velocity.max_tilt_deg", self.max_tilt_deg, 3.0, 15.0)?;
        within("velocity.max_tilt_rate_deg_s", self.max_tilt_rate_deg_s, 10.0, 200.0)?;
        within("velocity.acceleration_m_s2", self.acceleration_m_s2, 0.2, 2.0)?;
        within("velocity.braking_m_s2", self.braking_m_s2, 0.3, 4.0)
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

/// Steps of asked tilts that are remembered: at 50 Hz 0.32 s, more than a delay and an old attitude together.
const ASKED: usize = 16;
/// An older attitude is taken for one of this age, seconds: the forecast stays short.
const OLDEST_TILT_S: f32 = 0.15;

/// What is known of the motion when a tilt is to be asked for.
#[derive(Clone, Copy, Debug)]
pub struct Flown {
    /// Plan frame; `None` when it is not known: the body is held level under what was learned.
    pub velocity: Option<Vector>,
    /// Trust in it, 0..=1, scales the gains: what is not known is not chased.
    pub trust: f32,
    /// Acceleration by moving air, plan frame, m/s2, as the localization believes it; zero when it does not.
    pub air: Vector,
    /// Tilt from level as it was read last.
    pub tilt: Tilt,
    /// How long ago that was, seconds.
    pub tilt_age_s: f32,
    /// Heading of the body, plan frame, radians.
    pub heading: f32,
    /// Most tilt that may be asked for (and never more than the configured limit), radians.
    pub most_tilt_rad: f32,
}

/// The controller: a smoothed reference, its acceleration fed forward, the air fed forward, and proportional and
/// integral on what the velocity will miss the reference by when the tilt acts (a Smith predictor: Smith 1957).
#[derive(Clone, Debug)]
pub struct VelocityController {
    config: VelocityConfig,
    drag_per_s: f32,
    reference: Vector,
    /// Acceleration of the reference.
    change: Vector,
    compensation: Vector,
    air: Vector,
    tilt: Tilt,
    /// Tilts asked for and for how long each stood, seconds.
    asked: [(f32, Tilt); ASKED],
    newest: usize,
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
            change: Vector::ZERO,
            compensation: Vector::ZERO,
            air: Vector::ZERO,
            tilt: Tilt::default(),
            asked: [(0.0, Tilt::default()); ASKED],
            newest: 0,
        }
    }

    /// The learned disturbance beside what the localization knows of the air, an acceleration in the plan frame.
    #[must_use]
    pub fn learned(&self) -> Vector {
        -self.compensation
    }

    /// All that is held against: the learned disturbance and the air.
    #[must_use]
    pub fn disturbance(&self) -> Vector {
        self.air - self.compensation
    }

    /// Sets the learned disturbance (from before a restart, or from the attitude on the ground).
    pub fn set_learned(&mut self, disturbance: Vector) {
        let most = self.config.max_disturbance_m_s2;
        self.compensation = -disturbance.known().unwrap_or(Vector::ZERO).limited(most);
    }

    /// The velocity asked for now: the wish, as fast as it may be approached.
    #[must_use]
    pub fn reference(&self) -> Vector {
        self.reference
    }

    /// The velocity that a tilt asked for now will find when it begins to act: what was asked for before is on its
    /// way.
    fn foreseen(&self, velocity: Vector, flown: &Flown, heading: f32) -> Vector {
        let age_s =
            if flown.tilt_age_s.is_finite() { flown.tilt_age_s.clamp(0.0, OLDEST_TILT_S) } else { 0.0 };
        let mut tilted = flown.tilt.acceleration(heading).known().unwrap_or(Vector::ZERO);
        // From the reading of the tilt until now the velocity was carried on by it: that part is done again.
        let mut velocity = velocity - tilted * age_s;
        let mut left = self.config.delay_s + age_s;
        let (mut back, mut reach) = (0, 0.0);
        while back < ASKED && reach < left {
            reach += self.asked[(self.newest + ASKED - back) % ASKED].0;
            back += 1;
        }
        let mut unused = (reach - left).max(0.0);
        for back in (0..back).rev() {
            let (stood, tilt) = self.asked[(self.newest + ASKED - back) % ASKED];
            let dt = (stood - unused).max(0.0).min(left);
            unused = (unused - stood).max(0.0);
            left -= dt;
            let asked = tilt.acceleration(heading);
            let next = asked + (tilted - asked) * (-dt / self.config.tilt_lag_s).exp();
            let air = self.air - self.compensation;
            velocity += ((tilted + next) * 0.5 + air - velocity * self.drag_per_s) * dt;
            tilted = next;
        }
        velocity
    }

    /// The tilt, from level, for the next step of `dt` seconds towards a wish in the plan frame.
    pub fn step(&mut self, dt: f32, wish: Vector, flown: &Flown) -> Tilt {
        let c = self.config;
        let most = flown.most_tilt_rad.min(c.max_tilt_deg.to_radians()).max(0.0);
        let trust = if flown.trust.is_finite() { flown.trust.clamp(0.2, 1.0) } else { 0.2 };
        let heading = if flown.heading.is_finite() { flown.heading } else { 0.0 };
        self.air = flown.air.known().unwrap_or(Vector::ZERO).limited(c.max_disturbance_m_s2);
        self.asked[self.newest].0 = dt;
        let wanted = match flown.velocity.and_then(Vector::known) {
            Some(velocity) => {
                self.follow(dt, wish.known().unwrap_or(Vector::ZERO), velocity);
                let error = self.reference - self.foreseen(velocity, flown, heading);
                let drag = self.reference * self.drag_per_s;
                let against = self.compensation - self.air;
                let wanted = error * (trust * c.gain_per_s) + self.change + drag + against;
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
                (self.reference, self.change) = (Vector::ZERO, Vector::ZERO);
                self.compensation - self.air
            }
        };
        let wanted = Tilt::of_acceleration(wanted, heading).limited(most);
        let from = Vector::new(self.tilt.roll, self.tilt.pitch);
        let to = Vector::new(wanted.roll, wanted.pitch);
        let next = from.approached(to, c.max_tilt_rate_deg_s.to_radians() * dt);
        self.tilt = Tilt { roll: next.x, pitch: next.y }.limited(most);
        self.newest = (self.newest + 1) % ASKED;
        self.asked[self.newest] = (0.0, self.tilt);
        self.tilt
    }

    /// Moves the reference towards the wish, smoothly. What slows the drone down may do so at once, also where the wish
    /// leads back from where it flies.
    fn follow(&mut self, dt: f32, wish: Vector, flown: Vector) {
        let c = &self.config;
        let brakes = wish.norm() < self.reference.norm() || (wish - self.reference).dot(flown) < 0.0;
        let most = if brakes { c.braking_m_s2 } else { c.acceleration_m_s2 };
        let change = ((wish - self.reference) * (1.0 / c.response_s)).limited(most);
        self.change += (change - self.change) * (dt / c.smoothing_s).min(1.0);
        self.reference += self.change * dt;
    }
}
