//! What the operator asks for, and why it may be refused.

use crate::core::PilotCore;
use crate::senses::age_s;
use control::{Action, SpoolUp};
use core::fmt::Write;
use ipc_types::{Command, LinkState, Phase, Text, Verb};

/// A side sonar that has not answered for so long keeps the drone on the ground, seconds. Two pings lost in a row happen;
/// in flight they close the sectors for a moment.
const SIDES_S: f32 = 1.0;

impl PilotCore {
    /// Obeys a command, once; says why not when it is refused.
    pub fn command(&mut self, now: u64, message: &Command) {
        let Some(verb) = u8::try_from(message.verb).ok().and_then(Verb::from_code) else {
            self.refused += 1;
            return;
        };
        if message.command_sequence == self.command_sequence {
            return;
        }
        self.command_sequence = message.command_sequence;
        self.changed = true;
        let returning = self.airborne() && self.judged.action == Action::Return;
        match (verb, self.phase) {
            // The table's answer is more severe than these wishes; to come down at once remains free.
            (Verb::Hold | Verb::GoTo | Verb::PatrolStart | Verb::PatrolPause, _) if returning => {
                self.say("refused: returning home, the battery does not last for more");
            }
            (Verb::TakeOff, Phase::Grounded) => self.try_take_off(now, Phase::Hover),
            (Verb::TakeOff, _) => self.say("refused: already flying"),
            (Verb::GoTo | Verb::PatrolStart | Verb::Home, Phase::Grounded) => {
                self.try_take_off(now, Phase::Autonomous);
            }
            (Verb::GoTo | Verb::PatrolStart | Verb::Home, Phase::Arming | Phase::TakeOff) => {
                self.after_take_off = Phase::Autonomous;
            }
            (
                Verb::GoTo | Verb::PatrolStart | Verb::PatrolPause | Verb::PatrolStop | Verb::Home,
                Phase::Hover,
            ) => {
                self.enter(now, Phase::Autonomous);
                self.say("following navigation");
            }
            (Verb::PatrolPause | Verb::PatrolStop, Phase::Grounded) => self.say("refused: not flying"),
            (Verb::GoTo | Verb::PatrolStart | Verb::Home, Phase::Landing | Phase::EmergencyLanding) => {
                self.say("refused: landing");
            }
            (Verb::Land, Phase::Grounded | Phase::Cut) => self.say("refused: on the ground"),
            (Verb::Land, Phase::Arming) => self.give_up(now, "take-off called off"),
            (Verb::Land, Phase::TakeOff) if self.spool.is_some() => self.give_up(now, "take-off called off"),
            (Verb::Land, Phase::EmergencyLanding) => {}
            (Verb::Land, _) => {
                self.operator_land = true;
                self.land(now, None);
                self.say("landing: the operator's order");
            }
            (Verb::Hold, Phase::Grounded | Phase::Cut) => self.say("refused: on the ground"),
            (Verb::Hold, Phase::Arming) => self.give_up(now, "take-off called off"),
            (Verb::Hold, Phase::TakeOff) => self.after_take_off = Phase::Hover,
            (Verb::Hold, Phase::EmergencyLanding) => self.say("refused: emergency landing"),
            (Verb::Hold, _) => {
                self.operator_land = false;
                self.hold = None;
                self.hold_heading = None;
                self.enter(now, Phase::Hover);
                self.say("holding: the operator's order");
            }
            (_, Phase::Cut) => self.say("refused: the motors were cut"),
            _ => {}
        }
    }

    /// Starts to arm, or says in a sentence why not.
    fn try_take_off(&mut self, now: u64, then: Phase) {
        let mut sentence = Text::<96>::default();
        if self.why_not(now, &mut sentence) {
            self.text = sentence;
            return;
        }
        self.after_take_off = then;
        self.operator_land = false;
        self.enter(now, Phase::Arming);
        self.say("arming");
    }

    /// Writes why a take-off is refused; false when nothing stands in the way.
    fn why_not(&self, now: u64, out: &mut Text<96>) -> bool {
        let cell = self.cell_volts(now).unwrap_or(f32::NAN);
        let silent = self.shield.silent_for(now, SIDES_S);
        let policy = &self.config.failsafe;
        // A sentence that does not fit is cut; its beginning says what matters.
        let _ = if age_s(self.flight.at, now) > 1.0 {
            out.write_str("refused: the flight service is silent")
        } else if self.flight.link != LinkState::Up {
            write!(out, "refused: flight controller: {}", self.flight.link)
        } else if self.flight.armed {
            out.write_str("refused: the controller is armed already")
        } else if self.flight.blocks != 0 && !self.flight.reason.as_str().is_empty() {
            write!(out, "refused: {}", self.flight.reason)
        } else if age_s(self.attitude.at, now) > 0.5 {
            out.write_str("refused: the controller sends no attitude")
        } else if cell.is_nan() {
            out.write_str("refused: the controller does not tell the battery's voltage")
        } else if !self.flight.drawn_mah.is_finite() {
            out.write_str("refused: the controller does not tell the charge drawn from the battery")
        } else if cell < self.config.take_off.cell_volts {
            write!(
                out,
                "refused: battery at {cell:.2} V a cell, {:.2} needed",
                self.config.take_off.cell_volts
            )
        } else if !self.craft.has_down || age_s(self.down.ping_ns, now) > 0.5 {
            out.write_str("refused: the down sonar is silent")
        } else if !self.down.good {
            out.write_str("refused: the down sonar is not healthy")
        } else if silent > 0 {
            write!(out, "refused: {silent} of the side sonars silent")
        } else if age_s(self.pose.at, now) > policy.pose_stale_s.max(0.5) {
            out.write_str("refused: the localization is silent")
        } else if !self.place_known() {
            out.write_str("refused: the drone does not know where it is")
        } else {
            return false;
        };
        true
    }

    /// Back to motors off before the skids left the ground.
    pub(crate) fn give_up(&mut self, now: u64, why: &str) {
        self.spool = None;
        self.operator_land = false;
        self.enter(now, Phase::Grounded);
        self.say(why);
    }

    /// From armed to spooling up.
    pub(crate) fn spool_up(&mut self, now: u64) {
        self.spool = Some(SpoolUp::new(self.config.liftoff, self.climb.hover_us()));
        if let Some(rest) = self.down.rest_m() {
            self.height.set_rest(rest);
        }
        self.hold = self.place_known().then(|| self.motion.place());
        if let Some(pad) = self.hold {
            self.set_home(pad);
        }
        self.hold_heading = Some(self.heading());
        self.height_wish_m = self.config.height_m;
        self.seed_level();
        self.enter(now, Phase::TakeOff);
        self.say("taking off");
    }
}
