//! The velocity that is flown by.
//!
//! The particle set averages over many pings: its velocity follows a gust late, and a loop that flies by it sways.
//! This filter carries place and velocity from one measurement to the next by the measured tilt and what the
//! accelerometer feels: beside the thrust, which is along the body's own axis, that is the air (Leishman et al. 2014),
//! and a gust is known before it has moved the body.
//!
//! The tilt that a controller tells is wrong in a way that is known (Mahony, Hamel and Pflimlin 2008): its vertical is
//! turned towards what its accelerometer feels, which is gravity and the acceleration. With y = g tan(tilt) + felt
//! force, all as read, the acceleration is a = y + e, and e grows by k y, k being the gain of that turning: a speed that
//! was reached would be forgotten within 1/k = 4 s if e were left out. And an accelerometer that sits aslant
//! feels a part of gravity that turns with the body, while the vertical that has settled on it stays where it was: e
//! grows by what the turn has moved that part by.
//!
//! Optical flow, when there is any, measures the velocity within a frame; over a floor that shows little it still shows
//! a share of the motion, which is learned along with it. The change of a range between two pings measures the
//! velocity towards what was heard. The particles' place, which the walls hold fast, keeps the sum right. A controller
//! that tells no forces leaves the gust (first order, the Dryden shape) to be learned from the motion.

mod optical;

use crate::attitude::{Attitudes, Tilt, seconds};
use crate::kalman::Kalman;
use crate::rate::{LONGEST_S, Ping};
use ipc_types::MAX_SONARS;

/// Steps of the integration, seconds.
const STEP_S: f64 = 0.01;
/// Without any measurement for so long the velocity is the particles' again, seconds.
const SILENT_S: f64 = 0.3;
/// Standard deviation of one place of the particles, metres: they err by 3 cm, but for seconds, 16 times a second, and by
/// much more before they know that they are lost. What is felt carries the velocity that long.
const PLACE_M: f32 = 0.3;
/// Particles that spread by more than this along an axis are held by no wall there, metres: they go where this filter goes, and
/// to hear that back says nothing. Where there is flow it is kept: what is wrong with a dim floor's share is bounded by it
/// until the next wall (60 flights of watchman: nobody lost with it, 3 without).
const HELD_M: f32 = 0.1;
/// Standard deviation of the velocity that it begins with, and of one that stands on the ground, m/s.
const BEGIN_M_S: f32 = 0.2;
const STANDING_M_S: f32 = 0.02;
/// No attitude errs by more, radians: six degrees are a quarter of a second of the strongest acceleration.
const LARGEST_LEVEL: f32 = 0.1;
/// A place farther off is a jump of the particles, metres.
const JUMP_M: f32 = 0.6;
/// Rms of the air's acceleration, m/s², and the time in which it changes, seconds: FACTS 8 has 0.2 of gusts, more
/// near walls; the rest and the longer time make room for an error of level.
const GUST_M_S2: f64 = 0.3;
const GUST_S: f64 = 1.0;
/// Where the accelerometer feels the gust, what is left is the error of the attitude. The controller turns its vertical
/// towards what its accelerometer feels at this rate, 1/s: 0.25 by default in Betaflight (`imu_dcm_kp`), 0.2 in INAV.
const PULL_PER_S: f64 = 0.25;
/// What is left on the ground, where the vertical has settled, and after a restart in the air, m/s²; and its random walk,
/// m/s² per √s: the gyro's bias and noise, and a pull that is another than the one above.
const SETTLED_M_S2: f32 = 0.03;
const UNSETTLED_M_S2: f32 = 0.15;
const ERROR_WALK: f64 = 0.015;
/// How far the accelerometer's own error is from the level that is read on the ground, m/s² (half a degree: the rest
/// turns along with the gyro), and its random walk, m/s² per √s.
const LEVEL_M_S2: f32 = 0.09;
const LEVEL_WALK: f64 = 0.002;
/// Random walk of the velocity where the accelerometer feels the gust: its vibration, 30 readings a second.
const FELT_WALK: f64 = 0.025;
/// Random walk of the velocity beside the gust, m/s per √s: tilt is read to a tenth of a degree, 30 times a second.
const WALK: f64 = 0.1;
/// m/s².
const GRAVITY: f32 = 9.806_65;

