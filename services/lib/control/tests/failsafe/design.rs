//! DESIGN 4 written down a second time, without the table: what the tests compare with.

use control::{Action, Cause, Condition, OperatorLost, Stage};

/// Conditions that hold, one bit each, all of them for the same time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrong {
    pub(crate) flags: u32,
    pub(crate) lasted_s: f32,
}

impl Wrong {
    fn held(self, condition: Condition, seconds: f32) -> bool {
        self.flags & (1 << condition as u32) != 0 && self.lasted_s >= seconds
    }

    /// What is done and why, and whether a human is locked out.
    pub(crate) fn answer(self, stage: Stage, lost: OperatorLost) -> (Action, Cause, bool) {
        if matches!(stage, Stage::Grounded | Stage::Armed) {
            return (Action::None, Cause::None, false);
        }
        // "Side sonars: all silent 0.5 s: stop; 5 s: land."
        let blind = self.held(Condition::AllSonarsSilent, 0.5);
        // "Down sonar silent 0.3 s: hold learned throttle; 1 s: descend."
        let no_height = self.held(Condition::HeightSilent, 0.3);
        let no_link = self.held(Condition::LinkSilent, 1.0);
        // "3.3 V for 2 s: land here."
        let empty = self.held(Condition::CellEmpty, 2.0);
        // "Tilt over 60 degrees for 0.3 s: cut."
        let tilted = self.held(Condition::TiltedOver, 0.3);
        // "fewer than two walls in echo: land", and nothing that would hold a hover.
        let drifts = self.held(Condition::FewWalls, 5.0) || self.held(Condition::Adrift, 1.5);
        let locked_out = blind || no_height || no_link || empty || tilted || drifts;
        let (action, cause) = self.most_severe(stage, lost, drifts);
        (action, cause, locked_out)
    }

    fn most_severe(self, stage: Stage, lost: OperatorLost, drifts: bool) -> (Action, Cause) {
        let held = |condition, seconds| self.held(condition, seconds);
        if held(Condition::TiltedOver, 0.3) {
            return (Action::Cut, Cause::Tilt);
        }
        // From here on, of each action, the most severe cause first.
        if held(Condition::LinkSilent, 5.0) && held(Condition::PoseUncertain, 5.0) {
            return (Action::Descend, Cause::LinkDown);
        }
        if held(Condition::HeightSilent, 1.0) {
            return (Action::Descend, Cause::HeightUnknown);
        }
        let blind = held(Condition::PoseUncertain, 5.0) && held(Condition::AllSonarsSilent, 5.0);
        // "P(lost) > 5 % or sigma > 0.5 m ...: 20 s ... land."
        // A place that was searched for in vain for two minutes is not found by a third.
        let in_vain = held(Condition::Searching, 120.0);
        if blind || drifts || in_vain || held(Condition::PoseUncertain, 20.0) {
            return (Action::Descend, Cause::Lost);
        }
        if held(Condition::LandOrdered, 0.0) {
            return (Action::Land, Cause::Operator);
        }
        if held(Condition::LinkSilent, 5.0) {
            return (Action::Land, Cause::LinkDown);
        }
        if held(Condition::CellEmpty, 2.0) {
            return (Action::Land, Cause::BatteryLand);
        }
        if held(Condition::AllSonarsSilent, 5.0) {
            return (Action::Land, Cause::AllSonarsSilent);
        }
        // "Operator link lost while manual: 250 ms hover, 1 s lease dropped, then hold, return or land by policy."
        let lease_lost = held(Condition::OperatorSilent, 1.0);
        if lease_lost && lost == OperatorLost::Land {
            return (Action::Land, Cause::OperatorSilent);
        }
        let follows = stage == Stage::Autonomous;
        if follows && held(Condition::NavigationSilent, 60.0) {
            return (Action::Land, Cause::NavigationSilent);
        }
        // "Battery: return when what is left no longer covers the way home; 3.5 V a cell for 10 s: return."
        if held(Condition::HomeUncovered, 3.0)
            || held(Condition::ChargeUnknown, 10.0)
            || held(Condition::CellLow, 10.0)
        {
            return (Action::Return, Cause::BatteryReturn);
        }
        if lease_lost && lost == OperatorLost::Return {
            return (Action::Return, Cause::OperatorSilent);
        }
        if held(Condition::LinkSilent, 1.0) {
            return (Action::Hover, Cause::LinkDown);
        }
        if held(Condition::HeightSilent, 0.3) {
            return (Action::Hover, Cause::HeightUnknown);
        }
        if held(Condition::AllSonarsSilent, 0.5) {
            return (Action::Hover, Cause::AllSonarsSilent);
        }
        // "... for 1 s: stop and hover on sonar."
        if held(Condition::PoseUncertain, 1.0) {
            return (Action::Hover, Cause::PoseUncertain);
        }
        if held(Condition::OperatorSilent, 0.25) {
            return (Action::Hover, Cause::OperatorSilent);
        }
        if follows && held(Condition::NavigationSilent, 0.1) {
            return (Action::Hover, Cause::NavigationSilent);
        }
        // "A side sonar silent two of its turns: its sectors close": that is the shield's to do.
        if held(Condition::SideSonarSilent, 0.0) {
            return (Action::None, Cause::SideSonarSilent);
        }
        (Action::None, Cause::None)
    }
}

/// From when on a condition that has lasted keeps a drone on the ground, seconds.
pub(crate) fn grounds_after_s(condition: Condition) -> Option<f32> {
    match condition {
        Condition::AllSonarsSilent => Some(0.5),
        Condition::PoseUncertain | Condition::LinkSilent => Some(1.0),
        Condition::FewWalls => Some(5.0),
        Condition::Searching => Some(120.0),
        Condition::Adrift => Some(1.5),
        Condition::HomeUncovered => Some(3.0),
        Condition::ChargeUnknown | Condition::CellLow => Some(10.0),
        Condition::CellEmpty => Some(2.0),
        Condition::HeightSilent | Condition::TiltedOver => Some(0.3),
        Condition::NavigationSilent
        | Condition::OperatorSilent
        | Condition::SideSonarSilent
        | Condition::LandOrdered => None,
    }
}

/// From when on a condition that has lasted locks a human out, seconds.
pub(crate) fn locks_out_after_s(condition: Condition) -> Option<f32> {
    match condition {
        Condition::AllSonarsSilent => Some(0.5),
        Condition::LinkSilent => Some(1.0),
        Condition::FewWalls => Some(5.0),
        Condition::Adrift => Some(1.5),
        Condition::CellEmpty => Some(2.0),
        Condition::HeightSilent | Condition::TiltedOver => Some(0.3),
        _ => None,
    }
}
