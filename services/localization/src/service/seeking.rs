//! The service while it does not know its place.

use super::{BEHIND_S, Believed, Localization};
use crate::attitude::seconds;
use crate::seek::{Found, Why};
use crate::set::Seeking;
use crate::sweep::Group;
use crate::velocity::Frames;
use mcl::{Estimate, Generator, State, TrailPose, wrap_angle};

/// Standard deviation of a place that nobody knows, metres: that of any building.
const ANYWHERE_M: f32 = 50.0;
/// A place that was found: standard deviations of place and heading, metres and radians, and the least doubt. Under
/// the 5 % at which autonomy begins (DESIGN 4), above the 1 % that only readings may earn.
const FOUND_M: f32 = 0.15;
const FOUND_RAD: f32 = 0.12;
const FOUND_DOUBT: f32 = 0.03;
/// Until it was checked a place that was found is doubted this much at least.
const UNCHECKED_DOUBT: f32 = 0.02;
/// And one that was refuted or is suspected is none to fly by.
const SUSPECTED_DOUBT: f32 = 0.3;
/// A search that finds the place this near to where the set has it confirms it, metres.
const FOUND_AGAIN_M: f32 = 0.7;
/// A hypothesis among others is drawn as wide as the lattice, metres and radians.
const GUESS_M: f32 = 0.2;
const GUESS_RAD: f32 = 0.1;
/// A set that doubts itself this much looks for another place, and one that believes itself again stops.
const DOUBT_BEGINS: f32 = 0.05;
const DOUBT_ENDS: f32 = 0.01;

impl Localization {
    /// Begins to look for the place from nothing. Plan frame and compass frame are taken for one until it is found.
    pub(super) fn seek_from_nothing(&mut self) {
        self.seek.begin(Why::Start, 0.0);
        self.believed = None;
    }

    /// One step of looking from nothing: there is no set yet that could be moved and weighed.
    pub(super) fn seek_on(&mut self, now: u64) {
        if self.attitudes.is_empty() {
            return;
        }
        while let Some(group) = self.waiting.pop() {
            self.sense(group.time_ns, Some(&group));
        }
        let last = self.believed.map_or(0, |b| b.time_ns);
        if seconds(last, now) > self.config.silent_s {
            self.sense(now.saturating_sub((BEHIND_S * 1e9) as u64), None);
        }
        let here = self.trail_pose(self.velocity.time_ns);
        let (ended, found) = self.seek.work(&self.table, now, &here, None);
        if let Some(found) = found {
            self.adopt(now, &found);
        } else if ended {
            self.tell_hypotheses(now, &here);
        }
    }

    /// Follows velocity and way to a ping.
    fn sense(&mut self, time_ns: u64, group: Option<&Group>) {
        if self.grounded
            && let Some(resting) = self.attitudes.resting()
        {
            self.rest_level = self.level_of(&resting);
        }
        let level = self.rest_level;
        let place = if self.velocity.time_ns > 0 { self.velocity.place_now() } else { self.middle() };
        let frames = Frames { heading_offset: 0.0, level, drag: self.config.motion.drag };
        if self.grounded {
            // On the ground the sonars hear the floor, and it holds the velocity.
            self.flow_ns = time_ns;
            self.velocity.stand(time_ns, place, level);
            self.seek.forget();
        } else if self.velocity.is_known(time_ns) {
            self.velocity.advance(time_ns, &self.attitudes, &frames);
        } else {
            self.velocity.begin(time_ns, place, [0.0; 2], level);
            self.seek.forget();
        }
        self.adrift_ns = match self.adrift_ns {
            _ if self.grounded || self.flows_lately(time_ns) => 0,
            0 => time_ns,
            since => since,
        };
        if let Some(group) = group.filter(|_| !self.grounded) {
            let here = self.trail_pose(time_ns);
            self.seek.hear(time_ns, &here, group.readings(), 0);
        }
        let [x, y] = self.velocity.place_now();
        let [velocity_x, velocity_y] = self.velocity.velocity_now();
        let [of_x, of_y] = self.velocity.velocity_variance();
        let share = self.seek.share();
        let estimate = Estimate {
            x,
            y,
            velocity_x,
            velocity_y,
            heading_offset: 0.0,
            level_roll: level[0],
            level_pitch: level[1],
            variance_x: ANYWHERE_M * ANYWHERE_M,
            covariance_xy: 0.0,
            variance_y: ANYWHERE_M * ANYWHERE_M,
            heading_sigma: core::f32::consts::PI,
            velocity_sigma: of_x.max(of_y).sqrt(),
            effective: 0.0,
            share,
            p_lost: (1.0 - share).max(DOUBT_BEGINS),
            state: if share > 0.0 { State::Converging } else { State::Lost },
        };
        self.believed = Some(Believed { time_ns, estimate, count: 0, heading_mean: None });
    }

    /// The middle of the plan: where a drone is drawn that may be anywhere.
    fn middle(&self) -> [f32; 2] {
        let plan = self.table.plan();
        let (x, y) = plan.origin();
        let half = 0.5 * plan.resolution();
        [x + half * plan.width() as f32, y + half * plan.height() as f32]
    }

    /// Where the drone is in the trail's frame.
    fn trail_pose(&self, time_ns: u64) -> TrailPose {
        let yaw = self.attitudes.at(time_ns).unwrap_or_default().yaw;
        let [x, y] = self.velocity.way;
        TrailPose { x, y, heading_rad: wrap_angle(yaw + self.seek.offset_rad) }
    }

