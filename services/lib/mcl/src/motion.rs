//! How particles move (equations 1 and 2).

use crate::config::{ConfigError, within};
use crate::filter::BLOCK;
use crate::maths::{exp_minus, sin_cos, tan_tilt, wrap_angle};
use crate::particles::ParticlesMut;

/// Standard gravity, m/s².
const GRAVITY: f32 = 9.806_65;
/// Rows of noise that a block of particles uses up.
pub(crate) const NOISE_ROWS: usize = 8;
/// Longest interval moved over at once, seconds: a set older than this is as good as none.
const LONGEST_S: f32 = 10.0;

/// Process noise and drag.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionConfig {
    /// Random walk of the velocity, m/s per √s: gusts and the tilt that the controller misjudges.
    /// FACTS 8: 0.3 to 0.45; 0.15 lost half of the flights.
    pub velocity_noise: f32,
    /// The same where an accelerometer feels the gusts: a tilt that errs by 0.4 degrees for two seconds at a time.
    pub felt_noise: f32,
    /// Roughening of the position at rest, m per √s.
    pub position_noise: f32,
    /// Roughening of the position with the way flown, m per √m: the scale of the flow, the plan's own errors. FACTS 8 has
    /// 1 cm a ping of 60 ms, at any speed; a drone that waited in a corridor walked off along it by that.
    pub position_noise_per_m: f32,
    /// σ of equation 2's factor 1 + N(0, σ²) on the distance flown.
    pub distance_noise: f32,
    /// Random walk of the heading offset at rest, rad per √s.
    pub heading_noise: f32,
    /// Random walk of the heading offset with distance, rad per √m: compass error that varies with place.
    pub heading_noise_per_m: f32,
    /// Standard deviation of the heading offset about its mean, rad: a compass errs by 20 degrees at most (DESIGN 6), 0.2 on
    /// average where all errors are as likely. The walk is drawn back to the mean so much that it stays within this (Uhlenbeck and Ornstein
    /// 1930): without it, a set that hears nothing in a wide hall turns by what no compass errs by, and finds walls that
    /// fit.
    pub heading_spread: f32,
    /// Random walk of the level error, rad per √s.
    pub level_noise: f32,
    /// Linear air drag over mass, 1/s.
    pub drag: f32,
    /// Acceleration to reckon with while no attitude was known, m/s².
    pub blind_acceleration: f32,
    /// Least weight factor of a flow reading: caps what one frame can say.
    pub flow_floor: f32,
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            velocity_noise: 0.35,
            felt_noise: 0.17,
            position_noise: 0.01,
            position_noise_per_m: 0.05,
            distance_noise: 0.05,
            heading_noise: 0.02,
            heading_noise_per_m: 0.06,
            heading_spread: 0.2,
            level_noise: 0.001,
            drag: 0.25,
            blind_acceleration: 0.8,
            flow_floor: 0.02,
        }
    }
}

impl MotionConfig {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        within("motion.velocity_noise", self.velocity_noise, 0.01..=3.0)?;
        within("motion.felt_noise", self.felt_noise, 0.01..=3.0)?;
        within("motion.position_noise", self.position_noise, 0.001..=1.0)?;
        within("motion.position_noise_per_m", self.position_noise_per_m, 0.0..=1.0)?;
        within("motion.distance_noise", self.distance_noise, 0.0..=1.0)?;
        within("motion.heading_noise", self.heading_noise, 0.0..=1.0)?;
        within("motion.heading_noise_per_m", self.heading_noise_per_m, 0.0..=1.0)?;
        within("motion.heading_spread", self.heading_spread, 0.02..=10.0)?;
        within("motion.level_noise", self.level_noise, 0.0..=0.1)?;
        within("motion.drag", self.drag, 0.0..=5.0)?;
        within("motion.blind_acceleration", self.blind_acceleration, 0.0..=10.0)?;
        within("motion.flow_floor", self.flow_floor, 1e-4..=1.0)
    }
}

/// A velocity measured by optical flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Over the ground, body frame forward, at the end of the interval, m/s.
    pub velocity_x: f32,
    /// The same, left.
    pub velocity_y: f32,
    /// Standard deviation of each, m/s.
    pub sigma: f32,
}

