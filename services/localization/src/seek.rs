//! Looking for the drone's place on the plan: at a start from nothing, and when the set has lost it.
//!
//! The readings of the last metres are kept in a frame that follows the drone without a jump (the sum of its velocity,
//! and its heading as far as it is known), and compared with all places of the plan again and again ([`mcl::Search`]).
//! What two searches in a row agree on, each nearly sure by itself, is where the drone is.

use crate::attitude::seconds;
use crate::tally::{Opinion, Tally};
use floorplan::{ConeTable, Rooms};
use mcl::{Hypothesis, Lattice, Reading, Search, SonarConfig, Trail, TrailPose, Turns, wrap_angle};
use std::sync::Arc;

/// Questions to the cone table a step: a search of 300 m² with all headings takes two seconds of steps at 50 Hz, and a
/// step two milliseconds on one core of a PC, ten on the slowest Pi.
const LOOK_UPS: usize = 150_000;
/// Fewer readings tell places apart by chance only, and so do those that look to one side.
const LEAST_READINGS: usize = 24;
const LEAST_AROUND: f32 = 0.7;
/// Readings that must come between two searches: the same ones give the same answer.
const FRESH_READINGS: u32 = 24;
/// Sure is a search that gives one place so much of the belief, and fairly sure one that gives it this much. Where there is a
/// place that is believed already, another one must be that much more believable still.
const SURE: f32 = 0.97;
const SURE_OF_ANOTHER: f32 = 0.999;
const FAIRLY_SURE: f32 = 0.9;
/// Found is a place of which a search is sure, when all searches since so much of the way, metres, or so long ago,
/// seconds, agreed on it and were fairly sure: on the same spot the next search hears the same furniture and the same people.
const AGREED_M: f32 = 1.0;
const AGREED_S: f64 = 6.0;
/// The same for a set that has lost its place, seconds: it knows its heading, and the failsafe brings it down after 20.
const AGREED_LOST_S: f64 = 5.0;
/// A set loses its place to one near by: a slip, the next door, a gap that looked like another. A place farther than this from
/// where it was, metres, needs so much better readings.
const NEAR_BY_M: f32 = 4.0;
const FAR_SHARE: f32 = 0.1;
/// A check needs so many readings, and an audit, which leaves out furniture.
const CHECK_READINGS: usize = 60;
const AUDIT_READINGS: usize = 36;
/// And of which the place explains so much of what was heard: among clutter and behind a door that is shut the true one
/// explains 56 to 90 % (22 flights of the demo building, full clutter).
const EXPLAINED: f32 = 0.45;
/// Places this near to each other are one, metres and radians.
const NEAR_M: f32 = 0.7;
const NEAR_RAD: f32 = 0.35;
/// Heading error after a while of being lost, radians: the compass errs by 20 degrees at most (DESIGN 6), and most of that is
/// known.
const LOST_TURN_RAD: f32 = 0.45;

/// Why the place is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Why {
    /// Nothing was known at the start.
    Start,
    /// The set doubts itself.
    Lost,
    /// A place was found from nothing: is it still the likeliest by what is heard from now on alone?
    Check,
    /// All seems well: is there a place near by that explains the last metres better?
    Audit,
}

/// What a search said: how the trail's frame lies on the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Answer {
    /// Where it says `origin` is.
    best: Hypothesis,
    origin: TrailPose,
    share: f32,
    /// Since when, and since which length of the way, all searches agree and are fairly sure.
    agreed_ns: u64,
    agreed_m: f32,
    /// Where that was, in the trail's frame.
    agreed_at: (f32, f32),
}

impl Answer {
    /// Where `here` is on the plan by this answer, and how the frame is turned.
    fn carried(&self, here: &TrailPose) -> (f32, f32, f32) {
        carried(&self.best, &self.origin, here)
    }
}

fn carried(of: &Hypothesis, origin: &TrailPose, here: &TrailPose) -> (f32, f32, f32) {
    let (sin, cos) = of.turn_rad.sin_cos();
    let (dx, dy) = (here.x - origin.x, here.y - origin.y);
    (of.x + cos * dx - sin * dy, of.y + sin * dx + cos * dy, of.turn_rad)
}

/// A place that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) x: f32,
    pub(crate) y: f32,
    /// Of the trail's frame against the plan.
    pub(crate) turn_rad: f32,
    /// What is left for all other places.
    pub(crate) doubt: f32,
}

/// An audit looks this far around, metres, this far to either side of the heading, radians, and every so often, seconds: a
/// set that slips along a corridor while somebody stands in the way does so by decimetres a minute, and unnoticed.
const AUDIT_M: f32 = 3.0;
const AUDIT_TURN_RAD: f32 = 0.25;
const AUDIT_EVERY_S: f64 = 3.0;
/// And hears the last seconds only: what was heard before speaks for the place that was left.
const AUDITED_S: f64 = 14.0;
/// The room that the drone is known to be in.
struct Within {
    rooms: Arc<Rooms>,
    room: usize,
}

