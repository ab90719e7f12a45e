//! Watching a flight, in lockstep or among processes alike: truth, estimate, phase and round.

use airframe::picture::Track;
use airframe::score::{Ending, FlightScore, Observation, Scorer};
use airframe::world::World;
use ipc_types::{
    FailsafeAction, FailsafeCause, Patrol, PatrolState, Phase, PilotState, Pose, RoomState, Truth,
};
use manifest::Body;
use runtime::{Input, Ports, StartError};
use std::collections::VecDeque;

/// Truth kept while estimates for its times may still come: 1.3 s at 50 Hz.
const TRUTH_KEPT: usize = 64;
/// An estimate older than this stands still for its readers while the drone moves on: five poses of 20 Hz are missing.
const FRESH_NS: u64 = 250_000_000;
/// A later start of the world's clock than this is a stall: steps are whole milliseconds, and what a stall skips is 200 ms
/// or more.
const STALL_S: f64 = 0.05;
/// Whose middle is nearer than this to the airframe's edge is what was touched, metres: as broad as people are.
const PERSON_M: f32 = 0.375;

/// Everything that is seen of one flight.
pub struct Witness {
    truth: Input<Truth>,
    pose: Input<Pose>,
    pilot: Input<PilotState>,
    patrol: Input<Patrol>,
    recent: VecDeque<Truth>,
    /// The newest truth.
    pub last_truth: Option<Truth>,
    /// The newest pose.
    pub last_pose: Option<Pose>,
    /// The newest state of the pilot.
    pub last_pilot: Option<PilotState>,
    /// What the round says of itself.
    pub round: Round,
    /// Paths and close calls, for the picture.
    pub track: Track,
    body: Body,
    scorer: Scorer,
    failsafes: Vec<String>,
    flown: bool,
    last_track_s: f64,
    stalls: Stalls,
    digest: u64,
}

/// How long the world stood still: its clock starts later on the machine's clock after every stall.
#[derive(Debug, Clone, Copy, Default)]
struct Stalls {
    /// Where the world's clock started on the machine's clock, seconds, as the newest truth has it.
    start_s: Option<f64>,
    total_s: f64,
}

impl Stalls {
    fn follow(&mut self, truth: &Truth) {
        let start_s = truth.header.stamp_ns as f64 * 1e-9 - truth.time_s;
        let late_s = self.start_s.map_or(0.0, |before| start_s - before);
        if self.start_s.is_none() || late_s > STALL_S {
            self.start_s = Some(start_s);
            self.total_s += late_s;
        }
    }
}

