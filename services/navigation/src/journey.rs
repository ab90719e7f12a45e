//! The route: planned in slices, followed, planned again when something stands in the way.

mod amnesty;
pub(crate) mod planning;

use crate::atlas::Atlas;
use crate::place::Place;
use crate::setbacks::Setbacks;
use crate::track::{MAX_CORNERS, SHORTEST_M, Track};
use amnesty::{Amnesties, Pardon};
use core::fmt::{self, Write};
use ipc_types::{MAX_WAYPOINTS, RoomProgress, Text};
use patrol::{Bits, Costmap, RoomPlan, Round, RoutePlanner, Seen, Stop, Tally, Wishes};
use std::sync::Arc;

/// One slice of a route, in cells of 0.1 us.
pub(crate) const ROUTE_NODES: usize = 45_000;
/// Stops nearer together than this are the same place, metres.
pub(crate) const SAME_STOP_M: f32 = 0.6;
/// Distance flown between two looks, metres: the view reaches 20 times as far.
const LOOK_EVERY_M: f32 = 0.15;
/// Looks remembered: more than a kilometre.
const MAX_LOOKS: usize = 8192;
/// Places that are given up for one round at most.
pub(crate) const MAX_GIVEN_UP: usize = 64;
/// Work slices between two looks whether the next stops are still worth the way: once a second.
pub(crate) const TRIM_EVERY: u32 = 20;

/// What a slice of work came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// Nothing to plan.
    Idle,
    /// Not ready.
    Busy,
    /// There is a route to follow now.
    Ready,
    /// There is none.
    NoWay,
}

/// A corner of the route.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) room: Option<usize>,
    /// The stop that the way leads to ends here.
    pub(crate) stop: Option<usize>,
}

#[derive(Debug)]
pub(crate) enum Stage {
    Idle,
    /// What was seen is worked out again on a map that has changed: looks done so far.
    Review(usize),
    /// Asked for, not begun.
    Asked,
    Round(Box<Round>),
    /// Leg to the stop of this index is being searched.
    Leg(usize),
    /// A shorter way past stops that have been seen meanwhile, to the stop of this index.
    Trim(usize),
    /// All legs are there.
    Ready,
}

/// The route and what belongs to it.
#[derive(Debug)]
pub struct Journey {
    pub(crate) atlas: Arc<Atlas>,
    pub(crate) map: Costmap,
    pub(crate) seen: Seen,
    pub(crate) to_see: Bits,
    pub(crate) rooms: Vec<RoomPlan>,
    /// Why each room is left out; empty where it is not.
    pub(crate) reasons: Vec<Text<64>>,
    pub(crate) tallies: Vec<Tally>,
    pub(crate) planner: RoutePlanner,
    pub(crate) stage: Stage,
    pub(crate) stops: Vec<Stop>,
    /// Stop that is flown to.
    pub(crate) target: usize,
    pub(crate) corners: Vec<Corner>,
    pub(crate) track: Track,
    /// Where the drone looked about since start, and what had been seen before.
    looks: Vec<(f32, f32)>,
    seen_before: Bits,
    /// A door was taken for open that is shut: what was seen through it was not.
    pub(crate) review: bool,
    /// Coverage and rooms as a restart found them, until a round is planned.
    pub(crate) kept: Option<(f32, Vec<RoomProgress>)>,
    pub(crate) max_tries: u32,
    pub(crate) tried: (f32, f32),
    pub(crate) tries: u32,
    pub(crate) given_up: Vec<(f32, f32)>,
    fresh_starts: u32,
    amnesties: Amnesties,
    /// The doors that were found shut have been looked at again.
    doors_again: bool,
    /// How often each door was found shut in this round.
    pub(crate) found_shut: Vec<u32>,
    pub(crate) setbacks: Setbacks,
    pub(crate) since_trim: u32,
    pub(crate) round: bool,
    /// What is still wanted of the round: without the points that have been flown to.
    pub(crate) wishes: Wishes,
    /// Bit per wished point: there was no way to it.
    pub(crate) points_barred: u32,
    /// Every place of the round that was to be looked from has been passed or given up.
    pub(crate) looked: bool,
    trouble: Text<64>,
    /// The planning that was asked for begins with a clean slate.
    afresh: bool,
    /// It begins with an amnesty, for the doors too if so.
    pardon: Option<Pardon>,
    /// It leads aside from a way that leads so, radians.
    aside: Option<f32>,
    /// The route leads aside, to let somebody pass.
    pub(crate) stepping_aside: bool,
}

