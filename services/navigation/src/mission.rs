//! What is to be done: commands, the pilot's phases and where the round stands, as a state machine without
//! any route in it.

use crate::place::Place;
use ipc_types::{Answer, Command, FailsafeAction, PatrolState, Phase, PilotState, Verb};

/// Slow enough over the pad to come down, metres a second.
const STILL_M_S: f32 = 0.12;
/// For how long it must be still there, seconds.
const STILL_S: f32 = 1.0;
/// After hovering over the pad for this long a little farther off is good enough, seconds.
const PATIENCE_S: f32 = 15.0;
/// A round that was ordered and is still on the ground after this is given up, seconds: arming takes 5 to 10.
const TAKE_OFF_S: f32 = 45.0;
/// That little: times the usual distance. The estimate is off by as much again, and the pad is 0.35 m to its rim.
const PATIENCE_SHARE: f32 = 1.8;

/// Where the mission is heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Nowhere.
    None,
    /// The round, then home.
    Round,
    /// The pad, to land.
    Home,
    /// A place named by the operator.
    There((f32, f32)),
}

/// What the flying part is to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Intent {
    /// Stand; at this place if one is named.
    Hover(Option<(f32, f32)>),
    /// Follow the route.
    Follow,
    /// Come down over this place.
    Land((f32, f32)),
}

/// Something that the route planner must hear about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A new round: forget what was seen.
    NewRound,
    /// Plan towards the goal from here.
    Plan,
    /// Drop the route.
    Drop,
}

/// The last command that was heard, and what became of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Heard {
    /// Its sequence.
    pub sequence: u32,
    /// Its stamp, nanoseconds.
    pub stamp_ns: u64,
    /// What became of it.
    pub answer: Answer,
}

/// The state machine.
#[derive(Clone, Debug)]
pub struct Mission {
    state: PatrolState,
    goal: Goal,
    heard: Option<Heard>,
    pad: Option<(f32, f32)>,
    hold: Option<(f32, f32)>,
    phase: Phase,
    failsafe: FailsafeAction,
    /// Whether the automatic may move the drone.
    automatic: bool,
    /// Whether the failsafe that sends home has been answered.
    sent_home: bool,
    flew: bool,
    still_s: f32,
    over_pad_s: f32,
    grounded_s: f32,
}

impl Mission {
    /// Nothing to do. `pad` when the building's sidecar file names one.
    #[must_use]
    pub fn new(pad: Option<(f32, f32)>) -> Self {
        Self {
            state: PatrolState::Idle,
            goal: Goal::None,
            heard: None,
            pad,
            hold: None,
            phase: Phase::Grounded,
            failsafe: FailsafeAction::None,
            automatic: true,
            sent_home: false,
            flew: false,
            still_s: 0.0,
            over_pad_s: 0.0,
            grounded_s: 0.0,
        }
    }

    /// After a restart: where things stood. Something under way is planned again from where the drone is.
    pub fn restore(&mut self, state: PatrolState, pad: (f32, f32), there: Option<(f32, f32)>, heard: Heard) {
        self.heard = Some(heard);
        if pad.0.is_finite() && pad.1.is_finite() {
            self.pad = Some(pad);
        }
        self.flew = true;
        (self.state, self.goal) = match (state, there) {
            (PatrolState::Planning | PatrolState::Flying, _) => (PatrolState::Planning, Goal::Round),
            (PatrolState::Returning | PatrolState::Landing, _) => (PatrolState::Returning, Goal::Home),
            (PatrolState::GoingThere, Some(there)) => (PatrolState::GoingThere, Goal::There(there)),
            (PatrolState::GoingThere, None) => (PatrolState::Idle, Goal::None),
            (PatrolState::Paused, _) => (PatrolState::Paused, Goal::Round),
            (state, _) => (state, Goal::None),
        };
    }

    /// Where the round stands.
    #[must_use]
    pub fn state(&self) -> PatrolState {
        self.state
    }

    /// Where it is heading.
    #[must_use]
    pub fn goal(&self) -> Goal {
        self.goal
    }

    /// The pad, once it is known.
    #[must_use]
    pub fn pad(&self) -> Option<(f32, f32)> {
        self.pad
    }

    /// The last command heard; number 0 before any.
    #[must_use]
    pub fn heard(&self) -> Heard {
        self.heard.unwrap_or(Heard { sequence: 0, stamp_ns: 0, answer: Answer::None })
    }

    /// Whether the automatic may move the drone.
    #[must_use]
    pub fn automatic(&self) -> bool {
        self.automatic
    }

    /// The pilot's phase.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Whether the drone is in the air under the pilot's control.
    #[must_use]
    pub fn airborne(&self) -> bool {
        matches!(self.phase, Phase::Hover | Phase::Autonomous)
    }

