//! What was heard a moment ago and no sonar looks at squarely now.
//!
//! A flat face answers only within some 25 degrees of its normal (FACTS 2): a drone that turns or slides past
//! a box hears it, then does not, and it is still there.

use crate::held::seconds;
use crate::planar::{Vector, wrap_angle};

/// Points kept: all that eight sonars can find near the drone in a few seconds.
const POINTS: usize = 48;
/// Echoes farther from the middle of the drone than this are not kept, metres.
const NEAR_M: f32 = 1.5;
/// A point is forgotten after this, seconds: two metres of flight, or a person who went on.
const KEEP_S: f32 = 4.0;
/// Echoes nearer to each other come from one thing, metres: twice the error of the pose.
const SAME_M: f32 = 0.2;
/// A point this near the axis, radians (6 degrees), and nearer than what is heard by `THROUGH_M`, is gone: the
/// sonar heard through it.
const THROUGH_RAD: f32 = 0.105;
const THROUGH_M: f32 = 0.2;
/// Echoes that make a thing: one may be an outlier (1 % are).
const HEARD: u8 = 2;
/// What was heard so often is gone only when it was heard through three times: at its edge a face answers one ping and lets
/// the next one pass.
const SURELY: u8 = 4;

#[derive(Clone, Copy, Debug)]
struct Point {
    at: Vector,
    heard_ns: u64,
    times: u8,
}

/// Echoes of the last seconds in the plan frame.
#[derive(Clone, Debug)]
pub(super) struct Remembered {
    points: [Option<Point>; POINTS],
    next: usize,
}

impl Remembered {
    pub(super) fn new() -> Self {
        Self { points: [None; POINTS], next: 0 }
    }

    /// Takes an echo of a sonar with its face at `face` (plan frame) that looks along `axis`, from a drone
    /// whose middle is at `middle`.
    pub(super) fn hear(&mut self, now: u64, middle: Vector, face: Vector, axis: f32, range_m: f32) {
        for slot in &mut self.points {
            if let Some(point) = slot {
                let ray = point.at - face;
                let aside = wrap_angle(ray.angle() - axis).abs();
                if aside < THROUGH_RAD && ray.norm() < range_m - THROUGH_M {
                    point.times = point.times.saturating_sub(1);
                    if point.times < HEARD {
                        *slot = None;
                    }
                }
            }
        }
        let at = face + Vector::along(axis) * range_m;
        if (at - middle).norm() > NEAR_M {
            return;
        }
        if let Some(point) = self.points.iter_mut().flatten().find(|point| (point.at - at).norm() < SAME_M) {
            point.at = point.at + (at - point.at) * 0.5;
            point.times = (point.times + 1).min(SURELY);
            point.heard_ns = now;
            return;
        }
        self.points[self.next] = Some(Point { at, heard_ns: now, times: 1 });
        self.next = (self.next + 1) % POINTS;
    }

    /// Things heard often enough and not too long ago, plan frame.
    pub(super) fn things(&self, now: u64) -> impl Iterator<Item = Vector> + '_ {
        self.points
            .iter()
            .flatten()
            .filter(move |point| point.times >= HEARD && seconds(point.heard_ns, now) < KEEP_S)
            .map(|point| point.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn a_thing_is_heard_twice_kept_and_forgotten() {
        let mut memory = Remembered::new();
        let here = Vector::ZERO;
        memory.hear(0, here, here, 0.0, 0.8);
        assert_eq!(memory.things(0).count(), 0, "one may be an outlier");
        memory.hear(S / 4, here, here, 0.0, 0.82);
        assert_eq!(memory.things(S).count(), 1);
        assert!((memory.things(S).next().unwrap() - Vector::new(0.81, 0.0)).norm() < 0.01);
        assert_eq!(memory.things(5 * S).count(), 0);
    }

    #[test]
    fn what_is_heard_through_is_gone_and_what_is_beside_the_axis_stays() {
        let here = Vector::ZERO;
        let mut memory = Remembered::new();
        for k in 0..2 {
            memory.hear(k, here, here, 0.0, 0.8);
        }
        memory.hear(S, here, here, 0.2, 2.0);
        assert_eq!(memory.things(S).count(), 1);
        memory.hear(S, here, here, 0.03, 2.0);
        assert_eq!(memory.things(S).count(), 0);
    }

    /// A thing 0.8 m from a face that looks along `AXIS`, heard so often.
    fn a_thing(times: u64) -> Remembered {
        let mut memory = Remembered::new();
        for k in 0..times {
            memory.hear(k, FACE, FACE, AXIS, 0.8);
        }
        memory
    }

    const FACE: Vector = Vector::new(3.0, 2.0);
    const AXIS: f32 = 2.0;

    #[test]
    fn what_is_heard_from_just_behind_a_thing_is_not_heard_through_it() {
        // Five degrees aside, so that what is heard is another thing.
        for (range, stays) in [(0.99, 1), (1.01, 0)] {
            let mut memory = a_thing(2);
            memory.hear(S, FACE, FACE, AXIS + 0.09, range);
            assert_eq!(memory.things(S).count(), stays, "{range} m");
        }
    }

    /// At its edge a face answers one ping and lets the next one pass.
    #[test]
    fn a_thing_is_gone_when_it_was_heard_through_as_often_as_it_was_heard_and_three_times_at_most() {
        for (heard, outlives) in [(2, 0), (3, 1), (4, 2), (9, 2)] {
            let mut memory = a_thing(heard);
            for _ in 0..outlives {
                memory.hear(S, FACE, FACE, AXIS, 2.5);
            }
            assert_eq!(memory.things(S).count(), 1, "heard {heard} times");
            memory.hear(S, FACE, FACE, AXIS, 2.5);
            assert_eq!(memory.things(S).count(), 0, "heard {heard} times");
        }
    }

    #[test]
    fn things_farther_than_0_2_m_from_each_other_are_two_and_beyond_1_5_m_none() {
        // Two directions so far from each other, twice.
        let heard = |turn: f32, range: f32| {
            let mut memory = Remembered::new();
            for axis in [AXIS, AXIS + turn, AXIS, AXIS + turn] {
                memory.hear(0, FACE, FACE, axis, range);
            }
            memory.things(0).collect::<Vec<_>>()
        };
        let at = |turn: f32| FACE + Vector::along(AXIS + turn);
        assert_eq!(heard(0.18, 1.0).len(), 1);
        let two = heard(0.22, 1.0);
        assert!(two.len() == 2 && (two[0] - at(0.0)).norm() < 1e-3 && (two[1] - at(0.22)).norm() < 1e-3);
        assert!(heard(0.0, 1.55).is_empty());
        let mut memory = Remembered::new();
        for _ in 0..2 {
            memory.hear(0, Vector::ZERO, Vector::ZERO, 0.0, NEAR_M);
        }
        assert_eq!(memory.things(0).count(), 1, "farther than this are not kept");
    }

    #[test]
    fn the_oldest_thing_makes_room_when_there_are_too_many() {
        let mut memory = Remembered::new();
        for k in 0..=POINTS {
            let face = Vector::new(k as f32 * 0.5, 0.0);
            for _ in 0..2 {
                memory.hear(0, face, face, core::f32::consts::FRAC_PI_2, 1.0);
            }
        }
        assert_eq!(memory.things(0).count(), POINTS);
        assert!(memory.things(0).all(|thing| thing.x > 0.4), "the first one is forgotten");
    }
}
