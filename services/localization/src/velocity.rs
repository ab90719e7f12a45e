//! The velocity that is flown by.
//!
//! The particle set averages over many pings: its velocity follows a gust late, and a loop that flies by it sways.
//! This filter carries place, velocity and what the air does (a first-order gust, the Dryden shape) from one
//! measurement to the next by the measured tilt. Optical flow, when there is any, measures the velocity within a
//! frame; the particles' place, which the walls hold fast, keeps it right where the floor shows nothing.

use crate::attitude::{Attitudes, seconds};
use crate::flow::Frame;

/// Steps of the integration, seconds.
const STEP_S: f64 = 0.01;
/// Without any measurement for so long the velocity is the particles' again, seconds.
const SILENT_S: f64 = 0.3;
/// Standard deviation of one place of the particles, metres: they err by 3 cm, slowly (measured in flight).
const PLACE_M: f32 = 0.05;
/// A place farther off is a jump of the particles: begun anew, metres.
const JUMP_M: f32 = 0.6;
/// Rms of the air's acceleration, m/s², and the time in which it changes, seconds: FACTS 8 has 0.2 of gusts, more
/// near walls; the rest and the longer time make room for an error of level.
const GUST_M_S2: f32 = 0.3;
const GUST_S: f32 = 1.0;
/// Random walk of the velocity beside the gust, m/s per √s: tilt is read to a tenth of a degree, 30 times a second.
const WALK: f32 = 0.1;
/// m/s².
const GRAVITY: f32 = 9.806_65;

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

/// A Kalman filter on place, velocity and gust; both axes of the plan alike.
#[derive(Clone, Debug, Default)]
pub(crate) struct Velocity {
    /// Time of the state; zero: none.
    time_ns: u64,
    /// Place, velocity and gust along x and y, plan frame.
    state: [[f32; 3]; 2],
    /// Covariance, the same for both axes.
    variance: [[f32; 3]; 3],
}

impl Velocity {
    /// Begins at a place with a velocity.
    pub(crate) fn begin(&mut self, time_ns: u64, place: [f32; 2], velocity: [f32; 2]) {
        let gust = GUST_M_S2 * GUST_M_S2;
        self.time_ns = time_ns;
        self.state = [[place[0], velocity[0], 0.0], [place[1], velocity[1], 0.0]];
        self.variance = [[PLACE_M * PLACE_M, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, gust]];
    }

    fn is_known(&self, time_ns: u64) -> bool {
        self.time_ns > 0 && seconds(self.time_ns, time_ns) <= SILENT_S
    }

    /// Takes a flow frame.
    pub(crate) fn flow(&mut self, frame: &Frame, attitudes: &Attitudes, frames: &Frames) {
        if !self.is_known(frame.time_ns) {
            return;
        }
        self.advance(frame.time_ns, attitudes, frames);
        let yaw = attitudes.at(frame.time_ns).unwrap_or_default().yaw + frames.heading_offset;
        let (sin, cos) = yaw.sin_cos();
        let [x, y] = frame.velocity;
        // A frame from before the state's time is a little old; the gust since then is not worth a replay.
        self.measure(1, [cos * x - sin * y, sin * x + cos * y], frame.sigma);
    }

    /// Takes the particles' place at a time; begins with their velocity when nothing is known.
    pub(crate) fn place(
        &mut self,
        time_ns: u64,
        place: [f32; 2],
        velocity: [f32; 2],
        attitudes: &Attitudes,
        frames: &Frames,
    ) {
        let late = seconds(time_ns, self.time_ns).max(0.0) as f32;
        let known = self.is_known(time_ns);
        if known {
            self.advance(time_ns, attitudes, frames);
        }
        let now = [0, 1].map(|axis| place[axis] + late * self.state[axis][1]);
        let off = (now[0] - self.state[0][0]).hypot(now[1] - self.state[1][0]);
        if !known || off.is_nan() || off > JUMP_M {
            self.begin(time_ns, place, velocity);
        } else {
            self.measure(0, now, PLACE_M);
        }
    }

    /// Takes a measurement of one part of the state.
    fn measure(&mut self, part: usize, measured: [f32; 2], sigma: f32) {
        let column = [self.variance[0][part], self.variance[1][part], self.variance[2][part]];
        let noise = column[part] + sigma * sigma;
        let gain = column.map(|c| c / noise);
        for (state, measured) in self.state.iter_mut().zip(measured) {
            let miss = measured - state[part];
            for (value, gain) in state.iter_mut().zip(gain) {
                *value += gain * miss;
            }
        }
        for (row, gain) in self.variance.iter_mut().zip(gain) {
            for (value, of_part) in row.iter_mut().zip(column) {
                *value -= gain * of_part;
            }
        }
    }

