//! From phase to phase.

use crate::core::{Decided, PilotCore};
use crate::senses::{LEAST_LEFT_NS, age_s};
use control::{Action, Cause, Liftoff, TouchDown, Vector};
use core::fmt::Write;
use ipc_types::{LinkState, Phase, SetpointKind, Text};

/// A controller that says so for this long did disarm, seconds: its status comes five times a second, and a
/// restarted `flight` must have asked it first.
const DISARMED_S: f32 = 1.0;
/// The take-off is over when the height is this near, and the way to where it lands when the place is, metres.
const THERE_M: f32 = 0.12;
/// A climb that takes longer goes on as a hover, seconds.
const CLIMB_S: f32 = 12.0;
/// Above floor and lower than this a landing goes on, metres: two seconds more.
const LOW_M: f32 = 0.8;
/// Blind descent: rate, and time beyond the reckoned one after which the skids must stand, seconds: with
/// [`BLIND_SHORT`] it is down from 1.3 m by then, and lands at 0.6 m/s.
pub(crate) const BLIND_M_S: f32 = 0.35;
const BLIND_MORE_S: f32 = 5.0;
/// Who should stand by the reckoning gets so much less collective than that says: 0.12 m/s2. Where the reckoning was wrong
/// about the climb there may be a metre left, and motors that stop there are a crash.
pub(crate) const BLIND_SHORT: f32 = 0.994;

impl PilotCore {
    /// One transition at most a step.
    pub(crate) fn advance(&mut self, now: u64, dt: f32) {
        let says_disarmed = self.flight.at.is_some()
            && age_s(self.flight.at, now) < 1.0
            && self.flight.link == LinkState::Up
            && !self.flight.armed;
        let disarmed_s = self.disarmed.update(now, says_disarmed, 0.0);
        let flies = !matches!(self.phase, Phase::Grounded | Phase::Arming | Phase::Cut);
        if flies && disarmed_s >= DISARMED_S && self.phase_s(now) >= DISARMED_S {
            self.stand(now, "the controller disarmed by itself");
            return;
        }
        if self.airborne() {
            match self.judged.action {
                Action::Cut => {
                    self.enter(now, Phase::Cut);
                    self.say("motors cut: tilted over");
                    return;
                }
                Action::Land | Action::Descend
                    if self.phase != Phase::EmergencyLanding && self.judged.cause != Cause::Operator =>
                {
                    self.land(now, None);
                    self.enter(now, Phase::EmergencyLanding);
                    self.lands_at = self.floor_to_land_on();
                    self.say_failsafe("emergency landing");
                }
                // Who stopped the drone is asked first.
                Action::Return if self.stop_lands_ns.is_none() => self.turn_home(now),
                _ => {}
            }
        }
        match self.phase {
            Phase::Arming => self.arming(now),
            Phase::TakeOff => self.taking_off(now, dt),
            Phase::Hover => {
                self.settle();
                self.answer_stop(now);
            }
            Phase::Autonomous => {
                if let Some(setpoint) = self.fresh_setpoint(now)
                    && setpoint.kind == SetpointKind::Land
                    && matches!(self.judged.action, Action::None | Action::Return)
                {
                    self.land(now, setpoint.hold);
                    self.say("landing");
                }
            }
            Phase::Landing | Phase::EmergencyLanding => self.landing(now, dt),
            Phase::Cut => {
                if self.flight.at.is_some() && !self.flight.armed && self.phase_s(now) > 2.0 {
                    self.stand(now, "on the ground: the motors were cut");
                }
            }
            Phase::Grounded | Phase::Manual => {}
        }
    }

    /// Navigation knows the way home: whoever hovers follows it from now on, whoever takes off as soon as it is up,
    /// where doors can be flown through.
    fn turn_home(&mut self, now: u64) {
        match self.phase {
            Phase::Hover => {
                self.enter(now, Phase::Autonomous);
                self.say_failsafe("returning home");
            }
            Phase::TakeOff => self.after_take_off = Phase::Autonomous,
            _ => {}
        }
    }

    fn arming(&mut self, now: u64) {
        if self.flight.armed {
            self.spool_up(now);
        } else if self.phase_s(now) > self.config.take_off.arming_s {
            let mut sentence = Text::<96>::default();
            // What does not fit is cut.
            let _ = match self.flight.reason.as_str() {
                "" => sentence.write_str("refused: the controller did not arm"),
                reason => write!(sentence, "refused: not armed: {reason}"),
            };
            self.give_up(now, sentence.as_str());
        }
    }

    fn taking_off(&mut self, now: u64, dt: f32) {
        let Some(spool) = &mut self.spool else {
            let there = (self.height.height_m() - self.config.height_m).abs() < THERE_M;
            if there || self.phase_s(now) > CLIMB_S {
                if self.by_hand.lease.holder().is_some() {
                    self.fly_by_hand(now);
                    self.height_wish_m = self.config.height_m;
                } else {
                    self.enter(now, self.after_take_off);
                }
                match (self.phase, self.judged.action) {
                    (Phase::Autonomous, Action::Return) => self.say_failsafe("returning home"),
                    (Phase::Autonomous, _) => self.say("following navigation"),
                    (Phase::Manual, _) => self.say("by hand: stopping first"),
                    _ => self.say("hovering"),
                }
            }
            return;
        };
        match spool.step(dt) {
            Liftoff::SpoolingUp { throttle_us } => self.climb.override_throttle(throttle_us),
            Liftoff::Lifted { hover_us, height_m, climb_m_s } => {
                self.spool = None;
                self.changed = true;
                // What was learned in an earlier flight is better than the guess of a lift-off.
                if !self.hover_known {
                    self.climb.set_hover(hover_us);
                }
                self.hover_known = true;
                self.climb.set_throttle(self.climb.hover_us());
                self.height.set(now, height_m, climb_m_s, 0.0);
            }
            Liftoff::Stuck => self.give_up(now, "refused: full throttle does not lift the drone"),
        }
    }