    /// Whether the pilot flies navigation's wishes now.
    #[must_use]
    pub fn heeded(&self) -> bool {
        self.phase == Phase::Autonomous
            && matches!(self.failsafe, FailsafeAction::None | FailsafeAction::Return)
    }

    fn under_way(&self) -> bool {
        matches!(
            self.state,
            PatrolState::Planning | PatrolState::Flying | PatrolState::Returning | PatrolState::GoingThere
        )
    }

    /// Obeys a command, once and in time. `Err` when it makes no sense (counted by the caller).
    ///
    /// # Errors
    /// An unknown verb, a place that is none, or a command that has expired or was overtaken by a newer one.
    pub fn obey(
        &mut self,
        now: u64,
        command: &Command,
        place: Option<&Place>,
    ) -> Result<Option<Event>, Nonsense> {
        let verb = u8::try_from(command.verb).ok().and_then(Verb::from_code).ok_or(Nonsense)?;
        let there = (command.x_m, command.y_m);
        if verb == Verb::GoTo && !(there.0.abs() < 1e4 && there.1.abs() < 1e4) {
            return Err(Nonsense);
        }
        if self.heard.is_some_and(|heard| heard.sequence == command.command_sequence) {
            return Ok(None);
        }
        if !command.counts(now, self.heard().stamp_ns) {
            return Err(Nonsense);
        }
        let (answer, event) = self.follow(verb, there, place.map(|place| (place.x, place.y)));
        self.heard =
            Some(Heard { sequence: command.command_sequence, stamp_ns: command.header.stamp_ns, answer });
        Ok(event)
    }

    fn follow(&mut self, verb: Verb, there: (f32, f32), here: Option<(f32, f32)>) -> (Answer, Option<Event>) {
        // The pilot says the same a step later.
        self.automatic = match verb {
            Verb::AutomaticOff => false,
            Verb::AutomaticOn => true,
            _ => self.automatic,
        };
        match verb {
            // The pilot's alone.
            Verb::TakeOff | Verb::Cut | Verb::SticksRelease | Verb::AutomaticOn => (Answer::Accepted, None),
            Verb::GoTo | Verb::PatrolStart if !self.automatic => (Answer::Refused, None),
            Verb::Land => {
                self.stop(PatrolState::Idle, None);
                (Answer::Accepted, Some(Event::Drop))
            }
            Verb::Hold | Verb::PatrolPause | Verb::Stop | Verb::SticksTake | Verb::AutomaticOff => {
                let paused =
                    self.goal == Goal::Round && (self.under_way() || self.state == PatrolState::Paused);
                if paused {
                    self.state = PatrolState::Paused;
                    self.hold = here;
                    (Answer::Accepted, Some(Event::Drop))
                } else if verb != Verb::PatrolPause {
                    self.stop(PatrolState::Idle, here);
                    (Answer::Accepted, Some(Event::Drop))
                } else {
                    (Answer::Refused, None)
                }
            }
            Verb::GoTo => {
                self.head(Goal::There(there), PatrolState::GoingThere, here);
                (Answer::Working, Some(Event::Plan))
            }
            Verb::PatrolStart if self.goal == Goal::Round && self.state == PatrolState::Paused => {
                self.head(Goal::Round, PatrolState::Planning, here);
                (Answer::Accepted, Some(Event::Plan))
            }
            Verb::PatrolStart => {
                if self.phase == Phase::Grounded && self.pad.is_none() {
                    self.pad = here;
                }
                self.flew = self.airborne();
                self.head(Goal::Round, PatrolState::Planning, if self.flew { here } else { None });
                // A whole round takes many steps to plan: nobody waits for that.
                (Answer::Accepted, Some(Event::NewRound))
            }
            Verb::PatrolStop | Verb::Home => {
                self.head(Goal::Home, PatrolState::Returning, here);
                (Answer::Working, Some(Event::Plan))
            }
        }
    }

    fn answer(&mut self, answer: Answer) {
        if let Some(heard) = &mut self.heard
            && heard.answer == Answer::Working
        {
            heard.answer = answer;
        }
    }

    fn head(&mut self, goal: Goal, state: PatrolState, hold: Option<(f32, f32)>) {
        (self.goal, self.state, self.hold) = (goal, state, hold);
        (self.still_s, self.over_pad_s) = (0.0, 0.0);
    }

    fn stop(&mut self, state: PatrolState, hold: Option<(f32, f32)>) {
        self.head(Goal::None, state, hold);
    }

