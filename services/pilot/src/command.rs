//! What the operator asks for, and why it may be refused.

use crate::core::PilotCore;
use crate::manual::Holder;
use crate::senses::age_s;
use control::{Action, Cause, SpoolUp};
use core::fmt::Write;
use ipc_types::{Answer, Command, LinkState, Phase, PilotState, Text, Verb};

/// A side sonar that has not answered for so long keeps the drone on the ground, seconds. Two pings lost in a row happen;
/// in flight they close the sectors for a moment.
const SIDES_S: f32 = 1.0;

/// What is said of motors that an order has cut.
pub(crate) const CUT: &str = "motors cut: the operator's order; the drone falls";

/// Why an order is refused, and what is said of one that is obeyed.
pub(crate) type Ruling = Result<&'static str, Text<96>>;

pub(crate) fn refused(why: &str) -> Ruling {
    Err(Text::new(why))
}

/// The last command that was heard, and what became of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heard {
    pub(crate) sequence: u32,
    pub(crate) stamp_ns: u64,
    pub(crate) answer: Answer,
    pub(crate) text: Text<96>,
}

impl Default for Heard {
    fn default() -> Self {
        Self { sequence: 0, stamp_ns: 0, answer: Answer::None, text: Text::default() }
    }
}

impl Heard {
    /// What was heard before a restart.
    pub(crate) fn before(now: u64, state: &PilotState) -> Self {
        Self {
            sequence: state.command_sequence,
            // A time that has not come yet would shut out every later order.
            stamp_ns: state.command_ns.min(now),
            answer: u8::try_from(state.answer).ok().and_then(Answer::from_code).unwrap_or(Answer::None),
            text: state.answer_text,
        }
    }
}

impl PilotCore {
    /// Obeys a command, once and in time; says why not when it is refused. One that has expired or was overtaken by
    /// a newer one is counted and not answered: whoever gave it no longer waits.
    pub fn command(&mut self, now: u64, message: &Command) {
        let Some(verb) = u8::try_from(message.verb).ok().and_then(Verb::from_code) else {
            self.refused += 1;
            return;
        };
        if message.command_sequence == self.heard.sequence {
            return;
        }
        if !message.counts(now, self.heard.stamp_ns) {
            self.refused += 1;
            return;
        }
        let (answer, text) = match self.obey(now, message, verb) {
            Ok(sentence) => (Answer::Accepted, Text::new(sentence)),
            Err(sentence) => (Answer::Refused, sentence),
        };
        self.heard =
            Heard { sequence: message.command_sequence, stamp_ns: message.header.stamp_ns, answer, text };
        // Why the drone comes down matters more than what was asked of it meanwhile.
        if self.phase != Phase::EmergencyLanding {
            self.text = text;
        }
        self.changed = true;
    }

    fn obey(&mut self, now: u64, command: &Command, verb: Verb) -> Ruling {
        let ruling = self.rule(now, command, verb);
        if ruling.is_ok() {
            self.by_hand.lost_ns = None;
            if verb != Verb::Stop {
                self.stop_lands_ns = None;
            }
            // Whoever orders the drone to stand or to come down takes it out of the holder's hand.
            if matches!(verb, Verb::Hold | Verb::Land | Verb::Stop | Verb::Cut) {
                self.by_hand.lease.revoke();
            }
        }
        ruling
    }

