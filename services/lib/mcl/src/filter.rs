//! One update of the particle set.

use crate::beams::Beams;
use crate::config::{Config, ConfigError};
use crate::estimate::{Estimate, Summary};
use crate::generator::{Generator, Lanes};
use crate::map::RangeMap;
use crate::maths::sum;
use crate::memory::Memory;
use crate::motion::{Motion, NOISE_ROWS, Step};
use crate::particles::{ParticlesMut, ParticlesRef};
use crate::resample::draw_ancestors;
use crate::sonar::{Echo, Sweep};
use crate::trust::Evidence;

/// Particles are worked on in blocks of this many, so that what passes between the steps stays in the
/// first-level cache.
pub(crate) const BLOCK: usize = 256;
/// Doubt up to which the heading tells what the compass errs by on average.
const SURE: f32 = 0.05;
/// Weights below this are nothing: subnormal numbers are slow.
const NOTHING: f32 = 1e-30;

/// A known place to start from, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// Standard deviation of each, metres.
    pub sigma: f32,
    /// Plan heading minus compass yaw, radians.
    pub heading_offset: f32,
    /// Its standard deviation, radians.
    pub heading_sigma: f32,
    /// Level error of roll, radians.
    pub level_roll: f32,
    /// Level error of pitch, radians.
    pub level_pitch: f32,
    /// Standard deviation of each, radians.
    pub level_sigma: f32,
    /// Plan frame, m/s.
    pub velocity: [f32; 2],
    /// Doubt to begin with, 0..=1.
    pub p_lost: f32,
}

/// What came of an update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Update {
    /// Particles written; 0 when there was no room or no set to start from.
    pub count: usize,
    /// The set summed up.
    pub estimate: Estimate,
    /// Goes with the set just written.
    pub memory: Memory,
    /// Whether ancestors were drawn.
    pub resampled: bool,
    /// Bit i: reading i of the sweep was an echo that fits the plan at the estimated place.
    pub fits: u32,
    /// Bit i: reading i was shorter than the plan has it there.
    pub short: u32,
}

/// The filter: settings, the map, and room to work in. It holds nothing of the set: the same arguments
/// give the same result whatever was done before.
pub struct Filter<M> {
    config: Config,
    map: M,
    beams: Beams,
    summary: Summary,
    ancestors: Vec<u32>,
    noise: Box<[[f32; BLOCK]; NOISE_ROWS]>,
}