    /// Hears what the pilot is doing.
    ///
    /// # Errors
    /// A phase or an action that no version writes.
    pub fn hear(&mut self, pilot: &PilotState, place: Option<&Place>) -> Result<Option<Event>, Nonsense> {
        let phase = Phase::from_code(pilot.phase).ok_or(Nonsense)?;
        let action = FailsafeAction::from_code(pilot.action).ok_or(Nonsense)?;
        let here = place.map(|place| (place.x, place.y));
        self.phase = phase;
        self.failsafe = action;
        self.automatic = pilot.automatic != 0;
        self.sent_home &= action == FailsafeAction::Return;
        if self.airborne() {
            self.flew = true;
        }
        if self.pad.is_none() && phase == Phase::Grounded {
            self.pad = here;
        }
        match phase {
            Phase::Grounded if self.flew && self.state == PatrolState::Landing => {
                self.stop(PatrolState::Done, None);
                self.flew = false;
                return Ok(Some(Event::Drop));
            }
            Phase::Grounded if self.flew && self.under_way() => {
                self.stop(PatrolState::Failed, None);
                self.flew = false;
                return Ok(Some(Event::Drop));
            }
            // Nothing resumes by itself after manual control.
            Phase::Manual if self.under_way() || self.state == PatrolState::Landing => {
                let goal = self.goal;
                self.stop(if goal == Goal::Round { PatrolState::Paused } else { PatrolState::Idle }, None);
                self.goal = if goal == Goal::Round { goal } else { Goal::None };
                return Ok(Some(Event::Drop));
            }
            Phase::EmergencyLanding | Phase::Cut if self.under_way() || self.state == PatrolState::Paused => {
                self.stop(PatrolState::Failed, None);
                return Ok(Some(Event::Drop));
            }
            _ => {}
        }
        let homeward = matches!(self.state, PatrolState::Returning | PatrolState::Landing);
        // It may have begun during the take-off, and no later order takes it back; a way home that was looked for in
        // vain is not looked for five times a second.
        let looked_in_vain = self.sent_home && self.state == PatrolState::Failed;
        if action == FailsafeAction::Return && self.airborne() && !homeward && !looked_in_vain {
            self.sent_home = true;
            self.head(Goal::Home, PatrolState::Returning, here);
            return Ok(Some(Event::Plan));
        }
        Ok(None)
    }

    /// Gives up a mission whose take-off never comes; true when it just did.
    pub fn waited_on_the_ground(&mut self, dt_s: f32) -> bool {
        if self.phase != Phase::Grounded || self.flew || !self.under_way() {
            self.grounded_s = 0.0;
            return false;
        }
        self.grounded_s += dt_s;
        if self.grounded_s < TAKE_OFF_S {
            return false;
        }
        self.stop(PatrolState::Idle, None);
        true
    }

    /// The planner has a route.
    pub fn route_ready(&mut self) {
        self.answer(Answer::Accepted);
        if self.state == PatrolState::Planning {
            self.state = PatrolState::Flying;
        }
    }

    /// The planner has to work again: the drone stands meanwhile.
    pub fn replanning(&mut self, place: &Place) {
        self.hold = Some((place.x, place.y));
        if self.state == PatrolState::Flying {
            self.state = PatrolState::Planning;
        }
    }

    /// There is no way on.
    pub fn no_way(&mut self, place: Option<&Place>) {
        self.answer(Answer::Refused);
        let state = if self.goal == Goal::Round || self.goal == Goal::Home {
            PatrolState::Failed
        } else {
            PatrolState::Idle
        };
        self.stop(state, place.map(|place| (place.x, place.y)));
    }

    /// The round is flown: the rest of the route leads home.
    pub fn homeward(&mut self) {
        if self.goal == Goal::Round && matches!(self.state, PatrolState::Flying | PatrolState::Planning) {
            self.state = PatrolState::Returning;
            self.goal = Goal::Home;
        }
    }

    /// The end of the route is reached, here.
    pub fn arrived(&mut self, end: (f32, f32)) {
        match self.goal {
            Goal::There(_) => self.stop(PatrolState::Idle, Some(end)),
            Goal::Home | Goal::Round if self.pad.is_some() => {
                self.head(Goal::Home, PatrolState::Landing, self.pad);
            }
            _ => {}
        }
    }

    /// What to do now. `planned`: there is a route to follow. Over the pad it waits until it is near enough
    /// and still before it asks to land.
    pub fn intent(&mut self, place: Option<&Place>, planned: bool, pad_m: f32, dt_s: f32) -> Intent {
        let Some(place) = place else {
            return Intent::Hover(None);
        };
        if self.state == PatrolState::Landing
            && let Some(pad) = self.pad
        {
            let asked = self.still_s >= STILL_S;
            let wide = if self.over_pad_s > PATIENCE_S { PATIENCE_SHARE } else { 1.0 };
            let still = place.distance(pad) < pad_m * wide && place.vx.hypot(place.vy) < STILL_M_S * wide;
            self.over_pad_s += dt_s;
            if !asked {
                self.still_s = if still { self.still_s + dt_s } else { 0.0 };
                return Intent::Hover(Some(pad));
            }
            return Intent::Land(pad);
        }
        if self.under_way() && planned && self.heeded() { Intent::Follow } else { Intent::Hover(self.hold) }
    }
}

/// A message that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the message makes no sense")]
pub struct Nonsense;
