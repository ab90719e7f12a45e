//! One update of the plain filter.

use super::equations::{Moved, gaussian, log_gaussian, move_particle, normalise};
use super::population::{self, CapacityError};
use super::{Config, PosesMut, PosesRef};
use crate::SonarConfig;
use crate::config::{ConfigError, within};
use crate::estimate::{Estimate, State};
use crate::filter::{BLOCK, Start, Update};
use crate::generator::{Generator, Lanes};
use crate::map::RangeMap;
use crate::maths::{sin_cos, wrap_angle};
use crate::memory::Memory;
use crate::sonar::{Echo, MAX_READINGS, Reading, SonarModel};
use crate::trust::Evidence;
use floorplan::Plan;

/// What the vehicle's sensors measured.
#[derive(Clone, Copy, Debug)]
pub struct Scan<'a> {
    /// At most [`MAX_READINGS`] are used. Silence, and what lies outside the used range, says nothing: equation 3 has no
    /// term for it.
    pub readings: &'a [Reading],
    /// What the particles' headings are told against, plan frame, radians: 0 where they are headings on the plan, the
    /// compass yaw where they are offsets from it.
    pub reference_rad: f32,
}

/// The filter: settings, the map, and room to work in. It holds nothing of the set: the same arguments give the same result
/// whatever was done before.
pub struct Filter<M> {
    config: Config,
    map: M,
    /// σ of equation 3, metres.
    sigma: f32,
    /// Only for what a reading is worth to one who knows nothing of the place.
    blind: SonarModel,
    scratch: Vec<f32>,
    ancestors: Vec<u32>,
    noise: Box<[[f32; BLOCK]; 2]>,
}

