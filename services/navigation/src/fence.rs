//! Speed towards what is near: the nearer, the slower, and away from what is too near.
//!
//! Twenty-four directions around the drone, in each the nearest of what the sonars have seen and the plan
//! knows. In each the velocity's part towards it may be no more than `GAIN_PER_S * (gap - KEEP_M)`: the speed falls with
//! the gap in a time that the velocity loop can follow, and a gust that carries the drone nearer than
//! [`KEEP_M`] is answered by a motion away. The shield of the pilot knows nothing of the grid: it is the second
//! opinion.

use crate::steer::{STANDS_CERTAINTY, Scene};
use avoid::SIDE;
use core::f32::consts::TAU;

/// Directions: 15 degrees apart, so that a wall looked at aslant is at most 1 % farther than it is.
const DIRECTIONS: usize = 24;
/// What is farther than this matters to the histogram only, metres from the drone's middle.
const REACH_M: f32 = 1.0;
/// Speed for each metre of gap, 1/s: half of what the velocity loop follows (its answer takes 0.4 s).
const GAIN_PER_S: f32 = 1.2;
/// Gap that is kept, metres: a gust of 0.3 m/s2 carries the drone 5 cm before it is flown back.
pub const KEEP_M: f32 = 0.15;
/// Fastest motion away, metres a second.
const AWAY_M_S: f32 = 0.2;
/// Beside what no plan shows, and while it stands, the drone keeps to the middle of what is nearer than this, metres.
const ROOM_M: f32 = 0.4;
/// The same along the way that it waits for: nearer than people come who wait for it to go, or it would walk before them.
const WAITING_ROOM_M: f32 = 0.25;
/// Speed to the middle for each metre that it is off, 1/s, and at most, metres a second: no faster backwards than is heard.
const CENTRE_PER_S: f32 = 1.0;
const CENTRE_MOST_M_S: f32 = 0.15;
/// What lies within 45 degrees of a direction lies that way, as a cosine.
const THAT_WAY_COS: f32 = 0.7;
/// What lies more than 105 degrees off a motion is left behind by it, as a cosine.
const LEFT_BEHIND_COS: f32 = -0.26;
/// Slower wishes are standing, metres a second.
const STANDS_M_S: f32 = 0.02;
/// Passes over the directions; two opposite ones that are too near settle in the middle.
const PASSES: usize = 6;
/// Echoes older than this say nothing about now, seconds: a sweep of eight one by one is 0.48 s.
const ECHO_AGE_S: f32 = 0.5;

/// Gaps around the airframe.
#[derive(Clone, Copy, Debug)]
pub struct Fence {
    /// Unit vectors, plan frame, and the gap between airframe and what is nearest there, metres.
    sides: [(f32, f32, f32); DIRECTIONS],
    least_m: f32,
    unmapped_m: f32,
    /// The same for what does not lie behind a motion that way.
    unmapped_sides: [f32; DIRECTIONS],
}

impl Fence {
    /// Looks around.
    #[must_use]
    pub fn around(scene: &Scene<'_>, radius_m: f32) -> Self {
        let mut nearest = [f32::INFINITY; DIRECTIONS];
        let mut unmapped = f32::INFINITY;
        let mut unmapped_sides = [f32::INFINITY; DIRECTIONS];
        let note = |nearest: &mut [f32; DIRECTIONS], angle: f32, distance: f32| {
            if angle.is_finite() && distance < REACH_M {
                let side = (angle / TAU * DIRECTIONS as f32).round() as i32;
                if let Some(slot) = nearest.get_mut(side.rem_euclid(DIRECTIONS as i32) as usize) {
                    *slot = slot.min(distance);
                }
            }
        };
        let (x, y) = (scene.place.x, scene.place.y);
        if let Some(middle) = scene.window.index(x, y) {
            let (row, column) = ((middle / SIDE) as i32, (middle % SIDE) as i32);
            let reach = (REACH_M / avoid::CELL_M) as i32;
            let within = |middle: i32| (middle - reach).max(0)..(middle + reach + 1).min(SIDE as i32);
            for index in
                within(row).flat_map(|row| within(column).map(move |c| row as usize * SIDE + c as usize))
            {
                if scene.cells.get(index).is_some_and(|cell| *cell >= STANDS_CERTAINTY) {
                    let (cx, cy) = scene.window.centre(index);
                    let distance = (cx - x).hypot(cy - y);
                    unmapped = unmapped.min(distance);
                    note(&mut unmapped_sides, (cy - y).atan2(cx - x), distance);
                }
            }
        }
        for (bearing, distance) in scene.senses.near(scene.now, ECHO_AGE_S) {
            note(&mut nearest, scene.place.heading + bearing, distance);
        }
        for (side, unmapped) in nearest.iter_mut().zip(unmapped_sides) {
            *side = side.min(unmapped);
        }
        let unmapped_sides = unmapped_sides.map(|distance| distance - radius_m);
        let mut sides = [(0.0, 0.0, f32::INFINITY); DIRECTIONS];
        for (i, (side, seen)) in sides.iter_mut().zip(nearest).enumerate() {
            let (sin, cos) = (i as f32 * TAU / DIRECTIONS as f32).sin_cos();
            *side = (cos, sin, seen.min(wall(scene, cos, sin)) - radius_m);
        }
        let least_m = sides.iter().fold(f32::INFINITY, |least, side| least.min(side.2));
        Self { sides, least_m, unmapped_m: unmapped - radius_m, unmapped_sides }
    }

