//! Stops that have been seen from elsewhere meanwhile are left out of the route.

use crate::journey::{Corner, Journey, ROUTE_NODES, Stage, TRIM_EVERY, Work};
use crate::place::Place;
use patrol::Step;

/// Stops asked in one go whether they are still worth the way.
const TRIM_AHEAD: usize = 4;
/// A stop this near is flown to in any case, metres.
const TRIM_NEAR_M: f32 = 0.6;

impl Journey {
    /// Looks whether the next stops have been seen from the way there.
    pub(crate) fn consider_trim(&mut self, place: &Place) {
        self.since_trim += 1;
        if self.since_trim < TRIM_EVERY || !self.round {
            return;
        }
        self.since_trim = 0;
        let near =
            self.stops.get(self.target).is_some_and(|stop| place.distance((stop.x, stop.y)) < TRIM_NEAR_M);
        if near {
            return;
        }
        let least = self.map.limits().least_gain_m2;
        let seen = self.stops[self.target.min(self.stops.len())..]
            .iter()
            .take(TRIM_AHEAD)
            .take_while(|stop| {
                stop.look
                    && stop.point.is_none()
                    && self.seen.gain_m2(&self.map, &self.to_see, stop.x, stop.y) < least
            })
            .count();
        let to = self.target + seen;
        if seen > 0
            && let Some(stop) = self.stops.get(to)
        {
            self.planner.begin(&self.map, (place.x, place.y), (stop.x, stop.y));
            self.stage = Stage::Trim(to);
        }
    }

    pub(crate) fn work_on_trim(&mut self, to: usize) -> Work {
        match self.planner.advance(&self.map, ROUTE_NODES) {
            Step::Working => self.stage = Stage::Trim(to),
            Step::None => self.stage = Stage::Ready,
            Step::Found => {
                let after =
                    self.corners.iter().position(|corner| corner.stop == Some(to)).map_or(0, |at| at + 1);
                let rest: Vec<Corner> = self.corners.drain(..).skip(after).collect();
                self.track.clear();
                self.append_leg(to);
                for corner in rest {
                    self.push_corner((corner.x, corner.y), corner.stop);
                }
                self.target = to;
                self.stage = Stage::Ready;
            }
        }
        Work::Idle
    }
}
