//! Place to velocity.

use crate::check::{RangeError, within};
use crate::planar::Vector;

/// Settings of the position loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HoldConfig {
    /// Speed for each metre of error, 1/s: under half of the velocity loop's bandwidth.
    pub gain_per_s: f32,
    /// Fastest correction, m/s.
    pub max_speed_m_s: f32,
}

impl Default for HoldConfig {
    fn default() -> Self {
        Self { gain_per_s: 1.0, max_speed_m_s: 0.35 }
    }
}

impl HoldConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("hold.gain_per_s", self.gain_per_s, 0.1, 1.5)?;
        within("hold.max_speed_m_s", self.max_speed_m_s, 0.05, 1.0)
    }
}

/// The velocity that brings the drone from `at` to `place`, both in the plan frame.
#[must_use]
pub fn hold_velocity(config: &HoldConfig, place: Vector, at: Vector) -> Vector {
    ((place - at) * config.gain_per_s).known().unwrap_or(Vector::ZERO).limited(config.max_speed_m_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_far_place_is_approached_at_the_limit_and_nowhere_not_at_all() {
        let config = HoldConfig::default();
        let v = hold_velocity(&config, Vector::new(10.0, 0.0), Vector::ZERO);
        assert!((v.x - 0.35).abs() < 1e-6 && v.y == 0.0);
        assert_eq!(hold_velocity(&config, Vector::new(f32::NAN, 0.0), Vector::ZERO), Vector::ZERO);
    }
}
