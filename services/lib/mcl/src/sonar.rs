//! How sonar readings weigh particles (equation 3, as one part of a mixture).

use crate::SonarConfig;
use core::f32::consts::TAU;

/// Most readings weighed at once; more are ignored.
pub const MAX_READINGS: usize = 16;
/// Where the plan promises a surface nearer than this, metres, the exponential of unmapped things is not
/// squeezed into less room.
pub(crate) const NEAREST: f32 = 0.05;

/// What came back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Echo {
    /// The nearest echo, metres from the sensor's face.
    Range(f32),
    /// The sensor worked and heard nothing.
    Nothing,
}

/// One reading and the sensor's mount in the body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// What came back.
    pub echo: Echo,
    /// Azimuth of the axis, counter-clockwise from forward, radians.
    pub bearing_rad: f32,
    /// Elevation of the axis, up positive, radians.
    pub elevation_rad: f32,
    /// Position of the face, forward, metres.
    pub mount_x: f32,
    /// Position of the face, left, metres.
    pub mount_y: f32,
}

/// Readings of sensors that were fired together, and the attitude then.
#[derive(Clone, Copy, Debug)]
pub struct Sweep<'a> {
    /// At most [`MAX_READINGS`] are used.
    pub readings: &'a [Reading],
    /// Right side down positive.
    pub roll_rad: f32,
    /// Nose down positive.
    pub pitch_rad: f32,
    /// Compass frame.
    pub yaw_rad: f32,
    /// How much of the sweep is news, 0..=1: a drone that stands hears the same things again and again, and what is
    /// wrong with them (something unmapped, a door ajar) is wrong each time.
    pub news: f32,
    /// Bit i: where reading i has its echo from, something was heard before. If it is too short for the plan, it is no
    /// reason for doubt.
    pub familiar: u32,
    /// Bit i: reading i comes from a door that may be shut where the plan has it open. It says nothing of the place.
    pub doors: u32,
}

impl Sweep<'_> {
    /// The readings that say something of the place, with their indices.
    pub(crate) fn telling(&self) -> impl Iterator<Item = (usize, &Reading)> {
        let doors = self.doors;
        self.readings.iter().take(MAX_READINGS).enumerate().filter(move |(i, _)| doors >> i & 1 == 0)
    }

    /// How much of it is news, whatever was said: 0..=1.
    pub(crate) fn news(&self) -> f32 {
        if self.news.is_nan() { 1.0 } else { self.news.clamp(0.0, 1.0) }
    }
}

/// The mixture from which a reading is thought to come. For a place from which the plan promises an echo
/// at `r`: the wall itself (equation 3 around `r`), something unmapped before it (exponential, cut at
/// `r`), nothing at all, or anything.
#[derive(Clone, Debug)]
pub struct SonarModel {
    pub(crate) config: SonarConfig,
}

impl SonarModel {
    /// A model with these settings (checked by [`crate::Config::check`]).
    #[must_use]
    pub fn new(config: &SonarConfig) -> Self {
        Self { config: config.clone() }
    }

    /// Probability that a promised surface is what answers.
    pub(crate) fn hit(&self) -> f32 {
        let c = &self.config;
        1.0 - c.short - c.missed - c.random
    }

    /// Standard deviation of a hit at range `r`, metres.
    #[must_use]
    pub fn sigma(&self, r: f32) -> f32 {
        self.config.sigma.hypot(self.config.sigma_per_m * r)
    }

    /// Likelihood of `echo` where the plan promises `expected` metres (infinite: no echo): a density per
    /// metre for a range, a probability for no echo.
    #[must_use]
    pub fn likelihood(&self, echo: Echo, expected: f32) -> f32 {
        let c = &self.config;
        let reach = c.max_range;
        let promised = expected <= reach;
        match (echo, promised) {
            (Echo::Nothing, false) => 1.0 - c.unexpected,
            (Echo::Range(_), false) => c.unexpected / reach,
            (Echo::Nothing, true) => {
                // An echo grows weak towards the end of the reach.
                let far = ((expected / reach - 0.85) / 0.15).clamp(0.0, 1.0);
                c.missed + far * 0.5 * (1.0 - c.missed)
            }
            (Echo::Range(z), true) => {
                let sigma = self.sigma(expected);
                let error = (z - expected) / sigma;
                let gauss = (-0.5 * error * error).exp() / (sigma * TAU.sqrt());
                // Unmapped things stand as near as 1 m on average; the exponential is cut at the wall.
                let before =
                    if z < expected { (-z).exp() / (1.0 - (-expected.max(NEAREST)).exp()) } else { 0.0 };
                self.hit() * gauss + c.short * before + c.random / reach
            }
        }
    }

