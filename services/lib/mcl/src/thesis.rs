//! The thesis's own particle filter, plain, to be compared with [`crate::Filter`].
//!
//! One update is its cycle: move every particle (equation 2), let each measure what the vehicle measured (equation 3),
//! normalise (equation 4), sum up, and discard the least alike. What is read into the text where it is silent or cannot be
//! meant, and what follows from that, stands in `docs/thesis-localization.md`; in short:
//!
//! * Equation 2's factor is `1 + N(0, σ²)` ([`crate::noisy_distance`]).
//! * A particle measures along the axis of each sensor ([`CentreRay`]). Any other [`RangeMap`] may be put in its place.
//! * Weights are worked out as logarithms: five Gaussians of 2.5 cm are zero in any floating-point number almost everywhere.
//! * A quarter of the particles, the most alike, are kept each time; from [`Config::least`] on their number stays, and
//!   they are drawn by weight (the bootstrap filter of Gordon, Salmond and Smith 1993, which the thesis names).
//! * A probability of being lost, which the pilot needs, is not in the thesis: it is kept as that of [`crate::Filter`] is,
//!   from how well the readings fit the estimate ([`crate::TrustConfig`]).
//!
//! Columns in, columns out, no allocation after construction, randomness as an argument.

mod equations;
mod filter;
mod population;
mod ray;

pub use equations::{Moved, gaussian, move_particle, normalise};
pub use filter::{Filter, Scan};
pub use population::CapacityError;
pub use ray::CentreRay;

use crate::TrustConfig;
use crate::config::{ConfigError, within};

/// A particle set to be read: columns of equal length, one entry a particle.
#[derive(Clone, Copy, Debug)]
pub struct PosesRef<'a> {
    /// Plan frame, metres.
    pub x: &'a [f32],
    /// Plan frame, metres.
    pub y: &'a [f32],
    /// Heading, counter-clockwise, radians: in the plan frame, or against whatever reference [`Scan::reference_rad`] and
    /// [`Moved::direction_rad`] are told against (a compass).
    pub heading: &'a [f32],
    /// Normalised weights (equation 4).
    pub weight: &'a [f32],
}

/// Room for a particle set: columns at least as long as the set to be written.
#[derive(Debug)]
pub struct PosesMut<'a> {
    /// Plan frame, metres.
    pub x: &'a mut [f32],
    /// Plan frame, metres.
    pub y: &'a mut [f32],
    /// As [`PosesRef::heading`].
    pub heading: &'a mut [f32],
    /// Normalised weights.
    pub weight: &'a mut [f32],
}

impl PosesRef<'_> {
    /// Entries of the shortest column.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len().min(self.y.len()).min(self.heading.len()).min(self.weight.len())
    }

    /// Whether there is no particle.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<'a> PosesMut<'a> {
    /// Particles that fit: entries of the shortest column.
    #[must_use]
    pub fn capacity(&self) -> usize {
        self.x.len().min(self.y.len()).min(self.heading.len()).min(self.weight.len())
    }

    /// The same columns cut to `n`, which fits.
    fn first(self, n: usize) -> PosesMut<'a> {
        PosesMut {
            x: &mut self.x[..n],
            y: &mut self.y[..n],
            heading: &mut self.heading[..n],
            weight: &mut self.weight[..n],
        }
    }
}

/// All settings of the plain filter.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// σ of equation 3 in cells of the plan. FACTS 7: half a cell.
    pub sigma_cells: f32,
    /// Headings that each free cell begins with, evenly spread. FACTS 7: twelve.
    pub headings: usize,
    /// Share of the particles kept a resampling. FACTS 7: a quarter.
    pub kept: f32,
    /// Fewer particles than this are never left. The thesis names no number: here that of [`crate::PopulationConfig::min`].
    pub least: usize,
    /// σ of equation 2's factor on the distance. The thesis has "the errors of the motion system": 0.15 m/s of 0.5 m/s are
    /// what tilt and sonar alone leave (FACTS 8).
    pub distance_noise: f32,
    /// σ that equation 2 adds to the heading each update, radians: a controller tells its yaw in whole degrees (FACTS 1).
    pub heading_noise: f32,
    /// Readings nearer than this are not used, metres. FACTS 7: 5 cm.
    pub least_range: f32,
    /// Nor are readings beyond this, which is also what a particle measures where nothing stands, metres. FACTS 7: 375 cm.
    pub max_range: f32,
    /// When the estimate is no longer believed; ours, for the thesis has nothing of the kind.
    pub trust: TrustConfig,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            sigma_cells: 0.5,
            headings: 12,
            kept: 0.25,
            least: 1_000,
            distance_noise: 0.3,
            heading_noise: 0.02,
            least_range: 0.05,
            max_range: 3.75,
            trust: TrustConfig::default(),
        }
    }
}

impl Config {
    /// Looks through all settings.
    ///
    /// # Errors
    /// The first one outside its bounds.
    pub fn check(&self) -> Result<(), ConfigError> {
        within("thesis.sigma_cells", self.sigma_cells, 0.1..=20.0)?;
        within("thesis.headings", self.headings as f32, 1.0..=360.0)?;
        within("thesis.kept", self.kept, 0.01..=1.0)?;
        within("thesis.least", self.least as f32, 50.0..=50_000.0)?;
        within("thesis.distance_noise", self.distance_noise, 0.0..=1.0)?;
        within("thesis.heading_noise", self.heading_noise, 0.0..=1.0)?;
        within("thesis.least_range", self.least_range, 0.0..=0.5)?;
        within("thesis.max_range", self.max_range, 0.6..=10.0)?;
        self.trust.check()
    }
}

#[cfg(test)]
mod tests {
    use super::Config;

    #[test]
    fn the_defaults_are_within_their_bounds_and_a_bad_value_is_named() {
        assert_eq!(Config::default().check(), Ok(()));
        let bad = Config { kept: 0.0, ..Config::default() };
        assert_eq!(bad.check().map_err(|e| e.to_string()), Err("thesis.kept is 0; allowed: 0.01..=1".into()));
    }
}