    /// Begins to come down over a place, or over where it stands.
    pub(crate) fn land(&mut self, now: u64, place: Option<Vector>) {
        self.spool = None;
        self.stop_lands_ns = None;
        self.touch = TouchDown::default();
        self.blind_since_ns = None;
        // In a hover the drone stands over its place already; out of a flight it lands where it stops.
        self.hold = place.or(if self.phase == Phase::Hover { self.hold } else { None });
        let chosen = place.is_some() || !self.floor.stands_over_something();
        self.lands_at = if chosen { None } else { self.floor_to_land_on() };
        self.enter(now, Phase::Landing);
    }

    /// Where to land when nobody chose the place; `None` is here. Who is low above the floor is not sent up again.
    fn floor_to_land_on(&self) -> Option<Vector> {
        let low = self.height.clearance_m() < LOW_M && !self.floor.stands_over_something();
        self.floor.nearest(self.config.landing.farthest_floor_m).filter(|_| !low)
    }

    /// Whether a landing still goes to where the floor was seen: for as long as it is heard what is below and beside and known
    /// how fast it goes, and not for ever.
    fn goes_aside(&mut self, now: u64, blind: bool) -> bool {
        let blind = blind || self.judged.causes & Cause::AllSonarsSilent.bit() != 0;
        let Some(place) = self.lands_at else { return false };
        let there = self.floor.way_to(place).norm() < THERE_M;
        if there && self.floor.stands_over_something() {
            // The way erred, or the edge was not seen: there may be another place.
            self.lands_at = self.floor_to_land_on();
        }
        let there = there && self.lands_at == Some(place);
        if there || blind || !self.velocity_known(now) || self.phase_s(now) > self.config.landing.patience_s {
            self.lands_at = None;
        } else {
            self.hold = None;
        }
        self.lands_at.is_some()
    }

    fn landing(&mut self, now: u64, dt: f32) {
        let blind = self.height.silent_s(now) > self.config.failsafe.height_hold_s;
        if self.goes_aside(now, blind) {
            return;
        }
        self.settle();
        let (clearance, climb, load) =
            (self.height.clearance_m(), self.height.climb_m_s(), self.climb.load());
        if blind {
            let since = *self.blind_since_ns.get_or_insert(now);
            let reckoned = clearance.max(0.0) / BLIND_M_S + BLIND_MORE_S;
            let waited = age_s(Some(since), now);
            if self.touch.step_blind(&self.config.touch_down, dt, self.height.bias_m_s2(), load) {
                self.stand(now, "landed blind");
                return;
            }
            // The dead-reckoned height falls on below the ground: long enough below, it has been reached.
            if clearance < -BLIND_M_S * BLIND_MORE_S || waited > reckoned + 6.0 {
                self.stand(now, "landed blind");
                return;
            }
        } else {
            self.blind_since_ns = None;
        }
        if self.touch.step(&self.config.touch_down, dt, clearance, climb, load) && !blind {
            let mut sentence = Text::<96>::default();
            // What does not fit is cut.
            let _ = if self.judged.action == Action::None {
                sentence.write_str("landed")
            } else {
                write!(sentence, "landed: {}", crate::report::cause(self.judged.cause))
            };
            self.stand(now, sentence.as_str());
        }
    }

    /// Motors off: the skids stand.
    pub(crate) fn stand(&mut self, now: u64, why: &str) {
        self.spool = None;
        self.operator_land = false;
        self.stop_lands_ns = None;
        self.by_hand.lost_ns = None;
        self.cut_ordered = false;
        self.hold = None;
        self.hold_heading = None;
        self.decided = Decided::NEUTRAL;
        self.climb.set_throttle(1000.0);
        self.enter(now, Phase::Grounded);
        self.say(why);
    }

    /// Chooses the place to hold once the drone has stopped.
    pub(crate) fn settle(&mut self) {
        if self.hold.is_none() && self.place_known() && self.motion.velocity().norm() < 0.12 {
            self.hold = Some(self.motion.place());
        }
    }

    pub(crate) fn fresh_setpoint(&self, now: u64) -> Option<crate::senses::SetpointSeen> {
        self.setpoint.filter(|setpoint| now.saturating_add(LEAST_LEFT_NS) <= setpoint.expiry_ns)
    }

    fn say_failsafe(&mut self, what: &str) {
        let mut sentence = Text::<96>::default();
        // What does not fit is cut.
        let _ = write!(sentence, "{what}: {}", crate::report::cause(self.judged.cause));
        self.say(sentence.as_str());
    }
}