    /// The least gap to what no plan shows, metres; infinite when nothing of the kind is near.
    #[must_use]
    pub fn unmapped_m(&self) -> f32 {
        self.unmapped_m
    }

    /// The least gap to what no plan shows and what is not left behind by a motion in a direction, metres; infinite when
    /// nothing of the kind is near.
    #[must_use]
    pub fn unmapped_towards_m(&self, direction: f32) -> f32 {
        let (sin, cos) = direction.sin_cos();
        let sides = self.sides.iter().zip(self.unmapped_sides);
        let ahead = sides.filter(|(side, _)| side.0 * cos + side.1 * sin > LEFT_BEHIND_COS);
        ahead.fold(f32::INFINITY, |least, (_, gap)| least.min(gap))
    }

    /// Motion to the middle between what is on the left and on the right of a wish. Without one the drone makes room on all
    /// sides, and less of it along the `way` that it waits for.
    fn centred(&self, wish: (f32, f32), way: Option<f32>) -> (f32, f32) {
        if self.unmapped_m > ROOM_M {
            return (0.0, 0.0);
        }
        let gap = |ux: f32, uy: f32, room: f32| {
            let that_way = self.sides.iter().filter(|side| side.0 * ux + side.1 * uy > THAT_WAY_COS);
            that_way.fold(room, |least, side| least.min(side.2))
        };
        let speed = wish.0.hypot(wish.1);
        let ((ux, uy), room) = match way.filter(|way| way.is_finite()) {
            _ if speed >= STANDS_M_S => ((wish.0 / speed, wish.1 / speed), None),
            Some(way) => ((way.cos(), way.sin()), Some(WAITING_ROOM_M)),
            None => ((1.0, 0.0), Some(ROOM_M)),
        };
        let across = CENTRE_PER_S * 0.5 * (gap(-uy, ux, ROOM_M) - gap(uy, -ux, ROOM_M));
        let along = room.map_or(0.0, |room| CENTRE_PER_S * 0.5 * (gap(ux, uy, room) - gap(-ux, -uy, room)));
        let (cx, cy) = (along * ux - across * uy, along * uy + across * ux);
        let share = (CENTRE_MOST_M_S / cx.hypot(cy).max(1e-3)).min(1.0);
        (share * cx, share * cy)
    }

    /// What is left of a wish, plan frame, and whether something is nearer than is kept. `way`: the direction that the drone
    /// wants to go in, radians.
    #[must_use]
    pub fn keep(&self, wish: (f32, f32), way: Option<f32>) -> ((f32, f32), bool) {
        let (cx, cy) = self.centred(wish, way);
        let (mut vx, mut vy) = (wish.0 + cx, wish.1 + cy);
        for _ in 0..PASSES {
            for (ux, uy, gap) in self.sides.iter().filter(|side| side.2.is_finite()) {
                let most = (GAIN_PER_S * (gap - KEEP_M)).max(-AWAY_M_S);
                let excess = vx * ux + vy * uy - most;
                if excess > 0.0 {
                    (vx, vy) = (vx - excess * ux, vy - excess * uy);
                }
            }
        }
        ((vx, vy), self.least_m < KEEP_M)
    }
}

