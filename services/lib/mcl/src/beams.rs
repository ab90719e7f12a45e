//! A sweep made ready to weigh particles: one look-up table a reading, by the range that the plan has there.

use crate::SonarConfig;
use crate::filter::BLOCK;
use crate::map::RangeMap;
use crate::maths::{exp_minus, power, sin_cos, sum};
use crate::sonar::{Echo, MAX_READINGS, NEAREST, SonarModel, Sweep};
use core::f32::consts::TAU;

/// Likelihoods are kept by expected range in steps of 1/448 of the reach (9 mm at 4 m), a sixth of
/// sigma: the cone table is coarser.
const STEPS: usize = 448;
/// Entries beyond the steps all mean "no echo expected"; a power of two, for the mask below.
const ENTRIES: usize = 512;
/// 2²³: adding it leaves the rounded value in the low bits of an `f32` (0..=2²²).
const ROUND: f32 = 8_388_608.0;
/// What a sweep counts that is no news: the noise of each reading is new.
const STALE: f32 = 0.5;

/// What of the mixture depends on the expected range alone, by row.
struct Row {
    expected: f32,
    /// 1 / 2σ².
    precision: f32,
    /// Hit probability over σ√(2π).
    hit: f32,
    /// Weight of the exponential before the wall.
    before: f32,
}

/// One reading made ready to weigh particles.
struct Beam {
    bearing: f32,
    /// Cosine and sine of the bearing.
    direction: (f32, f32),
    mount_x: f32,
    mount_y: f32,
    /// Likelihood to one who does not know the place.
    blind: f32,
    /// Likelihood at the best place; the factors are in its proportion.
    best: f32,
    /// Sum over the set of prior weight times factor.
    evidence: f32,
    /// By expected range: likelihood over `best`, at least the floor.
    factor: [f32; ENTRIES],
}

/// The readings of one update made ready; kept in the filter, so that an update allocates nothing.
pub(crate) struct Beams {
    model: SonarModel,
    rows: Vec<Row>,
    beams: Vec<Beam>,
    used: usize,
    /// Exponent on each likelihood of this sweep.
    temper: f32,
    scale: f32,
    yaw: f32,
    /// Room for what passes between the loops of one block.
    columns: Box<[[f32; BLOCK]; 9]>,
}

impl Beams {
    pub(crate) fn new(config: &SonarConfig) -> Self {
        let model = SonarModel::new(config);
        let step = config.max_range / STEPS as f32;
        let rows = (0..=STEPS)
            .map(|i| {
                let expected = i as f32 * step;
                let sigma = model.sigma(expected);
                Row {
                    expected,
                    precision: 0.5 / (sigma * sigma),
                    hit: model.hit() / (sigma * TAU.sqrt()),
                    before: config.short / (1.0 - (-expected.max(NEAREST)).exp()),
                }
            })
            .collect();
        let beam = || Beam {
            bearing: 0.0,
            direction: (1.0, 0.0),
            mount_x: 0.0,
            mount_y: 0.0,
            blind: 1.0,
            best: 1.0,
            evidence: 0.0,
            factor: [1.0; ENTRIES],
        };
        Self {
            model,
            rows,
            beams: (0..MAX_READINGS).map(|_| beam()).collect(),
            used: 0,
            temper: config.temper,
            scale: STEPS as f32 / config.max_range,
            yaw: 0.0,
            columns: Box::new([[0.0; BLOCK]; 9]),
        }
    }

    pub(crate) fn model(&self) -> &SonarModel {
        &self.model
    }

    /// Fills one look-up table a reading.
    pub(crate) fn prepare(&mut self, sweep: &Sweep<'_>) {
        self.used = 0;
        self.yaw = sweep.yaw_rad;
        self.temper = self.model.config.temper * sweep.news().max(STALE);
        if !sweep.yaw_rad.is_finite() {
            return;
        }
        let model = &self.model;
        for (_, reading) in sweep.telling() {
            let Some(echo) = model.levelled(reading, sweep) else { continue };
            let beam = &mut self.beams[self.used];
            beam.bearing = reading.bearing_rad;
            beam.direction = (reading.bearing_rad.cos(), reading.bearing_rad.sin());
            beam.mount_x = reading.mount_x;
            beam.mount_y = reading.mount_y;
            beam.blind = model.blind_likelihood(echo);
            beam.evidence = 0.0;
            match echo {
                Echo::Range(z) => {
                    let random = model.config.random / model.config.max_range;
                    let near = (-z).exp();
                    for (factor, row) in beam.factor.iter_mut().zip(&self.rows) {
                        let error = z - row.expected;
                        let before = if error < 0.0 { row.before * near } else { 0.0 };
                        *factor = row.hit * exp_minus(error * error * row.precision) + before + random;
                    }
                }
                Echo::Nothing => {
                    for (factor, row) in beam.factor.iter_mut().zip(&self.rows) {
                        *factor = model.likelihood(echo, row.expected);
                    }
                }
            }
            beam.factor[STEPS + 1..].fill(model.likelihood(echo, f32::INFINITY));
            beam.best = beam.factor.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
            let (scale, floor) = (1.0 / beam.best, model.config.floor);
            for factor in &mut beam.factor {
                *factor = (*factor * scale).max(floor);
            }
            self.used += 1;
        }
    }

