//! The velocity that is flown by.
//!
//! The particle set averages over many pings: its velocity follows a gust late, and a loop that flies by it sways.
//! This filter carries place, velocity and what is not felt (a first-order gust, the Dryden shape) from one
//! measurement to the next by the measured tilt and what the accelerometer feels: beside the thrust, which is along
//! the body's own axis, that is the air (Leishman et al. 2014), and a gust is known before it has moved the body. A
//! controller that does not tell leaves the gust to be learned from the motion. Optical flow, when there is any, measures the velocity within a
//! frame; over a floor that shows little it still shows a share of the motion, which is learned along with it. The
//! change of a range between two pings measures the velocity towards what was heard. The particles' place, which the
//! walls hold fast, keeps the sum right.

use crate::attitude::{Attitudes, Tilt, seconds};
use crate::flow::Frame;
use crate::rate::{LONGEST_S, Ping};
use ipc_types::MAX_SONARS;

/// Steps of the integration, seconds.
const STEP_S: f64 = 0.01;
/// Without any measurement for so long the velocity is the particles' again, seconds.
const SILENT_S: f64 = 0.3;
/// Standard deviation of one place of the particles, metres: they err by 3 cm, and for so long that each counts for a
/// tenth of what it would alone.
const PLACE_M: f32 = 0.1;
/// A place farther off is a jump of the particles: begun anew, metres.
const JUMP_M: f32 = 0.6;
/// Rms of the air's acceleration, m/s², and the time in which it changes, seconds: FACTS 8 has 0.2 of gusts, more
/// near walls; the rest and the longer time make room for an error of level.
const GUST_M_S2: f32 = 0.3;
const GUST_S: f32 = 1.0;
/// The same where the accelerometer feels the gust: what is left are errors of the attitude, a third of a degree.
const UNFELT_M_S2: f32 = 0.12;
const UNFELT_S: f32 = 2.0;
/// Random walk of the velocity where the accelerometer feels the gust: its vibration, 30 readings a second.
const FELT_WALK: f32 = 0.04;
/// Random walk of the velocity beside the gust, m/s per √s: tilt is read to a tenth of a degree, 30 times a second.
const WALK: f32 = 0.1;
/// How fast the weight of a surprising measurement falls, like Student's t: flow errs when the body turns fast.
const FLOW_TAIL: f32 = 0.1;
/// m/s².
const GRAVITY: f32 = 9.806_65;

/// What share of the motion the flow sensor tells apart over a poor floor, before anything is known of the floor,
/// its standard deviation, the least that is believed, and its random walk per √s.
const SHARE: f32 = 0.65;
const SHARE_SIGMA: f32 = 0.25;
const SHARE_LEAST: f32 = 0.2;
const SHARE_WALK: f32 = 0.05;

/// What turns an attitude into an acceleration in the plan frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Frames {
    /// Heading in the plan less the controller's yaw, radians.
    pub(crate) heading_offset: f32,
    /// Roll and pitch that are read when the thrust is upright, radians.
    pub(crate) level: [f32; 2],
    /// Air drag over mass, 1/s.
    pub(crate) drag: f32,
}

/// What is flown by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Swept {
    /// Plan frame.
    pub(crate) velocity: [f32; 2],
    /// Standard deviation of each component.
    pub(crate) sigma: f32,
    /// Acceleration that the tilt does not explain, plan frame, m/s².
    pub(crate) air: [f32; 2],
}

/// A 3 by 3 block of the covariance.
pub(crate) type Block = [[f32; 3]; 3];

/// A Kalman filter on place, velocity and gust along both axes of the plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Velocity {
    /// Time of the state; zero: none.
    pub(crate) time_ns: u64,
    /// Place, velocity and gust along x and y, plan frame.
    pub(crate) state: [[f32; 3]; 2],
    /// Covariance of x with x, x with y, y with y.
    pub(crate) variance: [Block; 3],
    /// Share of the motion that the flow sensor tells apart over the poor floor below, its variance and its
    /// covariance with the state.
    share: f32,
    share_variance: f32,
    share_with: [[f32; 3]; 2],
    /// The velocity, summed up: unlike the place nothing corrects it.
    pub(crate) way: [f32; 2],
    /// The last echo of each sensor.
    pub(crate) pings: [Ping; MAX_SONARS],
}

