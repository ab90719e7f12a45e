//! Flying a few metres without knowing where: to hear what tells one place of the plan from another.
//!
//! Localization compares what the sonars heard on the last metres with the whole plan. Who only hovers hears eight
//! directions; who turns hears all of them, and who flies past corners, doors and furniture hears what tells rooms
//! apart that look alike from one place. So the drone first turns to and fro, and then flies in short legs to wherever
//! there is most room that it has not come from. It sees by its certainty grid alone, which then lies in a frame of
//! localization's own; the pilot's shield guards every move as any other.

use crate::place::Place;
use avoid::swath::free_length;
use avoid::{Window, wrap};
use core::f32::consts::TAU;
use ipc_types::seconds_between;

/// Turning to and fro at first: for so long, seconds, by so much to either side, radians: each of eight sonars sweeps
/// more than the 45 degrees to the next one, slowly enough that the way between two pings is heard as one place.
const LOOK_S: f32 = 8.0;
const LOOK_RAD: f32 = 0.8;
/// Speed of a leg, metres a second: half of the cruise, for nothing is known of what is ahead but what is heard.
const LEG_M_S: f32 = 0.25;
/// Length of a leg, metres: most of what the grid reaches.
const LEG_M: f32 = 1.6;
/// A leg ends where the way ahead is free for less than this beside the airframe, metres, and begins where more is.
const STOP_GAP_M: f32 = 0.45;
const LEAST_LEG_M: f32 = 0.5;
/// The strip looked at is wider than the airframe by this on each side, metres.
const SWATH_M: f32 = 0.15;
/// How far the strip reaches, metres: to the edge of the grid.
const REACH_M: f32 = 1.95;
/// Directions that are compared.
const DIRECTIONS: usize = 36;
/// A reading of one cell stands in the way.
const CERTAINTY: u8 = crate::steer::STANDS_CERTAINTY;
/// Legs remembered: their ends draw nobody back.
const REMEMBERED: usize = 12;
/// Within this of such an end it counts, metres, and by so many metres of free way.
const DRAWN_M: f32 = 3.0;
const COST_M: f32 = 0.5;
/// Going on as before is worth so many metres of free way.
const AHEAD_M: f32 = 0.3;
/// The nose looks along the leg to this before it is flown, radians.
const NOSE_RAD: f32 = 0.45;
/// Growth of the speed, metres a second squared.
const SPEED_UP_M_S2: f32 = 0.4;

/// What is wished.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// In the frame of the pose, metres a second.
    pub velocity: (f32, f32),
    /// The same frame, radians.
    pub heading: f32,
}

/// A leg being flown.
#[derive(Clone, Copy, Debug)]
struct Leg {
    direction: f32,
    from: (f32, f32),
}

/// The search move, and what it remembers.
#[derive(Clone, Debug, Default)]
pub struct Explore {
    /// When it began, and with which heading.
    since: Option<(u64, f32)>,
    leg: Option<Leg>,
    been: [(f32, f32); REMEMBERED],
    legs: usize,
    speed: f32,
}

impl Explore {
    /// Begins anew the next time.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// One decision in `dt_s`. `cells` in `window`: what was heard, in the frame of `place`.
    pub fn step(
        &mut self,
        now: u64,
        dt_s: f32,
        place: &Place,
        cells: &[u8],
        window: &Window,
        radius_m: f32,
    ) -> Move {
        let (since, from) = *self.since.get_or_insert((now, place.heading));
        let looked = seconds_between(since, now) as f32;
        let stand = |heading: f32| Move { velocity: (0.0, 0.0), heading };
        if looked < LOOK_S {
            return stand(wrap(from + LOOK_RAD * (TAU * looked / LOOK_S).sin()));
        }
        let here = (place.x, place.y);
        let free = |direction: f32| {
            free_length(cells, window, here, direction, radius_m + SWATH_M, REACH_M, CERTAINTY) - radius_m
        };
        if let Some(leg) = self.leg
            && (free(leg.direction) < STOP_GAP_M || place.distance(leg.from) > LEG_M)
        {
            self.been[self.legs % REMEMBERED] = leg.from;
            self.legs += 1;
            (self.leg, self.speed) = (None, 0.0);
        }
        if self.leg.is_none() {
            self.leg = self.choose(place, free).map(|direction| Leg { direction, from: here });
        }
        let Some(leg) = self.leg else {
            // No way on: it turns and hears what there is.
            self.speed = 0.0;
            return stand(wrap(from + LOOK_RAD * (TAU * looked / LOOK_S).sin()));
        };
        let nosed = wrap(leg.direction - place.heading).abs() < NOSE_RAD;
        let most = if nosed { LEG_M_S } else { 0.0 };
        self.speed = most.min(self.speed + SPEED_UP_M_S2 * dt_s);
        let (sin, cos) = leg.direction.sin_cos();
        Move { velocity: (self.speed * cos, self.speed * sin), heading: leg.direction }
    }