    /// Sends the hypotheses as a set: what competes is not hidden.
    fn tell_hypotheses(&mut self, now: u64, here: &TrailPose) {
        let (Some(mut loan), Some(b)) = (self.particles.loan(), self.believed) else { return };
        let starts = self.seek.hypotheses(here).map(|((x, y, turn_rad), share)| {
            (guess(&b.estimate, [x, y], turn_rad, GUESS_M, GUESS_RAD), share)
        });
        let mut generator = Generator::new(self.seed ^ self.sent);
        let doubt = 1.0 - self.seek.share();
        let update =
            self.filter.start_among(starts, doubt, crate::set::columns_mut(&mut loan), &mut generator);
        if update.count > 0 {
            self.send(now, now, &update, &generator, loan);
        }
    }

    /// Goes on from a place that was found.
    fn adopt(&mut self, now: u64, found: &Found) {
        let (Some(mut loan), Some(b)) = (self.particles.loan(), self.believed) else { return };
        let time_ns = self.velocity.time_ns;
        let heading_offset = wrap_angle(self.seek.offset_rad + found.turn_rad);
        let turned = wrap_angle(heading_offset - b.estimate.heading_offset);
        self.velocity.turn(time_ns, [found.x, found.y], turned);
        let mut start = guess(&b.estimate, [found.x, found.y], 0.0, FOUND_M, FOUND_RAD);
        start.heading_offset = heading_offset;
        start.velocity = self.velocity.velocity_now();
        start.p_lost = found.doubt.max(FOUND_DOUBT);
        let mut generator = Generator::new(self.seed ^ self.sent);
        // What is heard from now on has had no part in the finding.
        (self.elsewhere, self.suspected, self.doubted) = (0.0, false, 0.0);
        self.seek.begin(Why::Check, heading_offset);
        let update = self.filter.start_at(&start, crate::set::columns_mut(&mut loan), &mut generator);
        self.believed = Some(self.send(now, time_ns, &update, &generator, loan));
    }

    /// Looks for another place while the set doubts itself, or has only just been found.
    pub(super) fn watch(&mut self, now: u64, group: &Group, explained: u32, believed: &Believed) {
        let e = &believed.estimate;
        // A set that has lost its place may have turned with it; the compass has not.
        let compass = believed.heading_mean.unwrap_or(e.heading_offset);
        // The thesis's filter is flown as it is, to be compared.
        if self.grounded || self.plain.is_some() {
            self.seek.stop();
            (self.elsewhere, self.suspected, self.kept_why) = (0.0, false, None);
            return;
        }
        match self.seek.why() {
            None => match self.kept_why.take() {
                Some(why) => self.seek.begin(why, compass),
                None => self.seek.begin(Why::Audit, 0.0),
            },
            Some(Why::Audit) if e.p_lost >= DOUBT_BEGINS => self.seek.begin(Why::Lost, compass),
            Some(Why::Check | Why::Audit) if self.seek.is_refuted() => {
                self.suspected = true;
                self.seek.begin(Why::Lost, compass);
            }
            Some(Why::Lost) if self.suspected && e.p_lost < DOUBT_ENDS && self.seek.is_acquitted(now) => {
                self.suspected = false;
                self.seek.begin(Why::Audit, 0.0);
            }
            Some(Why::Lost) if !self.suspected && e.p_lost < DOUBT_ENDS => self.seek.begin(Why::Audit, 0.0),
            Some(_) => {}
        }
        let here = if self.seek.why() == Some(Why::Audit) {
            // A set that is believed is held by the walls: its own way is truer than the sum of the velocity.
            self.seek.offset_rad = e.heading_offset;
            TrailPose { x: e.x, y: e.y, ..self.trail_pose(believed.time_ns) }
        } else {
            self.trail_pose(believed.time_ns)
        };
        self.seek.hear(believed.time_ns, &here, group.readings(), explained);
        let suspect = (e.x, e.y, wrap_angle(e.heading_offset - self.seek.offset_rad));
        let (ended, found) = self.seek.work(&self.table, now, &here, Some(suspect));
        if ended {
            self.elsewhere = self.seek.elsewhere(e.x, e.y, &here);
        }
        let Some(found) = found else { return };
        let there = (found.x - e.x).hypot(found.y - e.y) > FOUND_AGAIN_M;
        match self.seek.why() {
            Some(Why::Check) if !there => self.seek.begin(Why::Audit, 0.0),
            Some(Why::Audit) if !there => {}
            _ => self.adopt(now, &found),
        }
    }

    /// The least that is to be doubted beside what the set doubts itself: a place that was found and is not checked yet,
    /// and one beside which another explains the last metres better.
    pub(super) fn least_doubt(&self) -> f32 {
        if self.suspected {
            return SUSPECTED_DOUBT;
        }
        let unsure = self.seeking() == Seeking::Unchecked || self.elsewhere > 0.5;
        if unsure { UNCHECKED_DOUBT } else { 0.0 }
    }

    /// How far the place was found.
    pub(super) fn seeking(&self) -> Seeking {
        match self.seek.why().or(self.kept_why) {
            Some(Why::Start) => Seeking::Hypotheses,
            _ if self.suspected => Seeking::Suspected,
            Some(Why::Check) => Seeking::Unchecked,
            _ => Seeking::No,
        }
    }
}

/// A place and what is known of the body.
fn guess(e: &Estimate, [x, y]: [f32; 2], turn_rad: f32, sigma: f32, heading_sigma: f32) -> mcl::Start {
    mcl::Start {
        x,
        y,
        sigma,
        heading_offset: wrap_angle(e.heading_offset + turn_rad),
        heading_sigma,
        level_roll: e.level_roll,
        level_pitch: e.level_pitch,
        level_sigma: 0.01,
        velocity: [0.0; 2],
        p_lost: 1.0,
    }
}