/// What was measured of the motion from the old set's time to the new one's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Length of the interval, seconds.
    pub dt_s: f32,
    /// How much of it passed without an attitude (after a restart), seconds.
    pub blind_s: f32,
    /// Mean over the interval, right side down positive.
    pub roll_rad: f32,
    /// Mean over the interval, nose down positive.
    pub pitch_rad: f32,
    /// Mean over the interval, compass frame, counter-clockwise.
    pub yaw_rad: f32,
    /// Mean specific force of the air over the interval, body frame forward and left, m/s²: what an accelerometer feels
    /// beside the thrust. Drag is part of it.
    pub felt: Option<[f32; 2]>,
    /// Velocity, where something shows it: a flow sensor, or what else the caller knows.
    pub flow: Option<Flow>,
    /// On the ground: nothing moves.
    pub grounded: bool,
}

/// The distance that a particle moves when the vehicle is believed to have moved `rho` metres: equation 2
/// with its factor read as `1 + N(0, sigma²)`. As printed the factor is `N(0, sigma²)`, whose mean is
/// zero: the set would spread where it stands and never follow.
#[inline]
#[must_use]
pub fn noisy_distance(rho: f32, sigma: f32, normal: f32) -> f32 {
    rho * (1.0 + sigma * normal)
}

/// Everything about one interval that is the same for all particles.
pub(crate) struct Step {
    dt: f32,
    roll: f32,
    pitch: f32,
    yaw: f32,
    keep: f32,
    push: f32,
    felt: [f32; 2],
    flow: [f32; 2],
    flow_gain: f32,
    flow_precision: f32,
    flow_cap: f32,
    velocity_sigma: f32,
    position_variance: f32,
    position_variance_per_m_s: f32,
    distance_sigma: f32,
    heading_variance: f32,
    heading_variance_per_m_s: f32,
    heading_mean: f32,
    heading_pull: f32,
    level_sigma: f32,
    grounded: bool,
}

impl Step {
    /// `widen` multiplies the wandering of place and heading while the set does not fit. `heading_mean`: what the heading
    /// offset wanders about, where that is known.
    pub(crate) fn new(config: &MotionConfig, motion: &Motion, widen: f32, heading_mean: Option<f32>) -> Self {
        let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
        let dt = finite(motion.dt_s).clamp(0.0, LONGEST_S);
        let blind = finite(motion.blind_s).clamp(0.0, dt);
        let felt = motion.felt.filter(|felt| felt.iter().all(|axis| axis.is_finite()));
        let (drag, wander) =
            if felt.is_some() { (0.0, config.felt_noise) } else { (config.drag, config.velocity_noise) };
        let keep = exp_minus(drag * dt);
        // ∫ of the decaying response; its limit without drag is dt.
        let push = if drag > 1e-3 { (1.0 - keep) / drag } else { dt };
        let spread = config.blind_acceleration * blind;
        let velocity_variance = wander * wander * dt + spread * spread;
        let flow = motion.flow.filter(|f| {
            f.velocity_x.is_finite() && f.velocity_y.is_finite() && f.sigma.is_finite() && f.sigma > 0.0
        });
        // The product of two Gaussians: what the motion predicts and what the flow says.
        let (flow, flow_gain, flow_precision, velocity_sigma) = match flow {
            Some(f) => {
                let total = velocity_variance + f.sigma * f.sigma;
                let gain = velocity_variance / total;
                let left = ((1.0 - gain) * velocity_variance).sqrt();
                ([f.velocity_x, f.velocity_y], gain, 0.5 / total, left)
            }
            None => ([0.0; 2], 0.0, 0.0, velocity_variance.sqrt()),
        };
        let root = dt.sqrt();
        Self {
            dt,
            roll: finite(motion.roll_rad),
            pitch: finite(motion.pitch_rad),
            yaw: finite(motion.yaw_rad),
            keep,
            push,
            felt: felt.unwrap_or_default(),
            flow,
            flow_gain,
            flow_precision,
            flow_cap: -config.flow_floor.ln(),
            velocity_sigma,
            position_variance: (config.position_noise * widen).powi(2) * dt,
            position_variance_per_m_s: (config.position_noise_per_m * widen).powi(2) * dt,
            distance_sigma: config.distance_noise,
            heading_variance: (config.heading_noise * widen).powi(2) * dt,
            heading_variance_per_m_s: config.heading_noise_per_m.powi(2) * dt,
            heading_mean: heading_mean.unwrap_or(0.0),
            heading_pull: heading_mean.map_or(0.0, |_| 0.5 / config.heading_spread.powi(2)),
            level_sigma: config.level_noise * root,
            grounded: motion.grounded,
        }
    }