impl<M: RangeMap> Filter<M> {
    /// A filter for sets of up to `capacity` particles on `map`. Allocates here and nowhere else.
    ///
    /// # Errors
    /// A setting outside its bounds.
    pub fn new(config: Config, map: M, capacity: usize) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            beams: Beams::new(&config.sonar),
            config,
            map,
            summary: Summary::new(),
            ancestors: vec![0; capacity],
            noise: Box::new([[0.0; BLOCK]; NOISE_ROWS]),
        })
    }

    /// The settings.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The map.
    pub fn map(&self) -> &M {
        &self.map
    }

    /// Writes a set around a known place into `next`.
    pub fn start_at(
        &mut self,
        start: &Start,
        mut next: ParticlesMut<'_>,
        generator: &mut Generator,
    ) -> Update {
        let count = self.config.population.max.min(next.capacity()).min(self.ancestors.len());
        let mut lanes = Lanes::new(generator);
        self.draw(start, &mut next, 0, count, &mut lanes);
        next.weight[..count].fill(1.0 / count as f32);
        let mut update = self.begin(count, start.p_lost, &next);
        update.memory.heading_mean = Some(crate::wrap_angle(start.heading_offset));
        update
    }

    /// Writes a set around places of which each may be the one, with the share of the belief that it has.
    pub fn start_among(
        &mut self,
        starts: impl Iterator<Item = (Start, f32)>,
        p_lost: f32,
        mut next: ParticlesMut<'_>,
        generator: &mut Generator,
    ) -> Update {
        let room = self.config.population.max.min(next.capacity()).min(self.ancestors.len());
        let mut lanes = Lanes::new(generator);
        let mut count = 0;
        for (start, share) in starts {
            let more = ((share.clamp(0.0, 1.0) * room as f32) as usize).min(room - count);
            self.draw(&start, &mut next, count, count + more, &mut lanes);
            count += more;
        }
        next.weight[..count].fill(1.0 / count.max(1) as f32);
        self.begin(count, p_lost, &next)
    }

    /// Draws the particles `from..count` around a place.
    fn draw(
        &mut self,
        start: &Start,
        next: &mut ParticlesMut<'_>,
        mut from: usize,
        count: usize,
        lanes: &mut Lanes,
    ) {
        while from < count {
            let to = (from + BLOCK).min(count);
            for row in self.noise.iter_mut() {
                lanes.fill_normal(row);
            }
            let [nx, ny, no, nr, np, ..] = &*self.noise;
            let block = next.part(from, to);
            for i in 0..to - from {
                block.x[i] = start.x + start.sigma * nx[i];
                block.y[i] = start.y + start.sigma * ny[i];
                block.heading_offset[i] =
                    crate::wrap_angle(start.heading_offset + start.heading_sigma * no[i]);
                block.level_roll[i] = start.level_roll + start.level_sigma * nr[i];
                block.level_pitch[i] = start.level_pitch + start.level_sigma * np[i];
            }
            block.velocity_x.fill(start.velocity[0]);
            block.velocity_y.fill(start.velocity[1]);
            from = to;
        }
    }

    /// What is to be said of a set that was drawn.
    fn begin(&mut self, count: usize, p_lost: f32, next: &ParticlesMut<'_>) -> Update {
        let (estimate, spread) = self.summary.of(&next.written(count));
        let estimate = estimate.doubted(p_lost.clamp(0.0, 1.0));
        let memory = Memory {
            p_lost: p_lost.clamp(0.0, 1.0),
            effective: estimate.effective,
            wanted: self.wanted(&estimate, spread),
            heading_mean: None,
        };
        Update { count, estimate, memory, resampled: false, fits: 0, short: 0 }
    }

    /// Reads the set `previous`, moves it by `motion`, weighs it by `sweep` when there is one, and
    /// writes it into `next`. `memory` is what [`Update::memory`] was for `previous`.
    ///
    /// Any input is survived: readings that make no sense are left out, motion that is not finite counts
    /// as rest, weights that vanish or are broken become equal and the estimate lost.
    pub fn update(
        &mut self,
        previous: ParticlesRef<'_>,
        memory: &Memory,
        motion: &Motion,
        sweep: Option<&Sweep<'_>>,
        mut next: ParticlesMut<'_>,
        generator: &mut Generator,
    ) -> Update {
        let have = previous.len();
        let room = next.capacity().min(self.ancestors.len());
        let previous = previous.first(have);
        let (count, resampled) = self.plan_count(have, room, memory);
        if resampled {
            draw_ancestors(previous.weight, generator.uniform(), &mut self.ancestors[..count]);
        }

        // While the set does not fit, it searches wider: up to four times the roughening, from a doubt
        // of 0.2 up.
        let widen = 1.0 + 3.0 * ((memory.p_lost - 0.2) / 0.6).clamp(0.0, 1.0);
        // And with any heading: what it took for the mean may be wrong as well.
        let heading_mean = memory.heading_mean.filter(|_| widen <= 1.0);
        let step = Step::new(&self.config.motion, motion, widen, heading_mean);
        let sweep = sweep.filter(|_| !motion.grounded);
        if let Some(sweep) = sweep {
            self.beams.prepare(sweep);
        }
        let mut lanes = Lanes::new(generator);
        let (mut prior, mut total) = (0.0, 0.0);
        let mut from = 0;
        while from < count {
            let to = (from + BLOCK).min(count);
            let mut block = next.part(from, to);
            if resampled {
                gather(&previous, &self.ancestors[from..to], &mut block);
                block.weight.fill(1.0 / count as f32);
            } else {
                copy(&previous, from, to, &mut block);
            }
            if !motion.grounded {
                for row in self.noise.iter_mut() {
                    lanes.fill_normal(row);
                }
            }
            step.apply(&mut block, &self.noise);
            prior += sum(block.weight);
            if sweep.is_some() {
                self.beams.weigh(&self.map, block.x, block.y, block.heading_offset, block.weight);
            }
            total += sum(block.weight);
            from = to;
        }

        let sound = total.is_finite() && total > NOTHING;
        if sound {
            normalise(&mut next.weight[..count], 1.0 / total);
        } else {
            next.weight[..count].fill(1.0 / count.max(1) as f32);
        }
        let (estimate, spread) = self.summary.of(&next.written(count));
        let doubt = if !sound {
            1.0
        } else if let Some(sweep) = sweep {
            let heard = self.compared(sweep, &estimate).map(|(i, range, expected, sigmas)| {
                (range < expected - sigmas, sweep.familiar >> i & 1 == 1)
            });
            let evidence = self
                .beams
                .evidence(prior)
                .zip(heard)
                .map(|((by_set, blind), (short, familiar))| Evidence { by_set, blind, short, familiar });
            self.config.trust.step(memory.p_lost, motion.dt_s, sweep.news(), evidence)
        } else if motion.grounded {
            memory.p_lost
        } else {
            self.config.trust.step(memory.p_lost, motion.dt_s, 1.0, core::iter::empty())
        };
        let estimate = estimate.doubted(doubt);
        let sure_s = if motion.grounded || doubt >= SURE { 0.0 } else { motion.dt_s };
        let heading_mean = memory.heading_mean_after(sure_s, estimate.heading_offset);
        let wanted = self.wanted(&estimate, spread);
        let memory = Memory { p_lost: doubt, effective: estimate.effective, wanted, heading_mean };
        let (fits, short) = sweep.map_or((0, 0), |s| self.fits(s, &estimate));
        Update { count, estimate, memory, resampled, fits, short }
    }

    /// Size of the next set, and whether ancestors must be drawn for it: when the weights have become
    /// uneven, or the set is a quarter too small or half too large.
    fn plan_count(&self, have: usize, room: usize, memory: &Memory) -> (usize, bool) {
        if have == 0 || room == 0 {
            return (0, false);
        }
        let p = &self.config.population;
        let wanted = (memory.wanted as usize).clamp(p.min, p.max).min(room);
        let uneven = memory.effective < self.config.resample.threshold * have as f32;
        let ill_sized = wanted * 4 > have * 5 || wanted * 3 < have * 2 || have > room;
        if uneven || ill_sized { (wanted, true) } else { (have, false) }
    }

    /// KLD sampling (Fox 2003): enough particles that, with 99 %, the set differs from the distribution
    /// it stands for by less than `error`. The bins that the distribution fills are counted from its
    /// spread instead of in a histogram: the ellipse of two standard deviations.
    fn wanted(&self, estimate: &Estimate, spread: [f32; 2]) -> f32 {
        let p = &self.config.population;
        let across = |sigma: f32| (4.0 * sigma / p.bin).max(1.0);
        let area = core::f32::consts::FRAC_PI_4 * across(spread[0]) * across(spread[1]);
        let headings = (4.0 * estimate.heading_sigma / p.heading_bin).max(1.0);
        let velocities = (4.0 * estimate.velocity_sigma / p.velocity_bin).max(1.0).powi(2);
        let bins = (area * headings * velocities).max(2.0);
        let k = bins - 1.0;
        let a = 2.0 / (9.0 * k);
        // 2.326: upper 1 % point of the standard normal.
        let n = k / (2.0 * p.error) * (1.0 - a + a.sqrt() * 2.326).powi(3);
        // Doubt wants particles too: a lost filter searches with all it may have.
        let doubt = p.max as f32 * ((estimate.p_lost - 0.2) / 0.6).clamp(0.0, 1.0);
        let wanted = n.max(doubt);
        if wanted.is_finite() { wanted.clamp(p.min as f32, p.max as f32) } else { p.max as f32 }
    }

    /// Each reading that says something about walls: its index, its range (infinite: silence), what the plan has
    /// at the estimated place, and three sigma of the sensor and of the place.
    fn compared<'s>(
        &'s self,
        sweep: &'s Sweep<'_>,
        e: &'s Estimate,
    ) -> impl Iterator<Item = (usize, f32, f32, f32)> + 's {
        let model = self.beams.model();
        let heading = sweep.yaw_rad + e.heading_offset;
        let (sin, cos) = heading.sin_cos();
        sweep.telling().filter_map(move |(i, r)| {
            let range = match model.levelled(r, sweep)? {
                Echo::Range(range) => range,
                Echo::Nothing => f32::INFINITY,
            };
            let expected = self.map.range(
                e.x + cos * r.mount_x - sin * r.mount_y,
                e.y + sin * r.mount_x + cos * r.mount_y,
                heading + r.bearing_rad,
            );
            Some((i, range, expected, 3.0 * model.sigma(range.min(expected)).hypot(e.sigma())))
        })
    }

    /// Which echoes fit the plan, and which are too short for it.
    fn fits(&self, sweep: &Sweep<'_>, e: &Estimate) -> (u32, u32) {
        self.compared(sweep, e).fold((0, 0), |(fits, short), (i, range, expected, sigmas)| {
            let bit = |is: bool| u32::from(is) << i;
            (fits | bit((range - expected).abs() < sigmas), short | bit(range < expected - sigmas))
        })
    }
}

