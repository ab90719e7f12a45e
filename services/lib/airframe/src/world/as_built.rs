//! The building as it was built: the plan, a little stretched and bent.

use super::draw::uniform;
use rand::Rng;

/// Largest stretch of the building against its plan (DESIGN 6).
const SCALE: f32 = 0.003;
/// Largest displacement of a wall against its plan besides the stretch, metres (DESIGN 6).
const BEND_M: f32 = 0.03;
/// Wavelengths of the bending, metres: walls are straight over a room and wrong over a building.
const WAVELENGTH_M: (f32, f32) = (6.0, 14.0);
/// Waves an axis: with two the field has no place where it is always right.
const WAVES: usize = 2;

/// Where things of the plan really stand. Drawn once a flight, unknown to the drone.
#[derive(Clone, Copy, Debug)]
pub struct AsBuilt {
    centre: (f32, f32),
    scale: (f32, f32),
    /// An axis and a wave: amplitude, wave vector, phase.
    waves: [[(f32, f32, f32, f32); WAVES]; 2],
}

impl AsBuilt {
    /// A building that is exactly its plan.
    #[must_use]
    pub fn exact() -> Self {
        Self { centre: (0.0, 0.0), scale: (0.0, 0.0), waves: [[(0.0, 0.0, 0.0, 0.0); WAVES]; 2] }
    }

    /// A building drawn at random about the plan's centre.
    pub fn drawn<R: Rng + ?Sized>(centre: (f32, f32), rng: &mut R) -> Self {
        let mut built = Self::exact();
        built.centre = centre;
        built.scale = (uniform(rng, -SCALE, SCALE), uniform(rng, -SCALE, SCALE));
        for axis in &mut built.waves {
            for wave in axis {
                // Each component stays below the bound over the square root of two, so that the vector does.
                let amplitude =
                    uniform(rng, 0.3, 1.0) * BEND_M / WAVES as f32 * std::f32::consts::FRAC_1_SQRT_2;
                let number = std::f32::consts::TAU / uniform(rng, WAVELENGTH_M.0, WAVELENGTH_M.1);
                let direction = uniform(rng, 0.0, std::f32::consts::TAU);
                let phase = uniform(rng, 0.0, std::f32::consts::TAU);
                *wave = (amplitude, number * direction.cos(), number * direction.sin(), phase);
            }
        }
        built
    }

    /// How far a thing drawn at a place of the plan is away from there.
    #[must_use]
    pub fn shift(&self, x: f32, y: f32) -> (f32, f32) {
        let bend = |waves: &[(f32, f32, f32, f32); WAVES]| -> f32 {
            waves.iter().map(|(a, kx, ky, phase)| a * (kx * x + ky * y + phase).sin()).sum()
        };
        (
            (x - self.centre.0) * self.scale.0 + bend(&self.waves[0]),
            (y - self.centre.1) * self.scale.1 + bend(&self.waves[1]),
        )
    }

    /// A place of the plan in the building.
    #[must_use]
    pub fn place(&self, x: f32, y: f32) -> (f32, f32) {
        let (dx, dy) = self.shift(x, y);
        (x + dx, y + dy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::draw::stream;

    #[test]
    fn the_building_is_wrong_but_never_by_more_than_stated() {
        let mut largest = 0.0f32;
        for seed in 0..50 {
            let built = AsBuilt::drawn((10.0, 10.0), &mut stream(seed, 1));
            for step in 0..40 {
                let (x, y) = (step as f32 * 0.5, 20.0 - step as f32 * 0.4);
                let (dx, dy) = built.shift(x, y);
                let stretch = ((x - 10.0) * 0.003).hypot((y - 10.0) * 0.003);
                assert!(dx.hypot(dy) <= 0.03 + stretch + 1e-5, "{dx} {dy} at {x} {y}");
                largest = largest.max(dx.hypot(dy));
            }
        }
        assert!(largest > 0.02, "the plan would be too good: {largest}");
    }
}
