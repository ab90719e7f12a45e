//! Height to throttle.

use crate::GRAVITY_M_S2;
use crate::check::{RangeError, within};
use crate::height::HeightEstimator;

/// Settings of the height loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClimbConfig {
    /// Climb rate for each metre of error, 1/s: under half of `rate_gain_per_s`.
    pub height_gain_per_s: f32,
    /// Acceleration for each m/s of error, 1/s. Motors (0.06 s), link (0.04 s) and the observer leave about
    /// 50 degrees of phase at 3, and 30 when the thrust answers 1.5 times as strongly as modelled.
    pub rate_gain_per_s: f32,
    /// Most climb, m/s.
    pub max_climb_m_s: f32,
    /// Most descent, m/s.
    pub max_descent_m_s: f32,
    /// Most commanded acceleration downwards, m/s2; upwards three times this, to end a fall in time.
    pub max_acceleration_m_s2: f32,
    /// Least and most throttle in the air, as multiples of the learned collective.
    pub collective_range: [f32; 2],
    /// Lag of the motors with their link, seconds: for the model of what the commanded throttle does.
    pub motor_lag_s: f32,
    /// Share of an unexplained acceleration that the hover throttle takes over each second.
    pub learning_per_s: f32,
}

impl Default for ClimbConfig {
    fn default() -> Self {
        Self {
            height_gain_per_s: 1.2,
            rate_gain_per_s: 3.0,
            max_climb_m_s: 0.5,
            max_descent_m_s: 0.4,
            max_acceleration_m_s2: 2.0,
            collective_range: [0.55, 1.5],
            motor_lag_s: 0.09,
            learning_per_s: 0.4,
        }
    }
}

impl ClimbConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("climb.height_gain_per_s", self.height_gain_per_s, 0.2, 3.0)?;
        within("climb.rate_gain_per_s", self.rate_gain_per_s, 0.5, 5.0)?;
        within("climb.max_climb_m_s", self.max_climb_m_s, 0.1, 1.5)?;
        within("climb.max_descent_m_s", self.max_descent_m_s, 0.1, 0.6)?;
        within("climb.max_acceleration_m_s2", self.max_acceleration_m_s2, 0.5, 4.0)?;
        within("climb.collective_range.0", self.collective_range[0], 0.2, 0.9)?;
        within("climb.collective_range.1", self.collective_range[1], 1.1, 2.5)?;
        within("climb.motor_lag_s", self.motor_lag_s, 0.01, 0.3)?;
        within("climb.learning_per_s", self.learning_per_s, 0.0, 2.0)
    }
}

/// What is wanted of the vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum VerticalWish {
    /// Be at this height above the floor, metres.
    Height(f32),
    /// Climb (descend when negative) at this rate, m/s.
    Rate(f32),
}

/// Throttle that carries nothing: the idle of the controller.
pub(crate) const IDLE_US: f32 = 1000.0;
/// Drag along the rotor axis, 1/s: small craft lose about a tenth of their climb rate a second.
const DRAG_PER_S: f32 = 0.1;
/// An unexplained acceleration beyond this is thrust that is missing (a cell, a propeller) or back again, m/s2: gusts, a
/// wrong level, vibration and an accelerometer that reads 3 % off stay below a sixth of the weight together.
const SUDDEN_M_S2: f32 = 1.5;
/// Time over which the hover throttle takes over what is beyond, seconds: as the accelerometer's own average. Slower, a
/// drone that lost 44 % of its thrust is on the floor before the throttle has risen by the third that it needs.
const SUDDEN_S: f32 = 0.1;
/// Bounds of a hover throttle that is believed. An aircraft outside would climb like a rocket or hardly fly.
const HOVER_RANGE_US: [f32; 2] = [1120.0, 1800.0];

/// The controller, with the hover throttle that it learns.
#[derive(Clone, Debug)]
pub struct ClimbController {
    config: ClimbConfig,
    hover_us: f32,
    throttle_us: f32,
    lagged_us: f32,
}

impl ClimbController {
    /// With a first guess of the hover throttle, microseconds.
    #[must_use]
    pub fn new(config: ClimbConfig, hover_us: f32) -> Self {
        let mut controller = Self { config, hover_us: 1450.0, throttle_us: IDLE_US, lagged_us: IDLE_US };
        controller.set_hover(hover_us);
        controller
    }

    /// Sets the hover throttle, within its bounds; what is no number is not taken.
    pub fn set_hover(&mut self, hover_us: f32) {
        if hover_us.is_finite() {
            self.hover_us = hover_us.clamp(HOVER_RANGE_US[0], HOVER_RANGE_US[1]);
        }
    }

    /// Starts from motors that already turn at this throttle (lift-off, restart in the air).
    pub fn set_throttle(&mut self, throttle_us: f32) {
        self.throttle_us = throttle_us;
        self.lagged_us = throttle_us;
    }

    /// The learned hover throttle, microseconds.
    #[must_use]
    pub fn hover_us(&self) -> f32 {
        self.hover_us
    }

    /// Throttle, microseconds, at which a drone hovers that accelerates by `bias_m_s2` at the learned one.
    #[must_use]
    pub fn balancing_us(&self, bias_m_s2: f32) -> f32 {
        let load = (1.0 - bias_m_s2 / GRAVITY_M_S2).clamp(0.5, 1.5);
        let us = IDLE_US + (self.hover_us - IDLE_US) * load.sqrt();
        if us.is_finite() { us.clamp(HOVER_RANGE_US[0], HOVER_RANGE_US[1]) } else { self.hover_us }
    }

    /// The throttle commanded last, microseconds.
    #[must_use]
    pub fn throttle_us(&self) -> f32 {
        self.throttle_us
    }

