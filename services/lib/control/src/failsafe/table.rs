//! The rows.

use super::condition::{Condition, Evidence};
use super::policy::{OperatorLost, Policy};
use super::{Action, Cause, TakeOver};

/// When a row that has acted stops acting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clears {
    /// When one of its conditions has gone: after [`Condition::clear`].
    Gone,
    /// On the ground with the motors off, whatever has become of its conditions. A human who takes the sticks, where
    /// [`TakeOver`] lets him, ends it too.
    Landed,
}

/// A time of the policy.
#[derive(Clone, Copy, Debug)]
pub struct After {
    /// Its key in the `[failsafe]` part of the pilot's configuration; empty for "at once".
    pub key: &'static str,
    /// Its value, seconds.
    pub seconds: fn(&Policy) -> f32,
}

/// One row of the table: conditions that have held together for so long do this.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Why.
    pub cause: Cause,
    /// What has to be so, all of it.
    pub conditions: &'static [Condition],
    /// How long all of them must have lasted.
    pub after: After,
    /// What is done.
    pub action: Action,
    /// When that ends.
    pub clears: Clears,
    /// Whether a human may take the sticks meanwhile.
    pub take_over: TakeOver,
    /// The row stands only when the policy says this of a lost operator.
    pub only: Option<OperatorLost>,
}

impl Row {
    /// How long its conditions have held together, seconds.
    #[must_use]
    pub fn lasted_s(&self, evidence: &Evidence) -> f32 {
        self.conditions.iter().map(|condition| evidence.lasted_s(*condition)).fold(f32::INFINITY, f32::min)
    }

    /// Whether they have held for long enough.
    #[must_use]
    pub fn holds(&self, evidence: &Evidence, policy: &Policy) -> bool {
        let lasted_s = self.lasted_s(evidence);
        let stands = self.only.is_none_or(|answer| answer == policy.operator_lost);
        stands && lasted_s > 0.0 && lasted_s >= (self.after.seconds)(policy)
    }
}

const AT_ONCE: After = After { key: "", seconds: |_| 0.0 };

/// A row that ends with its conditions.
const fn row(
    cause: Cause,
    conditions: &'static [Condition],
    after: After,
    action: Action,
    take_over: TakeOver,
) -> Row {
    Row { cause, conditions, after, action, clears: Clears::Gone, take_over, only: None }
}

/// A row that only the ground ends.
const fn kept(
    cause: Cause,
    conditions: &'static [Condition],
    after: After,
    action: Action,
    take_over: TakeOver,
) -> Row {
    Row { clears: Clears::Landed, ..row(cause, conditions, after, action, take_over) }
}

/// A row that stands when the policy answers a lost operator so.
const fn only(answer: OperatorLost, row: Row) -> Row {
    Row { only: Some(answer), ..row }
}

macro_rules! after {
    ($key:ident) => {
        After { key: stringify!($key), seconds: |policy| policy.$key }
    };
}

/// The table. Its order means nothing: the most severe wins.
///
/// What a landing began for is not asked again on the way down, and a battery does not fill up in the air: those rows are
/// kept. A human may fly where all he needs still works: height, velocity, a sonar for the shield, the controller's link.
#[rustfmt::skip]
pub const TABLE: &[Row] = {
    use Action as A;
    use Cause as C;
    use Condition as If;
    use TakeOver::{AfterStop, No, Yes};
    &[
        row(C::NavigationSilent, &[If::NavigationSilent], after!(navigation_hover_s), A::Hover, Yes),
        kept(C::NavigationSilent, &[If::NavigationSilent], after!(navigation_land_s), A::Land, AfterStop),
        // While the lease lasts his own sticks, heard again, are followed on.
        row(C::OperatorSilent, &[If::OperatorSilent], after!(operator_hover_s), A::Hover, Yes),
        // Nothing resumes by itself after manual control: it stands until somebody says what next.
        only(OperatorLost::Hold,
            row(C::OperatorSilent, &[If::OperatorSilent], after!(operator_lease_s), A::Hover, Yes)),
        only(OperatorLost::Return,
            row(C::OperatorSilent, &[If::OperatorSilent], after!(operator_lease_s), A::Return, Yes)),
        only(OperatorLost::Land,
            kept(C::OperatorSilent, &[If::OperatorSilent], after!(operator_lease_s), A::Land, AfterStop)),
        row(C::SideSonarSilent, &[If::SideSonarSilent], AT_ONCE, A::None, Yes),
        row(C::PoseUncertain, &[If::PoseUncertain], after!(pose_hover_s), A::Hover, AfterStop),
        kept(C::Lost, &[If::PoseUncertain], after!(pose_land_s), A::Descend, AfterStop),
        kept(C::Lost, &[If::Searching], after!(search_land_s), A::Descend, AfterStop),
        // Sticks ask for a velocity, and nothing measures it.
        kept(C::Lost, &[If::FewWalls], after!(walls_land_s), A::Descend, No),
        kept(C::Lost, &[If::Adrift], after!(drift_land_s), A::Descend, No),
        // The shield lets nothing through where no sonar looks.
        row(C::AllSonarsSilent, &[If::AllSonarsSilent], after!(sonars_hover_s), A::Hover, No),
        kept(C::AllSonarsSilent, &[If::AllSonarsSilent], after!(sonars_land_s), A::Land, No),
        kept(C::BatteryReturn, &[If::HomeUncovered], after!(home_return_s), A::Return, AfterStop),
        row(C::BatteryReturn, &[If::ChargeUnknown], after!(power_return_s), A::Return, AfterStop),
        kept(C::BatteryReturn, &[If::CellLow], after!(return_s), A::Return, AfterStop),
        kept(C::BatteryLand, &[If::CellEmpty], after!(land_s), A::Land, No),
        row(C::HeightUnknown, &[If::HeightSilent], after!(height_hold_s), A::Hover, No),
        kept(C::HeightUnknown, &[If::HeightSilent], after!(height_descend_s), A::Descend, No),
        row(C::LinkDown, &[If::LinkSilent], after!(link_hover_s), A::Hover, No),
        kept(C::LinkDown, &[If::LinkSilent], after!(link_land_s), A::Land, No),
        kept(C::Tilt, &[If::TiltedOver], after!(tilt_s), A::Cut, No),
        row(C::Operator, &[If::LandOrdered], AT_ONCE, A::Land, Yes),
        // A second failure takes away what the first one's answer relies on.
        kept(C::Lost, &[If::PoseUncertain, If::AllSonarsSilent], after!(sonars_land_s), A::Descend, No),
        kept(C::LinkDown, &[If::LinkSilent, If::PoseUncertain], after!(link_land_s), A::Descend, No),
    ]
};

/// One bit a row fits the memory of the judgements.
const _: () = assert!(TABLE.len() <= u32::BITS as usize);
