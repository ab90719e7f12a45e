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

/// Truth kept while estimates for its times may still come, seconds times 50 Hz.
const TRUTH_KEPT: usize = 64;

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
    /// Rooms that were left out, with reasons.
    pub skipped: Vec<String>,
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
        })
    }

    /// Takes what has come; to be called at least 20 times a second of the flight.
    pub fn look(&mut self, world: &World) {
        while let Some(truth) = self.truth.receive() {
            if self.recent.len() == TRUTH_KEPT {
                self.recent.pop_front();
            }
            self.recent.push_back(*truth);
            self.last_truth = Some(*truth);
            self.flown |= truth.armed != 0 && truth.on_ground == 0;
            if self.last_pose.is_none() {
                self.observe(world, &truth, None);
            }
        }
        while let Some(pose) = self.pose.receive() {
            self.last_pose = Some(*pose);
            // The estimate is compared with the truth of the time that it was made for.
            if let Some(truth) = self.truth_at(pose.estimated_ns) {
                self.observe(world, &truth, Some((pose.x_m, pose.y_m, pose.heading_rad)));
            }
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
            skipped: self.round.skipped,
        };
        self.scorer.finish(world, ending)
    }
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
        for room in patrol.rooms.iter().take(patrol.rooms_used as usize) {
            if room.state == u32::from(RoomState::Skipped.code()) {
                self.skipped.push(format!("{}: {}", room.name, room.reason));
            }
        }
    }
}
