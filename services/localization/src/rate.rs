//! Velocity from what echoes do between two pings.

use crate::attitude::{Attitudes, seconds};
use crate::velocity::{Frames, Velocity};

/// An echo is the plan's wall when it is not farther off than this, metres: plan, mounting and place err together.
const FITS_M: f32 = 0.25;
/// Two pings of a sensor are compared when they lie so far apart, seconds.
const SHORTEST_S: f32 = 0.05;
pub(crate) const LONGEST_S: f32 = 0.4;
/// Noise of one range, metres: quantum, jitter and lost periods (FACTS 2), and what a tilt that has changed does.
const RANGE_M: f32 = 0.010;
/// What the velocity changes by unseen between the middle of two pings and the later one, metres a second.
const LAG_M_S: f32 = 0.04;
/// How fast the weight of a surprising measurement falls, like Student's t: ranges have heavy tails (another surface,
/// somebody before the wall).
const RANGE_TAIL: f32 = 1.0;
/// A change of the range that no velocity explains is another surface, metres.
const RANGE_GATE_M: f32 = 0.05;
/// The wall's slope is taken over so much, metres: twice the raster.
const SLOPE_M: f32 = 0.1;
/// What is not the plan's: an echo from aside of the axis (up to 15 degrees of cone, and as much of surface) shows
/// that share of the motion across, and nothing quite stands still, metres a second.
const SLANT: f32 = 0.2;
const THING_M_S: f32 = 0.05;
/// Nearer than this, metres, it is propeller wash in the airframe, which stands still for ever and so would say that the
/// drone does: a sensor sits about 0.06 m from the middle of a disc of 0.225 m.
const NEAREST_M: f32 = 0.15;
/// A body that has turned farther between two pings hears another part of the thing, radians.
const TURNED_RAD: f32 = 0.4;

/// What a sonar heard, and where the drone was on its way.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ping {
    /// Zero: nothing that can be compared.
    pub(crate) time_ns: u64,
    range: f32,
    /// Heading of the drone in the plan, radians.
    heading: f32,
    /// [`Velocity::way`] then, as it is known now.
    pub(crate) way: [f32; 2],
    /// It was the plan's wall.
    mapped: bool,
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

impl Velocity {
    /// Takes an echo: what its range has changed by since the sensor's last ping, less what the way that was
    /// believed explains, is the velocity's error towards what was heard. For a wall that the plan knows, that is
    /// along its normal, and plan, mounting and range scale err alike at both ends and fall out. Anything else is
    /// taken to stand still on the sensor's axis; who walks changes the range by more than the drone can have
    /// flown and is left out. `expected` is the range that the plan gives from a place along an angle.
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
        let (place, speed) = (self.place_now(), self.velocity_now());
        let way = [0, 1].map(|axis| self.way[axis] - late * speed[axis]);
        let here = [0, 1].map(|axis| place[axis] - late * speed[axis]);
        let heading = attitudes.at(time_ns).unwrap_or_default().yaw + frames.heading_offset;
        let from = |place: [f32; 2], heading: f32| {
            let (sin, cos) = heading.sin_cos();
            let [mx, my] = ranged.mount;
            let (x, y) = (place[0] + cos * mx - sin * my, place[1] + sin * mx + cos * my);
            expected(x, y, heading + ranged.bearing)
        };
        let foretold = from(here, heading).filter(|now| (ranged.range - now).abs() < FITS_M);
        self.pings[sensor] = Ping { time_ns, range: ranged.range, heading, way, mapped: foretold.is_some() };
        let apart = seconds(last.time_ns, time_ns) as f32;
        if last.time_ns == 0 || !(SHORTEST_S..=LONGEST_S).contains(&apart) {
            return;
        }
        let gone = [0, 1].map(|axis| way[axis] - last.way[axis]);
        let change = ranged.range - last.range;
        let wall = || {
            let now = foretold.filter(|_| last.mapped)?;
            let before = from([here[0] - gone[0], here[1] - gone[1]], last.heading)?;
            let slope = [
                (from([here[0] + SLOPE_M, here[1]], heading)? - now) / SLOPE_M,
                (from([here[0], here[1] + SLOPE_M], heading)? - now) / SLOPE_M,
            ];
            let steep = slope[0].hypot(slope[1]);
            // Another wall or a door post has no slope of a wall.
            let found = (slope.map(|s| s / steep), (change - (now - before)) / steep, 0.0);
            (0.8..1.25).contains(&steep).then_some(found)
        };
        let thing = || {
            let (sin, cos) = (heading + ranged.bearing).sin_cos();
            let slant = THING_M_S.hypot(SLANT * speed[0].hypot(speed[1]));
            let turned = mcl::wrap_angle(heading - last.heading).abs();
            let answers = turned < TURNED_RAD && ranged.range > NEAREST_M && last.range > NEAREST_M;
            answers.then_some(([-cos, -sin], change + cos * gone[0] + sin * gone[1], slant))
        };
        let Some((normal, error, slant)) = wall().or_else(thing) else { return };
        let unsure = self.velocity_variance().iter().sum::<f32>().sqrt();
        // Another surface, somebody before it, somebody who walks: too much of a change.
        if error.abs() > RANGE_GATE_M + 2.0 * unsure * apart {
            return;
        }
        let sigma = (core::f32::consts::SQRT_2 * RANGE_M / apart).hypot(LAG_M_S).hypot(slant);
        let miss = error / apart;
        let spread = sigma * sigma + unsure * unsure;
        let sigma = sigma * (1.0 + RANGE_TAIL * miss * miss / spread).sqrt();
        self.measure(normal, miss, sigma);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::velocity::tests::{MS, level};

