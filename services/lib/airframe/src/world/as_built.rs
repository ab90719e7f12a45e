//! The building as it was built: the plan, a little stretched and bent.

use super::draw::uniform;
use rand::Rng;

/// Largest stretch of the building against its plan (DESIGN 6).
const SCALE: f32 = 0.003;
/// Largest displacement of a wall against its plan besides the stretch, metres (DESIGN 6): reached somewhere in every
/// building.
const BEND_M: f32 = 0.03;
/// Where the largest displacement is looked for: every quarter metre, which misses the crest of the shortest wave by less
/// than 2 %; and no more places an axis than this, so that a campus takes no longer than a house.
const LOOK_M: f32 = 0.25;
const LOOKS: usize = 200;
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

    /// A building of this size (metres in x and y) drawn at random about the plan's centre.
    pub fn drawn<R: Rng + ?Sized>(centre: (f32, f32), size: (f32, f32), rng: &mut R) -> Self {
        let mut built = Self::exact();
        built.centre = centre;
        built.scale = (uniform(rng, -SCALE, SCALE), uniform(rng, -SCALE, SCALE));
        for axis in &mut built.waves {
            for wave in axis {
                let amplitude = uniform(rng, 0.3, 1.0);
                let number = std::f32::consts::TAU / uniform(rng, WAVELENGTH_M.0, WAVELENGTH_M.1);
                let direction = uniform(rng, 0.0, std::f32::consts::TAU);
                let phase = uniform(rng, 0.0, std::f32::consts::TAU);
                *wave = (amplitude, number * direction.cos(), number * direction.sin(), phase);
            }
        }
        // How large the sum of the waves becomes depends on where their crests meet: what counts is the building.
        let largest = built.largest_bend(size);
        for wave in built.waves.iter_mut().flatten() {
            wave.0 *= BEND_M / largest.max(f32::MIN_POSITIVE);
        }
        built
    }

    fn largest_bend(&self, size: (f32, f32)) -> f32 {
        let looks = |length: f32| ((length / LOOK_M).ceil() as usize).clamp(1, LOOKS);
        let (across, up) = (looks(size.0), looks(size.1));
        let at = |k: usize, looks: usize, length: f32| (k as f32 / looks as f32 - 0.5) * length;
        let places = (0..=across).flat_map(|i| (0..=up).map(move |j| (i, j)));
        places
            .map(|(i, j)| {
                let (dx, dy) =
                    self.bend(self.centre.0 + at(i, across, size.0), self.centre.1 + at(j, up, size.1));
                dx.hypot(dy)
            })
            .fold(0.0, f32::max)
    }

    fn bend(&self, x: f32, y: f32) -> (f32, f32) {
        let sum = |waves: &[(f32, f32, f32, f32); WAVES]| -> f32 {
            waves.iter().map(|(a, kx, ky, phase)| a * (kx * x + ky * y + phase).sin()).sum()
        };
        (sum(&self.waves[0]), sum(&self.waves[1]))
    }

    /// How far a thing drawn at a place of the plan is away from there.
    #[must_use]
    pub fn shift(&self, x: f32, y: f32) -> (f32, f32) {
        let (dx, dy) = self.bend(x, y);
        ((x - self.centre.0) * self.scale.0 + dx, (y - self.centre.1) * self.scale.1 + dy)
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

    /// The largest displacement besides the stretch, looked for two and a half times as closely as when it was drawn.
    fn largest(built: &AsBuilt, size: (f32, f32)) -> f32 {
        let steps = |length: f32| (length * 10.0) as usize;
        let places = (0..=steps(size.0)).flat_map(|i| (0..=steps(size.1)).map(move |j| (i, j)));
        places
            .map(|(i, j)| {
                let (x, y) = (i as f32 * 0.1, j as f32 * 0.1);
                let (dx, dy) = built.shift(x, y);
                let stretch = ((x - built.centre.0) * built.scale.0, (y - built.centre.1) * built.scale.1);
                (dx - stretch.0).hypot(dy - stretch.1)
            })
            .fold(0.0, f32::max)
    }

    #[test]
    fn somewhere_in_every_building_the_plan_is_wrong_by_three_centimetres_and_nowhere_by_more() {
        for (size, seeds) in [((26.0, 14.0), 40), ((7.0, 5.0), 20), ((60.0, 50.0), 4)] {
            for seed in 0..seeds {
                let centre = (size.0 * 0.5, size.1 * 0.5);
                let built = AsBuilt::drawn(centre, size, &mut stream(seed, 1));
                let largest = largest(&built, size);
                assert!((0.0299..0.0311).contains(&largest), "{size:?}, seed {seed}: {largest} m");
                assert!(built.scale.0.abs() <= 0.003 && built.scale.1.abs() <= 0.003);
            }
        }
    }

    #[test]
    fn buildings_differ_and_stretch() {
        let drawn = |seed| AsBuilt::drawn((13.0, 7.0), (26.0, 14.0), &mut stream(seed, 1));
        let corner = |seed| drawn(seed).shift(26.0, 14.0);
        assert_ne!(corner(1), corner(2));
        // 0.3 % of 13 m is 3.9 cm: half of the draws stretch an axis by more than half of that.
        let stretched = (0..40).filter(|seed| drawn(*seed).scale.0.abs() > 0.0015).count();
        assert!((8..=32).contains(&stretched), "{stretched} of 40");
    }
}