impl Velocity {
    /// Begins at a place with a velocity.
    pub(crate) fn begin(&mut self, time_ns: u64, place: [f32; 2], velocity: [f32; 2]) {
        let gust = GUST_M_S2 * GUST_M_S2;
        let own = [[PLACE_M * PLACE_M, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, gust]];
        *self = Self {
            time_ns,
            state: [[place[0], velocity[0], 0.0], [place[1], velocity[1], 0.0]],
            variance: [own, [[0.0; 3]; 3], own],
            share: SHARE,
            share_variance: SHARE_SIGMA * SHARE_SIGMA,
            ..Self::default()
        };
    }

    pub(crate) fn is_known(&self, time_ns: u64) -> bool {
        self.time_ns > 0 && seconds(self.time_ns, time_ns) <= SILENT_S
    }

    /// Takes a flow frame.
    pub(crate) fn flow(&mut self, frame: &Frame, attitudes: &Attitudes, frames: &Frames) {
        if !self.is_known(frame.time_ns) {
            return;
        }
        self.advance(frame.time_ns, attitudes, frames);
        let [x, y] = in_plan(frame, attitudes, frames);
        // A frame from before the state's time is a little old; the gust since then is not worth a replay.
        let miss = [x - self.state[0][1], y - self.state[1][1]];
        let spread = frame.sigma * frame.sigma + self.variance[0][1][1].max(self.variance[2][1][1]);
        let sigma = frame.sigma * (1.0 + FLOW_TAIL * (miss[0] * miss[0] + miss[1] * miss[1]) / spread).sqrt();
        // The floor is another one: what was learned of a poor one is forgotten.
        self.share = SHARE;
        self.share_variance = SHARE_SIGMA * SHARE_SIGMA;
        self.share_with = [[0.0; 3]; 2];
        self.measure(1, [1.0, 0.0], 0.0, miss[0], sigma);
        self.measure(1, [0.0, 1.0], 0.0, miss[1], sigma);
    }

    /// Takes a flow frame from over a poor floor: it shows an unknown share of the velocity. While the velocity
    /// is well known the share is learned from it, afterwards the velocity is from the share.
    pub(crate) fn dim(&mut self, frame: &Frame, attitudes: &Attitudes, frames: &Frames) {
        if !self.is_known(frame.time_ns) {
            return;
        }
        self.advance(frame.time_ns, attitudes, frames);
        for (axis, shown) in in_plan(frame, attitudes, frames).into_iter().enumerate() {
            let velocity = self.state[axis][1];
            let mut along = [0.0; 2];
            along[axis] = self.share;
            self.measure(1, along, velocity, shown - self.share * velocity, frame.sigma);
            self.share = self.share.clamp(SHARE_LEAST, 1.0);
        }
    }

    /// Takes the particles' place at a time, and their spread along both axes: along a corridor they know it no
    /// better than this filter does. Begins with their velocity when nothing is known.
    pub(crate) fn place(
        &mut self,
        time_ns: u64,
        place: [f32; 2],
        spread: [f32; 2],
        velocity: [f32; 2],
        attitudes: &Attitudes,
        frames: &Frames,
    ) {
        let late = seconds(time_ns, self.time_ns).max(0.0) as f32;
        let known = self.is_known(time_ns);
        if known {
            self.advance(time_ns, attitudes, frames);
        }
        let off = [0, 1].map(|axis| place[axis] + late * self.state[axis][1] - self.state[axis][0]);
        let far = off[0].hypot(off[1]);
        if !known || far.is_nan() || far > JUMP_M {
            self.begin(time_ns, place, velocity);
        } else {
            self.measure(0, [1.0, 0.0], 0.0, off[0], PLACE_M.hypot(spread[0]));
            self.measure(0, [0.0, 1.0], 0.0, off[1], PLACE_M.hypot(spread[1]));
        }
    }