    /// Velocity (plan frame) and its standard deviation at a time after the newest measurement; `None` when
    /// that was too long ago.
    pub(crate) fn at(&self, time_ns: u64, attitudes: &Attitudes, frames: &Frames) -> Option<([f32; 2], f32)> {
        if !self.is_known(time_ns) {
            return None;
        }
        let mut then = self.clone();
        then.advance(time_ns, attitudes, frames);
        let velocity = [then.state[0][1], then.state[1][1]];
        velocity.iter().all(|v| v.is_finite()).then(|| (velocity, then.variance[1][1].max(0.0).sqrt()))
    }

    fn advance(&mut self, to_ns: u64, attitudes: &Attitudes, frames: &Frames) {
        let horizon = seconds(self.time_ns, to_ns).clamp(0.0, SILENT_S);
        let steps = (horizon / STEP_S).ceil();
        for step in 0..steps as u32 {
            let h = horizon / steps;
            let time = self.time_ns + ((f64::from(step) + 0.5) * h * 1e9) as u64;
            let tilt = attitudes.at(time).unwrap_or_default();
            let (sin, cos) = (tilt.yaw + frames.heading_offset).sin_cos();
            let forward = GRAVITY * (tilt.pitch - frames.level[1]).clamp(-0.6, 0.6).tan();
            let left = -GRAVITY * (tilt.roll - frames.level[0]).clamp(-0.6, 0.6).tan();
            let tilted = [cos * forward - sin * left, sin * forward + cos * left];
            let h = h as f32;
            let (keep, slow) = (1.0 - h / GUST_S, 1.0 - frames.drag * h);
            for ([place, velocity, gust], tilted) in self.state.iter_mut().zip(tilted) {
                *place += *velocity * h;
                *velocity = slow * *velocity + (tilted + *gust) * h;
                *gust *= keep;
            }
            // F P F' + Q with F = [1 h 0; 0 slow h; 0 0 keep].
            let [[pp, pv, pg], [_, vv, vg], [_, _, gg]] = self.variance;
            let (pv_next, pg_next) = (slow * (pv + h * vv) + h * (pg + h * vg), keep * (pg + h * vg));
            let vg_next = keep * (slow * vg + h * gg);
            self.variance = [
                [pp + 2.0 * h * pv + h * h * vv, pv_next, pg_next],
                [pv_next, slow * slow * vv + 2.0 * slow * h * vg + h * h * gg + WALK * WALK * h, vg_next],
                [pg_next, vg_next, keep * keep * gg + 2.0 * GUST_M_S2 * GUST_M_S2 / GUST_S * h],
            ];
        }
        self.time_ns = to_ns.max(self.time_ns);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn level() -> Attitudes {
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
        let (v, sigma) = velocity.at((100 + 40 * 29 + 60) * MS, &attitudes, &frames).unwrap();
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
            velocity.place((100 + 60 * i) * MS, place, [0.0; 2], &attitudes, &frames);
            if i == 1 {
                // The jump across y began it anew.
                let (v, _) = velocity.at(170 * MS, &attitudes, &frames).unwrap();
                assert!(v[0].abs() < 0.05 && v[1].abs() < 0.05, "{v:?}");
            }
        }
        let (v, _) = velocity.at((100 + 60 * 20) * MS, &attitudes, &frames).unwrap();
        assert!((v[0] - 0.4).abs() < 0.12 && v[1].abs() < 0.02, "{v:?}");
    }

    #[test]
    fn it_is_silent_when_nothing_is_measured() {
        let (attitudes, frames) = (level(), Frames::default());
        let mut velocity = Velocity::default();
        assert!(velocity.at(100 * MS, &attitudes, &frames).is_none());
        velocity.begin(100 * MS, [0.0; 2], [0.4, 0.0]);
        let (v, _) = velocity.at(110 * MS, &attitudes, &frames).unwrap();
        assert!((v[0] - 0.4).abs() < 0.02, "{v:?}");
        assert!(velocity.at(500 * MS, &attitudes, &frames).is_none());
    }
}
