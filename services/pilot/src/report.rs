//! What the pilot says: channels and state.

use crate::core::PilotCore;
use control::{Action, Cause, Hand, Loss, stick};
use ipc_types::{Channels, FailsafeAction, FailsafeCause, Phase, PilotState, SticksState, Text, nanoseconds};

/// Channels that are filled: four sticks, AUX1 (arm), AUX2 (angle).
const CHANNELS: usize = 6;

/// The message's word for an action.
pub(crate) fn action(action: Action) -> FailsafeAction {
    match action {
        Action::None => FailsafeAction::None,
        Action::Hover => FailsafeAction::Hover,
        Action::Return => FailsafeAction::Return,
        Action::Land => FailsafeAction::Land,
        Action::Descend => FailsafeAction::Descend,
        Action::Cut => FailsafeAction::Cut,
    }
}

/// The message's word for a cause.
pub(crate) fn cause(cause: Cause) -> FailsafeCause {
    match cause {
        Cause::None => FailsafeCause::None,
        Cause::NavigationSilent => FailsafeCause::NavigationSilent,
        Cause::OperatorSilent => FailsafeCause::OperatorSilent,
        Cause::SideSonarSilent => FailsafeCause::SideSonarSilent,
        Cause::PoseUncertain => FailsafeCause::PoseUncertain,
        Cause::AllSonarsSilent => FailsafeCause::AllSonarsSilent,
        Cause::BatteryReturn => FailsafeCause::BatteryReturn,
        Cause::BatteryLand => FailsafeCause::BatteryLand,
        Cause::Lost => FailsafeCause::Lost,
        Cause::HeightUnknown => FailsafeCause::HeightUnknown,
        Cause::LinkDown => FailsafeCause::LinkDown,
        Cause::Tilt => FailsafeCause::Tilt,
        Cause::Operator => FailsafeCause::Operator,
    }
}

/// The message's word for how far a human has the drone in hand.
pub(crate) fn sticks_state(hand: Hand) -> SticksState {
    match hand {
        Hand::Free => SticksState::Free,
        Hand::Stopping => SticksState::Stopping,
        Hand::AwaitingNeutral => SticksState::AwaitingNeutral,
        Hand::Ready => SticksState::Ready,
        Hand::Following => SticksState::Following,
        Hand::Silent => SticksState::Silent,
    }
}

/// The table's word for a message's action; none for what no version writes.
pub(crate) fn action_of(code: u8) -> Action {
    Action::ALL.iter().copied().find(|a| action(*a).code() == code).unwrap_or(Action::None)
}

/// The table's word for a message's cause; none for what no version writes.
pub(crate) fn cause_of(code: u8) -> Cause {
    Cause::ALL.iter().copied().find(|c| cause(*c).code() == code).unwrap_or(Cause::None)
}

impl PilotCore {
    /// The throttle that holds the drone now: the learned one, less what thrust does more than it should (more
    /// right after a take-off than one that was learned only in part).
    fn holding_us(&self) -> f32 {
        // While others fly, the bias is that of their throttle.
        self.climb.balancing_us(if self.frozen { 0.0 } else { self.height.bias_m_s2() })
    }

    /// Writes the channels of the last step, every field but the header.
    pub fn write_channels(&self, now: u64, out: &mut Channels) {
        let d = &self.decided;
        let mut us = [1000u16; 18];
        us[0] = stick::channel(d.roll_us, 1500);
        us[1] = stick::channel(d.pitch_us, 1500);
        us[2] = stick::channel(d.throttle_us, 1000);
        us[3] = stick::channel(d.yaw_us, 1500);
        us[4] = if d.arm { 2000 } else { 1000 };
        us[5] = 2000;
        // Never later than the wish that they were made from.
        out.expiry_ns = now.saturating_add(nanoseconds(f64::from(self.config.expiry_s))).min(d.expiry_ns);
        out.channels_us = us;
        out.count = CHANNELS as u16;
        out.source = d.source.code();
        out.arm = u8::from(d.arm);
        out.level_roll_us = stick::of_angle(self.trim.roll);
        out.level_pitch_us = stick::of_angle(self.trim.pitch);
        out.hover_throttle_us = if self.hover_known { self.holding_us() } else { f32::NAN };
        let height_known =
            !self.airborne() || self.height.silent_s(now) < self.config.failsafe.height_descend_s;
        out.height_m = if height_known { self.height.height_m() } else { f32::NAN };
        out.climb_m_s = self.height.climb_m_s();
        out.on_ground = u16::from(!self.airborne());
        out.prompt = u16::from(self.by_hand.prompt);
    }