    /// Takes a measurement along a direction of one part of the state (and of the share): what it misses the
    /// state by.
    pub(crate) fn measure(&mut self, part: usize, along: [f32; 2], of_share: f32, miss: f32, sigma: f32) {
        let [xx, xy, yy] = &self.variance;
        let [x, y] = &self.share_with;
        let column: [[f32; 3]; 2] = [
            core::array::from_fn(|i| xx[i][part] * along[0] + xy[i][part] * along[1] + x[i] * of_share),
            core::array::from_fn(|i| xy[part][i] * along[0] + yy[i][part] * along[1] + y[i] * of_share),
        ];
        let share = x[part] * along[0] + y[part] * along[1] + self.share_variance * of_share;
        let noise =
            column[0][part] * along[0] + column[1][part] * along[1] + share * of_share + sigma * sigma;
        if !(noise > 0.0 && miss.is_finite()) {
            return;
        }
        let gain = column.map(|axis| axis.map(|c| c / noise));
        for (state, gain) in self.state.iter_mut().zip(gain) {
            for (value, gain) in state.iter_mut().zip(gain) {
                *value += gain * miss;
            }
        }
        for (block, (a, b)) in self.variance.iter_mut().zip([(0, 0), (0, 1), (1, 1)]) {
            for (row, gain) in block.iter_mut().zip(gain[a]) {
                for (value, of_part) in row.iter_mut().zip(column[b]) {
                    *value -= gain * of_part;
                }
            }
        }
        self.share += share / noise * miss;
        for (with, gain) in self.share_with.iter_mut().zip(gain) {
            for (value, gain) in with.iter_mut().zip(gain) {
                *value -= gain * share;
            }
        }
        self.share_variance -= share * share / noise;
        // The error that was just found stood since before the last pings: the way since then was another.
        let time_ns = self.time_ns;
        for ping in self.pings.iter_mut().filter(|ping| ping.time_ns > 0) {
            let age = seconds(ping.time_ns, time_ns).clamp(0.0, f64::from(LONGEST_S)) as f32;
            for (way, gain) in ping.way.iter_mut().zip(gain) {
                *way -= gain[1] * miss * age;
            }
        }
    }

    /// Velocity (plan frame), its standard deviation and the air's acceleration at a time after the newest
    /// measurement; `None` when that was too long ago.
    pub(crate) fn at(&self, time_ns: u64, attitudes: &Attitudes, frames: &Frames) -> Option<Swept> {
        if !self.is_known(time_ns) {
            return None;
        }
        let mut then = self.clone();
        then.advance(time_ns, attitudes, frames);
        let velocity = [then.state[0][1], then.state[1][1]];
        let variance = then.variance[0][1][1].max(then.variance[2][1][1]).max(0.0);
        let air = then.air(time_ns, attitudes, frames);
        velocity.iter().chain(&air).all(|v| v.is_finite()).then(|| Swept {
            velocity,
            sigma: variance.sqrt(),
            air,
        })
    }

    /// What accelerates the body beside its tilt and its drag, plan frame, m/s².
    fn air(&self, time_ns: u64, attitudes: &Attitudes, frames: &Frames) -> [f32; 2] {
        let tilt = attitudes.at(time_ns).unwrap_or_default();
        let unfelt = [self.state[0][2], self.state[1][2]];
        if !tilt.force.iter().all(|axis| axis.is_finite()) {
            return unfelt;
        }
        let (sin, cos) = (tilt.yaw + frames.heading_offset).sin_cos();
        let (read, upright) = (tilted(&tilt, [0.0; 2]), tilted(&tilt, frames.level));
        let [forward, left] = [0, 1].map(|axis| read[axis] - upright[axis] + tilt.force[axis]);
        let felt = [cos * forward - sin * left, sin * forward + cos * left];
        [0, 1].map(|axis| felt[axis] + unfelt[axis] + frames.drag * self.state[axis][1])
    }