/// Looks for the place.
pub(crate) struct Seek {
    search: Search,
    trail: Trail,
    why: Option<Why>,
    within: Option<Within>,
    last: Option<Answer>,
    /// Readings since the last search began, and when that was.
    fresh: u32,
    began_ns: u64,
    /// The last audit found another place likelier: the next one follows at once.
    strays: bool,
    tally: Tally,
    /// The frame's heading less the compass, fixed while one search follows the other.
    pub(crate) offset_rad: f32,
}

impl Seek {
    pub(crate) fn new(
        lattice: Arc<Lattice>,
        sonar: &SonarConfig,
        within: Option<(Arc<Rooms>, usize)>,
    ) -> Self {
        Self {
            search: Search::new(lattice, sonar),
            trail: Trail::default(),
            why: None,
            within: within.map(|(rooms, room)| Within { rooms, room }),
            last: None,
            fresh: 0,
            began_ns: 0,
            strays: false,
            tally: Tally::default(),
            offset_rad: 0.0,
        }
    }

    /// Why it looks; `None` while it does not.
    pub(crate) fn why(&self) -> Option<Why> {
        self.why
    }

    /// Begins to look. `offset_rad`: heading in the trail's frame less the compass.
    pub(crate) fn begin(&mut self, why: Why, offset_rad: f32) {
        (self.why, self.offset_rad) = (Some(why), offset_rad);
        self.forget();
    }

    /// Looks no more.
    pub(crate) fn stop(&mut self) {
        self.forget();
        self.why = None;
    }

    /// Forgets what was heard: the way to it is not known.
    pub(crate) fn forget(&mut self) {
        let audits = self.why == Some(Why::Audit);
        self.trail.clear(if audits { AUDITED_S } else { f64::INFINITY });
        self.search.cancel();
        (self.last, self.fresh, self.strays) = (None, 0, false);
        self.tally = Tally::default();
    }

    /// Share of the likeliest place in the last search; 0 before the first.
    pub(crate) fn share(&self) -> f32 {
        self.last.map_or(0.0, |answer| answer.share)
    }

    /// Share of the last search that lies farther from a place than one place is wide.
    pub(crate) fn elsewhere(&self, x: f32, y: f32, here: &TrailPose) -> f32 {
        let away = self.hypotheses(here).filter(|((hx, hy, _), _)| (hx - x).hypot(hy - y) > NEAR_M);
        away.map(|(_, share)| share).sum()
    }

    /// Whether the searches have spoken against the place that is believed: one that was found, or any.
    pub(crate) fn is_refuted(&self) -> bool {
        match self.why {
            Some(Why::Check) => self.tally.is_refuted(),
            Some(Why::Audit) => self.tally.is_suspected(),
            Some(Why::Start | Why::Lost) | None => false,
        }
    }

    /// Whether what was heard since the place was suspected speaks for it.
    pub(crate) fn is_acquitted(&self, now: u64) -> bool {
        self.why == Some(Why::Lost) && self.tally.is_acquitted(now)
    }

    /// What the last search says of the place `at`, and of the likeliest other one.
    fn opinions(&self, at: (f32, f32), here: &TrailPose) -> [Opinion; 2] {
        let origin = self.search.origin();
        let all = self.search.hypotheses().iter().map(|of| (carried(of, &origin, here), of));
        let near = |(x, y): (f32, f32), (hx, hy, _): (f32, f32, f32)| (hx - x).hypot(hy - y) < NEAR_M;
        let away = all.clone().filter(|(of, _)| !near(at, *of));
        let other = away.max_by(|a, b| a.1.weight.total_cmp(&b.1.weight)).map(|((x, y, _), _)| (x, y));
        let of = |place: (f32, f32)| {
            all.clone().filter(|(of, _)| near(place, *of)).fold(Opinion::default(), |sum, (_, of)| Opinion {
                share: sum.share + of.weight,
                explained: sum.explained.max(of.explained),
            })
        };
        let mut this = of(at);
        // Among things that no plan shows the readings may carry the place itself off to another one.
        if let Some(itself) = self.search.suspect() {
            this.share = this.share.max(itself.weight.min(1.0));
            this.explained = this.explained.max(itself.explained);
        }
        let other = other.map_or_else(Opinion::default, of);
        [this, Opinion { share: other.share.min(1.0 - this.share), ..other }]
    }

    /// Takes the readings of one group. Of those that are `explained` (bit i: reading i) by what stands on no plan an
    /// audit wants to know nothing: among furniture every other place fits better here and there.
    pub(crate) fn hear(&mut self, time_ns: u64, here: &TrailPose, readings: &[Reading], explained: u32) {
        let audits = self.why == Some(Why::Audit);
        for (i, reading) in readings.iter().enumerate() {
            if !audits || explained >> i & 1 == 0 {
                self.trail.push(seconds(0, time_ns), here, core::slice::from_ref(reading));
                self.fresh = self.fresh.saturating_add(1);
            }
        }
    }

    /// The hypotheses of the last search as they are at `here`: x, y, turn and share.
    pub(crate) fn hypotheses(&self, here: &TrailPose) -> impl Iterator<Item = ((f32, f32, f32), f32)> {
        let origin = self.search.origin();
        self.search.hypotheses().iter().map(move |of| (carried(of, &origin, here), of.weight))
    }