    #[test]
    fn a_wall_shows_the_velocity_along_its_normal_and_none_along_itself() {
        // 0.3 m/s towards a wall at x = 3 that is 4 cm off, and 0.3 along it: the believed velocity is nothing.
        let (attitudes, frames) = (level(), Frames::default());
        let expected = |x: f32, _: f32, angle: f32| (angle.cos() > 0.9).then_some(3.0 - x);
        let ranged = |t: f32| Ranged { sensor: 0, range: 3.04 - 0.3 * t, mount: [0.06, 0.0], bearing: 0.1 };
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
        for i in 0..6u64 {
            let time_ns = (100 + 240 * i) * MS;
            velocity.range(time_ns, &ranged(0.24 * i as f32), &attitudes, &frames, expected);
            if i == 2 {
                assert!((velocity.velocity_now()[0] - 0.3).abs() < 0.05, "{:?}", velocity.velocity_now());
            }
        }
        let [vx, vy] = velocity.at(1300 * MS, &attitudes, &frames).unwrap().velocity;
        assert!((vx - 0.3).abs() < 0.03 && vy.abs() < 1e-3, "{vx} {vy}");
        assert!(
            velocity.velocity_variance()[0] < 0.5 * velocity.velocity_variance()[1],
            "{:?}",
            velocity.velocity_variance()
        );
    }

    #[test]
    fn two_sensors_on_one_wall_do_not_count_an_error_twice() {
        let (attitudes, frames) = (level(), Frames::default());
        let expected = |x: f32, _: f32, angle: f32| (angle.cos() > 0.9).then_some(3.0 - x);
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
        let mut most = 0.0f32;
        for i in 0..20u64 {
            let t = 0.06 * i as f32;
            let ranged =
                Ranged { sensor: (i % 4) as u8, range: 3.0 - 0.3 * t, mount: [0.0; 2], bearing: 0.0 };
            velocity.range((100 + 60 * i) * MS, &ranged, &attitudes, &frames, expected);
            most = most.max(velocity.velocity_now()[0]);
        }
        assert!(
            (velocity.velocity_now()[0] - 0.3).abs() < 0.02 && most < 0.33,
            "{most} {:?}",
            velocity.velocity_now()
        );
    }

    #[test]
    fn somebody_who_steps_before_the_wall_is_no_velocity() {
        let (attitudes, frames) = (level(), Frames::default());
        let expected = |x: f32, _: f32, _: f32| Some(3.0 - x);
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
        for (i, range) in [3.0, 3.0, 2.8, 2.3, 3.0, 3.0].into_iter().enumerate() {
            let ranged = Ranged { sensor: 0, range, mount: [0.0; 2], bearing: 0.0 };
            velocity.range((100 + 240 * i as u64) * MS, &ranged, &attitudes, &frames, expected);
            assert!(velocity.velocity_now()[0].abs() < 0.02, "{i}: {:?}", velocity.velocity_now());
        }
    }

    #[test]
    fn what_stands_there_shows_a_drift_that_nothing_else_does() {
        // 0.3 m/s towards somebody who is on no plan, over a floor that shows nothing.
        let (attitudes, frames) = (level(), Frames::default());
        let mut velocity = Velocity::default();
        velocity.begin(100 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
        for i in 0..6u64 {
            let range = 1.2 - 0.3 * 0.24 * i as f32;
            let ranged = Ranged { sensor: 0, range, mount: [0.06, 0.0], bearing: 0.0 };
            velocity.range((100 + 240 * i) * MS, &ranged, &attitudes, &frames, |_, _, _| None);
        }
        let [vx, vy] = velocity.at(1300 * MS, &attitudes, &frames).unwrap().velocity;
        assert!((vx - 0.3).abs() < 0.05 && vy.abs() < 1e-3, "{vx} {vy}");
    }

    #[test]
    fn wash_in_the_airframe_is_nothing_that_stands_there() {
        // 0.3 m/s over a floor that shows nothing: an echo from between the propellers never changes.
        let (attitudes, frames) = (level(), Frames::default());
        let believed = |range: f32| {
            let mut velocity = Velocity::default();
            velocity.begin(100 * MS, [0.0; 2], [0.3, 0.0], [0.0; 2]);
            for i in 0..5u64 {
                let ranged = Ranged { sensor: 0, range, mount: [0.06, 0.0], bearing: 0.0 };
                velocity.range((100 + 240 * i) * MS, &ranged, &attitudes, &frames, |_, _, _| None);
            }
            velocity.velocity_now()[0]
        };
        assert!((believed(0.05) - 0.3).abs() < 1e-3, "{}", believed(0.05));
        assert!(believed(0.5) < 0.1, "what stands there and comes no nearer is believed: {}", believed(0.5));
    }
}
