//! The line of the route: what to aim at, and how to keep to it.

use super::{DOOR_M, OPEN_M, Steering};
use crate::config::NavigationConfig;
use crate::place::Place;
use crate::track::Track;
use floorplan::DistanceField;

/// The straight line to the aim may pass this much nearer to walls than the route does, metres.
const CUT_LOSS_M: f32 = 0.03;
/// Farther than this from walls corners are cut as they come, metres.
const CUT_FREELY_M: f32 = 0.7;
/// The aim is never nearer than about this, metres: the direction would jitter with the estimate.
const SHORTEST_AHEAD_M: f32 = 0.35;
/// Places of the route between the drone and its aim that are asked for their clearance.
const AIM_SAMPLES: usize = 8;
/// Length of route that its direction is taken from, metres.
const ONWARD_M: f32 = 0.3;
/// Where walls come nearer to both sides of the route by so much, over so much aside, metres, there is no way round.
const GATE_M: f32 = 0.05;
const GATE_ASIDE_M: f32 = 0.25;
/// The drone comes back to the line at this rate, 1/s: a quarter of the velocity loop's.
const BACK_PER_S: f32 = 1.5;
const BACK_MOST_M_S: f32 = 0.25;
/// Where it will be aside of the line is looked at this far ahead, seconds: what the velocity loop takes to turn it.
const ASIDE_AHEAD_S: f32 = 0.3;
/// This far aside of the line in a narrow place there is no motion onward, metres: half of the room
/// beside a disc of 0.45 m in a door of 0.9 m.
const ASIDE_STOPS_M: f32 = 0.12;

/// What the route asks for at one decision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// Place to fly at, plan frame, metres.
    pub x: f32,
    /// Place to fly at, plan frame, metres.
    pub y: f32,
    /// Least clearance of the plan on the way there, metres.
    pub clearance_m: f32,
    /// Least clearance of the route between here and there, metres.
    pub route_m: f32,
    /// How far it is to the narrowest place there, metres, if it has a wall to either side like a door: what stands in it is
    /// not gone round.
    pub gate_m: Option<f32>,
    /// Distance of the drone from the route, metres.
    pub aside_m: f32,
    /// The place of the route that is nearest to the drone, and one a little further on: its direction.
    pub foot: (f32, f32),
    /// See `foot`.
    pub onward: (f32, f32),
    /// What is left of the route, metres.
    pub remaining_m: f32,
}

impl Steering {
    /// The aim on the route: as far ahead as wished, but no farther than the straight line there keeps
    /// about the clearance of the route itself. `None` without a route.
    #[must_use]
    pub fn aim(
        &self,
        config: &NavigationConfig,
        field: &DistanceField,
        place: &Place,
        track: &Track,
    ) -> Option<Aim> {
        track.end()?;
        let here = field.distance(place.x, place.y);
        let mut ahead = config.look_ahead_m;
        loop {
            let sample = |i: usize| track.aim(ahead * i as f32 / AIM_SAMPLES as f32);
            let clearance = |i: usize| field.distance(sample(i).0, sample(i).1);
            let (narrowest, route) = (0..=AIM_SAMPLES)
                .map(|i| (i, clearance(i)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, f32::INFINITY));
            let (x, y) = track.aim(ahead);
            let line = clearance_between(field, (place.x, place.y), (x, y));
            if ahead < SHORTEST_AHEAD_M || line >= route.min(here).min(CUT_FREELY_M) - CUT_LOSS_M {
                let remaining_m = track.remaining();
                return Some(Aim {
                    x,
                    y,
                    clearance_m: route.min(line),
                    route_m: route,
                    gate_m: gate(
                        field,
                        sample(narrowest.saturating_sub(1)),
                        sample(narrowest),
                        sample((narrowest + 1).min(AIM_SAMPLES)),
                    )
                    .then(|| place.distance(sample(narrowest))),
                    aside_m: track.aside(),
                    foot: track.at(track.along()),
                    onward: track.aim(ONWARD_M),
                    remaining_m,
                });
            }
            ahead *= 0.8;
        }
    }
}

/// Along the line and back to it. On the way into a narrow place, the farther aside, the slower onward: a disc of 0.45 m has
/// 0.225 m on each side in the middle of a door, and comes to the middle before it goes in.
pub(super) fn along(aim: &Aim, place: &Place, speed: f32, entering: bool, wish: (f32, f32)) -> (f32, f32) {
    let (tx, ty) = (aim.onward.0 - aim.foot.0, aim.onward.1 - aim.foot.1);
    let length = tx.hypot(ty);
    if length < 0.3 * ONWARD_M {
        return wish;
    }
    let (tx, ty) = (tx / length, ty / length);
    let (ox, oy) = (aim.foot.0 - place.x, aim.foot.1 - place.y);
    // Only across: what lies along the line is progress, not error.
    let across = oy * tx - ox * ty;
    let back = (BACK_PER_S * across).clamp(-BACK_MOST_M_S, BACK_MOST_M_S);
    let soon = across - ASIDE_AHEAD_S * (place.vy * tx - place.vx * ty);
    let tight = if entering { ((OPEN_M - aim.route_m) / (OPEN_M - DOOR_M)).clamp(0.0, 1.0) } else { 0.0 };
    let onward = speed * (1.0 - tight * (across.abs().max(soon.abs()) / ASIDE_STOPS_M).min(1.0));
    (onward * tx - back * ty, onward * ty + back * tx)
}

/// Whether walls come nearer to either side of a place, on the way from one before it to one behind.
fn gate(field: &DistanceField, before: (f32, f32), place: (f32, f32), behind: (f32, f32)) -> bool {
    let (dx, dy) = (behind.0 - before.0, behind.1 - before.1);
    let length = dx.hypot(dy);
    if length < 0.01 {
        return false;
    }
    let (nx, ny) = (-dy / length * GATE_ASIDE_M, dx / length * GATE_ASIDE_M);
    let here = field.distance(place.0, place.1);
    let aside = |side: f32| field.distance(place.0 + side * nx, place.1 + side * ny);
    aside(1.0) < here - GATE_M && aside(-1.0) < here - GATE_M
}

/// Least clearance of the plan along a straight line, metres, looked at every 10 cm.
#[must_use]
pub fn clearance_between(field: &DistanceField, a: (f32, f32), b: (f32, f32)) -> f32 {
    let length = (b.0 - a.0).hypot(b.1 - a.1);
    // A line longer than a plan is broken input; the samples stay bounded.
    let steps = (length / 0.1).ceil().clamp(1.0, 200.0) as usize;
    (0..=steps)
        .map(|i| {
            let t = i as f32 / steps as f32;
            field.distance(a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
        })
        .fold(f32::INFINITY, f32::min)
}
