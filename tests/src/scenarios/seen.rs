//! What is seen of a flight, by the truth.

use super::Scenario;
use cli::flight::Flight;
use ipc_types::{FailsafeAction, FailsafeCause, SticksState, Truth};
use serde::Serialize;

/// Slower than this it stands, horizontally: a hover sways by some 0.1 m/s, m/s.
const STANDS_M_S: f32 = 0.2;
/// For so long, seconds.
const STANDS_S: f64 = 1.0;
/// Better than this it knows its place, metres.
const KNOWN_M: f32 = 0.5;
/// The touch-down's speed is the fastest of so long before it, seconds.
const BEFORE_S: f64 = 0.1;

/// A failsafe that acted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FailsafeSeen {
    /// Seconds after the take-off; negative before it.
    pub at_s: f64,
    /// `cause: action`.
    pub text: String,
    /// How severe.
    #[serde(skip)]
    pub action: FailsafeAction,
    /// Why.
    #[serde(skip)]
    pub cause: FailsafeCause,
}

/// What came of a flight. Times are seconds after the take-off.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Seen {
    /// Simulated time of the take-off.
    pub took_off_s: Option<f64>,
    /// Touches.
    pub contacts: u32,
    /// The first of them: when and where.
    pub first_contact: Option<(f64, f32, f32)>,
    /// Least distance to anything solid in flight, metres.
    pub clearance_m: f32,
    /// It stood disarmed on the ground at the end, after a flight.
    pub landed: bool,
    /// When it was down and disarmed.
    pub ended_s: Option<f64>,
    /// Where it began, plan frame.
    pub start: (f32, f32),
    /// Where it ended.
    pub place: (f32, f32),
    /// Distance of the end from the pad's middle.
    pub off_pad_m: f32,
    /// Phase of the pilot at the end.
    pub phase: String,
    /// What the pilot said of the last order.
    pub answer: String,
    /// Failsafes that acted, in their order.
    pub failsafes: Vec<FailsafeSeen>,
    /// It stood from this time on for a second, after the first fault began.
    pub stopped_s: Option<f64>,
    /// Downward speed of the last touch-down, m/s.
    pub touch_down_m_s: Option<f32>,
    /// Last time in the air at which its place was wrong by over 0.5 m, since the first fault began.
    pub wrong_until_s: Option<f64>,
    /// Largest error of its place in the air, metres.
    pub error_m: f32,
    /// Nearest to where the last `goto` leads, metres.
    pub goal_m: Option<f32>,
    /// Highest above the floor, metres.
    pub height_m: f32,
    /// For how long it followed the sticks, seconds.
    pub by_hand_s: f64,
    /// How far it flew by them, metres.
    pub by_hand_m: f64,
    /// Whether somebody held the sticks at the end.
    pub held: bool,
    /// How often the motors were armed.
    pub armings: u32,
    /// For each fault: it was there from the start, or began in the air.
    pub begun: Vec<bool>,
    #[serde(skip)]
    trail: Trail,
}

/// What is remembered from one look to the next.
#[derive(Clone, Debug, Default)]
struct Trail {
    at_s: f64,
    armed: bool,
    airborne: bool,
    standing_since_s: Option<f64>,
    sinking: Vec<(f64, f32)>,
}