impl Journey {
    /// No route yet.
    #[must_use]
    pub fn new(atlas: Arc<Atlas>, max_tries: u32) -> Self {
        let map = atlas.map().clone();
        let rooms = atlas.rooms().len();
        Self {
            seen: Seen::new(&map),
            planner: RoutePlanner::new(&map),
            to_see: Bits::default(),
            rooms: vec![RoomPlan::default(); rooms],
            reasons: vec![Text::default(); rooms],
            tallies: vec![Tally::default(); rooms],
            stage: Stage::Idle,
            stops: Vec::new(),
            target: 0,
            corners: Vec::with_capacity(MAX_CORNERS),
            track: Track::new(),
            looks: Vec::with_capacity(MAX_LOOKS),
            seen_before: Bits::default(),
            review: false,
            kept: None,
            max_tries,
            tried: (f32::NAN, f32::NAN),
            tries: 0,
            given_up: Vec::with_capacity(MAX_GIVEN_UP),
            fresh_starts: 0,
            amnesties: Amnesties::default(),
            doors_again: false,
            found_shut: vec![0; map.doors().len()],
            setbacks: Setbacks::new(),
            since_trim: 0,
            round: false,
            wishes: atlas.wishes().clone(),
            points_barred: 0,
            looked: false,
            trouble: Text::default(),
            afresh: false,
            pardon: None,
            aside: None,
            stepping_aside: false,
            map,
            atlas,
        }
    }

    /// Asks for a round that knows nothing of earlier ones.
    pub fn plan_new_round(&mut self) {
        self.plan();
        self.afresh = true;
    }

    /// Forgets everything that an earlier round has seen. Allocates: for the start and for planning.
    pub(crate) fn new_round(&mut self) {
        self.pardon = None;
        self.map = self.atlas.map().clone();
        self.seen = Seen::new(&self.map);
        self.to_see = Bits::default();
        self.rooms.fill(RoomPlan::default());
        self.reasons.fill(Text::default());
        self.given_up.clear();
        self.setbacks.clear();
        self.tries = 0;
        self.amnesties = Amnesties::default();
        self.doors_again = false;
        self.found_shut.fill(0);
        self.looks.clear();
        self.seen_before.clear();
        self.review = false;
        self.kept = None;
        self.wishes.clone_from(self.atlas.wishes());
        self.points_barred = 0;
        self.looked = false;
    }

    /// Takes over what an earlier run has seen.
    pub(crate) fn restore_seen(&mut self, words: &[u64]) {
        self.seen_before.copy_from_words(words);
        self.seen.restore(words);
    }

    /// Asks for a route from wherever the drone is when the planning begins.
    pub fn plan(&mut self) {
        self.drop_route();
        self.stage = Stage::Asked;
        self.fresh_starts = 0;
    }

    /// Asks for a way aside from one that leads `towards`, radians; for the route, where there is no room.
    pub(crate) fn plan_aside(&mut self, towards: f32) {
        self.plan();
        self.aside = towards.is_finite().then_some(towards);
    }

    /// No route, and none wanted.
    pub fn drop_route(&mut self) {
        self.stepping_aside = false;
        self.aside = None;
        self.stage = Stage::Idle;
        self.stops.clear();
        self.corners.clear();
        self.track.clear();
        self.target = 0;
    }

    /// Whether there is a route to follow.
    #[must_use]
    pub fn planned(&self) -> bool {
        !self.track.is_empty()
    }

    /// Whether the route is known to its end.
    #[must_use]
    pub fn complete(&self) -> bool {
        matches!(self.stage, Stage::Ready | Stage::Trim(_))
    }

    /// The line to follow.
    #[must_use]
    pub fn track(&self) -> &Track {
        &self.track
    }

    /// Where the drone may fly, with what was found.
    #[must_use]
    pub fn map(&self) -> &Costmap {
        &self.map
    }

    /// Share of what there is to see that has been seen, 0..1; 0 before a round was planned.
    #[must_use]
    pub fn coverage(&self) -> f32 {
        let total = self.seen.total(&self.to_see);
        let kept = self.kept.as_ref().map_or(0.0, |(coverage, _)| *coverage);
        if total.all == 0 { kept } else { total.share() }
    }