/// What share of the motion the flow sensor tells apart over a poor floor, before anything is known of the floor,
/// its standard deviation, the least that is believed, and its random walk per √s.
const SHARE: f32 = 0.65;
const SHARE_SIGMA: f32 = 0.25;
const SHARE_LEAST: f32 = 0.2;
const SHARE_WALK: f64 = 0.05;

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

/// Along x of the plan: place, velocity, and the acceleration that attitude and accelerometer do not tell of. The same
/// along y stands [`Y`] further on.
const PLACE: usize = 0;
const SPEED: usize = 1;
const UNTOLD: usize = 2;
const Y: usize = 3;
/// The accelerometer's own error forward and left, body frame.
const LEVEL: usize = 6;
/// Share of the motion that the flow sensor tells apart over the poor floor below.
const SHARE_AT: usize = 8;
const STATES: usize = 9;

/// A Kalman filter on place, velocity and what is not felt, along both axes of the plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Velocity {
    /// Time of the state; zero: none.
    pub(crate) time_ns: u64,
    filter: Kalman<STATES>,
    /// The yaw that the state has followed to; `None` before the first.
    yaw: Option<f32>,
    /// The velocity, summed up: unlike the place nothing corrects it.
    pub(crate) way: [f32; 2],
    /// Flow has been measured.
    flows: bool,
    /// The last echo of each sensor.
    pub(crate) pings: [Ping; MAX_SONARS],
}

impl Velocity {
    /// Begins at a place with a velocity. What is known of the attitude's error is kept; before anything is, `level` is
    /// what it reads (roll, pitch) of an upright body.
    pub(crate) fn begin(&mut self, time_ns: u64, place: [f32; 2], velocity: [f32; 2], level: [f32; 2]) {
        if self.time_ns == 0 {
            self.settle(level, UNSETTLED_M_S2);
        }
        for axis in 0..2 {
            self.filter.set(PLACE + Y * axis, place[axis], PLACE_M);
            self.filter.set(SPEED + Y * axis, velocity[axis], BEGIN_M_S);
        }
        self.forget_share();
        (self.time_ns, self.pings) = (time_ns, Default::default());
    }

    /// Stands on the ground, where the vertical is that of the accelerometer.
    pub(crate) fn stand(&mut self, time_ns: u64, place: [f32; 2], level: [f32; 2]) {
        self.begin(time_ns, place, [0.0; 2], level);
        for axis in 0..2 {
            self.filter.set(SPEED + Y * axis, 0.0, STANDING_M_S);
        }
        self.settle(level, SETTLED_M_S2);
        self.yaw = None;
    }

    /// The plan's frame turns out to lie otherwise: what was x and y so far is turned by `angle`, and the place is this one.
    pub(crate) fn turn(&mut self, time_ns: u64, place: [f32; 2], angle: f32) {
        let (sin, cos) = f64::from(angle).sin_cos();
        let mut turned = [[0.0; STATES]; STATES];
        for (i, row) in turned.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        for i in [PLACE, SPEED, UNTOLD] {
            (turned[i][i], turned[i][i + Y]) = (cos, -sin);
            (turned[i + Y][i], turned[i + Y][i + Y]) = (sin, cos);
            let [x, y] = [self.filter.state[i], self.filter.state[i + Y]];
            (self.filter.state[i], self.filter.state[i + Y]) = (cos * x - sin * y, sin * x + cos * y);
        }
        self.filter.carry(&turned);
        for (axis, place) in place.into_iter().enumerate() {
            self.filter.set(PLACE + Y * axis, place, PLACE_M);
        }
        (self.time_ns, self.pings) = (time_ns, Default::default());
    }

    fn settle(&mut self, level: [f32; 2], untold: f32) {
        for (axis, error) in tilted(&Tilt::default(), level).into_iter().enumerate() {
            self.filter.set(UNTOLD + Y * axis, 0.0, untold);
            self.filter.set(LEVEL + axis, -error, LEVEL_M_S2);
        }
    }

