//! What is said: the sentence for people, and messages for when there is little to say.

use crate::config::NavigationConfig;
use crate::core::Core;
use crate::mission::{Goal, Intent};
use crate::steer::Steer;
use core::fmt::Write;
use ipc_types::{Answer, PatrolState, Polar, Setpoint, SetpointKind, SteeringReason, Text, nanoseconds};

impl Core {
    /// Says in one sentence what is being done and why.
    pub(crate) fn say(&mut self, intent: Intent, seeing: bool) {
        let mut text = Text::<128>::default();
        let state = self.mission.state();
        let journey = &self.journey;
        // What does not fit is cut at the end, where it matters least.
        let _ = match (state, intent) {
            (PatrolState::Idle, _) => write!(text, "waiting for a command"),
            (PatrolState::Done, _) => write!(text, "the round is flown and the drone has landed"),
            (PatrolState::Failed, _) => write!(text, "gave up: {}", journey.trouble()),
            (PatrolState::Paused, _) => write!(text, "paused: waiting for the operator"),
            (PatrolState::Landing, Intent::Land(_)) => write!(text, "landing on the pad"),
            (PatrolState::Landing, _) => write!(text, "coming to rest over the pad"),
            (_, Intent::Follow) if !seeing => write!(text, "standing: no fresh pose or ranges"),
            (_, Intent::Follow) => {
                let _ = match self.mission.goal() {
                    Goal::There((x, y)) => write!(text, "flying to {x:.1}, {y:.1}"),
                    Goal::Home => write!(text, "flying home"),
                    _ => journey.write_errand(&mut text),
                };
                self.write_steering(&mut text)
            }
            _ if self.courtesy.staying() => write!(text, "letting somebody pass"),
            _ if !journey.planned() => write!(text, "working out the route"),
            _ if !self.mission.airborne() => write!(text, "ready: waiting for the take-off"),
            _ => write!(text, "standing: the pilot is flying on its own"),
        };
        self.text = text;
    }

    /// Answers the last command in one sentence; `why` if it is refused.
    pub(crate) fn say_answer(&mut self, why: &str) {
        let mut text = Text::default();
        // What does not fit is cut at the end, where it matters least.
        let _ = match self.mission.heard().answer {
            Answer::None => Ok(()),
            Answer::Working => write!(text, "working out the route"),
            Answer::Accepted => write!(text, "{}", self.mission.state()),
            Answer::Refused => write!(text, "refused: {why}"),
        };
        self.answer = text;
    }

    fn write_steering(&self, text: &mut Text<128>) -> core::fmt::Result {
        if self.blockage.waiting() {
            write!(text, ": something stands in the way, waiting for it to move on")
        } else {
            Ok(())
        }
    }
}

/// Standing where it is, at the height of the round.
pub(crate) fn blank_setpoint(now: u64, config: &NavigationConfig) -> Setpoint {
    Setpoint {
        expiry_ns: now.saturating_add(nanoseconds(f64::from(config.expiry_s))),
        heading_rad: f32::NAN,
        height_m: config.height_m,
        hold_x_m: f32::NAN,
        hold_y_m: f32::NAN,
        kind: u32::from(SetpointKind::Hover.code()),
        ..Setpoint::default()
    }
}

/// Fills what the histogram did not; without a decision everything.
pub(crate) fn write_polar(polar: &mut Polar, steer: Option<(&Steer, bool)>) {
    polar.reserved = 0;
    let Some((steer, seeing)) = steer else {
        polar.raw.fill(0.0);
        polar.smoothed.fill(0.0);
        polar.blocked.fill(0);
        (polar.threshold_high, polar.threshold_low) = (f32::NAN, f32::NAN);
        (polar.target_rad, polar.chosen_rad, polar.speed_m_s) = (f32::NAN, f32::NAN, 0.0);
        (polar.valley_first, polar.valley_last) = (255, 255);
        polar.reason = SteeringReason::Blind.code();
        return;
    };
    polar.threshold_high = steer.decision.threshold_high;
    polar.threshold_low = steer.decision.threshold_low;
    polar.target_rad = steer.target;
    polar.chosen_rad = steer.direction;
    polar.speed_m_s = steer.velocity.0.hypot(steer.velocity.1);
    (polar.valley_first, polar.valley_last) = steer.decision.valley.unwrap_or((255, 255));
    polar.reason = if seeing { steer.reason } else { SteeringReason::Blind }.code();
}