    /// Multiplies the weights of a block of particles by the tempered likelihood of the readings.
    pub(crate) fn weigh<M: RangeMap>(
        &mut self,
        map: &M,
        x: &[f32],
        y: &[f32],
        heading_offset: &[f32],
        weight: &mut [f32],
    ) {
        if self.used == 0 {
            return;
        }
        let n = x.len().min(BLOCK);
        let (x, y, offset, weight) = (&x[..n], &y[..n], &heading_offset[..n], &mut weight[..n]);
        let [sin, cos, sensor_x, sensor_y, angle, axis_cos, axis_sin, expected, product] = &mut *self.columns;
        for i in 0..n {
            (sin[i], cos[i]) = sin_cos(self.yaw + offset[i]);
        }
        product.fill(1.0);
        for beam in &mut self.beams[..self.used] {
            let axis = self.yaw + beam.bearing;
            for i in 0..n {
                sensor_x[i] = x[i] + cos[i] * beam.mount_x - sin[i] * beam.mount_y;
                sensor_y[i] = y[i] + sin[i] * beam.mount_x + cos[i] * beam.mount_y;
                angle[i] = axis + offset[i];
                axis_cos[i] = cos[i] * beam.direction.0 - sin[i] * beam.direction.1;
                axis_sin[i] = sin[i] * beam.direction.0 + cos[i] * beam.direction.1;
            }
            map.ranges(
                &sensor_x[..n],
                &sensor_y[..n],
                &angle[..n],
                &axis_cos[..n],
                &axis_sin[..n],
                &mut expected[..n],
            );
            for i in 0..n {
                let factor = beam.factor[entry(expected[i] * self.scale)];
                product[i] *= factor;
                expected[i] = weight[i] * factor;
            }
            beam.evidence += sum(&expected[..n]);
        }
        let temper = self.temper;
        for i in 0..n {
            weight[i] *= power(product[i], temper);
        }
    }

    /// Of each reading: its likelihood under the set before it was weighed (prior weights summing to
    /// `total`), and to one who does not know the place.
    pub(crate) fn evidence(&self, total: f32) -> impl Iterator<Item = (f32, f32)> + '_ {
        self.beams[..self.used].iter().map(move |b| (b.best * b.evidence / total, b.blind))
    }
}

/// Row of the table for a range in steps: rounded, everything past the steps (infinite and NaN too) in
/// the last row. Adding 2²³ instead of a cast, because a cast that saturates costs more than the rest.
#[inline]
fn entry(steps: f32) -> usize {
    ((steps.min((ENTRIES - 1) as f32) + ROUND).to_bits() & (ENTRIES as u32 - 1)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sonar::Reading;

    #[test]
    fn a_range_falls_into_its_row() {
        assert_eq!(entry(0.0), 0);
        assert_eq!(entry(17.4), 17);
        assert_eq!(entry(STEPS as f32), STEPS);
        for beyond in [512.0, 1e9, f32::INFINITY, f32::NAN] {
            assert_eq!(entry(beyond), 511, "{beyond}");
        }
    }

    struct Wall;

    impl RangeMap for Wall {
        fn range(&self, x: f32, _: f32, _: f32) -> f32 {
            2.0 - x
        }
    }

    #[test]
    fn what_is_no_news_weighs_less() {
        let reading = Reading {
            echo: Echo::Range(2.0),
            bearing_rad: 0.0,
            elevation_rad: 0.0,
            mount_x: 0.0,
            mount_y: 0.0,
        };
        let ratio = |news: f32| {
            let mut beams = Beams::new(&SonarConfig::default());
            let readings = [reading];
            beams.prepare(&Sweep {
                readings: &readings,
                roll_rad: 0.0,
                pitch_rad: 0.0,
                yaw_rad: 0.0,
                news,
                familiar: 0,
                doors: 0,
            });
            let mut weight = [1.0, 1.0];
            beams.weigh(&Wall, &[0.0, 0.1], &[0.0; 2], &[0.0; 2], &mut weight);
            weight[1] / weight[0]
        };
        assert!(ratio(1.0) < 0.9, "{}", ratio(1.0));
        assert!((ratio(0.7) - ratio(1.0).powf(0.7)).abs() < 0.01, "{}", ratio(0.7));
        assert!((ratio(0.0) - ratio(1.0).powf(STALE)).abs() < 0.01, "{}", ratio(0.0));
        assert_eq!(ratio(f32::NAN), ratio(1.0));
    }
}
