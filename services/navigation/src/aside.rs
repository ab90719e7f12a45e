//! Stepping aside for people. A door takes one at a time: a drone that waits in it for somebody who waits for the drone
//! keeps both there. So where somebody walks up to it in a narrow place it goes to where there is room beside the
//! way, lets them pass, and comes back.

use crate::journey::Journey;
use crate::place::Place;
use crate::senses::{Approach, Senses};
use avoid::wrap;
use ipc_types::seconds_between;

/// Whoever has come nearer by so much in a row walks, metres: one change of a range may be another surface.
const WALKED_M: f32 = 0.25;
/// Somebody who walks up no farther than this beside the way on, metres, and nearer than this, metres,
const ON_WAY_M: f32 = 0.7;
const MEETS_M: f32 = 2.5;
/// is taken to be there still for so long, seconds, and for as long as the drone does not move on.
const THERE_S: f64 = 15.0;
/// After waiting for so long it steps aside, seconds: who only crosses the way is past.
const AFTER_S: f32 = 8.0;
/// It stays there until nobody has come nearer for so long, and at the longest for so long, seconds: five metres of somebody
/// slow.
const QUIET_S: f64 = 2.0;
const LONGEST_S: f64 = 10.0;
/// Less clearance than this, metres, on this much of the way ahead, metres, is narrow: two do not pass each other.
const NARROW_M: f32 = 0.75;
const AHEAD_M: f32 = 1.2;
/// Stepped aside within this, metres, so often in a row: who stands there does not want to pass.
const HERE_M: f32 = 1.5;
const MOST: u32 = 3;
/// So far beside the way somebody passes, metres: shoulders, the airframe and the reach of two that sway.
const BESIDE_M: f32 = 0.95;
/// No farther away than this, metres.
const FAR_M: f32 = 3.5;
/// Clearance there, metres.
const ROOM_M: f32 = 0.5;
/// Between two places that are looked at, metres.
const APART_M: f32 = 0.2;

/// When to step aside, and for how long.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Courtesy {
    /// When somebody walked up on the way, and where the drone was.
    met: Option<(u64, (f32, f32))>,
    /// Since when it stays beside the way, and when somebody came nearer last.
    since_ns: Option<u64>,
    near_ns: u64,
    /// Where it stepped aside last, and how often in a row.
    here: Option<(f32, f32)>,
    times: u32,
}

impl Courtesy {
    /// Nobody was met.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Notes who walks up on the way that leads `towards` (radians, plan frame).
    pub(crate) fn look(&mut self, now: u64, senses: &Senses, place: &Place, towards: f32) {
        let on_way = |approach: &Approach| {
            let (sin, cos) = wrap(place.heading + approach.bearing - towards).sin_cos();
            approach.walked > WALKED_M
                && cos > 0.0
                && approach.distance < MEETS_M
                && approach.distance * sin.abs() < ON_WAY_M
        };
        if senses.approaching(now).any(|approach| on_way(&approach)) {
            self.met = Some((now, (place.x, place.y)));
        }
    }

    /// Whether to step aside now, after waiting for `waited_s` in a place that is `contested`. Counts.
    pub(crate) fn due(&mut self, now: u64, place: &Place, waited_s: f32, contested: bool) -> bool {
        let met = self
            .met
            .is_some_and(|(at, here)| seconds_between(at, now) < THERE_S || place.distance(here) < HERE_M);
        if !(met && contested && waited_s > AFTER_S) {
            return false;
        }
        let again = self.here.is_some_and(|here| place.distance(here) < HERE_M);
        self.times = if again { self.times + 1 } else { 1 };
        self.here = Some((place.x, place.y));
        self.met = None;
        self.times <= MOST
    }

    /// The place beside the way is reached.
    pub(crate) fn stay(&mut self, now: u64) {
        (self.since_ns, self.near_ns) = (Some(now), now);
    }

    /// Whether it stays beside the way.
    pub(crate) fn staying(&self) -> bool {
        self.since_ns.is_some()
    }

    /// True once, when whoever was to pass has passed, or does not want to.
    pub(crate) fn over(&mut self, now: u64, senses: &Senses) -> bool {
        let Some(since) = self.since_ns else { return false };
        if senses.approaching(now).any(|a| a.walked > WALKED_M && a.distance < MEETS_M) {
            self.near_ns = now;
        }
        let over = seconds_between(self.near_ns, now) >= QUIET_S || seconds_between(since, now) >= LONGEST_S;
        if over {
            self.since_ns = None;
        }
        over
    }
}

impl Journey {
    /// Whether the way ahead is too narrow for two and there is nothing better to do than to pass: it leads home, or was
    /// tried again and again. Otherwise another room is looked at meanwhile.
    pub(crate) fn contested(&self) -> bool {
        let looking = self.stops.get(self.target).is_some_and(|stop| stop.look);
        (!looking || self.waits_in_vain()) && self.narrow_ahead()
    }

    fn narrow_ahead(&self) -> bool {
        let along = self.track().along();
        (0..=6).map(|i| along + AHEAD_M * i as f32 / 6.0).any(|along| {
            let (x, y) = self.track().at(along);
            self.map.mapped_clearance(x, y) < NARROW_M
        })
    }

    /// The nearest place with room beside a way that leads `towards` and back, in a straight line from here.
    pub(crate) fn room_beside(&self, place: &Place, towards: f32) -> Option<(f32, f32)> {
        let (sin, cos) = towards.sin_cos();
        let steps = (FAR_M / APART_M) as i32;
        let places = (-steps..=steps)
            .flat_map(|i| (-steps..=steps).map(move |j| (i as f32 * APART_M, j as f32 * APART_M)));
        places
            .filter(|(dx, dy)| {
                let (along, aside) = (dx * cos + dy * sin, (dy * cos - dx * sin).abs());
                aside > BESIDE_M && along < 0.3 && dx.hypot(*dy) < FAR_M
            })
            .filter(|(dx, dy)| self.map.clearance(place.x + dx, place.y + dy) > ROOM_M)
            .filter(|(dx, dy)| {
                let steps = (dx.hypot(*dy) / 0.1).ceil().max(1.0) as i32;
                (1..=steps).all(|i| {
                    let t = i as f32 / steps as f32;
                    self.map.passable(place.x + t * dx, place.y + t * dy)
                })
            })
            .min_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)))
            .map(|(dx, dy)| (place.x + dx, place.y + dy))
    }
}
