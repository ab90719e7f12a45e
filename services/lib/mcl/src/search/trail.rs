//! What was heard on the last metres of the way.

use crate::maths::{sin_cos, wrap_angle};
use crate::sonar::{Echo, Reading};
use core::f32::consts::TAU;

/// Most readings kept: four full turns of the directions below.
pub const MAX_HEARD: usize = 160;
/// Directions that are told apart: a cone is three of them wide.
const DIRECTIONS: f32 = 36.0;
/// A reading replaces one of the same direction that was made nearer to here than this, metres: it says the same again.
const SAME_PLACE_M: f32 = 0.3;
/// What was heard more than this far back on the way is left out, metres: by then the way itself is off by several
/// per cent, and the compass with it.
const LONGEST_WAY_M: f32 = 8.0;
/// The same for what was heard longer ago than this, seconds: a velocity that errs by two centimetres a second has led
/// half a metre astray by then, and people have gone on.
const LONGEST_S: f64 = 25.0;

/// One echo, or silence, with where the sensor was and whither it looked, in the frame of the trail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Heard {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) axis_rad: f32,
    pub(crate) echo: Echo,
    /// Length of the way when it was heard, and when that was.
    way_m: f32,
    time_s: f64,
}

/// Where the drone is in the frame of the trail: any frame whose place and heading follow the drone without a jump.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrailPose {
    /// Metres.
    pub x: f32,
    /// Metres.
    pub y: f32,
    /// Radians, counter-clockwise.
    pub heading_rad: f32,
}

/// The readings of the last metres: at most one for each direction and place. Fixed size, nothing is allocated.
#[derive(Clone, Debug)]
pub struct Trail {
    heard: [Heard; MAX_HEARD],
    count: usize,
    last: Option<TrailPose>,
    way_m: f32,
    longest_s: f64,
}

const NONE: Heard = Heard { x: 0.0, y: 0.0, axis_rad: 0.0, echo: Echo::Nothing, way_m: 0.0, time_s: 0.0 };

impl Default for Trail {
    fn default() -> Self {
        Self { heard: [NONE; MAX_HEARD], count: 0, last: None, way_m: 0.0, longest_s: LONGEST_S }
    }
}

impl Trail {
    /// Forgets everything: the frame has jumped. From now on nothing older than `longest_s` is kept, seconds, and nothing
    /// older than 25 s in any case.
    pub fn clear(&mut self, longest_s: f64) {
        *self = Self { longest_s: longest_s.min(LONGEST_S), ..Self::default() };
    }

    /// Readings kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether nothing was heard yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Length of the way since the trail began, metres.
    #[must_use]
    pub fn way_m(&self) -> f32 {
        self.way_m
    }

    /// Share of all directions around the drone that some reading looked into, 0..=1.
    #[must_use]
    pub fn around(&self) -> f32 {
        let mut seen = [false; DIRECTIONS as usize];
        for heard in self.heard() {
            // A cone covers its own direction and one to either side.
            for beside in 0..3 {
                seen[(direction(heard.axis_rad) + beside + seen.len() - 1) % seen.len()] = true;
            }
        }
        seen.iter().filter(|seen| **seen).count() as f32 / DIRECTIONS
    }

    pub(crate) fn heard(&self) -> &[Heard] {
        &self.heard[..self.count]
    }

    /// Takes readings that were made at `pose` together, at a time in seconds of any clock. What is not finite is left out.
    pub fn push(&mut self, time_s: f64, pose: &TrailPose, readings: &[Reading]) {
        if !(time_s.is_finite() && pose.x.is_finite() && pose.y.is_finite() && pose.heading_rad.is_finite()) {
            return;
        }
        if let Some(last) = self.last {
            self.way_m += (pose.x - last.x).hypot(pose.y - last.y);
        }
        self.last = Some(*pose);
        self.forget(time_s);
        let (sin, cos) = sin_cos(pose.heading_rad);
        for reading in readings {
            let heard = Heard {
                x: pose.x + cos * reading.mount_x - sin * reading.mount_y,
                y: pose.y + sin * reading.mount_x + cos * reading.mount_y,
                axis_rad: wrap_angle(pose.heading_rad + reading.bearing_rad),
                echo: reading.echo,
                way_m: self.way_m,
                time_s,
            };
            let finite = match heard.echo {
                Echo::Range(range) => range.is_finite() && range > 0.0,
                Echo::Nothing => true,
            };
            if finite && heard.x.is_finite() && heard.y.is_finite() && heard.axis_rad.is_finite() {
                self.keep(heard);
            }
        }
    }

