//! Knowing that the skids stand.

use crate::GRAVITY_M_S2;
use crate::check::{RangeError, within};

/// Settings of the touch-down detector.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TouchDownConfig {
    /// Thrust over weight under which a drone that does not sink must be standing on something.
    pub load: f32,
    /// For how long, seconds.
    pub standing_s: f32,
    /// Believed clearance above which nothing is a touch-down, metres.
    pub clearance_m: f32,
    /// Reading so close to the one at rest that a fall from there is softer than a landing, metres:
    /// sqrt(2 g h) = 0.63 m/s.
    pub skim_m: f32,
}

impl Default for TouchDownConfig {
    fn default() -> Self {
        Self { load: 0.75, standing_s: 0.2, clearance_m: 0.35, skim_m: 0.02 }
    }
}

impl TouchDownConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("touch_down.load", self.load, 0.4, 0.9)?;
        within("touch_down.standing_s", self.standing_s, 0.1, 1.0)?;
        within("touch_down.clearance_m", self.clearance_m, 0.1, 0.6)?;
        within("touch_down.skim_m", self.skim_m, 0.005, 0.024)
    }
}

/// Blind, thrust over weight under which what carries is the floor: a hover throttle that is wrong by a quarter, as after a
/// hurried take-off, looks like a floor down to 0.64.
const BLIND_LOAD: f32 = 0.6;

/// Watches a descent for its end.
#[derive(Clone, Debug, Default)]
pub struct TouchDown {
    standing_s: f32,
    skimming_s: f32,
    first_clearance: f32,
    felt_s: f32,
}

impl TouchDown {
    /// One step of a descent without echoes; true when the skids stand. `unexplained_m_s2`: felt beyond what the thrust
    /// explains. In the air nothing carries what the thrust lacks; a floor does, and the less thrust the more.
    pub fn step_blind(
        &mut self,
        config: &TouchDownConfig,
        dt: f32,
        unexplained_m_s2: f32,
        load: f32,
    ) -> bool {
        let carried = load < BLIND_LOAD && unexplained_m_s2 > 0.5 * GRAVITY_M_S2 * (1.0 - load);
        self.felt_s = if carried { self.felt_s + dt } else { 0.0 };
        self.felt_s >= config.standing_s
    }

    /// One step of `dt` seconds of a commanded descent; true when the skids stand.
    ///
    /// `clearance_m` and `climb_m_s` by the estimator, `load` the commanded thrust over the weight. Under
    /// three quarters of its weight in thrust a drone in the air sinks at 2.5 m/s2: 5 cm in the 0.2 s that it
    /// is watched. One that does not is standing, whatever a soft floor makes the sonar say.
    pub fn step(
        &mut self,
        config: &TouchDownConfig,
        dt: f32,
        clearance_m: f32,
        climb_m_s: f32,
        load: f32,
    ) -> bool {
        if clearance_m.is_nan() || clearance_m > config.clearance_m {
            *self = Self::default();
            return false;
        }
        if load < config.load && climb_m_s > -0.25 {
            if self.standing_s == 0.0 {
                self.first_clearance = clearance_m;
            }
            self.standing_s += dt;
            if self.first_clearance - clearance_m > 0.04 {
                self.standing_s = 0.0;
            }
        } else {
            self.standing_s = 0.0;
        }
        self.skimming_s =
            if clearance_m < config.skim_m && climb_m_s.abs() < 0.15 { self.skimming_s + dt } else { 0.0 };
        self.standing_s >= config.standing_s || self.skimming_s >= 2.0 * config.standing_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sinking_is_not_standing() {
        let config = TouchDownConfig::default();
        let mut touch = TouchDown::default();
        let mut clearance = 0.30;
        while clearance > 0.05 {
            assert!(!touch.step(&config, 0.02, clearance, -0.3, 0.7), "at {clearance}");
            clearance -= 0.006;
        }
        // Standing: the throttle winds down and nothing moves, though a soft floor reads 6 cm long.
        assert!((0..20).any(|_| touch.step(&config, 0.02, 0.06, -0.02, 0.7)));
    }

    #[test]
    fn without_echoes_what_carries_is_the_floor() {
        let config = TouchDownConfig::default();
        let mut touch = TouchDown::default();
        // Falling with a third of the thrust gone, or in a gust: nothing carries. And what a wrong hover throttle seems to carry.
        assert!((0..500).all(|_| !touch.step_blind(&config, 0.02, -3.0, 0.55)));
        assert!((0..500).all(|_| !touch.step_blind(&config, 0.02, 1.5, 0.55)));
        assert!((0..500).all(|_| !touch.step_blind(&config, 0.02, 3.0, 0.7)));
        let stood = (0..500).position(|_| touch.step_blind(&config, 0.02, 2.5, 0.55));
        assert!(stood.is_some_and(|steps| (8..=12).contains(&steps)), "{stood:?}");
    }

    #[test]
    fn a_hover_is_not_standing_and_height_forbids_it() {
        let config = TouchDownConfig::default();
        let mut touch = TouchDown::default();
        assert!((0..500).all(|_| !touch.step(&config, 0.02, 0.1, 0.0, 0.97)));
        assert!((0..500).all(|_| !touch.step(&config, 0.02, 0.6, 0.0, 0.3)));
        assert!((0..500).all(|_| !touch.step(&config, 0.02, f32::NAN, 0.0, 0.3)));
    }
}