/// Where an estimate is by now: while it is fresh it moves with the truth since its time, so that its error is that of its
/// own time; later it stands still.
fn carried_on(pose: &Pose, then: Option<&Truth>, now: &Truth) -> (f32, f32, f32) {
    let estimate = (pose.x_m, pose.y_m, pose.heading_rad);
    match then {
        Some(then) if now.header.stamp_ns.saturating_sub(pose.estimated_ns) <= FRESH_NS => (
            estimate.0 + now.x_m - then.x_m,
            estimate.1 + now.y_m - then.y_m,
            estimate.2 + now.yaw_rad - then.yaw_rad,
        ),
        _ => estimate,
    }
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo), carried on over `bytes`.
fn digested(digest: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(digest, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

/// What the round says of itself.
#[derive(Debug, Clone, Default)]
pub struct Round {
    /// How it is going.
    pub state: Option<PatrolState>,
    /// Share seen, by the drone's own account.
    pub coverage: f32,
    /// Next waypoint and how many there are.
    pub next: (u32, u32),
    /// One sentence.
    pub text: String,
    /// Rooms that were left out or seen in part only, with reasons.
    pub skipped: Vec<String>,
    /// Rooms that were still to be seen.
    unfinished: Vec<String>,
}

impl Witness {
    /// Opens the ports of a scorer.
    ///
    /// # Errors
    /// When the manifest does not allow it.
    pub fn open(ports: &mut Ports, world: &World, body: Body) -> Result<Self, StartError> {
        Ok(Self {
            truth: ports.input()?,
            pose: ports.input()?,
            pilot: ports.input()?,
            patrol: ports.input()?,
            recent: VecDeque::with_capacity(TRUTH_KEPT),
            last_truth: None,
            last_pose: None,
            last_pilot: None,
            round: Round::default(),
            track: Track::default(),
            scorer: Scorer::new(world, body.radius_m),
            body,
            failsafes: Vec::new(),
            flown: false,
            last_track_s: f64::NEG_INFINITY,
            stalls: Stalls::default(),
            digest: 0xcbf2_9ce4_8422_2325,
        })
    }

    /// Takes what has come; to be called at least 20 times a second of the flight.
    pub fn look(&mut self, world: &World) {
        let mut fresh = 0;
        while let Some(truth) = self.truth.receive() {
            if self.recent.len() == TRUTH_KEPT {
                self.recent.pop_front();
            }
            self.recent.push_back(*truth);
            fresh = (fresh + 1).min(TRUTH_KEPT);
            self.digest = digested(self.digest, bytemuck::bytes_of(&*truth));
            self.stalls.follow(&truth);
            self.last_truth = Some(*truth);
            self.flown |= truth.armed != 0 && truth.on_ground == 0;
        }
        while let Some(pose) = self.pose.receive() {
            self.digest = digested(self.digest, bytemuck::bytes_of(&*pose));
            self.last_pose = Some(*pose);
        }
        // Every truth counts, whether anybody estimates or not.
        for k in self.recent.len() - fresh..self.recent.len() {
            let Some(truth) = self.recent.get(k).copied() else { break };
            let then = self.last_pose.and_then(|pose| self.truth_at(pose.estimated_ns));
            let estimate = self.last_pose.map(|pose| carried_on(&pose, then.as_ref(), &truth));
            self.observe(world, &truth, estimate);
        }
        while let Some(state) = self.pilot.receive() {
            self.note_failsafe(&state);
            self.last_pilot = Some(*state);
        }
        if let Some(patrol) = self.patrol.latest() {
            self.round.take(&patrol);
        }
    }

    fn truth_at(&self, at_ns: u64) -> Option<Truth> {
        let gap = |truth: &Truth| truth.header.stamp_ns.abs_diff(at_ns);
        self.recent.iter().min_by_key(|truth| gap(truth)).copied()
    }

    fn observe(&mut self, world: &World, truth: &Truth, estimate: Option<(f32, f32, f32)>) {
        let airborne = truth.armed != 0 && truth.on_ground == 0;
        let seen = Observation {
            time_s: truth.time_s,
            x: truth.x_m,
            y: truth.y_m,
            yaw: truth.yaw_rad,
            airborne,
            estimate,
            p_lost: self.last_pose.filter(|pose| pose.searching == 0).map(|pose| pose.p_lost),
        };
        self.scorer.observe(world, &seen);
        if airborne && truth.time_s - self.last_track_s >= 0.1 {
            self.last_track_s = truth.time_s;
            let used = (truth.people_used as usize).min(truth.people.len());
            let people = truth.people[..used].iter().map(|person| (person.x_m, person.y_m));
            let body = (truth.z_m, self.body.height_m, self.body.radius_m);
            let estimate = estimate.map(|(x, y, _)| (x, y));
            let place = (truth.x_m, truth.y_m);
            self.track.observe(world, truth.time_s, place, estimate, truth.clearance_m, body, people);
        }
    }

    fn note_failsafe(&mut self, state: &PilotState) {
        let (Some(cause), Some(action)) =
            (FailsafeCause::from_code(state.cause), FailsafeAction::from_code(state.action))
        else {
            return;
        };
        if action == FailsafeAction::None || cause == FailsafeCause::None {
            return;
        }
        let text = format!("{cause}: {action}");
        if self.failsafes.last() != Some(&text) {
            self.failsafes.push(text);
        }
    }

    /// Whether the flight is over: it was in the air and stands disarmed on the ground.
    #[must_use]
    pub fn landed(&self) -> bool {
        self.flown && self.last_truth.is_some_and(|truth| truth.armed == 0 && truth.on_ground != 0)
    }

    /// Whether it has left the ground.
    #[must_use]
    pub fn flown(&self) -> bool {
        self.flown
    }

    /// Contacts so far.
    #[must_use]
    pub fn contacts(&self) -> u32 {
        self.last_truth.map_or(0, |truth| truth.contacts)
    }

    /// Share seen by the truth so far.
    #[must_use]
    pub fn coverage(&self) -> f32 {
        self.scorer.coverage().fraction()
    }

    /// What has been seen, for the picture.
    #[must_use]
    pub fn scorer(&self) -> &Scorer {
        &self.scorer
    }

    /// Phase of the flight in words.
    #[must_use]
    pub fn phase(&self) -> &'static str {
        self.last_pilot.and_then(|state| Phase::from_code(state.phase)).map_or("no pilot yet", Phase::word)
    }

    /// Distance between the newest estimate and the truth of its time.
    #[must_use]
    pub fn error_m(&self) -> Option<f32> {
        let pose = self.last_pose?;
        let truth = self.truth_at(pose.estimated_ns)?;
        Some((pose.x_m - truth.x_m).hypot(pose.y_m - truth.y_m))
    }

    /// The score.
    #[must_use]
    pub fn finish(self, world: &World, seed: u64) -> FlightScore {
        let place = self.last_truth.map_or((0.0, 0.0), |truth| (truth.x_m, truth.y_m));
        let ending = Ending {
            seed,
            contacts: self.contacts(),
            min_clearance_m: self.last_truth.map_or(0.0, |truth| truth.min_clearance_m),
            landed: self.landed(),
            place,
            failsafes: self.failsafes,
            skipped: self.round.missed(),
            stalled_s: self.stalls.total_s as f32,
            digest: self.digest,
        };
        self.scorer.finish(world, ending)
    }
}

/// What is nearest to the airframe, in the words of the world, and in which direction of the plan frame it lies.
#[must_use]
pub fn touched(world: &World, truth: &Truth, body: Body) -> (String, f32) {
    // People walk in the simulator's own world: the truth says where.
    let people = truth.people.iter().take(truth.people_used as usize);
    let person = people
        .map(|person| (person.x_m - truth.x_m, person.y_m - truth.y_m))
        .min_by(|a, b| a.0.hypot(a.1).total_cmp(&b.0.hypot(b.1)));
    if let Some((dx, dy)) = person
        && dx.hypot(dy) < body.radius_m + PERSON_M
    {
        return ("a person".to_owned(), dy.atan2(dx));
    }
    let at = |x: f32, y: f32| world.nearest(x, y, truth.z_m, body.height_m, body.radius_m);
    let here = at(truth.x_m, truth.y_m);
    // It lies where the way out of it does not.
    let (mut best, mut bearing) = (f32::NEG_INFINITY, 0.0);
    for turn in 0..72 {
        let angle = turn as f32 * core::f32::consts::TAU / 72.0;
        let there = at(truth.x_m - 0.1 * angle.cos(), truth.y_m - 0.1 * angle.sin());
        if there.clearance > best {
            (best, bearing) = (there.clearance, angle);
        }
    }
    (here.name.to_owned(), bearing)
}

impl Round {
    fn take(&mut self, patrol: &Patrol) {
        self.state = u8::try_from(patrol.state).ok().and_then(PatrolState::from_code);
        self.coverage = patrol.coverage;
        self.next = (patrol.next, patrol.waypoints_used);
        if self.text != patrol.text.as_str() {
            patrol.text.as_str().clone_into(&mut self.text);
        }
        self.skipped.clear();
        self.unfinished.clear();
        for room in patrol.rooms.iter().take(patrol.rooms_used as usize) {
            let (name, reason, percent) = (room.name, room.reason, 100.0 * room.seen);
            match u8::try_from(room.state).ok().and_then(RoomState::from_code) {
                Some(RoomState::Skipped) => self.skipped.push(format!("{name}: {reason}")),
                Some(RoomState::PartlySeen) => {
                    self.skipped.push(format!("{name}: {percent:.0} % seen, {reason}"));
                }
                Some(RoomState::Waiting) => self.unfinished.push(format!("{name}: not flown to")),
                Some(RoomState::Entered) => {
                    self.unfinished.push(format!("{name}: {percent:.0} % seen when the round ended"));
                }
                _ => {}
            }
        }
        for point in 0..u32::BITS {
            let is = |bits: u32| bits & (1 << point) != 0;
            if is(patrol.points_barred) {
                self.skipped.push(format!("point {}: no way to it", point + 1));
            } else if is(patrol.points_waiting) {
                self.unfinished.push(format!("point {}: not flown to", point + 1));
            }
        }
    }

    /// What was not seen of a round that is over.
    fn missed(mut self) -> Vec<String> {
        self.skipped.append(&mut self.unfinished);
        self.skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ipc_types::Header;

    fn truth(stamp_s: f64, time_s: f64, x: f32) -> Truth {
        let header = Header { stamp_ns: (stamp_s * 1e9) as u64, ..Header::default() };
        Truth { header, time_s, x_m: x, y_m: 2.0, ..Truth::default() }
    }

    #[test]
    fn an_estimate_is_compared_with_its_own_time_while_it_is_fresh_and_then_stands_still() {
        let then = truth(10.0, 10.0, 1.0);
        let pose = Pose { estimated_ns: 10_000_000_000, x_m: 1.1, y_m: 2.0, ..Pose::default() };
        let error = |now: &Truth| {
            let (x, y, _) = carried_on(&pose, Some(&then), now);
            (x - now.x_m).hypot(y - now.y_m)
        };
        // 0.2 m farther within the time that a pose takes to come: still the 10 cm of its own time.
        assert!((error(&truth(10.2, 10.2, 1.2)) - 0.1).abs() < 1e-5);
        // Half a second of silence later the drone is 0.4 m from where it is said to be.
        assert!((error(&truth(10.5, 10.5, 1.5)) - 0.4).abs() < 1e-5);
    }

    #[test]
    fn stalls_add_up_and_whole_steps_are_none() {
        let mut stalls = Stalls::default();
        for (stamp_s, time_s) in [(100.0, 0.0), (100.021, 0.02), (101.0, 0.8), (101.02, 0.82), (103.0, 2.3)] {
            stalls.follow(&truth(stamp_s, time_s, 0.0));
        }
        assert!((stalls.total_s - 0.7).abs() < 1e-6, "{}", stalls.total_s);
    }
}