    /// Writes the state, every field but the header.
    pub fn write_state(&self, out: &mut PilotState) {
        let nowhere = f32::NAN;
        let if_lost = |loss| action(self.failsafe.if_lost(loss, &self.config.failsafe)).code();
        out.phase_since_ns = self.phase_since_ns;
        out.failsafe_since_ns = self.failsafe.since_ns();
        out.causes = self.judged.causes;
        out.command_ns = self.heard.stamp_ns;
        out.command_sequence = self.heard.sequence;
        out.answer = u32::from(self.heard.answer.code());
        out.answer_text = self.heard.text;
        out.phase = self.phase.code();
        out.cause = cause(self.judged.cause).code();
        out.action = action(self.judged.action).code();
        out.if_pose_lost = if_lost(Loss::Pose);
        out.if_operator_lost = if_lost(Loss::OperatorLink);
        out.if_height_lost = if_lost(Loss::Height);
        out.if_sonars_lost = if_lost(Loss::SideSonars);
        out.if_navigation_lost = if_lost(Loss::Navigation);
        out.if_controller_lost = if_lost(Loss::Controller);
        out.if_charge_lost = if_lost(Loss::Charge);
        out.on_ground = u8::from(!self.airborne());
        out.arm = u8::from(self.decided.arm);
        out.hover_throttle_us = if self.hover_known { self.holding_us() } else { nowhere };
        out.level_roll_us = stick::of_angle(self.trim.roll);
        out.level_pitch_us = stick::of_angle(self.trim.pitch);
        out.height_m = self.height.height_m();
        out.climb_m_s = self.height.climb_m_s();
        out.surface_m = self.height.surface_m();
        let disturbance = self.velocity.learned();
        out.disturbance_x_m_s2 = disturbance.x;
        out.disturbance_y_m_s2 = disturbance.y;
        out.hold_x_m = self.hold.map_or(nowhere, |hold| hold.x);
        out.hold_y_m = self.hold.map_or(nowhere, |hold| hold.y);
        out.hold_heading_rad = self.hold_heading.unwrap_or(nowhere);
        out.shield_speed_m_s = self.decided.shield_speed_m_s;
        self.write_hand(out);
        out.text = self.text;
    }

    /// Who holds the sticks, and what was ordered of them.
    fn write_hand(&self, out: &mut PilotState) {
        let lease = &self.by_hand.lease;
        let holder = lease.holder();
        out.lease = lease.number();
        out.holder = holder.map_or_else(Text::default, |holder| holder.account);
        out.holder_socket = holder.map_or(0, |holder| holder.socket);
        out.sticks = sticks_state(lease.hand()).code();
        let age_s = self.last_step_ns.and_then(|now| lease.age_s(now));
        out.sticks_age_ms = age_s.map_or(f32::NAN, |age_s| age_s * 1000.0);
        out.automatic = u8::from(self.automatic);
        out.stop_lands_ns = self.stop_lands_ns.unwrap_or(0);
        if self.phase == Phase::Cut && self.cut_ordered {
            out.cause = FailsafeCause::Operator.code();
            out.action = FailsafeAction::Cut.code();
        }
    }

    /// Whether the state has changed in a way that must be known at once; asking clears it.
    pub fn take_changed(&mut self) -> bool {
        core::mem::take(&mut self.changed)
    }

    /// One sentence for `sereno ps`.
    pub fn write_status(&self, out: &mut Text<96>) {
        use core::fmt::Write;
        // What does not fit is cut.
        let _ = match (self.phase, self.judged.action) {
            (Phase::Grounded, _) => write!(out, "{}: {}", self.phase, self.text),
            (_, Action::None) => write!(out, "{} at {:.2} m", self.phase, self.height.height_m()),
            (_, what) => write!(
                out,
                "{} at {:.2} m, {}: {}",
                self.phase,
                self.height.height_m(),
                cause(self.judged.cause),
                action(what)
            ),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_codes_of_messages_and_table_agree() {
        for &a in Action::ALL {
            assert_eq!((action(a).code(), action(a).word()), (a as u8, a.word()));
        }
        assert_eq!(Action::ALL.len(), FailsafeAction::ALL.len());
        for (code, &c) in Cause::ALL.iter().enumerate() {
            assert_eq!((usize::from(cause(c).code()), cause(c).word()), (code, c.words()));
            assert_eq!(c.bit(), 1 << code);
            assert_eq!(cause_of(c as u8), c);
        }
        assert_eq!(Cause::ALL.len(), FailsafeCause::ALL.len());
        assert_eq!(cause_of(200), Cause::None);
        assert_eq!((action_of(Action::Cut as u8), action_of(200)), (Action::Cut, Action::None));
    }
}
