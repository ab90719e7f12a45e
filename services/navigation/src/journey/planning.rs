//! The slices in which a round and its legs are planned.

use super::{Journey, ROUTE_NODES, SAME_STOP_M, Stage, Work};
use crate::mission::Goal;
use crate::place::Place;
use core::fmt::Write;
use ipc_types::{MAX_WAYPOINTS, Text};
use patrol::{Bits, Obstacle, Progress, Round, Step, Stop};

/// One slice of working out a round: about 6 ms here, 15 ms on a Pi 4, of the 50 ms between decisions: whoever
/// stands in a door until it is done is shaken by gusts.
const ROUND_UNITS: usize = 1_800_000;
/// Looks worked out again in a slice: about 30 us each.
const LOOKS_A_SLICE: usize = 60;
/// Planning that failed is tried again with a clean slate this often.
const FRESH_STARTS: u32 = 4;
/// Marks nearer to the drone than this are forgotten when it is walled in by them, metres.
const FORGET_M: f32 = 1.0;

/// The bit of a wished point.
pub(crate) fn bit(point: usize) -> u32 {
    u32::try_from(point).ok().and_then(|point| 1_u32.checked_shl(point)).unwrap_or(0)
}

impl Journey {
    /// One bounded slice of planning. Allocates; never part of a decision.
    pub fn work(&mut self, goal: Goal, place: &Place, pad: Option<(f32, f32)>) -> Work {
        match core::mem::replace(&mut self.stage, Stage::Idle) {
            Stage::Idle => Work::Idle,
            Stage::Asked if self.afresh => {
                self.afresh = false;
                self.new_round();
                self.stage = Stage::Asked;
                Work::Busy
            }
            Stage::Asked if self.pardon.is_some() => {
                if let Some(pardon) = self.pardon.take() {
                    self.pardon(pardon);
                }
                self.stage = Stage::Asked;
                Work::Busy
            }
            Stage::Asked if self.review => {
                self.review = false;
                self.seen.restore(self.seen_before.words());
                self.stage = Stage::Review(0);
                Work::Busy
            }
            Stage::Asked => self.begin(goal, place, pad),
            Stage::Review(done) => {
                for (x, y) in self.looks.iter().skip(done).take(LOOKS_A_SLICE) {
                    self.seen.mark(&self.map, *x, *y);
                }
                let done = done + LOOKS_A_SLICE;
                self.stage = if done < self.looks.len() { Stage::Review(done) } else { Stage::Asked };
                Work::Busy
            }
            Stage::Round(round) => self.work_on_round(round, place),
            Stage::Leg(stop) => self.work_on_leg(stop, place),
            Stage::Trim(stop) => self.work_on_trim(stop),
            Stage::Ready => {
                self.stage = Stage::Ready;
                self.consider_trim(place);
                Work::Idle
            }
        }
    }

    fn begin(&mut self, goal: Goal, place: &Place, pad: Option<(f32, f32)>) -> Work {
        if let Some(towards) = self.aside.take()
            && goal != Goal::None
            && let Some((x, y)) = self.room_beside(place, towards)
        {
            self.round = false;
            self.stepping_aside = true;
            self.stops.clear();
            self.stops.push(Stop { x, y, room: None, look: false, point: None });
            return self.begin_leg(0, (place.x, place.y));
        }
        self.round = goal == Goal::Round;
        let to = match (goal, pad) {
            (Goal::None, _) => return Work::Idle,
            (Goal::There(there), _) => there,
            (Goal::Home | Goal::Round, None) => return self.no_way("the pad is not known"),
            (Goal::Round, Some(pad)) => {
                let from = (place.x, place.y);
                let round = Round::new(&self.map, self.rooms.len(), from, pad, &self.seen, &self.wishes);
                self.stage = Stage::Round(Box::new(round));
                return Work::Busy;
            }
            (Goal::Home, Some(pad)) => pad,
        };
        self.stops.clear();
        self.stops.push(Stop { x: to.0, y: to.1, room: None, look: false, point: None });
        self.begin_leg(0, (place.x, place.y))
    }

