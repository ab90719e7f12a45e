//! Orders that stand: a stop that waits for an answer, the automatic switched off, a cut.

use crate::command::CUT;
use crate::core::PilotCore;
use control::Action;
use ipc_types::{Phase, nanoseconds};

impl PilotCore {
    /// Brakes and hovers. Who is not asked anything for long enough lands: [`Self::answer_stop`].
    pub(crate) fn stop(&mut self, now: u64) -> &'static str {
        let wait_ns = nanoseconds(f64::from(self.config.stop_lands_s));
        self.stop_lands_ns = Some(now.saturating_add(wait_ns));
        if self.phase == Phase::TakeOff {
            self.after_take_off = Phase::Hover;
            return "stopping after the take-off: lands if nobody orders anything else";
        }
        self.stand_still(now);
        "stopping: lands if nobody orders anything else"
    }

    /// Wishes nothing any more: the drone brakes, and holds the place where it comes to a stop.
    pub(crate) fn stand_still(&mut self, now: u64) {
        self.operator_land = false;
        self.hold = None;
        self.hold_heading = None;
        self.enter(now, Phase::Hover);
    }

    /// Lands when nobody has answered a stop.
    pub(crate) fn answer_stop(&mut self, now: u64) {
        if self.stop_lands_ns.is_some_and(|at| now >= at) {
            self.operator_land = true;
            self.land(now, None);
            self.say("landing: nobody ordered anything after the stop");
        }
    }

    /// Stops the motors at once.
    pub(crate) fn cut(&mut self, now: u64) -> &'static str {
        self.spool = None;
        self.operator_land = false;
        self.stop_lands_ns = None;
        self.cut_ordered = true;
        self.enter(now, Phase::Cut);
        CUT
    }

    /// Nothing automatic begins any more, and what flies holds; a failsafe goes on.
    pub(crate) fn automatic_off(&mut self, now: u64) -> &'static str {
        self.automatic = false;
        if self.judged.action != Action::Return {
            match self.phase {
                Phase::Autonomous => self.stand_still(now),
                Phase::Arming | Phase::TakeOff => self.after_take_off = Phase::Hover,
                _ => {}
            }
        }
        "the automatic is off"
    }

    /// The automatic may move the drone again; nothing begins by itself.
    pub(crate) fn automatic_on(&mut self) -> &'static str {
        self.automatic = true;
        "the automatic is on"
    }
}