    /// Moves a block of at most [`BLOCK`] particles in place, and multiplies the weight of each by how
    /// well it had foretold the flow.
    ///
    /// The velocity is drawn from prediction *and* flow together, and the particle pays for the
    /// difference through its weight: the proposal that is optimal for a linear measurement (Doucet et
    /// al. 2000, as in FastSLAM 2.0). Weighing draws of the prediction alone would throw most of the set
    /// away at each frame, since the flow is as sharp as the prediction.
    pub(crate) fn apply(&self, p: &mut ParticlesMut<'_>, noise: &[[f32; BLOCK]; NOISE_ROWS]) {
        let n = p.x.len().min(BLOCK);
        if self.grounded {
            p.velocity_x[..n].fill(0.0);
            p.velocity_y[..n].fill(0.0);
            return;
        }
        let [n_vx, n_vy, n_x, n_y, n_heading, n_roll, n_pitch, n_distance] = noise;
        let (x, y, w) = (&mut p.x[..n], &mut p.y[..n], &mut p.weight[..n]);
        let (vx, vy, ho) = (&mut p.velocity_x[..n], &mut p.velocity_y[..n], &mut p.heading_offset[..n]);
        let (lr, lp) = (&mut p.level_roll[..n], &mut p.level_pitch[..n]);
        for i in 0..n {
            let speed = (vx[i] * vx[i] + vy[i] * vy[i]).sqrt();
            let heading_variance = self.heading_variance + self.heading_variance_per_m_s * speed;
            let heading_sigma = heading_variance.sqrt();
            let position_sigma = (self.position_variance + self.position_variance_per_m_s * speed).sqrt();
            let back =
                wrap_angle(ho[i] - self.heading_mean) * (self.heading_pull * heading_variance).min(1.0);
            let offset = wrap_angle(ho[i] - back + heading_sigma * n_heading[i]);
            let level_roll = lr[i] + self.level_sigma * n_roll[i];
            let level_pitch = lp[i] + self.level_sigma * n_pitch[i];
            let (sin, cos) = sin_cos(self.yaw + offset);

            // Nose down drives forward (+x), right side down drives right (-y).
            let forward = GRAVITY * tan_tilt(self.pitch - level_pitch) + self.felt[0];
            let left = -GRAVITY * tan_tilt(self.roll - level_roll) + self.felt[1];
            let foretold_x = vx[i] * self.keep + (cos * forward - sin * left) * self.push;
            let foretold_y = vy[i] * self.keep + (sin * forward + cos * left) * self.push;

            let surprise_x = cos * self.flow[0] - sin * self.flow[1] - foretold_x;
            let surprise_y = sin * self.flow[0] + cos * self.flow[1] - foretold_y;
            let miss = (surprise_x * surprise_x + surprise_y * surprise_y) * self.flow_precision;
            w[i] *= exp_minus(miss.min(self.flow_cap));

            let new_x = foretold_x + self.flow_gain * surprise_x + self.velocity_sigma * n_vx[i];
            let new_y = foretold_y + self.flow_gain * surprise_y + self.velocity_sigma * n_vy[i];
            let far = 0.5 * self.dt;
            x[i] += noisy_distance((vx[i] + new_x) * far, self.distance_sigma, n_distance[i])
                + position_sigma * n_x[i];
            y[i] += noisy_distance((vy[i] + new_y) * far, self.distance_sigma, n_distance[i])
                + position_sigma * n_y[i];
            vx[i] = new_x;
            vy[i] = new_y;
            ho[i] = offset;
            lr[i] = level_roll;
            lp[i] = level_pitch;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generator::{Generator, Lanes};

    /// x, y, heading offset, velocity x and y, level roll and pitch, weight.
    type Columns = [[f32; BLOCK]; 8];

    /// Applies a step so many times; before each of them `hold` sets what shall not wander.
    fn fly(step: &Step, seed: u64, steps: usize, columns: &mut Columns, hold: impl Fn(&mut Columns)) {
        let mut lanes = Lanes::new(&mut Generator::new(seed));
        let mut noise = Box::new([[0.0; BLOCK]; NOISE_ROWS]);
        for _ in 0..steps {
            for row in noise.iter_mut() {
                lanes.fill_normal(row);
            }
            hold(columns);
            let [x, y, heading_offset, velocity_x, velocity_y, level_roll, level_pitch, weight] =
                &mut *columns;
            let mut particles = ParticlesMut {
                x,
                y,
                heading_offset,
                velocity_x,
                velocity_y,
                level_roll,
                level_pitch,
                weight,
            };
            step.apply(&mut particles, &noise);
        }
    }

    /// Foretold and measured alike to a millimetre a second.
    fn steady(speed: f32) -> Motion {
        let flow = Some(Flow { velocity_x: speed, velocity_y: 0.0, sigma: 0.001 });
        Motion { dt_s: 0.06, felt: Some([0.0; 2]), flow, ..Motion::default() }
    }

    fn root_mean_square(values: impl Iterator<Item = f32>) -> f32 {
        (values.map(|value| value * value).sum::<f32>() / BLOCK as f32).sqrt()
    }

    /// N = 256 particles, each 50 steps of 60 ms; the standard error of a spread is 1 / √(2 · 256) = 4 %.
    #[test]
    fn what_stands_stays_together_and_what_flies_spreads() {
        let config = MotionConfig::default();
        let spread_after = |speed: f32| {
            let mut columns = [[0.0; BLOCK]; 8];
            columns[3].fill(speed);
            columns[7].fill(1.0 / BLOCK as f32);
            let step = Step::new(&config, &steady(speed), 1.0, None);
            fly(&step, 5, 50, &mut columns, |columns| columns[2].fill(0.0));
            // Across the way, where the distance's own factor has no part.
            root_mean_square(columns[1].iter().copied())
        };
        let (stood, flew) = (spread_after(0.0), spread_after(0.4));
        let expected = [0.01 * 3.0f32.sqrt(), (0.01f32.powi(2) * 3.0 + 0.05f32.powi(2) * 1.2).sqrt()];
        assert!((stood / expected[0] - 1.0).abs() < 0.15, "{stood}");
        assert!((flew / expected[1] - 1.0).abs() < 0.15, "{flew} over 1.2 m");
    }

    /// N = 256 particles over an hour at half a metre a second; the standard error of a spread is 1 / √(2 · 256) = 4 %.
    #[test]
    fn the_heading_offset_wanders_as_far_as_compasses_err_and_no_farther() {
        let config = MotionConfig::default();
        let spread = |mean: Option<f32>| {
            let mut columns = [[0.0; BLOCK]; 8];
            columns[2].fill(3.0);
            let step = Step::new(&config, &steady(0.5), 1.0, mean);
            fly(&step, 7, 60_000, &mut columns, |columns| {
                for (column, value) in [(3, 0.5), (4, 0.0), (5, 0.0), (6, 0.0), (7, 1.0)] {
                    columns[column].fill(value);
                }
            });
            root_mean_square(columns[2].iter().map(|offset| wrap_angle(offset - 3.0)))
        };
        // About a mean beside the half turn, so that wrapping is asked for.
        let held = spread(Some(3.0));
        assert!((held / config.heading_spread - 1.0).abs() < 0.15, "{held}");
        assert!(spread(None) > 1.5, "without a mean it is anywhere after an hour");
    }

    /// Equation 2 as printed, and as meant. N = 80 000, standard error of the mean 0.1 / √N = 0.0004.
    #[test]
    fn equation_2_as_printed_does_not_move_the_set() {
        let mut normals = vec![0.0; 80_000];
        Lanes::new(&mut Generator::new(3)).fill_normal(&mut normals);
        let mean = |f: &dyn Fn(f32) -> f32| normals.iter().map(|n| f64::from(f(*n))).sum::<f64>() / 80_000.0;
        let printed = mean(&|n| 0.5 * (0.2 * n));
        let meant = mean(&|n| noisy_distance(0.5, 0.2, n));
        assert!(printed.abs() < 0.002, "ρ N(0, σ²) leaves the set where it was: {printed}");
        assert!((meant - 0.5).abs() < 0.002, "ρ (1 + N(0, σ²)) takes it along: {meant}");
    }
}