    fn rule(&mut self, now: u64, command: &Command, verb: Verb) -> Ruling {
        let returning = self.airborne()
            && (self.judged.action, self.judged.cause) == (Action::Return, Cause::BatteryReturn);
        let holder = self.by_hand.lease.holder().copied();
        match (verb, self.phase) {
            (Verb::AutomaticOff, _) => Ok(self.automatic_off(now)),
            (Verb::AutomaticOn, _) => Ok(self.automatic_on()),
            (_, Phase::Cut) => refused("refused: the motors were cut"),
            (Verb::SticksTake, _) => self.take_sticks(now, command),
            (Verb::SticksRelease, _) => self.release_sticks(now, command),
            (Verb::Cut, Phase::Grounded) => refused("refused: the motors are off"),
            (Verb::Cut, _) => Ok(self.cut(now)),
            (Verb::Stop | Verb::Hold | Verb::Land, Phase::Grounded) if holder.is_some() => {
                Ok("the sticks are nobody's: on the ground")
            }
            (Verb::Stop, Phase::Grounded) => refused("refused: on the ground"),
            (Verb::Stop, Phase::Arming) => Ok(self.call_off(now)),
            (Verb::Stop, Phase::EmergencyLanding) => refused("refused: emergency landing"),
            (Verb::Stop, _) => Ok(self.stop(now)),
            // Who holds the sticks takes off by them; everything else would fly beside him.
            (
                Verb::TakeOff
                | Verb::GoTo
                | Verb::PatrolStart
                | Verb::PatrolPause
                | Verb::PatrolStop
                | Verb::Home,
                _,
            ) if holder.is_some_and(|his| verb != Verb::TakeOff || his != Holder::of(command)) => {
                holder.as_ref().map_or(refused("refused: a human holds the sticks"), Self::held_by)
            }
            (Verb::GoTo | Verb::PatrolStart, _) if !self.automatic => {
                refused("refused: the automatic is switched off")
            }
            // The table's answer is more severe than these wishes; to come down at once remains free.
            (Verb::Hold | Verb::GoTo | Verb::PatrolStart | Verb::PatrolPause, _) if returning => {
                refused("refused: returning home, the battery does not last for more")
            }
            (Verb::TakeOff, Phase::Grounded) => self.try_take_off(now, Phase::Hover),
            (
                Verb::TakeOff,
                Phase::Arming
                | Phase::TakeOff
                | Phase::Hover
                | Phase::Autonomous
                | Phase::Manual
                | Phase::Landing
                | Phase::EmergencyLanding,
            ) => refused("refused: already flying"),
            (Verb::GoTo | Verb::PatrolStart | Verb::Home, Phase::Grounded) => {
                self.try_take_off(now, Phase::Autonomous)
            }
            (Verb::PatrolPause | Verb::PatrolStop, Phase::Grounded) => refused("refused: not flying"),
            (
                Verb::GoTo | Verb::PatrolStart | Verb::Home | Verb::PatrolStop,
                Phase::Arming | Phase::TakeOff,
            ) => {
                self.after_take_off = Phase::Autonomous;
                Ok("following navigation after the take-off")
            }
            // Navigation keeps the round and wishes to stand, or there is no round and the take-off ends in a hover.
            (Verb::PatrolPause, Phase::Arming | Phase::TakeOff) => Ok("hovering after the take-off"),
            (
                Verb::GoTo | Verb::PatrolStart | Verb::PatrolPause | Verb::PatrolStop | Verb::Home,
                Phase::Hover | Phase::Autonomous,
            ) => {
                if self.phase == Phase::Hover {
                    self.enter(now, Phase::Autonomous);
                }
                Ok("following navigation")
            }
            (
                Verb::GoTo | Verb::PatrolStart | Verb::PatrolPause | Verb::PatrolStop | Verb::Home,
                Phase::Manual,
            ) => refused("refused: a human holds the sticks"),
            (
                Verb::GoTo | Verb::PatrolStart | Verb::PatrolPause | Verb::PatrolStop | Verb::Home,
                Phase::Landing | Phase::EmergencyLanding,
            ) => refused("refused: landing"),
            (Verb::Land | Verb::Hold, Phase::Grounded) => refused("refused: on the ground"),
            (Verb::Land | Verb::Hold, Phase::Arming) => Ok(self.call_off(now)),
            (Verb::Land, Phase::TakeOff) if self.spool.is_some() => Ok(self.call_off(now)),
            (Verb::Land, Phase::EmergencyLanding) => Ok("landing already"),
            (
                Verb::Land,
                Phase::TakeOff | Phase::Hover | Phase::Autonomous | Phase::Manual | Phase::Landing,
            ) => {
                self.operator_land = true;
                self.land(now, None);
                Ok("landing: the operator's order")
            }
            (Verb::Hold, Phase::TakeOff) => {
                self.after_take_off = Phase::Hover;
                Ok("hovering after the take-off")
            }
            (Verb::Hold, Phase::EmergencyLanding) => refused("refused: emergency landing"),
            (Verb::Hold, Phase::Hover | Phase::Autonomous | Phase::Manual | Phase::Landing) => {
                self.stand_still(now);
                Ok("holding: the operator's order")
            }
        }
    }