    /// The direction with most room, those that lead back counting less.
    fn choose(&self, place: &Place, free: impl Fn(f32) -> f32) -> Option<f32> {
        let known = self.legs.min(REMEMBERED);
        let mut best: Option<(f32, f32)> = None;
        for k in 0..DIRECTIONS {
            let direction = wrap(place.heading + k as f32 * TAU / DIRECTIONS as f32);
            let room = free(direction);
            if room < STOP_GAP_M + LEAST_LEG_M {
                continue;
            }
            let back: f32 = self.been[..known]
                .iter()
                .filter(|been| place.distance(**been) < DRAWN_M)
                .map(|(x, y)| wrap((y - place.y).atan2(x - place.x) - direction).cos().max(0.0))
                .sum();
            let worth = room + AHEAD_M * wrap(direction - place.heading).cos() - COST_M * back;
            if best.is_none_or(|(most, _)| worth > most) {
                best = Some((worth, direction));
            }
        }
        best.map(|(_, direction)| direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avoid::CELLS;

    /// Flies as told through walls on the grid around the origin; says whether it kept clear and where it was.
    fn fly(solid: impl Fn(f32, f32) -> bool, seconds: f32) -> Vec<(f32, f32)> {
        let mut explore = Explore::default();
        let mut place = Place::default();
        let mut way = Vec::new();
        for step in 0..(seconds / 0.05) as u64 {
            let window = Window::around(place.x, place.y).unwrap();
            let cells: Vec<u8> = (0..CELLS)
                .map(|cell| {
                    let (x, y) = window.centre(cell);
                    if solid(x, y) { 40 } else { 0 }
                })
                .collect();
            let wish = explore.step(step * 50_000_000, 0.05, &place, &cells, &window, 0.225);
            place.heading = wrap(place.heading + wrap(wish.heading - place.heading).clamp(-0.05, 0.05));
            place.x += 0.05 * wish.velocity.0;
            place.y += 0.05 * wish.velocity.1;
            way.push((place.x, place.y));
        }
        way
    }

    #[test]
    fn it_turns_first_and_then_flies_about_a_room_without_coming_near_its_walls() {
        let way = fly(|x, y| !(-1.0..3.0).contains(&x) || !(-1.0..5.0).contains(&y), 60.0);
        assert!(way[..155].iter().all(|place| *place == (0.0, 0.0)));
        let spread = |of: fn(&(f32, f32)) -> f32| {
            let (low, high) =
                way.iter().map(of).fold((f32::MAX, f32::MIN), |(low, high), v| (low.min(v), high.max(v)));
            high - low
        };
        assert!(spread(|p| p.0) + spread(|p| p.1) > 3.5, "{} {}", spread(|p| p.0), spread(|p| p.1));
        for (x, y) in way {
            assert!((-0.6..2.6).contains(&x) && (-0.6..4.6).contains(&y), "{x} {y}");
        }
    }

    #[test]
    fn where_there_is_no_room_it_stands_and_turns() {
        let way = fly(|x, y| x.hypot(y) > 0.8, 30.0);
        assert!(way.iter().all(|place| *place == (0.0, 0.0)));
    }
}
