//! The velocity that is flown by.
//!
//! The particle set averages over many pings: its velocity follows a gust late, and a loop that flies by it sways.
//! This filter carries place, velocity and what the air does (a first-order gust, the Dryden shape) from one
//! measurement to the next by the measured tilt. Optical flow, when there is any, measures the velocity within a
//! frame; where the floor shows nothing, the change of a wall's range between two pings measures it along the wall's
//! normal. The particles' place, which the walls hold fast, keeps the sum right.

use crate::attitude::{Attitudes, seconds};
use crate::flow::Frame;
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
/// Random walk of the velocity beside the gust, m/s per √s: tilt is read to a tenth of a degree, 30 times a second.
const WALK: f32 = 0.1;
/// An echo is the plan's wall when it is not farther off than this, metres: plan, mounting and place err together.
const FITS_M: f32 = 0.25;
/// Two pings of a sensor are compared when they lie so far apart, seconds.
const SHORTEST_S: f32 = 0.05;
const LONGEST_S: f32 = 0.4;
/// Noise of one range, metres: quantum, jitter and lost periods (FACTS 2), and what a tilt that has changed does.
const RANGE_M: f32 = 0.010;
/// What the velocity changes by unseen between the middle of two pings and the later one, metres a second.
const LAG_M_S: f32 = 0.04;
/// How fast the weight of a surprising measurement falls: like Student's t, ranges have the heavier tails (another
/// surface, somebody before the wall), flow errs when the body turns fast.
const RANGE_TAIL: f32 = 1.0;
const FLOW_TAIL: f32 = 0.1;
/// A change of the range that no velocity explains is another surface, metres.
const RANGE_GATE_M: f32 = 0.05;
/// The wall's slope is taken over so much, metres: twice the raster.
const SLOPE_M: f32 = 0.1;
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

/// What a sonar heard, and where the drone was on its way.
#[derive(Clone, Copy, Debug, Default)]
struct Ping {
    /// Zero: nothing that can be compared.
    time_ns: u64,
    range: f32,
    /// Heading of the drone in the plan, radians.
    heading: f32,
    /// [`Velocity::way`] then, as it is known now.
    way: [f32; 2],
}

/// One reading of a side sonar.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ranged {
    pub(crate) sensor: u8,
    pub(crate) range: f32,
    /// Where the sensor sits and looks, body frame.
    pub(crate) mount: [f32; 2],
    pub(crate) bearing: f32,
}

/// A 3 by 3 block of the covariance.
type Block = [[f32; 3]; 3];