    fn keep(&mut self, new: Heard) {
        let same = |old: &Heard| {
            direction(old.axis_rad) == direction(new.axis_rad)
                && (old.x - new.x).hypot(old.y - new.y) < SAME_PLACE_M
        };
        if let Some(at) = self.heard().iter().position(same) {
            // In the order of age, so that the oldest are the first.
            self.heard[at..self.count].rotate_left(1);
            self.heard[self.count - 1] = new;
            return;
        }
        if self.count == MAX_HEARD {
            self.heard.rotate_left(1);
            self.count -= 1;
        }
        self.heard[self.count] = new;
        self.count += 1;
    }

    /// Drops what lies too far back.
    fn forget(&mut self, now_s: f64) {
        let old = |heard: &&Heard| {
            self.way_m - heard.way_m > LONGEST_WAY_M || now_s - heard.time_s > self.longest_s
        };
        let old = self.heard().iter().take_while(old).count();
        self.heard[..self.count].rotate_left(old);
        self.count -= old;
    }
}

/// Which direction an axis looks into, 0..72.
fn direction(axis_rad: f32) -> usize {
    let step = (axis_rad * (DIRECTIONS / TAU)).round().rem_euclid(DIRECTIONS);
    step as usize % DIRECTIONS as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(degrees: f32, range: f32) -> Reading {
        Reading {
            echo: Echo::Range(range),
            bearing_rad: degrees.to_radians(),
            elevation_rad: 0.0,
            mount_x: 0.1,
            mount_y: 0.0,
        }
    }

    #[test]
    fn who_stands_keeps_the_newest_reading_of_each_direction() {
        let mut trail = Trail::default();
        let pose = TrailPose { x: 1.0, y: 2.0, heading_rad: 0.5 };
        for turn in 0..10 {
            trail.push(f64::from(turn), &pose, &[reading(0.0, 1.0 + turn as f32), reading(90.0, 2.0)]);
        }
        assert_eq!(trail.len(), 2);
        assert!(trail.heard().iter().any(|heard| heard.echo == Echo::Range(10.0)));
        let [ahead, _] = trail.heard() else { unreachable!("two readings") };
        assert!((ahead.x - 1.0 - 0.1 * 0.5f32.cos()).abs() < 1e-5);
        assert!((ahead.axis_rad - 0.5).abs() < 1e-5);
    }

    #[test]
    fn who_turns_looks_all_around_and_who_flies_leaves_things_behind() {
        let mut trail = Trail::default();
        for k in 0..72 {
            let pose = TrailPose { x: 0.0, y: 0.0, heading_rad: k as f32 * TAU / 72.0 };
            trail.push(0.0, &pose, &[reading(0.0, 1.0)]);
        }
        // Two of five degrees each share a direction.
        assert_eq!((trail.len(), trail.around()), (36, 1.0));
        for k in 0..40 {
            trail.push(1.0, &TrailPose { x: 0.4 * k as f32, ..TrailPose::default() }, &[reading(0.0, 1.0)]);
        }
        // Of 15.6 m the last eight, a reading every 0.4 m.
        assert_eq!(trail.len(), 21);
        trail.push(30.0, &TrailPose { x: 15.6, ..TrailPose::default() }, &[reading(90.0, 1.0)]);
        assert_eq!(trail.len(), 1, "the rest was heard too long ago");
        trail.clear(f64::INFINITY);
        assert!(trail.is_empty() && trail.around() == 0.0);
    }

    #[test]
    fn the_oldest_make_room_and_nonsense_is_left_out() {
        let mut trail = Trail::default();
        for k in 0..200 {
            let pose = TrailPose { x: 0.0, y: 0.0, heading_rad: 0.0 };
            trail.push(0.0, &pose, &[Reading { mount_x: 0.4 * k as f32, ..reading(0.0, 1.0 + k as f32) }]);
        }
        assert_eq!(trail.len(), MAX_HEARD);
        assert_eq!(trail.heard()[MAX_HEARD - 1].echo, Echo::Range(200.0));
        assert_eq!(trail.heard()[0].echo, Echo::Range(41.0));
        let count = trail.len();
        for heading_rad in [f32::NAN, f32::INFINITY] {
            trail.push(0.0, &TrailPose { x: 0.0, y: 0.0, heading_rad }, &[reading(40.0, 1.0)]);
        }
        let here = TrailPose::default();
        trail.push(0.0, &here, &[reading(f32::NAN, 1.0), reading(50.0, f32::NAN), reading(60.0, -1.0)]);
        assert_eq!(trail.len(), count);
    }
}