fn gather(previous: &ParticlesRef<'_>, ancestors: &[u32], block: &mut ParticlesMut<'_>) {
    let pick = |from: &[f32], to: &mut [f32]| {
        for (slot, ancestor) in to.iter_mut().zip(ancestors) {
            *slot = from[*ancestor as usize];
        }
    };
    pick(previous.x, block.x);
    pick(previous.y, block.y);
    pick(previous.velocity_x, block.velocity_x);
    pick(previous.velocity_y, block.velocity_y);
    pick(previous.heading_offset, block.heading_offset);
    pick(previous.level_roll, block.level_roll);
    pick(previous.level_pitch, block.level_pitch);
}

fn copy(previous: &ParticlesRef<'_>, from: usize, to: usize, block: &mut ParticlesMut<'_>) {
    block.x.copy_from_slice(&previous.x[from..to]);
    block.y.copy_from_slice(&previous.y[from..to]);
    block.velocity_x.copy_from_slice(&previous.velocity_x[from..to]);
    block.velocity_y.copy_from_slice(&previous.velocity_y[from..to]);
    block.heading_offset.copy_from_slice(&previous.heading_offset[from..to]);
    block.level_roll.copy_from_slice(&previous.level_roll[from..to]);
    block.level_pitch.copy_from_slice(&previous.level_pitch[from..to]);
    block.weight.copy_from_slice(&previous.weight[from..to]);
}

/// Equation 4.
fn normalise(weights: &mut [f32], scale: f32) {
    for w in weights {
        let scaled = *w * scale;
        *w = if scaled < NOTHING { 0.0 } else { scaled };
    }
}