/// A Kalman filter on place, velocity and gust along both axes of the plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Velocity {
    /// Time of the state; zero: none.
    time_ns: u64,
    /// Place, velocity and gust along x and y, plan frame.
    state: [[f32; 3]; 2],
    /// Covariance of x with x, x with y, y with y.
    variance: [Block; 3],
    /// The velocity, summed up: unlike the place nothing corrects it.
    way: [f32; 2],
    /// The last echo of each sensor.
    pings: [Ping; MAX_SONARS],
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
            ..Self::default()
        };
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
        let miss = [cos * x - sin * y - self.state[0][1], sin * x + cos * y - self.state[1][1]];
        let spread = frame.sigma * frame.sigma + self.variance[0][1][1].max(self.variance[2][1][1]);
        let sigma = frame.sigma * (1.0 + FLOW_TAIL * (miss[0] * miss[0] + miss[1] * miss[1]) / spread).sqrt();
        self.measure(1, [1.0, 0.0], miss[0], sigma);
        self.measure(1, [0.0, 1.0], miss[1], sigma);
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
        let off = [0, 1].map(|axis| place[axis] + late * self.state[axis][1] - self.state[axis][0]);
        let far = off[0].hypot(off[1]);
        if !known || far.is_nan() || far > JUMP_M {
            self.begin(time_ns, place, velocity);
        } else {
            self.measure(0, [1.0, 0.0], off[0], PLACE_M);
            self.measure(0, [0.0, 1.0], off[1], PLACE_M);
        }
    }

    /// Takes an echo of a wall that the plan knows: what its range has changed by since the sensor's last ping,
    /// less what the plan says for the way that was believed, is the velocity's error along the wall's normal.
    /// Plan, mounting and range scale err alike at both ends and fall out. `expected` is the range that the plan
    /// gives from a place along an angle.
    pub(crate) fn range(
        &mut self,
        time_ns: u64,
        ranged: &Ranged,
        attitudes: &Attitudes,
        frames: &Frames,
        expected: impl Fn(f32, f32, f32) -> Option<f32>,
    ) {
        let sensor = usize::from(ranged.sensor);
        let Some(last) = self.pings.get(sensor).copied() else { return };
        self.pings[sensor] = Ping::default();
        if !self.is_known(time_ns) {
            return;
        }
        self.advance(time_ns, attitudes, frames);
        // Flow may have carried the state past the ping.
        let late = seconds(time_ns, self.time_ns).max(0.0) as f32;
        let way = [0, 1].map(|axis| self.way[axis] - late * self.state[axis][1]);
        let here = [0, 1].map(|axis| self.state[axis][0] - late * self.state[axis][1]);
        let heading = attitudes.at(time_ns).unwrap_or_default().yaw + frames.heading_offset;
        let from = |place: [f32; 2], heading: f32| {
            let (sin, cos) = heading.sin_cos();
            let [mx, my] = ranged.mount;
            let (x, y) = (place[0] + cos * mx - sin * my, place[1] + sin * mx + cos * my);
            expected(x, y, heading + ranged.bearing)
        };
        let Some(now) = from(here, heading).filter(|now| (ranged.range - now).abs() < FITS_M) else {
            return;
        };
        self.pings[sensor] = Ping { time_ns, range: ranged.range, heading, way };
        let apart = seconds(last.time_ns, time_ns) as f32;
        if last.time_ns == 0 || !(SHORTEST_S..=LONGEST_S).contains(&apart) {
            return;
        }
        let gone = [0, 1].map(|axis| way[axis] - last.way[axis]);
        let (Some(before), Some(right), Some(up)) = (
            from([here[0] - gone[0], here[1] - gone[1]], last.heading),
            from([here[0] + SLOPE_M, here[1]], heading),
            from([here[0], here[1] + SLOPE_M], heading),
        ) else {
            return;
        };
        let slope = [(right - now) / SLOPE_M, (up - now) / SLOPE_M];
        let steep = slope[0].hypot(slope[1]);
        let error = (ranged.range - last.range) - (now - before);
        let normal = slope.map(|s| s / steep);
        let unsure = [0, 1].map(|axis| self.variance[2 * axis][1][1]).iter().sum::<f32>().max(0.0).sqrt();
        // Another wall, a door post, somebody before the wall: no slope of a wall, or too much of a change.
        if !(0.8..1.25).contains(&steep) || error.abs() > RANGE_GATE_M + 2.0 * unsure * apart {
            return;
        }
        let sigma = (core::f32::consts::SQRT_2 * RANGE_M / apart).hypot(LAG_M_S);
        let miss = error / (apart * steep);
        let spread = sigma * sigma + unsure * unsure;
        let sigma = sigma * (1.0 + RANGE_TAIL * miss * miss / spread).sqrt();
        self.measure(1, normal, miss, sigma);
    }

    /// Takes a measurement along a direction of one part of the state: what it misses the state by.
    fn measure(&mut self, part: usize, along: [f32; 2], miss: f32, sigma: f32) {
        let [xx, xy, yy] = &self.variance;
        let column: [[f32; 3]; 2] = [
            core::array::from_fn(|i| xx[i][part] * along[0] + xy[i][part] * along[1]),
            core::array::from_fn(|i| xy[part][i] * along[0] + yy[i][part] * along[1]),
        ];
        let noise = column[0][part] * along[0] + column[1][part] * along[1] + sigma * sigma;
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
        // The error that was just found stood since before the last pings: the way since then was another.
        let time_ns = self.time_ns;
        for ping in self.pings.iter_mut().filter(|ping| ping.time_ns > 0) {
            let age = seconds(ping.time_ns, time_ns).clamp(0.0, f64::from(LONGEST_S)) as f32;
            for (way, gain) in ping.way.iter_mut().zip(gain) {
                *way -= gain[1] * miss * age;
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
        let variance = then.variance[0][1][1].max(then.variance[2][1][1]).max(0.0);
        velocity.iter().all(|v| v.is_finite()).then(|| (velocity, variance.sqrt()))
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
            for (([place, velocity, gust], way), tilted) in
                self.state.iter_mut().zip(&mut self.way).zip(tilted)
            {
                *place += *velocity * h;
                *way += *velocity * h;
                *velocity = slow * *velocity + (tilted + *gust) * h;
                *gust *= keep;
            }
            let forward = [[1.0, h, 0.0], [0.0, slow, h], [0.0, 0.0, keep]];
            for (block, own) in self.variance.iter_mut().zip([true, false, true]) {
                *block = carried(&forward, block);
                if own {
                    block[1][1] += WALK * WALK * h;
                    block[2][2] += 2.0 * GUST_M_S2 * GUST_M_S2 / GUST_S * h;
                }
            }
        }
        self.time_ns = to_ns.max(self.time_ns);
    }
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
    fn a_wall_shows_the_velocity_along_its_normal_and_none_along_itself() {
        // 0.3 m/s towards a wall at x = 3 that is 4 cm off, and 0.3 along it: the believed velocity is nothing.
        let (attitudes, frames) = (level(), Frames::default());
        let expected = |x: f32, _: f32, angle: f32| (angle.cos() > 0.9).then_some(3.0 - x);
        let ranged = |t: f32| Ranged { sensor: 0, range: 3.04 - 0.3 * t, mount: [0.06, 0.0], bearing: 0.1 };
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2]);
        for i in 0..6u64 {
            let time_ns = (100 + 240 * i) * MS;
            velocity.range(time_ns, &ranged(0.24 * i as f32), &attitudes, &frames, expected);
            if i == 2 {
                assert!((velocity.state[0][1] - 0.3).abs() < 0.05, "{:?}", velocity.state);
            }
        }
        let ([vx, vy], _) = velocity.at(1300 * MS, &attitudes, &frames).unwrap();
        assert!((vx - 0.3).abs() < 0.03 && vy.abs() < 1e-3, "{vx} {vy}");
        assert!(velocity.variance[0][1][1] < 0.5 * velocity.variance[2][1][1], "{:?}", velocity.variance);
    }

    #[test]
    fn two_sensors_on_one_wall_do_not_count_an_error_twice() {
        let (attitudes, frames) = (level(), Frames::default());
        let expected = |x: f32, _: f32, angle: f32| (angle.cos() > 0.9).then_some(3.0 - x);
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2]);
        let mut most = 0.0f32;
        for i in 0..20u64 {
            let t = 0.06 * i as f32;
            let ranged =
                Ranged { sensor: (i % 4) as u8, range: 3.0 - 0.3 * t, mount: [0.0; 2], bearing: 0.0 };
            velocity.range((100 + 60 * i) * MS, &ranged, &attitudes, &frames, expected);
            most = most.max(velocity.state[0][1]);
        }
        assert!((velocity.state[0][1] - 0.3).abs() < 0.02 && most < 0.33, "{most} {:?}", velocity.state);
    }

    #[test]
    fn somebody_who_steps_before_the_wall_is_no_velocity() {
        let (attitudes, frames) = (level(), Frames::default());
        let expected = |x: f32, _: f32, _: f32| Some(3.0 - x);
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2]);
        for (i, range) in [3.0, 3.0, 2.8, 2.3, 3.0, 3.0].into_iter().enumerate() {
            let ranged = Ranged { sensor: 0, range, mount: [0.0; 2], bearing: 0.0 };
            velocity.range((100 + 240 * i as u64) * MS, &ranged, &attitudes, &frames, expected);
            assert!(velocity.state[0][1].abs() < 0.02, "{i}: {:?}", velocity.state);
        }
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
