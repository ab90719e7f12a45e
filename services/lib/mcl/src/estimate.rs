//! What the set says, summed up.

use crate::filter::BLOCK;
use crate::maths::{LANES, wrap_angle};
use crate::particles::ParticlesRef;

/// How far the estimate may be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// What was known no longer fits.
    Lost,
    /// Hypotheses compete.
    Converging,
    /// One place, believed.
    Tracking,
}

/// The set summed up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean of the main cluster, plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// Plan frame, m/s.
    pub velocity_x: f32,
    /// Plan frame, m/s.
    pub velocity_y: f32,
    /// Plan heading minus compass yaw, radians.
    pub heading_offset: f32,
    /// What the roll reading is when the body is level, radians.
    pub level_roll: f32,
    /// What the pitch reading is when the body is level, radians.
    pub level_pitch: f32,
    /// Covariance of the main cluster, m².
    pub variance_x: f32,
    /// Covariance of the main cluster, m².
    pub covariance_xy: f32,
    /// Covariance of the main cluster, m².
    pub variance_y: f32,
    /// Standard deviation of the heading offset, radians.
    pub heading_sigma: f32,
    /// Standard deviation of each velocity component, m/s.
    pub velocity_sigma: f32,
    /// Effective sample size 1 / Σ w².
    pub effective: f32,
    /// Share of the weight in the main cluster, 0..=1.
    pub share: f32,
    /// Probability that the true place is not the one said here, 0..=1.
    pub p_lost: f32,
    /// A word for all that.
    pub state: State,
}

impl Estimate {
    /// The larger standard deviation of the position, in any direction, metres.
    #[must_use]
    pub fn sigma(&self) -> f32 {
        let mean = 0.5 * (self.variance_x + self.variance_y);
        let half = 0.5 * (self.variance_x - self.variance_y);
        (mean + half.hypot(self.covariance_xy)).max(0.0).sqrt()
    }

    /// The smaller one.
    #[must_use]
    pub fn sigma_across(&self) -> f32 {
        let mean = 0.5 * (self.variance_x + self.variance_y);
        let half = 0.5 * (self.variance_x - self.variance_y);
        (mean - half.hypot(self.covariance_xy)).max(0.0).sqrt()
    }

    /// The same with at least this much doubt.
    pub(crate) fn doubted(mut self, p_lost: f32) -> Self {
        self.p_lost = self.p_lost.max(p_lost);
        self.state = state(self.p_lost, self.sigma(), self.share);
        self
    }
}

/// The state that goes with a doubt and a spread: tracking while the place is believed to half a metre
/// (DESIGN 4 stops the drone beyond that), lost when it is more likely wrong than right.
pub(crate) fn state(p_lost: f32, sigma: f32, share: f32) -> State {
    if p_lost > 0.5 {
        State::Lost
    } else if p_lost < 0.2 && sigma < 0.5 && share > 0.8 {
        State::Tracking
    } else {
        State::Converging
    }
}

/// Columns that are summed.
const COLUMNS: usize = 7;
/// The one of them that is an angle.
const TURNING: usize = 4;

/// Weighted first and second moments of the columns, taken about an origin inside the set so that
/// single precision suffices.
#[derive(Clone, Copy)]
struct Moments {
    weight: f64,
    weight_squared: f64,
    mean: [f64; COLUMNS],
    square: [f64; COLUMNS],
    xy: f64,
}

/// Adds a column's weighted moments about `origin`, lane by lane.
#[inline]
fn add(
    weight: &[f32],
    column: &[f32],
    about: impl Fn(f32) -> f32,
    sum: &mut [f32; LANES],
    square: &mut [f32; LANES],
) {
    let mut add = |weights: &[f32], values: &[f32]| {
        for (lane, (w, v)) in weights.iter().zip(values).enumerate().take(LANES) {
            let d = about(*v);
            sum[lane] += w * d;
            square[lane] += w * d * d;
        }
    };
    let ((weights, w), (values, v)) = (weight.as_chunks::<LANES>(), column.as_chunks::<LANES>());
    for (w, v) in weights.iter().zip(values) {
        add(w, v);
    }
    add(w, v);
}

fn moments(p: &ParticlesRef<'_>, origin: &[f32; COLUMNS], near: Option<(f32, f32, f32)>) -> Moments {
    let columns = [p.x, p.y, p.velocity_x, p.velocity_y, p.heading_offset, p.level_roll, p.level_pitch];
    let mut sum = [[0.0f32; LANES]; COLUMNS];
    let mut square = [[0.0f32; LANES]; COLUMNS];
    let (mut weight, mut weight2, mut xy) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
    let (mut weights, mut across) = ([0.0f32; BLOCK], [0.0f32; BLOCK]);
    let mut from = 0;
    while from < p.len() {
        let to = (from + BLOCK).min(p.len());
        let (weights, across) = (&mut weights[..to - from], &mut across[..to - from]);
        let (x, y) = (&p.x[from..to], &p.y[from..to]);
        weights.copy_from_slice(&p.weight[from..to]);
        if let Some((cx, cy, radius)) = near {
            for (w, (x, y)) in weights.iter_mut().zip(x.iter().zip(y)) {
                let (dx, dy) = (x - cx, y - cy);
                *w = if dx * dx + dy * dy <= radius * radius { *w } else { 0.0 };
            }
        }
        for (k, column) in columns.iter().enumerate() {
            let (column, origin) = (&column[from..to], origin[k]);
            let (sum, square) = (&mut sum[k], &mut square[k]);
            if k == TURNING {
                add(weights, column, |v| wrap_angle(v - origin), sum, square);
            } else {
                add(weights, column, |v| v - origin, sum, square);
            }
        }
        for (across, (x, y)) in across.iter_mut().zip(x.iter().zip(y)) {
            *across = (x - origin[0]) * (y - origin[1]);
        }
        add(weights, across, |v| v, &mut xy, &mut [0.0; LANES]);
        for (lane, w) in weights.iter().enumerate() {
            weight[lane % LANES] += w;
            weight2[lane % LANES] += w * w;
        }
        from = to;
    }
    let total = |lanes: &[f32; LANES]| lanes.iter().map(|l| f64::from(*l)).sum::<f64>();
    let w = total(&weight);
    let scale = if w > 0.0 { 1.0 / w } else { 0.0 };
    Moments {
        weight: w,
        weight_squared: total(&weight2),
        mean: core::array::from_fn(|k| total(&sum[k]) * scale),
        square: core::array::from_fn(|k| total(&square[k]) * scale),
        xy: total(&xy) * scale,
    }
}