    /// Works one slice; `true` in the step in which a search has ended. `suspect`: where the set says that the drone is.
    pub(crate) fn work(
        &mut self,
        table: &ConeTable,
        now: u64,
        here: &TrailPose,
        suspect: Option<(f32, f32, f32)>,
    ) -> (bool, Option<Found>) {
        if !self.search.is_running() {
            let least = match self.why {
                Some(Why::Check) => CHECK_READINGS,
                Some(Why::Audit) => AUDIT_READINGS,
                _ => LEAST_READINGS,
            };
            let enough = self.trail.len() >= least && self.trail.around() >= LEAST_AROUND;
            let rests =
                self.why == Some(Why::Audit) && !self.strays && seconds(self.began_ns, now) < AUDIT_EVERY_S;
            if !enough || rests || self.fresh < FRESH_READINGS {
                return (false, None);
            }
            (self.fresh, self.began_ns) = (0, now);
            let turns = match self.why {
                Some(Why::Lost) => Turns { middle_rad: 0.0, half_rad: LOST_TURN_RAD },
                Some(Why::Audit) => Turns { middle_rad: 0.0, half_rad: AUDIT_TURN_RAD },
                _ => Turns::ALL,
            };
            self.search.begin(&self.trail, here, turns, suspect);
        }
        let within = self.within.as_ref().filter(|_| self.why == Some(Why::Start));
        let around = suspect.filter(|_| self.why == Some(Why::Audit));
        let allowed = |x: f32, y: f32| {
            within.is_none_or(|w| w.rooms.room_at(x, y) == Some(w.room))
                && around.is_none_or(|(ax, ay, _)| (x - ax).hypot(y - ay) < AUDIT_M)
        };
        if !self.search.step(table, LOOK_UPS, allowed) {
            return (false, None);
        }
        (true, self.judge(now, here, suspect))
    }

    fn judge(&mut self, now: u64, here: &TrailPose, suspect: Option<(f32, f32, f32)>) -> Option<Found> {
        // Where the set was lost weighs for what is near.
        let lost_at = suspect.filter(|_| self.why == Some(Why::Lost));
        let prior = |of: &Hypothesis| match lost_at {
            Some((x, y, _)) if (of.x - x).hypot(of.y - y) > NEAR_BY_M => FAR_SHARE * of.weight,
            _ => of.weight,
        };
        let all: f32 = self.search.hypotheses().iter().map(prior).sum();
        let best = *self.search.hypotheses().iter().max_by(|a, b| prior(a).total_cmp(&prior(b)))?;
        let near = |other: &&Hypothesis| {
            (other.x - best.x).hypot(other.y - best.y) < NEAR_M
                && wrap_angle(other.turn_rad - best.turn_rad).abs() < NEAR_RAD
        };
        let share: f32 = self.search.hypotheses().iter().filter(near).map(prior).sum::<f32>() / all.max(1e-6);
        let (origin, way_m) = (self.search.origin(), self.trail.way_m());
        let mut answer =
            Answer { best, origin, share, agreed_ns: now, agreed_m: way_m, agreed_at: (here.x, here.y) };
        let (x, y, turn_rad) = answer.carried(here);
        if let Some(before) = self.last.filter(|before| before.share >= FAIRLY_SURE) {
            let (bx, by, turn) = before.carried(here);
            if (bx - x).hypot(by - y) < NEAR_M && wrap_angle(turn - turn_rad).abs() < NEAR_RAD {
                (answer.agreed_ns, answer.agreed_m) = (before.agreed_ns, before.agreed_m);
                answer.agreed_at = before.agreed_at;
            }
        }
        self.last = Some(answer);
        let flown = way_m - answer.agreed_m >= AGREED_M;
        let (from_x, from_y) = answer.agreed_at;
        let moved = (here.x - from_x).hypot(here.y - from_y) >= AGREED_M;
        let wait_s = if self.why == Some(Why::Lost) { AGREED_LOST_S } else { AGREED_S };
        let waited = seconds(answer.agreed_ns, now) >= wait_s;
        if let Some((sx, sy, _)) = suspect {
            let opinions = self.opinions((sx, sy), here);
            self.tally.add(now, here, opinions, self.why == Some(Why::Audit));
        }
        let confirms = suspect.is_some_and(|(sx, sy, _)| (x - sx).hypot(y - sy) < NEAR_M);
        self.strays = self.why == Some(Why::Audit) && !confirms && share >= FAIRLY_SURE;
        let sure = match self.why {
            Some(Why::Check) if confirms => self.tally.is_confirmed(here),
            Some(Why::Audit) if confirms => share >= SURE,
            // Who turns to and fro among things that no plan shows hears the same things for ever: what is believed is
            // given up for what was believable from two places.
            Some(Why::Check | Why::Audit) => share >= SURE_OF_ANOTHER && moved,
            _ => share >= SURE && (flown || waited),
        };
        (sure && best.explained >= EXPLAINED).then_some(Found { x, y, turn_rad, doubt: 1.0 - share })
    }
}

#[cfg(test)]
mod tests;