impl<M: RangeMap> Filter<M> {
    /// A filter for sets of up to `capacity` particles on `map`, whose plan has cells of `resolution_m` metres. Allocates
    /// here and nowhere else.
    ///
    /// # Errors
    /// A setting outside its bounds.
    pub fn new(config: Config, map: M, resolution_m: f32, capacity: usize) -> Result<Self, ConfigError> {
        config.check()?;
        // What plans may have.
        within("thesis.resolution_m", resolution_m, 0.01..=0.5)?;
        let blind = SonarConfig { max_range: config.max_range, ..SonarConfig::default() };
        Ok(Self {
            sigma: config.sigma_cells * resolution_m,
            blind: SonarModel::new(&blind),
            config,
            map,
            scratch: vec![0.0; capacity],
            ancestors: vec![0; capacity],
            noise: Box::new([[0.0; BLOCK]; 2]),
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The thesis's start: nothing is known, each free cell of the plan holds a particle for each heading.
    ///
    /// # Errors
    /// There is no room for so many.
    pub fn start_everywhere(&mut self, plan: &Plan, mut next: PosesMut<'_>) -> Result<Update, CapacityError> {
        let room = self.scratch.len();
        let count = population::everywhere(&self.config, plan, reborrow(&mut next), room)?;
        // Nobody who may be anywhere is where the mean of all places is.
        Ok(self.begun(count, next, 1.0))
    }

    /// The start from a known place, as the service has it, with up to `count` particles.
    pub fn start_around(
        &mut self,
        start: &Start,
        count: usize,
        mut next: PosesMut<'_>,
        generator: &mut Generator,
    ) -> Update {
        let count = population::around(start, count, reborrow(&mut next), generator, &mut self.scratch);
        self.begun(count, next, start.p_lost.clamp(0.0, 1.0))
    }

    fn begun(&self, count: usize, next: PosesMut<'_>, p_lost: f32) -> Update {
        let estimate = summed_up(&next.first(count)).doubted(p_lost);
        let memory =
            Memory { p_lost, effective: estimate.effective, wanted: count as f32, heading_mean: None };
        Update { count, estimate, memory, resampled: false, fits: 0, short: 0 }
    }

    /// Reads the set `previous`, moves it by `moved` (`None`: on the ground, where nothing moves and nothing is heard),
    /// weighs it by `scan`, sums it up, and writes what resampling leaves of it into `next`. `dt_s` is the time since the
    /// last update, seconds, for the doubt alone; `memory` is what [`Update::memory`] was for `previous`.
    ///
    /// Any input is survived: readings and motion that make no sense are left out, and weights that are no numbers become
    /// equal and the estimate lost.
    #[expect(
        clippy::too_many_arguments,
        reason = "as Filter::update of the crate, with the time apart from the motion"
    )]
    pub fn update(
        &mut self,
        previous: PosesRef<'_>,
        memory: &Memory,
        dt_s: f32,
        moved: Option<&Moved>,
        scan: Option<&Scan<'_>>,
        next: PosesMut<'_>,
        generator: &mut Generator,
    ) -> Update {
        let count = previous.len().min(next.capacity()).min(self.scratch.len());
        let mut next = next.first(count);
        next.x.copy_from_slice(&previous.x[..count]);
        next.y.copy_from_slice(&previous.y[..count]);
        next.heading.copy_from_slice(&previous.heading[..count]);
        next.weight.copy_from_slice(&previous.weight[..count]);
        let mut lanes = Lanes::new(generator);
        if let Some(moved) = moved {
            self.advance(&mut next, &moved.sane(), &mut lanes);
        }
        let scan = scan.filter(|s| moved.is_some() && count > 0 && s.reference_rad.is_finite());
        let used = scan.map(|scan| self.usable(scan)).filter(|(_, n)| *n > 0);
        let sound = match (scan, &used) {
            (Some(scan), Some((readings, n))) => self.weigh(&mut next, scan.reference_rad, &readings[..*n]),
            _ => true,
        };
        let estimate = summed_up(&next);
        let mut update = Update { count, estimate, memory: *memory, resampled: false, fits: 0, short: 0 };
        let p_lost = if !sound {
            1.0
        } else if let (Some(scan), Some((readings, n))) = (scan, &used) {
            self.compare(scan.reference_rad, &readings[..*n], memory, dt_s, &mut update)
        } else if moved.is_none() {
            memory.p_lost
        } else {
            self.config.trust.step(memory.p_lost, dt_s, 1.0, core::iter::empty())
        };
        update.estimate = estimate.doubted(p_lost);
        if used.is_some() && sound {
            let (scratch, ancestors) = (&mut self.scratch, &mut self.ancestors);
            update.count = population::resample(&self.config, next, generator, scratch, ancestors);
            update.resampled = true;
        }
        update.memory =
            Memory { p_lost, effective: estimate.effective, wanted: update.count as f32, heading_mean: None };
        update
    }

    /// Equation 2.
    fn advance(&mut self, set: &mut PosesMut<'_>, moved: &Moved, lanes: &mut Lanes) {
        let sigmas = [self.config.distance_noise, self.config.heading_noise];
        let blocks = set.x.chunks_mut(BLOCK).zip(set.y.chunks_mut(BLOCK)).zip(set.heading.chunks_mut(BLOCK));
        for ((x, y), heading) in blocks {
            for row in self.noise.iter_mut() {
                lanes.fill_normal(row);
            }
            let [far, turn] = &*self.noise;
            for i in 0..x.len() {
                let at = move_particle([x[i], y[i], heading[i]], moved, sigmas, [far[i], turn[i]]);
                [x[i], y[i], heading[i]] = at;
            }
        }
    }

    /// The readings that equation 3 has a term for, with their places in the scan, and how many they are.
    fn usable(&self, scan: &Scan<'_>) -> ([(usize, f32, Reading); MAX_READINGS], usize) {
        let mut found = [(0, 0.0, NO_READING); MAX_READINGS];
        let mut n = 0;
        for (i, reading) in scan.readings.iter().take(MAX_READINGS).enumerate() {
            let Echo::Range(range) = reading.echo else { continue };
            let sane = (self.config.least_range..=self.config.max_range).contains(&range)
                && reading.bearing_rad.is_finite()
                && reading.mount_x.abs() < 2.0
                && reading.mount_y.abs() < 2.0;
            if sane {
                found[n] = (i, range, *reading);
                n += 1;
            }
        }
        (found, n)
    }

    /// What a sensor would measure on a vehicle with this place and heading (plan frame), metres.
    fn measured(&self, [x, y, heading]: [f32; 3], reading: &Reading) -> f32 {
        let (sin, cos) = sin_cos(heading);
        let range = self.map.range(
            x + cos * reading.mount_x - sin * reading.mount_y,
            y + sin * reading.mount_x + cos * reading.mount_y,
            heading + reading.bearing_rad,
        );
        // A ray that meets nothing, and one from nowhere, ends at the reach.
        range.min(self.config.max_range)
    }

    /// Equation 3 over all sensors, and equation 4. False when no particle can be weighed.
    fn weigh(&self, set: &mut PosesMut<'_>, reference: f32, readings: &[(usize, f32, Reading)]) -> bool {
        let precision = 0.5 / (self.sigma * self.sigma);
        for i in 0..set.weight.len() {
            let at = [set.x[i], set.y[i], set.heading[i] + reference];
            let log = |(_, range, reading): &(usize, f32, Reading)| {
                log_gaussian(*range, self.measured(at, reading), precision)
            };
            set.weight[i] = if at.iter().all(|v| v.is_finite()) {
                readings.iter().map(log).sum()
            } else {
                f32::NEG_INFINITY
            };
        }
        normalise(set.weight)
    }

    /// Not the thesis's: how well the readings fit the estimate. The set is taken for a Gaussian around it, so a reading's
    /// likelihood by the set is equation 3 with the set's spread added to the sensor's. Fills in which readings fit and which
    /// are too short, and returns the probability of being lost.
    fn compare(
        &self,
        reference: f32,
        readings: &[(usize, f32, Reading)],
        memory: &Memory,
        dt_s: f32,
        update: &mut Update,
    ) -> f32 {
        let e = update.estimate;
        let sigma = self.sigma.hypot(e.sigma());
        let at = [e.x, e.y, e.heading_offset + reference];
        let expected = |reading: &Reading| self.measured(at, reading);
        for (i, range, reading) in readings {
            let off = range - expected(reading);
            update.fits |= u32::from(off.abs() < 3.0 * sigma) << i;
            update.short |= u32::from(off < -3.0 * sigma) << i;
        }
        let short = update.short;
        let evidence = readings.iter().map(|(i, range, reading)| Evidence {
            by_set: gaussian(*range, expected(reading), sigma),
            blind: self.blind.blind_likelihood(Echo::Range(*range)),
            short: short >> i & 1 == 1,
            familiar: false,
        });
        self.config.trust.step(memory.p_lost, dt_s, 1.0, evidence)
    }
}

const NO_READING: Reading =
    Reading { echo: Echo::Nothing, bearing_rad: 0.0, elevation_rad: 0.0, mount_x: 0.0, mount_y: 0.0 };

fn reborrow<'a>(set: &'a mut PosesMut<'_>) -> PosesMut<'a> {
    PosesMut { x: &mut *set.x, y: &mut *set.y, heading: &mut *set.heading, weight: &mut *set.weight }
}

/// The weighted mean of the whole set and its spread; of several places that compete it is the middle, and the spread says
/// so. Velocity and level, which the set does not hold, are zero.
fn summed_up(set: &PosesMut<'_>) -> Estimate {
    let origin = (set.x.first().copied().unwrap_or(0.0), set.y.first().copied().unwrap_or(0.0));
    let (mut total, mut squared) = (0.0f64, 0.0f64);
    // x, y, xx, xy, yy about the origin, cosine and sine.
    let mut sums = [0.0f64; 7];
    for i in 0..set.weight.len() {
        let w = f64::from(set.weight[i]);
        let (dx, dy) = (f64::from(set.x[i] - origin.0), f64::from(set.y[i] - origin.1));
        let (sin, cos) = sin_cos(set.heading[i]);
        total += w;
        squared += w * w;
        let terms = [dx, dy, dx * dx, dx * dy, dy * dy, f64::from(cos), f64::from(sin)];
        // What weighs nothing may be no number.
        if w > 0.0 {
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += w * term);
        }
    }
    let [x, y, xx, xy, yy, cos, sin] = sums.map(|sum| if total > 0.0 { sum / total } else { 0.0 });
    // Mardia's circular standard deviation; the resultant is at most 1 but for rounding.
    let heading_sigma = (-2.0 * cos.hypot(sin).clamp(1e-9, 1.0).ln()).sqrt() as f32;
    let sound = [x, y, xx, xy, yy, cos, sin].iter().all(|v| v.is_finite()) && total > 0.0;
    Estimate {
        x: origin.0 + x as f32,
        y: origin.1 + y as f32,
        velocity_x: 0.0,
        velocity_y: 0.0,
        heading_offset: wrap_angle(sin.atan2(cos) as f32),
        level_roll: 0.0,
        level_pitch: 0.0,
        variance_x: (xx - x * x).max(0.0) as f32,
        covariance_xy: (xy - x * y) as f32,
        variance_y: (yy - y * y).max(0.0) as f32,
        heading_sigma,
        velocity_sigma: 0.0,
        effective: if squared > 0.0 { (total * total / squared) as f32 } else { 0.0 },
        share: 1.0,
        p_lost: if sound { 0.0 } else { 1.0 },
        state: State::Lost,
    }
}