/// Side of the histogram that finds the main cluster.
const GRID: usize = 48;
/// A set wider than this is looked through for clusters, metres.
const WIDE_M: f32 = 0.35;
/// Particles this near to the peak belong to it, metres.
const CLUSTER_M: f32 = 1.0;

/// Finds where most of the weight is; keeps the room that it needs.
pub(crate) struct Summary {
    grid: Vec<f32>,
}

impl Summary {
    pub(crate) fn new() -> Self {
        Self { grid: vec![0.0; GRID * GRID] }
    }

    /// Centre of the fullest 3x3 cells of a histogram over the set's bounding box.
    fn peak(&mut self, p: &ParticlesRef<'_>) -> (f32, f32) {
        let bounds = |v: &[f32]| {
            v.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
        };
        let ((x0, x1), (y0, y1)) = (bounds(p.x), bounds(p.y));
        // Cells of a third of a cluster's reach, or larger when the set is wider than the grid.
        let cell = ((x1 - x0).max(y1 - y0) / (GRID - 3) as f32).max(CLUSTER_M / 3.0);
        let scale = 1.0 / cell;
        let index = |v: f32, low: f32| (((v - low) * scale) as usize + 1).min(GRID - 2);
        self.grid.fill(0.0);
        for i in 0..p.len() {
            self.grid[index(p.y[i], y0) * GRID + index(p.x[i], x0)] += p.weight[i];
        }
        let mut best = (-1.0, 0, 0);
        for iy in 1..GRID - 1 {
            for ix in 1..GRID - 1 {
                let row = |iy: usize| self.grid[iy * GRID + ix - 1..=iy * GRID + ix + 1].iter().sum::<f32>();
                let sum = row(iy - 1) + row(iy) + row(iy + 1);
                if sum > best.0 {
                    best = (sum, ix, iy);
                }
            }
        }
        (x0 + (best.1 as f32 - 0.5) * cell, y0 + (best.2 as f32 - 0.5) * cell)
    }

    /// Sums up a set of normalised weights. A set whose weights or values do not add up gives an
    /// estimate that is lost; otherwise only a set of several clusters is doubted here. Also returns the area in which the *whole* set lives, as standard
    /// deviations along and across.
    pub(crate) fn of(&mut self, p: &ParticlesRef<'_>) -> (Estimate, [f32; 2]) {
        let origin = [
            p.x.first(),
            p.y.first(),
            p.velocity_x.first(),
            p.velocity_y.first(),
            p.heading_offset.first(),
            p.level_roll.first(),
            p.level_pitch.first(),
        ]
        .map(|v| v.copied().unwrap_or(0.0));
        let all = moments(p, &origin, None);
        let effective = if all.weight_squared > 0.0 {
            (all.weight * all.weight / all.weight_squared) as f32
        } else {
            0.0
        };
        let mut estimate = describe(&all, &origin, 0.0, effective, 1.0);
        let spread = [estimate.sigma(), estimate.sigma_across()];
        if spread[0] > WIDE_M {
            let (mut cx, mut cy) = self.peak(p);
            // The second look is centred on what the first one found.
            for _ in 0..2 {
                let main = moments(p, &origin, Some((cx, cy, CLUSTER_M)));
                if main.weight > 0.0 {
                    let share = (main.weight / all.weight) as f32;
                    estimate = describe(&main, &origin, 1.0 - share, effective, share);
                    (cx, cy) = (estimate.x, estimate.y);
                }
            }
        }
        (estimate, spread)
    }
}

fn describe(m: &Moments, origin: &[f32; COLUMNS], p_lost: f32, effective: f32, share: f32) -> Estimate {
    let mean: [f32; COLUMNS] = core::array::from_fn(|k| origin[k] + m.mean[k] as f32);
    let variance: [f32; COLUMNS] =
        core::array::from_fn(|k| (m.square[k] - m.mean[k] * m.mean[k]).max(0.0) as f32);
    let sound = mean.iter().chain(&variance).all(|v| v.is_finite()) && m.weight > 0.0;
    let mut estimate = Estimate {
        x: mean[0],
        y: mean[1],
        velocity_x: mean[2],
        velocity_y: mean[3],
        heading_offset: wrap_angle(mean[4]),
        level_roll: mean[5],
        level_pitch: mean[6],
        variance_x: variance[0],
        covariance_xy: (m.xy - m.mean[0] * m.mean[1]) as f32,
        variance_y: variance[1],
        heading_sigma: variance[4].sqrt(),
        velocity_sigma: (0.5 * (variance[2] + variance[3])).sqrt(),
        effective,
        share,
        p_lost: if sound { p_lost } else { 1.0 },
        state: State::Lost,
    };
    estimate.state = state(estimate.p_lost, estimate.sigma(), share);
    estimate
}