/// Distance to what the plan knows in a direction, metres, by steps that the distance field allows.
fn wall(scene: &Scene<'_>, ux: f32, uy: f32) -> f32 {
    let mut way = 0.0;
    // Each step is at least 2 cm: bounded by a metre's worth of them.
    while way < REACH_M {
        let free = scene.field.distance(scene.place.x + way * ux, scene.place.y + way * uy);
        if free < 0.02 {
            return way;
        }
        way += free.max(0.02);
    }
    f32::INFINITY
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gaps by direction in steps of 15 degrees; elsewhere nothing is near.
    fn fence(gaps: &[(usize, f32)]) -> Fence {
        let mut sides = [(0.0, 0.0, f32::INFINITY); DIRECTIONS];
        for (i, side) in sides.iter_mut().enumerate() {
            let (sin, cos) = (i as f32 * TAU / DIRECTIONS as f32).sin_cos();
            let gap = gaps.iter().find(|(at, _)| *at == i).map_or(f32::INFINITY, |(_, gap)| *gap);
            *side = (cos, sin, gap);
        }
        let least_m = gaps.iter().fold(f32::INFINITY, |least, (_, gap)| least.min(*gap));
        Fence { sides, least_m, unmapped_m: f32::INFINITY, unmapped_sides: [f32::INFINITY; DIRECTIONS] }
    }

    #[test]
    fn the_speed_towards_something_falls_with_the_gap_and_along_it_does_not() {
        let ((vx, vy), near) = fence(&[(0, 0.35)]).keep((0.5, 0.3), None);
        assert!((vx - GAIN_PER_S * (0.35 - KEEP_M)).abs() < 1e-5 && (vy - 0.3).abs() < 1e-5 && !near);
        assert_eq!(fence(&[]).keep((0.5, 0.3), None), ((0.5, 0.3), false));
    }

    #[test]
    fn what_is_too_near_is_left_even_without_a_wish() {
        let ((vx, vy), near) = fence(&[(0, 0.05)]).keep((0.0, 0.0), None);
        assert!((-AWAY_M_S..-0.05).contains(&vx) && vy.abs() < 1e-5 && near, "{vx} {vy}");
        let ((vx, _), _) = fence(&[(0, -1.0)]).keep((0.5, 0.0), None);
        assert!((vx + AWAY_M_S).abs() < 1e-5, "never faster away than allowed: {vx}");
    }

    #[test]
    fn beside_something_unmapped_the_drone_keeps_to_the_middle_and_makes_room_while_it_stands() {
        // A box 0.2 m to the left, a wall 0.3 m to the right.
        let beside = Fence { unmapped_m: 0.2, ..fence(&[(6, 0.2), (18, 0.3)]) };
        let ((vx, vy), _) = beside.keep((0.4, 0.0), None);
        assert!((vx - 0.4).abs() < 1e-4 && (vy + 0.5 * CENTRE_PER_S * 0.1).abs() < 1e-4, "{vx} {vy}");
        // Somebody 0.25 m ahead, nothing behind: back, no faster than allowed, and not for ever.
        let before = |gap: f32, way| Fence { unmapped_m: gap, ..fence(&[(0, gap)]) }.keep((0.0, 0.0), way).0;
        let back = |room: f32, gap: f32| -0.5 * CENTRE_PER_S * (room - gap);
        assert!((before(0.25, None).0 - back(ROOM_M, 0.25)).abs() < 1e-4, "{:?}", before(0.25, None));
        assert_eq!(before(ROOM_M + 0.01, None), (0.0, 0.0));
        // On the way that it waits for, people who wait too are not led on by a drone that creeps away from them...
        let waiting = before(0.2, Some(0.0));
        assert!((waiting.0 - back(WAITING_ROOM_M, 0.2)).abs() < 1e-4, "{waiting:?}");
        assert_eq!(before(WAITING_ROOM_M + 0.01, Some(0.0)), (0.0, 0.0));
        // ...but beside it there is room to be made, so that the way on opens.
        let aside = before(0.25, Some(core::f32::consts::FRAC_PI_2));
        assert!((aside.0 - back(ROOM_M, 0.25)).abs() < 1e-4, "{aside:?}");
        // Walls alone do not move it: the planned line keeps to their middle.
        assert_eq!(fence(&[(0, 0.25)]).keep((0.0, 0.0), None).0, (0.0, 0.0));
    }

    #[test]
    fn what_is_left_behind_costs_no_speed() {
        let mut sides = [f32::INFINITY; DIRECTIONS];
        // 0.2 m behind a motion along x, 0.3 m to its left.
        (sides[12], sides[6]) = (0.2, 0.3);
        let fence = Fence { unmapped_sides: sides, ..fence(&[]) };
        assert_eq!(fence.unmapped_towards_m(0.0), 0.3);
        assert_eq!(fence.unmapped_towards_m(core::f32::consts::PI), 0.2);
        assert_eq!(fence.unmapped_towards_m(-core::f32::consts::FRAC_PI_4), f32::INFINITY);
    }

    #[test]
    fn between_the_posts_of_a_door_the_way_on_stays_open() {
        // 0.225 m to either side, nothing ahead.
        let ((vx, vy), near) = fence(&[(6, 0.225), (18, 0.225)]).keep((0.4, 0.2), None);
        assert!((vx - 0.4).abs() < 1e-4 && vy <= GAIN_PER_S * (0.225 - KEEP_M) + 1e-4 && !near, "{vx} {vy}");
    }
}
