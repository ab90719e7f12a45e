//! The magnetometer indoors: an unknown zero and an error that varies smoothly with place.

use super::noise::within;
use rand::{Rng, RngExt};
use std::f64::consts::{PI, TAU};

/// Largest error anywhere, radians: 20 degrees (DESIGN 6). A flight draws between half of it and all.
const LARGEST_RAD: f64 = 0.349;
/// Wave lengths of the disturbance, metres: steel in walls and floors, from a pillar to a wing.
const WAVE_M: [(f64, f64); 3] = [(3.0, 6.0), (6.0, 12.0), (12.0, 25.0)];
/// Share of each wave; together one, so that the largest error is a bound.
const SHARES: [f64; 3] = [0.25, 0.35, 0.4];
/// Noise of one reading, radians.
const NOISE_RAD: f64 = 0.015;

#[derive(Clone, Copy, Debug, Default)]
struct Wave {
    x: f64,
    y: f64,
    phase: f64,
    amplitude: f64,
}

/// One flight's compass.
#[derive(Clone, Debug)]
pub struct Compass {
    offset: f64,
    waves: [Wave; 3],
}

impl Compass {
    /// One flight's draw of building orientation and disturbance.
    pub fn draw(random: &mut impl Rng) -> Self {
        let offset = within(random, PI);
        let amplitude = LARGEST_RAD * (0.5 + 0.5 * random.random::<f64>());
        let waves = std::array::from_fn(|i| {
            let (short, long) = WAVE_M[i];
            let number = TAU / (short + (long - short) * random.random::<f64>());
            let (sin, cos) = within(random, PI).sin_cos();
            Wave {
                x: number * cos,
                y: number * sin,
                phase: within(random, PI),
                amplitude: SHARES[i] * amplitude,
            }
        });
        Self { offset, waves }
    }

    /// Without disturbance: heading by compass = yaw in the plan + `offset`, radians.
    #[must_use]
    pub fn undisturbed(offset: f64) -> Self {
        Self { offset, waves: [Wave::default(); 3] }
    }

    /// Heading by compass minus yaw in the plan, far from any disturbance: the plan's orientation.
    #[must_use]
    pub fn offset_rad(&self) -> f64 {
        self.offset
    }

    /// Error at a place, radians counter-clockwise.
    #[must_use]
    pub fn error_rad(&self, x: f64, y: f64) -> f64 {
        self.waves.iter().map(|w| w.amplitude * (w.x * x + w.y * y + w.phase).sin()).sum()
    }

    /// What it shows: counter-clockwise from compass zero, radians, not wrapped.
    pub(crate) fn read(&self, x: f64, y: f64, yaw: f64, random: &mut impl Rng) -> f64 {
        yaw + self.offset + self.error_rad(x, y) + NOISE_RAD * super::normal(random)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;

    #[test]
    fn the_error_is_bounded_varies_with_place_and_is_smooth() {
        for seed in 0..50 {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
            let compass = Compass::draw(&mut random);
            let (mut low, mut high): (f64, f64) = (0.0, 0.0);
            for i in 0..300 {
                let x = 0.1 * f64::from(i);
                let error = compass.error_rad(x, 0.3 * x);
                assert!(error.abs() <= 20.0_f64.to_radians() + 1e-3);
                let step = (compass.error_rad(x + 0.1, 0.3 * x) - error).abs();
                assert!(step < 4.0_f64.to_radians(), "{step}");
                low = low.min(error);
                high = high.max(error);
            }
            assert!(high - low > 4.0_f64.to_radians(), "seed {seed}: {low} {high}");
        }
    }
}