impl Seen {
    /// Takes what the witness has seen by now; to be called 50 times a second.
    pub(super) fn look(&mut self, flight: &Flight, scenario: &Scenario) {
        let Some(truth) = flight.witness.last_truth else { return };
        let airborne = truth.armed != 0 && truth.on_ground == 0;
        if self.took_off_s.is_none() {
            self.start = (truth.x_m, truth.y_m);
            if airborne {
                self.took_off_s = Some(truth.time_s);
            }
        }
        let at_s = truth.time_s - self.took_off_s.unwrap_or(truth.time_s);
        let before = (self.place, self.trail.at_s);
        self.place = (truth.x_m, truth.y_m);
        self.trail.at_s = at_s;
        if let Some(pilot) = flight.witness.last_pilot {
            self.held = pilot.lease != 0;
            if pilot.sticks == SticksState::Following.code() {
                self.by_hand_s += at_s - before.1;
                self.by_hand_m += f64::from((self.place.0 - before.0.0).hypot(self.place.1 - before.0.1));
            }
        }
        let pad = flight.world.pad();
        self.off_pad_m = (truth.x_m - pad.x).hypot(truth.y_m - pad.y);
        self.clearance_m = truth.min_clearance_m;
        if truth.contacts > self.contacts {
            self.contacts = truth.contacts;
            self.first_contact.get_or_insert((at_s, truth.x_m, truth.y_m));
        }
        self.armings += u32::from(truth.armed != 0 && !self.trail.armed);
        self.trail.armed = truth.armed != 0;
        self.height_m = self.height_m.max(truth.z_m);
        self.landed = flight.witness.landed();
        if self.landed {
            self.ended_s.get_or_insert(at_s);
        } else {
            self.ended_s = None;
        }
        self.touch(&truth, airborne, at_s);
        self.begin(scenario, at_s);
        if self.took_off_s.is_some() && at_s >= scenario.trouble_s() {
            self.stop(&truth, at_s);
        }
        if airborne {
            let error_m = flight.witness.error_m().unwrap_or(f32::INFINITY);
            self.error_m = self.error_m.max(error_m);
            if error_m > KNOWN_M && at_s >= scenario.trouble_s() {
                self.wrong_until_s = Some(at_s);
            }
            if let Some([x, y]) = scenario.goal() {
                let away = (truth.x_m - x).hypot(truth.y_m - y);
                self.goal_m = Some(self.goal_m.map_or(away, |before| before.min(away)));
            }
        }
        self.hear(flight, at_s);
    }

    /// A fault that begins on the ground after the flight finds nothing to break. Whether the motors run is not asked:
    /// stopping them may be what the fault does.
    fn begin(&mut self, scenario: &Scenario, at_s: f64) {
        self.begun.resize(scenario.faults.len(), false);
        for (begun, fault) in self.begun.iter_mut().zip(&scenario.faults) {
            *begun |= fault.from_s.is_none_or(|from_s| self.trail.airborne && at_s >= from_s);
        }
    }

    /// How fast the ground comes.
    fn touch(&mut self, truth: &Truth, airborne: bool, at_s: f64) {
        if airborne || self.trail.airborne {
            self.trail.sinking.retain(|(then, _)| at_s - then <= BEFORE_S);
            self.trail.sinking.push((at_s, -truth.velocity_z_m_s));
        }
        // A cut in the air is no touch-down; the ground comes later.
        if self.trail.airborne && truth.on_ground != 0 {
            let fastest = self.trail.sinking.iter().map(|(_, speed)| *speed).fold(0.0, f32::max);
            self.touch_down_m_s = Some(fastest);
        }
        self.trail.airborne = truth.on_ground == 0 && self.took_off_s.is_some();
    }

    fn stop(&mut self, truth: &Truth, at_s: f64) {
        if self.stopped_s.is_some() {
            return;
        }
        if truth.velocity_x_m_s.hypot(truth.velocity_y_m_s) > STANDS_M_S {
            self.trail.standing_since_s = None;
            return;
        }
        let since = *self.trail.standing_since_s.get_or_insert(at_s);
        if at_s - since >= STANDS_S {
            self.stopped_s = Some(since);
        }
    }

    /// What the pilot says of itself.
    fn hear(&mut self, flight: &Flight, at_s: f64) {
        flight.witness.phase().clone_into(&mut self.phase);
        let Some(state) = flight.witness.last_pilot else { return };
        if self.answer != state.answer_text.as_str() {
            state.answer_text.as_str().clone_into(&mut self.answer);
        }
        let (Some(cause), Some(action)) =
            (FailsafeCause::from_code(state.cause), FailsafeAction::from_code(state.action))
        else {
            return;
        };
        if action == FailsafeAction::None || cause == FailsafeCause::None {
            return;
        }
        if self.failsafes.last().is_none_or(|last| (last.cause, last.action) != (cause, action)) {
            self.failsafes.push(FailsafeSeen { at_s, text: format!("{cause}: {action}"), action, cause });
        }
    }
}
