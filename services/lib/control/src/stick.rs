//! Angles and turn rates to radio channels and back.
//!
//! The law is the one measured on Betaflight 4.5 to 2026.12 in ANGLE mode at default rates (FACTS 1):
//! angle = 60 degrees (70 x + 600 x |x|) / 670 with x = (channel - 1500) / 500. The yaw stick asks for the
//! rate (70 x + 600 x |x|) degrees a second by the same curve (+200 us: 124, measured 135 degrees in 1.2 s
//! with its spin-up). A yaw stick to the right turns clockwise; our yaw is counter-clockwise.

use core::f32::consts::FRAC_PI_3;

/// Stick at rest.
pub const CENTRE_US: f32 = 1500.0;
/// Least value that ever leaves this program.
pub const LEAST_US: u16 = 1000;
/// Greatest value that ever leaves this program.
pub const MOST_US: u16 = 2000;

const LINEAR: f32 = 70.0;
const QUADRATIC: f32 = 600.0;
const FULL: f32 = LINEAR + QUADRATIC;
/// Angle at full stick: `angle_limit` is 60 by default.
const FULL_ANGLE_RAD: f32 = FRAC_PI_3;
const FULL_YAW_RATE_RAD_S: f32 = FULL * core::f32::consts::PI / 180.0;

/// -1..1 of the stick to -1..1 of its effect.
fn curve(x: f32) -> f32 {
    (LINEAR * x + QUADRATIC * x * x.abs()) / FULL
}

/// The inverse of [`curve`].
fn uncurve(y: f32) -> f32 {
    let y = y.clamp(-1.0, 1.0);
    let x = ((LINEAR * LINEAR + 4.0 * QUADRATIC * FULL * y.abs()).sqrt() - LINEAR) / (2.0 * QUADRATIC);
    x.copysign(y)
}

/// The tilt that a roll or pitch channel asks for, radians.
#[must_use]
pub fn angle_of(channel_us: f32) -> f32 {
    FULL_ANGLE_RAD * curve(((channel_us - CENTRE_US) / 500.0).clamp(-1.0, 1.0))
}

/// The roll or pitch channel that asks for a tilt, microseconds, unrounded; the centre for what is no number.
#[must_use]
pub fn of_angle(angle_rad: f32) -> f32 {
    if angle_rad.is_finite() { CENTRE_US + 500.0 * uncurve(angle_rad / FULL_ANGLE_RAD) } else { CENTRE_US }
}

/// The turn rate that a yaw channel asks for, radians a second counter-clockwise.
#[must_use]
pub fn yaw_rate_of(channel_us: f32) -> f32 {
    -FULL_YAW_RATE_RAD_S * curve(((channel_us - CENTRE_US) / 500.0).clamp(-1.0, 1.0))
}

/// The yaw channel that asks for a turn rate counter-clockwise, microseconds, unrounded.
#[must_use]
pub fn of_yaw_rate(rate_rad_s: f32) -> f32 {
    if rate_rad_s.is_finite() {
        CENTRE_US - 500.0 * uncurve(rate_rad_s / FULL_YAW_RATE_RAD_S)
    } else {
        CENTRE_US
    }
}

/// A channel as it is sent: rounded, 1000..=2000, `absent` for what is no number.
#[must_use]
pub fn channel(us: f32, absent: u16) -> u16 {
    let us = if us.is_finite() { us } else { f32::from(absent) };
    us.round().clamp(f32::from(LEAST_US), f32::from(MOST_US)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_measured_points_of_the_law() {
        for (us, degrees) in [(1600.0, 3.4), (1700.0, 11.1), (1800.0, 23.1), (1400.0, -3.4)] {
            assert!((angle_of(us).to_degrees() - degrees).abs() < 0.06, "{us} {}", angle_of(us).to_degrees());
        }
        // 124 degrees a second clockwise; 1.2 s with 0.1 s of spin-up are the 135 degrees of FACTS 1.
        assert!((yaw_rate_of(1700.0).to_degrees() + 124.0).abs() < 0.5);
    }

    proptest! {
        #[test]
        fn the_inverse_is_one(angle in -1.0f32..1.0, rate in -8.0f32..8.0) {
            prop_assert!((angle_of(of_angle(angle)) - angle).abs() < 1e-4);
            prop_assert!((yaw_rate_of(of_yaw_rate(rate)) - rate).abs() < 1e-3);
        }

        #[test]
        fn a_channel_is_always_legal(bits in any::<u32>()) {
            let us = f32::from_bits(bits);
            for sent in [channel(us, 1000), channel(of_angle(us), 1500), channel(of_yaw_rate(us), 1500)] {
                prop_assert!((1000..=2000).contains(&sent));
            }
        }
    }
}