    fn work_on_round(&mut self, mut round: Box<Round>, place: &Place) -> Work {
        match round.advance(&self.map, &self.seen, ROUND_UNITS) {
            Progress::Working => {
                self.stage = Stage::Round(round);
                Work::Busy
            }
            Progress::Failed => self.start_afresh(place, "the drone is walled in"),
            Progress::Done => {
                self.to_see = round.to_see().clone();
                self.kept = None;
                for (room, found) in round.rooms().iter().enumerate().take(self.rooms.len()) {
                    self.rooms[room] = *found;
                    let name = self.atlas.rooms().name(room);
                    let reason = found.skipped.map(|obstacle| obstacle.reason(name, self.map.doors()));
                    self.reasons[room].set(reason.as_deref().unwrap_or_default());
                }
                self.points_barred = round.barred().iter().fold(0, |bits, point| bits | bit(*point));
                let given_up = &self.given_up;
                let wanted = |stop: &&Stop| {
                    !stop.look || !given_up.iter().any(|(x, y)| (x - stop.x).hypot(y - stop.y) < SAME_STOP_M)
                };
                self.stops.clear();
                self.stops.extend(round.stops().iter().filter(wanted));
                self.looked &= !self.stops.iter().any(|stop| stop.look);
                if !self.stops.iter().any(|stop| stop.look) && self.forgive() {
                    self.stage = Stage::Asked;
                    return Work::Busy;
                }
                self.begin_leg(0, (place.x, place.y))
            }
        }
    }

    fn begin_leg(&mut self, stop: usize, from: (f32, f32)) -> Work {
        let Some(to) = self.stops.get(stop) else {
            self.stage = Stage::Ready;
            return Work::Idle;
        };
        self.planner.begin(&self.map, from, (to.x, to.y));
        self.stage = Stage::Leg(stop);
        Work::Busy
    }

    fn work_on_leg(&mut self, stop: usize, place: &Place) -> Work {
        if self.corners.len() + 200 > MAX_WAYPOINTS && stop > self.target + 1 {
            // A route of this length is planned as it is flown.
            self.forget_passed();
            if self.corners.len() + 200 > MAX_WAYPOINTS {
                self.stage = Stage::Leg(stop);
                return Work::Idle;
            }
        }
        match self.planner.advance(&self.map, ROUTE_NODES) {
            Step::Working => {
                self.stage = Stage::Leg(stop);
                Work::Busy
            }
            Step::Found => {
                let first = self.track.is_empty();
                self.append_leg(stop);
                let from = self.end_of_route().unwrap_or((place.x, place.y));
                self.begin_leg(stop + 1, from);
                if first { Work::Ready } else { Work::Busy }
            }
            Step::None => {
                let last = stop + 1 == self.stops.len();
                if last && self.track.is_empty() {
                    let reason = self.planner.obstacle().unwrap_or(Obstacle::NoWay);
                    let mut text = Text::<64>::default();
                    // What does not fit is cut.
                    let _ = write!(text, "no way on: {reason}");
                    return self.start_afresh(place, text.as_str());
                }
                let from = self.end_of_route().unwrap_or((place.x, place.y));
                if last {
                    // The way home is asked for again, from nearer by, when the rest is flown.
                    self.stops.truncate(stop);
                    self.stage = Stage::Ready;
                    return Work::Idle;
                }
                let left = self.stops.remove(stop);
                self.points_barred |= left.point.map_or(0, bit);
                self.begin_leg(stop, from)
            }
        }
    }

    /// Plans again with a clean slate around the drone; gives up after a few times.
    fn start_afresh(&mut self, place: &Place, why: &str) -> Work {
        if self.fresh_starts >= FRESH_STARTS {
            return self.no_way(why);
        }
        self.fresh_starts += 1;
        if self.fresh_starts == 1 {
            self.map.forget_unmapped(place.x, place.y, FORGET_M);
        } else {
            // What stood there may have gone, and a door may have been opened.
            self.map.set_unmapped(&Bits::default());
            for door in 0..self.map.doors().len() {
                self.map.set_door(door, false);
            }
        }
        self.stage = Stage::Asked;
        Work::Busy
    }

    fn no_way(&mut self, why: &str) -> Work {
        self.drop_route();
        self.trouble = Text::new(why);
        Work::NoWay
    }

    fn end_of_route(&self) -> Option<(f32, f32)> {
        self.corners.last().map(|corner| (corner.x, corner.y))
    }
}
