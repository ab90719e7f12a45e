//! Equations 1 to 4 of the thesis's section on the particle filter.

use crate::maths::{sin_cos, wrap_angle};
use crate::motion::noisy_distance;
use core::f32::consts::TAU;

/// How the vehicle moved since the last update.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// ρ, metres.
    pub distance_m: f32,
    /// Which way, counter-clockwise from the heading that it has after the turn, radians. The thesis has 0: it flies where
    /// it looks.
    pub direction_rad: f32,
    /// How far its heading turned before it moved, counter-clockwise, radians.
    pub turned_rad: f32,
}

impl Moved {
    /// The same with rest for what is not finite.
    pub(super) fn sane(&self) -> Self {
        let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
        Self {
            distance_m: finite(self.distance_m),
            direction_rad: finite(self.direction_rad),
            turned_rad: finite(self.turned_rad),
        }
    }
}

/// Equation 2: place (m) and heading (rad) of a particle after a motion, with `sigmas` (of the factor on the distance; of
/// the heading, rad) and a standard normal draw for each. With draws of zero it is equation 1.
///
/// The distance is `ρ (1 + N(0, σ²))`: as printed, `ρ N(0, σ²)`, the set would on average not move at all.
#[inline]
#[must_use]
pub fn move_particle(
    [x, y, heading]: [f32; 3],
    moved: &Moved,
    sigmas: [f32; 2],
    normals: [f32; 2],
) -> [f32; 3] {
    let heading = heading + moved.turned_rad;
    let (sin, cos) = sin_cos(heading + moved.direction_rad);
    let distance = noisy_distance(moved.distance_m, sigmas[0], normals[0]);
    [x + distance * cos, y + distance * sin, wrap_angle(heading + sigmas[1] * normals[1])]
}

/// Equation 3: the density at `x` of a normal distribution around `mu`.
#[must_use]
pub fn gaussian(x: f32, mu: f32, sigma: f32) -> f32 {
    log_gaussian(x, mu, 0.5 / (sigma * sigma)).exp() / (sigma * TAU.sqrt())
}

/// The part of equation 3's logarithm that differs between particles; `precision` is 1 / 2σ². What is left out falls out
/// in equation 4.
#[inline]
pub(super) fn log_gaussian(x: f32, mu: f32, precision: f32) -> f32 {
    let error = x - mu;
    -error * error * precision
}

