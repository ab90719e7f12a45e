//! Heading to turn rate.

use crate::check::{RangeError, within};
use crate::planar::wrap_angle;

/// Settings of the heading loop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct HeadingConfig {
    /// Turn rate for each radian of error, 1/s. The yaw loop of the controller answers in about 0.1 s and the
    /// attitude comes at 30 Hz: 1.5 leaves more than 60 degrees of phase.
    pub gain_per_s: f32,
    /// Most turn rate, degrees a second. 45 turns no sonar by more than 11 degrees in a sweep of 0.24 s.
    pub max_rate_deg_s: f32,
}

impl Default for HeadingConfig {
    fn default() -> Self {
        Self { gain_per_s: 2.5, max_rate_deg_s: 45.0 }
    }
}

impl HeadingConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("heading.gain_per_s", self.gain_per_s, 0.1, 4.0)?;
        within("heading.max_rate_deg_s", self.max_rate_deg_s, 5.0, 120.0)
    }
}

/// The turn rate, radians a second counter-clockwise, that brings `heading` to `wanted` the short way round;
/// none when either is no number.
#[must_use]
pub fn yaw_rate(config: &HeadingConfig, wanted_rad: f32, heading_rad: f32) -> f32 {
    let error = wrap_angle(wanted_rad - heading_rad);
    if !error.is_finite() {
        return 0.0;
    }
    let most = config.max_rate_deg_s.to_radians();
    (config.gain_per_s * error).clamp(-most, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_the_short_way_and_no_faster_than_allowed() {
        let config = HeadingConfig::default();
        assert!(yaw_rate(&config, 3.0, -3.0) < 0.0, "through pi, clockwise");
        assert!((yaw_rate(&config, 2.0, 0.0) - 45f32.to_radians()).abs() < 1e-5);
        assert_eq!(yaw_rate(&config, f32::NAN, 0.0), 0.0);
    }

    #[test]
    fn settles_with_a_lagging_yaw_loop() {
        // Yaw loop: 0.1 s first order behind 60 ms of delay, the heading seen at 30 Hz.
        let config = HeadingConfig::default();
        let (mut heading, mut rate, mut seen) = (0.0f32, 0.0f32, 0.0f32);
        let mut pipe = std::collections::VecDeque::from(vec![0.0; 6]);
        let mut most = 0.0f32;
        for step in 0..800 {
            if step % 3 == 0 {
                seen = heading;
            }
            pipe.push_back(yaw_rate(&config, 1.5, seen));
            rate += (pipe.pop_front().unwrap_or(0.0) - rate) * 0.1;
            heading += rate * 0.01;
            most = most.max(heading);
        }
        assert!((heading - 1.5).abs() < 0.01, "{heading}");
        assert!(most < 1.55, "overshoot to {most}");
    }
}
