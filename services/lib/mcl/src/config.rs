//! The filter's settings and their bounds.

use crate::{MotionConfig, TrustConfig};
use core::ops::RangeInclusive;
use thiserror::Error;

/// A setting outside its bounds.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{field} is {value}; allowed: {low}..={high}")]
pub struct ConfigError {
    /// Path of the setting, for example `motion.velocity_noise`.
    pub field: &'static str,
    /// What it was set to.
    pub value: f32,
    /// Smallest value allowed.
    pub low: f32,
    /// Largest value allowed.
    pub high: f32,
}

pub(crate) fn within(field: &'static str, value: f32, range: RangeInclusive<f32>) -> Result<(), ConfigError> {
    if range.contains(&value) {
        Ok(())
    } else {
        Err(ConfigError { field, value, low: *range.start(), high: *range.end() })
    }
}

/// The sonar mixture: where a reading comes from when the drone is at a particle's place.
#[derive(Clone, Debug, PartialEq)]
pub struct SonarConfig {
    /// Standard deviation of a hit at zero range, metres: the sensor's few millimetres, the plan's few
    /// centimetres and the cone table's cells together.
    pub sigma: f32,
    /// Growth of that deviation with range: speed of sound, mount angle.
    pub sigma_per_m: f32,
    /// Probability that something unmapped answers first, where the plan promises a surface. FACTS 8:
    /// about 0.06; more makes it worse, for then no short reading contradicts anything any more.
    pub short: f32,
    /// Probability that a promised echo does not come back.
    pub missed: f32,
    /// Probability of any reading at all.
    pub random: f32,
    /// Probability of an echo where the plan promises none: unmapped things, walls met at an angle at
    /// which the model has already given up.
    pub unexpected: f32,
    /// Exponent on each reading's likelihood: below one because the same wrong thing is heard again and
    /// again, while the mixture treats each reading as news.
    pub temper: f32,
    /// Least likelihood of a reading, as a fraction of the best place's: caps what one reading can say.
    pub floor: f32,
    /// Readings beyond this are no echo, metres.
    pub max_range: f32,
    /// A sensor whose axis is farther from level than this says nothing about walls, radians.
    pub max_elevation: f32,
}

impl Default for SonarConfig {
    fn default() -> Self {
        Self {
            sigma: 0.06,
            sigma_per_m: 0.015,
            short: 0.06,
            missed: 0.18,
            random: 0.05,
            unexpected: 0.35,
            temper: 0.5,
            floor: 0.01,
            max_range: 4.0,
            max_elevation: 0.35,
        }
    }
}

/// How many particles there are.
#[derive(Clone, Debug, PartialEq)]
pub struct PopulationConfig {
    /// Never fewer.
    pub min: usize,
    /// Never more.
    pub max: usize,
    /// Bound on the difference between the set and the true distribution (Fox 2003, KLD sampling).
    pub error: f32,
    /// Side of the bins in which that difference is measured, metres.
    pub bin: f32,
    /// Height of those bins, radians.
    pub heading_bin: f32,
    /// And their side in velocity, m/s: a set that does not know its speed needs far more particles.
    pub velocity_bin: f32,
}

impl Default for PopulationConfig {
    fn default() -> Self {
        Self { min: 1_000, max: 5_000, error: 0.04, bin: 0.1, heading_bin: 0.17, velocity_bin: 0.2 }
    }
}

/// When ancestors are drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct ResampleConfig {
    /// Draw when the effective sample size falls below this share of the set.
    pub threshold: f32,
}

impl Default for ResampleConfig {
    fn default() -> Self {
        Self { threshold: 0.5 }
    }
}

/// All settings of the filter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Config {
    /// How particles move.
    pub motion: MotionConfig,
    /// How readings weigh them.
    pub sonar: SonarConfig,
    /// How many there are.
    pub population: PopulationConfig,
    /// When ancestors are drawn.
    pub resample: ResampleConfig,
    /// When the estimate is no longer believed.
    pub trust: TrustConfig,
}

impl Config {
    /// Looks through all settings.
    ///
    /// # Errors
    /// The first one outside its bounds.
    pub fn check(&self) -> Result<(), ConfigError> {
        let s = &self.sonar;
        within("sonar.sigma", s.sigma, 0.005..=0.5)?;
        within("sonar.sigma_per_m", s.sigma_per_m, 0.0..=0.2)?;
        within("sonar.short", s.short, 0.0..=0.4)?;
        within("sonar.missed", s.missed, 0.01..=0.4)?;
        within("sonar.random", s.random, 0.001..=0.15)?;
        within("sonar.unexpected", s.unexpected, 0.01..=0.99)?;
        within("sonar.temper", s.temper, 0.05..=1.0)?;
        // 16 readings at the floor must still be a normal f32.
        within("sonar.floor", s.floor, 0.005..=0.5)?;
        within("sonar.max_range", s.max_range, 0.5..=10.0)?;
        within("sonar.max_elevation", s.max_elevation, 0.05..=1.0)?;
        let p = &self.population;
        within("population.min", p.min as f32, 50.0..=50_000.0)?;
        within("population.max", p.max as f32, p.min as f32..=50_000.0)?;
        within("population.error", p.error, 0.001..=0.5)?;
        within("population.bin", p.bin, 0.02..=1.0)?;
        within("population.heading_bin", p.heading_bin, 0.02..=1.6)?;
        within("population.velocity_bin", p.velocity_bin, 0.02..=2.0)?;
        within("resample.threshold", self.resample.threshold, 0.05..=1.0)?;
        self.motion.check()?;
        self.trust.check()
    }
}

#[cfg(test)]
mod tests {
    use super::Config;

    #[test]
    fn the_defaults_are_within_their_bounds() {
        assert_eq!(Config::default().check(), Ok(()));
    }

    #[test]
    fn a_bad_value_is_named_with_its_bounds() {
        let mut config = Config::default();
        config.motion.velocity_noise = f32::NAN;
        let text = config.check().map_err(|e| e.to_string());
        assert_eq!(text, Err("motion.velocity_noise is NaN; allowed: 0.01..=3".into()));
        let mut config = Config::default();
        config.population.max = config.population.min - 1;
        assert_eq!(config.check().map_err(|e| e.field), Err("population.max"));
    }
}