    /// Likelihood of `echo` to one who has no idea where on the plan it was made.
    pub(crate) fn blind_likelihood(&self, echo: Echo) -> f32 {
        // Of the cones in rooms and corridors about four in ten hear nothing, for want of a wall that faces
        // them; echoes are the rarer the farther. Only the order of magnitude matters.
        match echo {
            Echo::Nothing => 0.4,
            Echo::Range(z) => {
                0.6 * (-z / (0.6 * self.config.max_range)).exp() / (0.487 * self.config.max_range)
            }
        }
    }

    /// Elevation of a sensor's axis against the horizon in a tilted body.
    fn elevation(reading: &Reading, sweep: &Sweep<'_>) -> f32 {
        let (sin, cos) = reading.bearing_rad.sin_cos();
        reading.elevation_rad - sweep.pitch_rad * cos + sweep.roll_rad * sin
    }

    /// The reading as it would be with the axis level; `None` when it says nothing about walls: the
    /// sensor looks up or down, or the numbers make no sense.
    pub(crate) fn levelled(&self, reading: &Reading, sweep: &Sweep<'_>) -> Option<Echo> {
        let elevation = Self::elevation(reading, sweep);
        let usable = elevation.abs() <= self.config.max_elevation
            && reading.bearing_rad.is_finite()
            && reading.mount_x.abs() < 2.0
            && reading.mount_y.abs() < 2.0;
        match reading.echo {
            _ if !usable => None,
            Echo::Nothing => Some(Echo::Nothing),
            Echo::Range(z) if z > 0.0 && z <= self.config.max_range => Some(Echo::Range(z * elevation.cos())),
            Echo::Range(z) if z > self.config.max_range => Some(Echo::Nothing),
            Echo::Range(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SonarConfig;

    fn model() -> SonarModel {
        SonarModel::new(&SonarConfig::default())
    }

    /// Over all ranges and no echo, the mixture is a probability (to the cut of the Gaussian's tails).
    #[test]
    fn the_mixture_sums_to_one() {
        for expected in [0.5, 1.3, 2.0, 3.0, f32::INFINITY] {
            let step = 0.001;
            let ranges: f32 = (0..4000)
                .map(|i| model().likelihood(Echo::Range((i as f32 + 0.5) * step), expected) * step)
                .sum();
            let sum = ranges + model().likelihood(Echo::Nothing, expected);
            assert!((sum - 1.0).abs() < 0.02, "{expected}: {sum}");
        }
    }

    #[test]
    fn a_short_reading_is_forgiven_a_long_one_is_not() {
        let m = model();
        let short = m.likelihood(Echo::Range(1.0), 2.0);
        let long = m.likelihood(Echo::Range(2.0), 1.0);
        assert!(short > 1.8 * long, "an unmapped chair is likelier than a hole in a wall: {short} {long}");
        assert!(m.likelihood(Echo::Range(2.0), 2.0) > 40.0 * short);
    }

    #[test]
    fn sensors_that_look_away_from_the_walls_say_nothing() {
        let reading = Reading {
            echo: Echo::Range(1.0),
            bearing_rad: 0.0,
            elevation_rad: 0.0,
            mount_x: 0.2,
            mount_y: 0.0,
        };
        let level = Sweep {
            readings: &[],
            roll_rad: 0.0,
            pitch_rad: 0.0,
            yaw_rad: 0.0,
            news: 1.0,
            familiar: 0,
            doors: 0,
        };
        let m = model();
        assert_eq!(m.levelled(&reading, &level), Some(Echo::Range(1.0)));
        let down = Reading { elevation_rad: -1.57, ..reading };
        assert_eq!(m.levelled(&down, &level), None);
        assert_eq!(m.levelled(&reading, &Sweep { pitch_rad: 0.6, ..level }), None, "nose in the floor");
        assert!(m.levelled(&reading, &Sweep { roll_rad: 0.6, ..level }).is_some(), "roll turns about it");
        for echo in [f32::NAN, -1.0, 0.0] {
            assert_eq!(m.levelled(&Reading { echo: Echo::Range(echo), ..reading }, &level), None);
        }
        let far = Reading { echo: Echo::Range(9.0), ..reading };
        assert_eq!(m.levelled(&far, &level), Some(Echo::Nothing), "beyond the reach");
    }
}