    /// What was learned of a poor floor is forgotten.
    fn forget_share(&mut self) {
        self.filter.set(SHARE_AT, SHARE, SHARE_SIGMA);
    }

    /// Plan frame, metres.
    pub(crate) fn place_now(&self) -> [f32; 2] {
        [0, 1].map(|axis| self.filter.state[PLACE + Y * axis] as f32)
    }

    /// Plan frame, m/s.
    pub(crate) fn velocity_now(&self) -> [f32; 2] {
        [0, 1].map(|axis| self.filter.state[SPEED + Y * axis] as f32)
    }

    /// Of each component of the velocity.
    pub(crate) fn velocity_variance(&self) -> [f32; 2] {
        [0, 1].map(|axis| self.filter.variance[SPEED + Y * axis][SPEED + Y * axis].max(0.0) as f32)
    }

    /// What the accelerometer feels of gravity in a body that stands upright, forward and left, with the sign turned, m/s².
    pub(crate) fn accelerometer_error(&self) -> [f32; 2] {
        [0, 1].map(|axis| self.filter.state[LEVEL + axis] as f32)
    }

    /// What the attitude reads (roll, pitch) now when the body is upright, radians; `frames` has it where no accelerometer
    /// is heard.
    pub(crate) fn upright(&self, attitudes: &Attitudes, frames: &Frames) -> [f32; 2] {
        let Some((_, tilt)) = attitudes.newest().filter(|_| self.time_ns > 0) else { return frames.level };
        if !tilt.force.iter().all(|axis| axis.is_finite()) {
            return frames.level;
        }
        let (sin, cos) = (self.yaw.unwrap_or(tilt.yaw) + frames.heading_offset).sin_cos();
        let [x, y] = [0, 1].map(|axis| self.filter.state[UNTOLD + Y * axis] as f32);
        let [forward, left] = self.accelerometer_error();
        let read = [forward - cos * x - sin * y, left + sin * x - cos * y].map(|a| (a / GRAVITY).atan());
        [-read[1], read[0]].map(|angle| angle.clamp(-LARGEST_LEVEL, LARGEST_LEVEL))
    }

    pub(crate) fn is_known(&self, time_ns: u64) -> bool {
        self.time_ns > 0 && seconds(self.time_ns, time_ns) <= SILENT_S
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
        let (here, speed) = (self.place_now(), self.velocity_now());
        let off = [0, 1].map(|axis| place[axis] + late * speed[axis] - here[axis]);
        let far = off[0].hypot(off[1]);
        if !known || far.is_nan() {
            self.begin(time_ns, place, velocity, frames.level);
            return;
        }
        for axis in 0..2 {
            if far > JUMP_M {
                // The particles think better of where it is: that is no motion.
                self.filter.set(
                    PLACE + Y * axis,
                    place[axis] + late * speed[axis],
                    PLACE_M.hypot(spread[axis]),
                );
                continue;
            }
            let mut along = [0.0; STATES];
            along[PLACE + Y * axis] = 1.0;
            let sigma = if self.flows {
                PLACE_M.hypot(spread[axis])
            } else {
                PLACE_M * (1.0 + (spread[axis] / HELD_M).powi(2))
            };
            self.take(&along, off[axis], sigma);
        }
    }

    /// Takes a measurement of the velocity along a direction of the plan: what it misses the state by.
    pub(crate) fn measure(&mut self, along: [f32; 2], miss: f32, sigma: f32) {
        let mut of_state = [0.0; STATES];
        (of_state[SPEED], of_state[SPEED + Y]) = (along[0].into(), along[1].into());
        self.take(&of_state, miss, sigma);
    }

