//! Single-precision functions without branches or calls, so that loops over columns vectorise.

use core::f32::consts::{FRAC_2_PI, TAU};

/// 1.5 · 2²³: adding it rounds an `f32` below 2²² in size to the nearest integer, which is then found in
/// the low bits of the sum.
const ROUND: f32 = 12_582_912.0;
/// π/2 in two parts (Cody and Waite), so that the reduced angle keeps its digits.
const HALF_PI_HIGH: f32 = 1.570_796_4;
const HALF_PI_LOW: f32 = -4.371_139e-8;

/// The same angle in -π..=π. Exact to 1e-6 rad for a few thousand turns; NaN stays NaN.
#[inline]
#[must_use]
pub fn wrap_angle(angle: f32) -> f32 {
    let turns = (angle * (1.0 / TAU) + ROUND) - ROUND;
    angle - turns * TAU
}

/// Accumulators side by side: a sum that waits for nothing.
pub(crate) const LANES: usize = 8;

/// The sum, taken in eight parts.
#[inline]
pub(crate) fn sum(values: &[f32]) -> f32 {
    let (whole, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for chunk in whole {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value;
        }
    }
    lanes.iter().sum::<f32>() + rest.iter().sum::<f32>()
}

/// Sine and cosine, absolute error below 1e-6 for angles up to a thousand turns.
#[inline]
pub(crate) fn sin_cos(angle: f32) -> (f32, f32) {
    let shifted = angle * FRAC_2_PI + ROUND;
    let quadrant = shifted.to_bits();
    let turns = shifted - ROUND;
    let r = (angle - turns * HALF_PI_HIGH) - turns * HALF_PI_LOW;
    let r2 = r * r;
    // Taylor coefficients: on |r| <= π/4 the first dropped terms are below 4e-7.
    let sin = r * (1.0 + r2 * (-1.0 / 6.0 + r2 * (1.0 / 120.0 - r2 * (1.0 / 5040.0))));
    let cos = 1.0 + r2 * (-0.5 + r2 * (1.0 / 24.0 + r2 * (-1.0 / 720.0 + r2 * (1.0 / 40_320.0))));
    let odd = quadrant & 1;
    let (s, c) = if odd == 1 { (cos, sin) } else { (sin, cos) };
    let sin_sign = (quadrant & 2) << 30;
    let cos_sign = (quadrant.wrapping_add(1) & 2) << 30;
    (f32::from_bits(s.to_bits() ^ sin_sign), f32::from_bits(c.to_bits() ^ cos_sign))
}

/// e^-x for `x` in 0..=80 (clamped), relative error below 1e-4: weights need no more.
#[inline]
pub(crate) fn exp_minus(x: f32) -> f32 {
    let t = -x.clamp(0.0, 80.0) * core::f32::consts::LOG2_E;
    let shifted = t + ROUND;
    let f = (t - (shifted - ROUND)) * core::f32::consts::LN_2;
    let power = f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3f80_0000));
    power * (1.0 + f * (1.0 + f * (0.5 + f * (1.0 / 6.0 + f * (1.0 / 24.0)))))
}

/// x^exponent for `x` in 1e-37..=1 and an exponent in 0..=1, relative error below 1e-3.
#[inline]
pub(crate) fn power(x: f32, exponent: f32) -> f32 {
    let bits = x.to_bits();
    let whole = (bits >> 23).cast_signed() - 127;
    let mantissa = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000);
    // ln m = 2 artanh((m - 1) / (m + 1)), with an argument of at most 1/3.
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let s2 = s * s;
    let ln = 2.0 * s * (1.0 + s2 * (1.0 / 3.0 + s2 * (1.0 / 5.0 + s2 * (1.0 / 7.0))));
    exp_minus(-exponent * (whole as f32 * core::f32::consts::LN_2 + ln))
}

/// Tangent of a tilt: good to 1e-3 below 0.5 rad, and clamped at 0.6 rad, beyond which the motion model
/// has nothing to say anyway.
#[inline]
pub(crate) fn tan_tilt(angle: f32) -> f32 {
    let a = angle.clamp(-0.6, 0.6);
    let a2 = a * a;
    a * (1.0 + a2 * (1.0 / 3.0 + a2 * (2.0 / 15.0)))
}

#[cfg(test)]
mod tests {
    use super::{exp_minus, power, sin_cos, tan_tilt, wrap_angle};

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        for i in -20_000..20_000 {
            let a = i as f32 * 0.001_7;
            let (s, c) = sin_cos(a);
            let (es, ec) = f64::from(a).sin_cos();
            assert!((f64::from(s) - es).abs() < 2e-6 && (f64::from(c) - ec).abs() < 2e-6, "{a}: {s} {c}");
        }
    }

    #[test]
    fn the_exponential_agrees_with_the_library() {
        for i in 0..8_000 {
            let x = i as f32 * 0.01;
            let e = (-f64::from(x)).exp();
            assert!((f64::from(exp_minus(x)) / e - 1.0).abs() < 1e-4, "{x}");
        }
        assert!(exp_minus(f32::INFINITY) < 1e-34);
        assert!((exp_minus(-3.0) - 1.0).abs() < 1e-6, "negative arguments are clamped");
    }

    #[test]
    fn powers_agree_with_the_library() {
        for i in 1..4_000 {
            let x = (-(i as f32) * 0.02).exp();
            for t in [0.1, 0.6, 1.0] {
                let e = f64::from(x).powf(f64::from(t));
                assert!((f64::from(power(x, t)) / e - 1.0).abs() < 1e-3, "{x}^{t}");
            }
        }
    }

    #[test]
    fn angles_wrap_into_one_turn() {
        for i in -500..500 {
            let a = i as f32 * 0.31;
            let w = wrap_angle(a);
            assert!(w.abs() <= core::f32::consts::PI + 1e-5, "{a} -> {w}");
            let (s, c) = (f64::from(w).sin() - f64::from(a).sin(), f64::from(w).cos() - f64::from(a).cos());
            assert!(s.abs() < 1e-4 && c.abs() < 1e-4, "{a} -> {w}");
        }
    }

    #[test]
    fn the_tangent_of_a_tilt_is_good_where_quadrotors_fly() {
        for i in -50..=50 {
            let a = i as f32 * 0.01;
            assert!((tan_tilt(a) - a.tan()).abs() < 2e-3, "{a}");
        }
        assert!(tan_tilt(1.5) < 0.7, "a tumbling aircraft is clamped");
    }
}