    /// Why there is no way on; empty without trouble.
    #[must_use]
    pub fn trouble(&self) -> &str {
        self.trouble.as_str()
    }

    /// Whether the round is flown and only the way to the pad is left.
    #[must_use]
    pub fn homeward(&self) -> bool {
        self.round
            && self.complete()
            && !self.stops[self.target.min(self.stops.len())..].iter().any(|stop| stop.look)
    }

    /// Before the drone turns home: true when the round is planned again for the rooms that were left out.
    pub fn look_again(&mut self) -> bool {
        let again = self.homeward() && self.forgive();
        if again {
            self.plan();
        }
        again
    }

    /// What the present leg is for.
    ///
    /// # Errors
    /// Only what `out` itself reports.
    pub fn write_errand(&self, out: &mut dyn Write) -> fmt::Result {
        if self.stepping_aside {
            return write!(out, "stepping aside for somebody");
        }
        let looks = self.stops.iter().filter(|stop| stop.look).count();
        match self.stops.get(self.target) {
            Some(stop) if stop.point.is_some() => {
                write!(out, "flying to a point of the round: place {} of {looks}", self.target + 1)
            }
            Some(stop) if stop.look => {
                let room = stop.room.map_or("the building", |room| self.atlas.rooms().name(room));
                write!(out, "looking at {room}: place {} of {looks}", self.target + 1)
            }
            _ => write!(out, "flying back to the pad"),
        }
    }

    /// Marks what is in sight.
    pub fn see(&mut self, place: &Place) {
        if self.looks.last().is_none_or(|looked| place.distance(*looked) >= LOOK_EVERY_M) {
            self.seen.mark(&self.map, place.x, place.y);
            if self.looks.len() == MAX_LOOKS {
                self.seen_before.copy_from_words(self.seen.bits().words());
                self.looks.clear();
            }
            self.looks.push((place.x, place.y));
        }
    }

    /// Moves the progress along the route.
    pub fn advance(&mut self, place: &Place) {
        self.track.advance(place.x, place.y);
        let next = self.track.next();
        while let Some(stop) = self.stops.get(self.target) {
            let passed = self.corners[..next.min(self.corners.len())]
                .iter()
                .any(|corner| corner.stop == Some(self.target));
            if !(passed && stop.look) {
                break;
            }
            if let Some(point) = stop.point.and_then(|point| self.wishes.points.get_mut(point)) {
                *point = None;
            }
            self.target += 1;
            self.since_trim = TRIM_EVERY;
        }
        self.looked |= self.homeward();
    }

    /// Adds a point to corners and track; one that repeats the last only names its stop.
    pub(crate) fn push_corner(&mut self, (x, y): (f32, f32), stop: Option<usize>) {
        if let Some(last) = self.corners.last_mut()
            && (last.x - x).hypot(last.y - y) < 2.0 * SHORTEST_M
        {
            last.stop = stop.or(last.stop);
            return;
        }
        if self.corners.len() < MAX_WAYPOINTS && self.track.push(x, y) {
            let room = self.map.raster().cell(x, y).and_then(|cell| self.map.room_of(cell));
            self.corners.push(Corner { x, y, room, stop });
        }
    }

    pub(crate) fn append_leg(&mut self, stop: usize) {
        let count = self.planner.route().points.len();
        for i in 0..count {
            let point = self.planner.route().points[i];
            self.push_corner(point, (i + 1 == count).then_some(stop));
        }
    }

    /// Drops the corners that are passed, to make room for those to come.
    fn forget_passed(&mut self) {
        let passed = self.track.next().saturating_sub(1).min(self.corners.len());
        self.corners.drain(..passed);
        self.track.forget(passed);
    }

    /// Corner that is flown to.
    #[must_use]
    pub(crate) fn next_corner(&self) -> usize {
        self.track.next().min(self.corners.len())
    }

    /// Whether a stop of the round still lies in this room.
    #[must_use]
    pub(crate) fn has_stop_in(&self, room: usize) -> bool {
        self.stops.iter().skip(self.target).any(|stop| stop.look && stop.room == Some(room))
    }

    /// Whether a place in this room was given up.
    #[must_use]
    pub(crate) fn gave_up_in(&self, room: usize) -> bool {
        self.given_up.iter().any(|(x, y)| {
            self.map.raster().cell(*x, *y).and_then(|cell| self.map.room_of(cell)) == Some(room)
        })
    }
}