    fn take(&mut self, along: &[f64; STATES], miss: f32, sigma: f32) {
        let Some(moved) = self.filter.measure(along, miss, sigma) else { return };
        // The error that was just found stood since before the last pings: the way since then was another.
        let time_ns = self.time_ns;
        for ping in self.pings.iter_mut().filter(|ping| ping.time_ns > 0) {
            let age = seconds(ping.time_ns, time_ns).clamp(0.0, f64::from(LONGEST_S)) as f32;
            ping.way[0] -= moved[SPEED] as f32 * age;
            ping.way[1] -= moved[SPEED + Y] as f32 * age;
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
        let velocity = then.velocity_now();
        let [of_x, of_y] = then.velocity_variance();
        let air = then.air(time_ns, attitudes, frames);
        velocity.iter().chain(&air).all(|v| v.is_finite()).then(|| Swept {
            velocity,
            sigma: of_x.max(of_y).sqrt(),
            air,
        })
    }

    /// What accelerates the body beside its tilt and its drag, plan frame, m/s².
    fn air(&self, time_ns: u64, attitudes: &Attitudes, frames: &Frames) -> [f32; 2] {
        let tilt = attitudes.at(time_ns).unwrap_or_default();
        let unfelt = [0, 1].map(|axis| self.filter.state[UNTOLD + Y * axis] as f32);
        if !tilt.force.iter().all(|axis| axis.is_finite()) {
            return unfelt;
        }
        let (sin, cos) = (tilt.yaw + frames.heading_offset).sin_cos();
        let (read, upright) = (tilted(&tilt, [0.0; 2]), tilted(&tilt, frames.level));
        let [forward, left] = [0, 1].map(|axis| read[axis] - upright[axis] + tilt.force[axis]);
        let felt = [cos * forward - sin * left, sin * forward + cos * left];
        [0, 1].map(|axis| felt[axis] + unfelt[axis] + frames.drag * self.velocity_now()[axis])
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
            let (spread, walk, drag, keep, pull) = if felt {
                (ERROR_WALK * ERROR_WALK, FELT_WALK, 0.0, 1.0, PULL_PER_S * h)
            } else {
                let spread = 2.0 * GUST_M_S2 * GUST_M_S2 / GUST_S;
                (spread, WALK, f64::from(frames.drag), 1.0 - h / GUST_S, 0.0)
            };
            // The vertical keeps its error in the plan while the body turns; the accelerometer takes its own along.
            let before = (self.yaw.replace(tilt.yaw).unwrap_or(tilt.yaw) + frames.heading_offset).sin_cos();
            let (more_sin, more_cos) = if felt { (sin - before.0, cos - before.1) } else { (0.0, 0.0) };
            let slow = 1.0 - drag * h;
            let [forward, left] = self.accelerometer_error();
            let turned = [more_cos * forward - more_sin * left, more_sin * forward + more_cos * left];
            let mut motion = [[0.0; STATES]; STATES];
            for (i, row) in motion.iter_mut().enumerate() {
                row[i] = 1.0;
            }
            for axis in 0..2 {
                let [place, speed, untold] = [PLACE, SPEED, UNTOLD].map(|i| i + Y * axis);
                let state = &mut self.filter.state;
                let felt = f64::from(tilted[axis]);
                self.way[axis] += (state[speed] * h) as f32;
                state[place] += state[speed] * h;
                state[speed] = slow * state[speed] + (felt + state[untold]) * h;
                state[untold] = keep * state[untold] + pull * felt + f64::from(turned[axis]);
                motion[place][speed] = h;
                (motion[speed][speed], motion[speed][untold]) = (slow, h);
                motion[untold][untold] = keep;
            }
            let (more_sin, more_cos) = (f64::from(more_sin), f64::from(more_cos));
            (motion[UNTOLD][LEVEL], motion[UNTOLD][LEVEL + 1]) = (more_cos, -more_sin);
            (motion[UNTOLD + Y][LEVEL], motion[UNTOLD + Y][LEVEL + 1]) = (more_sin, more_cos);
            self.filter.carry(&motion);
            let noises = [
                (SPEED, walk * walk),
                (SPEED + Y, walk * walk),
                (UNTOLD, spread),
                (UNTOLD + Y, spread),
                (LEVEL, LEVEL_WALK * LEVEL_WALK),
                (LEVEL + 1, LEVEL_WALK * LEVEL_WALK),
                (SHARE_AT, SHARE_WALK * SHARE_WALK),
            ];
            for (i, noise) in noises {
                self.filter.variance[i][i] += noise * h;
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

#[cfg(test)]
pub(crate) mod tests;
