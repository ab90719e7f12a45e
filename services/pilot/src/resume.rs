//! Going on after a restart in the air.

use crate::command::{CUT, Heard};
use crate::core::PilotCore;
use crate::report::{action_of, cause_of};
use control::{Cause, Failsafe, Lease, SpoolUp, Tilt, Vector, stick};
use ipc_types::{Phase, PilotState};

/// A climb is reckoned on for at most so long, seconds: a restart takes a tenth of it.
const LONGEST_AWAY_S: f64 = 0.5;

impl PilotCore {
    /// Goes on from the last state that the pilot published before it died. `now` is the time of the first
    /// step. A state that makes no sense is not used.
    pub fn resume(&mut self, now: u64, state: &PilotState) {
        let Some(phase) = Phase::from_code(state.phase) else {
            self.refused += 1;
            return;
        };
        self.heard = Heard::before(now, state);
        // Whoever held the sticks holds them no longer, and the number of his lease does not come again.
        self.by_hand.lease = Lease::after(state.lease);
        self.automatic = state.automatic != 0;
        if (1120.0..=1800.0).contains(&state.hover_throttle_us) {
            self.climb.set_hover(state.hover_throttle_us);
        }
        if phase == Phase::Grounded || (state.arm == 0 && phase != Phase::Cut) {
            return;
        }
        // What only the ground ends is not called back by a restart.
        let (cause, action) = (cause_of(state.cause), action_of(state.action));
        self.failsafe = Failsafe::resumed(cause, action, state.failsafe_since_ns.min(now));
        self.judged = self.failsafe.judged();
        if phase == Phase::Cut {
            self.enter(now, phase);
            self.cut_ordered = cause == Cause::Operator;
            self.say(if self.cut_ordered { CUT } else { "motors cut: tilted over" });
            return;
        }
        let trim = |us: f32| if us.is_finite() { stick::angle_of(us).clamp(-0.087, 0.087) } else { 0.0 };
        self.trim = Tilt { roll: trim(state.level_roll_us), pitch: trim(state.level_pitch_us) };
        self.velocity.set_learned(Vector::new(state.disturbance_x_m_s2, state.disturbance_y_m_s2));
        self.hold_heading = state.hold_heading_rad.is_finite().then_some(state.hold_heading_rad);
        self.hold = Vector::new(state.hold_x_m, state.hold_y_m).known();
        self.operator_land = cause == Cause::Operator;
        let longest_ns = ipc_types::nanoseconds(f64::from(self.config.stop_lands_s));
        self.stop_lands_ns =
            Some(state.stop_lands_ns).filter(|at| *at > 0).map(|at| at.min(now.saturating_add(longest_ns)));
        self.last_step_ns = Some(now);
        // It went on climbing meanwhile.
        let age_s = ipc_types::seconds_between(state.header.stamp_ns, now).clamp(0.0, LONGEST_AWAY_S) as f32;
        self.height.set(now, state.height_m + state.climb_m_s * age_s, state.climb_m_s, state.surface_m);
        self.climb.set_throttle(self.climb.hover_us());
        self.hover_known = true;
        let flying = state.on_ground == 0;
        match phase {
            Phase::TakeOff if !flying => {
                // Between idle and hover, within one step: lifted or not, this carries most of the weight.
                let mut spool = SpoolUp::new(self.config.liftoff, self.climb.hover_us());
                spool.resume();
                self.spool = Some(spool);
                self.enter(now, Phase::TakeOff);
            }
            Phase::Manual => {
                // Nothing resumes by itself after manual control.
                self.hold = None;
                let height_m = state.height_m.max(self.config.min_height_m);
                self.height_wish_m = height_m.min(self.config.max_height_m);
                self.enter(now, Phase::Hover);
            }
            _ => self.enter(now, phase),
        }
        self.phase_since_ns = now;
        self.resumed = true;
        // A round goes on when navigation says so; until its first setpoint the drone hovers.
        self.say("took over after a restart");
    }
}