    /// The thrust commanded last over the weight: 1 in a hover.
    #[must_use]
    pub fn load(&self) -> f32 {
        square((self.throttle_us - IDLE_US) / (self.hover_us - IDLE_US))
    }

    /// The vertical acceleration that the throttle of the last steps should give, m/s2: thrust goes with the
    /// square of the throttle above idle and tilts with the body.
    pub fn expected_acceleration(&mut self, dt: f32, tilt_rad: f32, climb_m_s: f32) -> f32 {
        self.lagged_us += (self.throttle_us - self.lagged_us) * (dt / (self.config.motor_lag_s + dt));
        let load = square((self.lagged_us - IDLE_US) / (self.hover_us - IDLE_US));
        GRAVITY_M_S2 * (load * tilt_rad.clamp(-1.0, 1.0).cos() - 1.0) - DRAG_PER_S * climb_m_s
    }

    /// The throttle for the next step, microseconds. Learns the hover throttle when `learn`.
    pub fn step(
        &mut self,
        dt: f32,
        wish: VerticalWish,
        estimate: &mut HeightEstimator,
        tilt_rad: f32,
        learn: bool,
    ) -> f32 {
        let c = self.config;
        let climb = match wish {
            VerticalWish::Height(height) => c.height_gain_per_s * (height - estimate.height_m()),
            VerticalWish::Rate(rate) => rate,
        };
        let climb = if climb.is_finite() { climb.clamp(-c.max_descent_m_s, c.max_climb_m_s) } else { 0.0 };
        let wanted = (c.rate_gain_per_s * (climb - estimate.climb_m_s()))
            .clamp(-c.max_acceleration_m_s2, 3.0 * c.max_acceleration_m_s2);
        let load = (1.0 + (wanted - estimate.bias_m_s2()) / GRAVITY_M_S2) / tilt_rad.clamp(-0.6, 0.6).cos();
        let low = c.collective_range[0];
        let multiple = load.max(low * low).sqrt();
        let collective = multiple.clamp(low, c.collective_range[1]);
        let free = (low + 0.02..c.collective_range[1] - 0.02).contains(&multiple);
        self.throttle_us = IDLE_US + (self.hover_us - IDLE_US) * collective;
        if learn {
            self.take_over_sudden(dt, estimate);
        }
        if learn && free {
            let taken = estimate.take_bias(c.learning_per_s * dt);
            // An unexplained lift means that less throttle hovers: d(load) = -2 d(collective) / collective.
            self.set_hover(
                IDLE_US + (self.hover_us - IDLE_US) * (1.0 - 0.5 * taken / GRAVITY_M_S2).clamp(0.98, 1.02),
            );
        }
        self.throttle_us
    }

    /// Thrust that is missing is so at any throttle: the hover throttle takes it over at once. At the ends of the range as
    /// well, for it is measured and no sum of errors; and beyond them, for the range goes with the hover throttle.
    fn take_over_sudden(&mut self, dt: f32, estimate: &mut HeightEstimator) {
        let bias = estimate.bias_m_s2();
        let beyond = bias - bias.clamp(-SUDDEN_M_S2, SUDDEN_M_S2);
        if beyond == 0.0 {
            return;
        }
        let taken = estimate.take_bias(beyond / bias * (dt / SUDDEN_S).min(1.0));
        // What is missing grows with the load that is commanded: d(load) = -2 load d(collective) / collective.
        let load = square((self.lagged_us - IDLE_US) / (self.hover_us - IDLE_US)).max(0.5);
        let factor = (1.0 - 0.5 * taken / (GRAVITY_M_S2 * load)).clamp(0.95, 1.05);
        self.set_hover(IDLE_US + (self.hover_us - IDLE_US) * factor);
    }

    /// Commands a throttle from outside (spool-up, touch-down).
    pub fn override_throttle(&mut self, throttle_us: f32) {
        self.throttle_us = throttle_us;
    }
}

fn square(x: f32) -> f32 {
    let x = x.max(0.0);
    x * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::HeightConfig;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_throttle_stays_within_its_range(
            wish in any::<f32>(), height in -1.0f32..3.0, climb in -3.0f32..3.0, tilt in -1.5f32..1.5,
            hover in any::<f32>(), steps in 1usize..50,
        ) {
            let mut estimate = HeightEstimator::new(HeightConfig::default(), 0.05);
            estimate.set(0, height, climb, 0.0);
            let mut controller = ClimbController::new(ClimbConfig::default(), hover);
            for _ in 0..steps {
                let us = controller.step(0.02, VerticalWish::Height(wish), &mut estimate, tilt, true);
                let collective = (us - 1000.0) / (controller.hover_us() - 1000.0);
                prop_assert!((0.5..=1.6).contains(&collective), "{us}");
                prop_assert!((1120.0..=1800.0).contains(&controller.hover_us()));
            }
        }
    }

    #[test]
    fn a_tilted_body_gets_more_throttle() {
        let mut estimate = HeightEstimator::new(HeightConfig::default(), 0.05);
        estimate.set(0, 1.0, 0.0, 0.0);
        let mut controller = ClimbController::new(ClimbConfig::default(), 1500.0);
        let level = controller.step(0.02, VerticalWish::Height(1.0), &mut estimate, 0.0, false);
        let tilted = controller.step(0.02, VerticalWish::Height(1.0), &mut estimate, 0.26, false);
        assert!((level - 1500.0).abs() < 0.1);
        assert!((tilted - level - 500.0 * (1.0 / 0.26f32.cos().sqrt() - 1.0)).abs() < 0.1);
    }
}