    pub(crate) fn advance(&mut self, to_ns: u64, attitudes: &Attitudes, frames: &Frames) {
        let horizon = seconds(self.time_ns, to_ns).clamp(0.0, SILENT_S);
        let steps = (horizon / STEP_S).ceil();
        for step in 0..steps as u32 {
            let h = horizon / steps;
            let time = self.time_ns + ((f64::from(step) + 0.5) * h * 1e9) as u64;
            let tilt = attitudes.at(time).unwrap_or_default();
            let (sin, cos) = (tilt.yaw + frames.heading_offset).sin_cos();
            let felt = tilt.force.iter().all(|axis| axis.is_finite());
            // In the frame that attitude and accelerometer share an error of level has no part.
            let [forward, left] = if felt {
                let [forward, left] = tilted(&tilt, [0.0; 2]);
                [forward + tilt.force[0], left + tilt.force[1]]
            } else {
                tilted(&tilt, frames.level)
            };
            let tilted = [cos * forward - sin * left, sin * forward + cos * left];
            let h = h as f32;
            let (gust_m_s2, gust_s, walk, drag) = if felt {
                (UNFELT_M_S2, UNFELT_S, FELT_WALK, 0.0)
            } else {
                (GUST_M_S2, GUST_S, WALK, frames.drag)
            };
            let (keep, slow) = (1.0 - h / gust_s, 1.0 - drag * h);
            for (([place, velocity, gust], way), tilted) in
                self.state.iter_mut().zip(&mut self.way).zip(tilted)
            {
                *place += *velocity * h;
                *way += *velocity * h;
                *velocity = slow * *velocity + (tilted + *gust) * h;
                *gust *= keep;
            }
            let forward = [[1.0, h, 0.0], [0.0, slow, h], [0.0, 0.0, keep]];
            for with in &mut self.share_with {
                *with = core::array::from_fn(|i| (0..3).map(|k| forward[i][k] * with[k]).sum());
            }
            self.share_variance += SHARE_WALK * SHARE_WALK * h;
            for (block, own) in self.variance.iter_mut().zip([true, false, true]) {
                *block = carried(&forward, block);
                if own {
                    block[1][1] += walk * walk * h;
                    block[2][2] += 2.0 * gust_m_s2 * gust_m_s2 / gust_s * h;
                }
            }
        }
        self.time_ns = to_ns.max(self.time_ns);
    }
}

/// Acceleration forward and left by a tilt that is read, of a body that is upright at `level` (roll, pitch), m/s².
fn tilted(tilt: &Tilt, level: [f32; 2]) -> [f32; 2] {
    let of = |angle: f32| GRAVITY * angle.clamp(-0.6, 0.6).tan();
    [of(tilt.pitch - level[1]), -of(tilt.roll - level[0])]
}

/// The velocity of a frame, which is in the body's, in the plan's.
fn in_plan(frame: &Frame, attitudes: &Attitudes, frames: &Frames) -> [f32; 2] {
    let yaw = attitudes.at(frame.time_ns).unwrap_or_default().yaw + frames.heading_offset;
    let (sin, cos) = yaw.sin_cos();
    let [x, y] = frame.velocity;
    [cos * x - sin * y, sin * x + cos * y]
}