    /// Starts to arm, or says in a sentence why not.
    pub(crate) fn try_take_off(&mut self, now: u64, then: Phase) -> Ruling {
        let mut sentence = Text::<96>::default();
        if self.why_not(now, &mut sentence) {
            return Err(sentence);
        }
        self.after_take_off = then;
        self.operator_land = false;
        self.enter(now, Phase::Arming);
        Ok("arming")
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
        } else if !self.place_known() && !self.searching() {
            out.write_str("refused: the drone does not know where it is")
        } else if self.judged.no_arming != Cause::None {
            write!(out, "refused: a failsafe holds: {}", self.judged.no_arming.words())
        } else {
            return false;
        };
        true
    }

    pub(crate) fn call_off(&mut self, now: u64) -> &'static str {
        let why = "take-off called off";
        self.give_up(now, why);
        why
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::PilotConfig;
    use crate::core::Craft;
    use ipc_types::COMMAND_LIFE_NS;

    const SECOND: u64 = 1_000_000_000;

    fn core() -> PilotCore {
        let craft = Craft {
            radius_m: 0.225,
            sides: Vec::new(),
            has_down: true,
            rest_m: 0.05,
            beam_rest_m: 0.05,
            hover_us: 1500.0,
            cells: 3,
            capacity_mah: 3700.0,
            cruise_m_s: 0.5,
            max_tilt_rad: 0.2,
        };
        PilotCore::new(PilotConfig::default(), craft, None)
    }

    fn order(verb: Verb, sequence: u32, given_ns: u64) -> Command {
        let mut command = Command {
            expiry_ns: given_ns + COMMAND_LIFE_NS,
            verb: verb.code().into(),
            command_sequence: sequence,
            ..Command::default()
        };
        command.header.stamp_ns = given_ns;
        command
    }

    fn state(core: &PilotCore) -> PilotState {
        let mut state = PilotState::default();
        core.write_state(&mut state);
        state
    }

    #[test]
    fn every_order_is_answered_in_every_phase() {
        for &verb in Verb::ALL {
            for &phase in Phase::ALL {
                let mut core = core();
                core.phase = phase;
                core.say("from before");
                core.command(SECOND, &order(verb, 7, SECOND));
                let state = state(&core);
                let text = state.answer_text;
                assert_eq!((state.command_sequence, state.command_ns), (7, SECOND), "{verb} in {phase}");
                let refused = state.answer == u32::from(Answer::Refused.code());
                assert!(refused || state.answer == u32::from(Answer::Accepted.code()), "{verb} in {phase}");
                assert_eq!(text.as_str().starts_with("refused: "), refused, "{verb} in {phase}: {text}");
                assert!(
                    !text.as_str().is_empty() && text.as_str() != "from before",
                    "{verb} in {phase}: {text}"
                );
            }
        }
    }

    /// One operator orders, another orders something else later, and the pilot is restarted: both orders are still in
    /// the history of their senders' channels.
    #[test]
    fn what_was_overtaken_or_has_expired_is_not_obeyed_after_a_restart() {
        let (first, second) = (order(Verb::Home, 100, 10 * SECOND), order(Verb::Hold, 200, 10 * SECOND + 1));
        let mut before = core();
        before.phase = Phase::Hover;
        before.command(10 * SECOND, &first);
        assert_eq!(before.phase, Phase::Autonomous);
        before.command(10 * SECOND + 1, &second);
        assert_eq!(before.phase, Phase::Hover);

        for history in [[&first, &second], [&second, &first]] {
            let mut after = core();
            after.resume(11 * SECOND, &state(&before));
            after.phase = Phase::Hover;
            for command in history {
                after.command(11 * SECOND, command);
            }
            assert_eq!((after.phase, after.heard.sequence), (Phase::Hover, 200));
        }
        // A pilot without any memory obeys what is fresh, and nothing else.
        let mut blank = core();
        blank.phase = Phase::Hover;
        blank.command(12 * SECOND, &first);
        assert_eq!((blank.phase, blank.refused), (Phase::Hover, 1));
        blank.command(12 * SECOND - 1, &first);
        assert_eq!(blank.phase, Phase::Autonomous);
    }

    #[test]
    fn a_time_that_has_not_come_shuts_nobody_out() {
        let mut core = core();
        core.resume(SECOND, &PilotState { command_ns: u64::MAX, ..PilotState::default() });
        core.phase = Phase::Autonomous;
        core.command(2 * SECOND, &order(Verb::Land, 3, 2 * SECOND));
        assert_eq!(core.phase, Phase::Landing);
    }
}