/// Equation 4, of weights given as their logarithms, in place. The largest is taken out first, which changes nothing in the
/// quotient and keeps it a number. False when no weight is one: then all are equal.
pub fn normalise(log_weights: &mut [f32]) -> bool {
    let best = log_weights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let mut total = 0.0f64;
    for weight in log_weights.iter_mut() {
        let share = (*weight - best).exp();
        *weight = if share.is_nan() { 0.0 } else { share };
        total += f64::from(*weight);
    }
    let sound = best.is_finite() && total.is_finite() && total > 0.0;
    let equal = 1.0 / log_weights.len().max(1) as f32;
    let scale = (1.0 / total) as f32;
    for weight in log_weights.iter_mut() {
        *weight = if sound { *weight * scale } else { equal };
    }
    sound
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::{Generator, Lanes};
    use core::f32::consts::FRAC_PI_2;

    fn near(found: [f32; 3], expected: [f32; 3]) {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?} {expected:?}");
    }

    /// The thesis's own example: turned by 10 degrees and 10 cm ahead.
    #[test]
    fn equation_1_moves_along_the_heading() {
        let moved = Moved { distance_m: 0.1, direction_rad: 0.0, turned_rad: 10f32.to_radians() };
        let at = move_particle([1.0, 2.0, 0.0], &moved, [0.3, 0.1], [0.0; 2]);
        // 0.1 cos 10° = 0.0984808, 0.1 sin 10° = 0.0173648, 10° = 0.1745329.
        near(at, [1.098_480_8, 2.017_364_8, 0.174_532_9]);
        let sideways = Moved { distance_m: 0.5, direction_rad: FRAC_PI_2, turned_rad: 0.0 };
        near(move_particle([1.0, 2.0, FRAC_PI_2], &sideways, [0.0; 2], [0.0; 2]), [0.5, 2.0, FRAC_PI_2]);
    }

    #[test]
    fn equation_2_adds_noise_to_distance_and_heading() {
        let moved = Moved { distance_m: 2.0, ..Moved::default() };
        // 2 (1 + 0.1 · 1.5) = 2.3; 0.05 · -2 = -0.1.
        near(move_particle([0.0; 3], &moved, [0.1, 0.05], [1.5, -2.0]), [2.3, 0.0, -0.1]);
        // The noise of the heading comes after the motion: it bends the next step, not this one.
        near(move_particle([0.0, 0.0, -0.1], &moved, [0.0; 2], [0.0; 2]), [1.990_008_3, -0.199_666_8, -0.1]);
    }

    /// N = 80 000; the standard error of the mean is 0.3 / √N = 0.001 of the metre flown.
    #[test]
    fn the_set_goes_where_the_vehicle_goes_and_spreads_along_its_way() {
        let mut normals = vec![0.0; 80_000];
        Lanes::new(&mut Generator::new(7)).fill_normal(&mut normals);
        let moved = Moved { distance_m: 1.0, ..Moved::default() };
        let ends: Vec<f64> = normals
            .iter()
            .map(|n| f64::from(move_particle([0.0; 3], &moved, [0.3, 0.0], [*n, 0.0])[0]))
            .collect();
        let mean = ends.iter().sum::<f64>() / 80_000.0;
        let spread = (ends.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 80_000.0).sqrt();
        assert!((mean - 1.0).abs() < 0.005, "{mean}");
        assert!((spread - 0.3).abs() < 0.005, "{spread}");
    }

    #[test]
    fn equation_3_is_the_normal_density() {
        // 1 / (0.025 √(2π)) = 15.95769; two sigma off times e^-2 = 0.1353353.
        assert!((gaussian(1.0, 1.0, 0.025) - 15.957_69).abs() < 1e-3);
        assert!((gaussian(1.05, 1.0, 0.025) - 2.159_64).abs() < 1e-3);
        assert!((gaussian(0.0, 1.0, 1.0) - 0.241_970_7).abs() < 1e-6);
    }

    #[test]
    fn equation_4_makes_the_weights_sum_to_one() {
        // Two sensors each, sigma 1: products e^0, e^-0.5, e^-1 of what differs; their sum is 1.9744101.
        let mut weights = [0.0, -0.5, -1.0];
        assert!(normalise(&mut weights));
        near(weights, [0.506_480_4, 0.307_195_9, 0.186_323_7]);
        // The same out of equation 3's own numbers, as printed.
        let printed = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]
            .map(|[a, b]: [f32; 2]| [a, b].iter().map(|error| gaussian(*error, 0.0, 1.0)).product::<f32>());
        let total: f32 = printed.iter().sum();
        near(printed.map(|w| w / total), weights);
    }

    #[test]
    fn what_is_zero_as_printed_still_has_a_quotient() {
        // 5 m off at 2.5 cm: e^-20000 as printed.
        let mut weights = [-20_000.0, -20_000.5];
        assert_eq!(gaussian(5.0, 0.0, 0.025), 0.0);
        assert!(normalise(&mut weights));
        assert!((weights[0] - 0.622_459_3).abs() < 1e-4, "{weights:?}");
    }

    #[test]
    fn weights_of_nothing_become_equal() {
        for broken in [[f32::NEG_INFINITY; 4], [f32::NAN; 4]] {
            let mut weights = broken;
            assert!(!normalise(&mut weights));
            assert_eq!(weights, [0.25; 4]);
        }
        let mut one = [f32::NAN, 0.0];
        assert!(normalise(&mut one));
        assert_eq!(one, [0.0, 1.0]);
        assert!(!normalise(&mut []));
    }
}