/// F P F'.
fn carried(f: &Block, p: &Block) -> Block {
    let product = |a: &Block, b: &dyn Fn(usize, usize) -> f32| -> Block {
        core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| a[i][k] * b(k, j)).sum()))
    };
    let half = product(f, &|k, j| p[k][j]);
    product(&half, &|k, j| f[j][k])
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) const MS: u64 = 1_000_000;

    pub(crate) fn level() -> Attitudes {
        let mut attitudes = Attitudes::default();
        for i in 1..60 {
            attitudes.push(i * 33 * MS, 0.0, 0.0, 0.0);
        }
        attitudes
    }

    #[test]
    fn a_gust_is_followed_within_a_frame_and_a_half() {
        // 0.5 m/s² from a level body: tilt alone would see nothing.
        let (attitudes, frames) = (level(), Frames::default());
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2]);
        for i in 0..30u64 {
            let time_ns = (100 + 40 * i) * MS;
            let frame = Frame { time_ns, velocity: [0.5 * 0.04 * i as f32, 0.0], sigma: 0.07 };
            velocity.flow(&frame, &attitudes, &frames);
        }
        let Swept { velocity: v, sigma, .. } =
            velocity.at((100 + 40 * 29 + 60) * MS, &attitudes, &frames).unwrap();
        let truth = 0.5 * (0.04 * 29.0 + 0.06);
        assert!((v[0] - truth).abs() < 0.06 * 0.5 && v[1].abs() < 1e-6, "{v:?}, true {truth}");
        assert!((0.01..0.07).contains(&sigma), "{sigma}");
    }

    #[test]
    fn the_place_alone_shows_a_drift_within_a_second() {
        // 0.4 m/s that neither tilt nor flow tell of.
        let (attitudes, frames) = (level(), Frames::default());
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2]);
        for i in 1..=20u64 {
            let place = [0.4 * 0.06 * i as f32, 1.0];
            velocity.place((100 + 60 * i) * MS, place, [0.0; 2], [0.0; 2], &attitudes, &frames);
            if i == 1 {
                // The jump across y began it anew.
                let v = velocity.at(170 * MS, &attitudes, &frames).unwrap().velocity;
                assert!(v[0].abs() < 0.05 && v[1].abs() < 0.05, "{v:?}");
            }
        }
        let v = velocity.at((100 + 60 * 20) * MS, &attitudes, &frames).unwrap().velocity;
        assert!((v[0] - 0.4).abs() < 0.12 && v[1].abs() < 0.02, "{v:?}");
    }

    #[test]
    fn a_poor_floor_teaches_its_share_and_then_shows_the_velocity_by_it() {
        // 0.4 m/s, well known; the floor shows four tenths of it. Then a draught that nothing else shows takes three
        // quarters of the speed away.
        let (attitudes, frames) = (level(), Frames::default());
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.4, 0.0]);
        for i in 0..50u64 {
            let time_ns = (100 + 20 * i) * MS;
            velocity.flow(&Frame { time_ns, velocity: [0.4, 0.0], sigma: 0.05 }, &attitudes, &frames);
        }
        let dim = |velocity: &mut Velocity, frames_: std::ops::Range<u64>, speed: f32| {
            for i in frames_ {
                let frame = Frame { time_ns: (1100 + 20 * i) * MS, velocity: [0.4 * speed, 0.0], sigma: 0.1 };
                velocity.dim(&frame, &attitudes, &frames);
            }
        };
        dim(&mut velocity, 0..10, 0.4);
        assert!(velocity.share < 0.55, "the share is nearer to 0.4 than to {SHARE}: {}", velocity.share);
        assert!((velocity.state[0][1] - 0.4).abs() < 0.08, "{:?}", velocity.state);
        let before = velocity.state[0][1];
        dim(&mut velocity, 10..40, 0.1);
        let after = velocity.state[0][1];
        assert!(
            after < before - 0.15 && after > 0.0 && velocity.state[1][1].abs() < 1e-3,
            "{before} {after}"
        );
        // A good floor again: nothing of the poor one is kept.
        let frame = Frame { time_ns: 1920 * MS, velocity: [0.1, 0.0], sigma: 0.05 };
        velocity.flow(&frame, &attitudes, &frames);
        assert_eq!(velocity.share, SHARE);
    }

    #[test]
    fn a_gust_that_is_felt_is_known_without_flow_and_an_error_of_level_is_none() {
        // A draught of 0.5 m/s2 for 0.8 s, nothing else measured but the particles' place, which has not moved yet. The
        // controller sits 1.5 degrees aslant, which nobody knows: its accelerometer does as well.
        let frames = Frames::default();
        let mut attitudes = Attitudes::default();
        for i in 1..60u64 {
            let gust = if i > 6 { 0.5 } else { 0.0 };
            attitudes.push_felt(i * 33 * MS, 0.0, 0.026, 0.0, [gust - GRAVITY * 0.026_f32.sin(), 0.0]);
        }
        let mut velocity = Velocity::default();
        velocity.begin(200 * MS, [0.0; 2], [0.0; 2]);
        for i in 1..=13u64 {
            let t = 0.06 * i as f32;
            let place = [0.25 * t * t, 0.0];
            velocity.place((200 + 60 * i) * MS, place, [0.0; 2], [0.0; 2], &attitudes, &frames);
        }
        let swept = velocity.at((200 + 60 * 13) * MS, &attitudes, &frames).unwrap();
        assert!((swept.velocity[0] - 0.5 * 0.78).abs() < 0.03 && swept.velocity[1].abs() < 1e-3, "{swept:?}");
        // The pilot takes 1.5 degrees for a tilt as long as nobody knows better; with what it is told of the air it comes
        // to the same, and when the level is known the air is the draught.
        assert!((swept.air[0] - (0.5 - GRAVITY * 0.026)).abs() < 0.03, "{swept:?}");
        let level = Frames { level: [0.0, 0.026], ..frames };
        let air = velocity.at((200 + 60 * 13) * MS, &attitudes, &level).unwrap().air;
        assert!((air[0] - 0.5).abs() < 0.03, "{air:?}");
    }

    #[test]
    fn it_is_silent_when_nothing_is_measured() {
        let (attitudes, frames) = (level(), Frames::default());
        let mut velocity = Velocity::default();
        assert!(velocity.at(100 * MS, &attitudes, &frames).is_none());
        velocity.begin(100 * MS, [0.0; 2], [0.4, 0.0]);
        let v = velocity.at(110 * MS, &attitudes, &frames).unwrap().velocity;
        assert!((v[0] - 0.4).abs() < 0.02, "{v:?}");
        assert!(velocity.at(500 * MS, &attitudes, &frames).is_none());
    }
}
