//! The failsafe table of DESIGN 4: a pure function of for how long what has been wrong.

use crate::check::{RangeError, within};

/// What a failsafe does, from mild to severe: the order decides which one wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Action {
    /// Nothing.
    None = 0,
    /// Stop and hover.
    Hover = 1,
    /// Fly home and land.
    Return = 2,
    /// Land here.
    Land = 3,
    /// Come down level without position control.
    Descend = 4,
    /// Stop the motors.
    Cut = 5,
}

impl Action {
    /// From mild to severe.
    pub const ALL: &'static [Self] =
        &[Self::None, Self::Hover, Self::Return, Self::Land, Self::Descend, Self::Cut];
}

/// Causes, from mild to severe: between equal actions the higher one is named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Cause {
    /// None.
    None = 0,
    /// Navigation fell silent.
    NavigationSilent = 1,
    /// A side sonar is silent; the shield has closed its sectors.
    SideSonarSilent = 2,
    /// The pose is stale, or P(lost) or sigma too large.
    PoseUncertain = 3,
    /// All side sonars are silent.
    AllSonarsSilent = 4,
    /// The way home is just covered, a cell is low, or nobody knows.
    BatteryReturn = 5,
    /// A cell is nearly empty.
    BatteryLand = 6,
    /// The pose stayed uncertain too long, or too few walls answer.
    Lost = 7,
    /// The down sonar is silent.
    HeightUnknown = 8,
    /// The flight controller's link is down.
    LinkDown = 9,
    /// Tilted over.
    Tilt = 10,
    /// The operator ordered it.
    Operator = 11,
}

impl Cause {
    /// Its bit in [`Judgement::causes`].
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self as u8
    }
}

/// For how long what has been so, in seconds; 0 when it is not so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evidence {
    /// The motors run and the skids are off the ground: on the ground nothing is a failsafe.
    pub airborne: bool,
    /// The phase follows navigation.
    pub autonomous: bool,
    /// No setpoint of navigation that has not expired.
    pub navigation_silent_s: f32,
    /// At least one side sonar has given nothing for two of its turns.
    pub side_sonar_silent_s: f32,
    /// Every side sonar has given nothing for two of its turns.
    pub all_sonars_silent_s: f32,
    /// The pose is stale, not tracked, or beyond the policy's P(lost) or sigma.
    pub pose_uncertain_s: f32,
    /// Localization has been searching the plan for the drone since it is in the air.
    pub searching_s: f32,
    /// The pose is uncertain *and* fewer than two walls answer.
    pub few_walls_s: f32,
    /// The pose is uncertain *and* nothing holds the velocity: a hover would drift.
    pub adrift_s: f32,
    /// What is left in the battery does not cover the way home and the reserve.
    pub home_uncovered_s: f32,
    /// Nobody can tell what is left in the battery.
    pub charge_unknown_s: f32,
    /// A cell is under the return voltage.
    pub cell_low_s: f32,
    /// A cell is under the landing voltage.
    pub cell_empty_s: f32,
    /// No believable echo of the down sonar.
    pub height_silent_s: f32,
    /// The flight controller has not answered.
    pub link_silent_s: f32,
    /// Tilted beyond the policy's angle.
    pub tilt_s: f32,
    /// The operator's standing order, or [`Action::None`].
    pub operator: Option<Action>,
}

/// The numbers of the table.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Policy {
    /// Navigation silent, beyond the expiry of its last setpoint: hover.
    pub navigation_hover_s: f32,
    /// Navigation silent: land.
    pub navigation_land_s: f32,
    /// P(lost) above which the pose is uncertain.
    pub p_lost: f32,
    /// Standard deviation of the position above which the pose is uncertain, metres.
    pub sigma_m: f32,
    /// Age above which a pose is stale.
    pub pose_stale_s: f32,
    /// Pose uncertain: stop and hover.
    pub pose_hover_s: f32,
    /// Pose uncertain: come down.
    pub pose_land_s: f32,
    /// The place on the plan was looked for in vain: come down.
    pub search_land_s: f32,
    /// Pose uncertain and fewer than two walls in echo: come down.
    pub walls_land_s: f32,
    /// Pose uncertain and adrift: come down.
    pub drift_land_s: f32,
    /// All side sonars silent: stop.
    pub sonars_hover_s: f32,
    /// All side sonars silent: land.
    pub sonars_land_s: f32,
    /// Age above which what was heard of the battery is stale.
    pub power_stale_s: f32,
    /// Charge unknown: return.
    pub power_return_s: f32,
    /// Volts a cell under which to return.
    pub return_volts: f32,
    /// For how long under `return_volts`.
    pub return_s: f32,
    /// Volts a cell under which to land here.
    pub land_volts: f32,
    /// For how long under `land_volts`.
    pub land_s: f32,
    /// Charge wanted beyond what the way home takes, as a share of it.
    pub home_reserve: f32,
    /// Down sonar silent: hold the learned throttle.
    pub height_hold_s: f32,
    /// Down sonar silent: descend.
    pub height_descend_s: f32,
    /// Flight controller silent: stop.
    pub link_hover_s: f32,
    /// Flight controller silent: land.
    pub link_land_s: f32,
    /// Tilt at which the motors are cut, degrees.
    pub tilt_deg: f32,
    /// For how long beyond `tilt_deg`.
    pub tilt_s: f32,
}

impl Default for Policy {
    /// DESIGN 4. Where it names no number: navigation, which restarts in well under a second, hovers at once
    /// and lands after a minute; the controller's link hovers after 1 s and lands after 5 s. The battery is told of
    /// twice a second: four messages in a row are not lost by chance; a charge that nobody knows is given as long to
    /// come back as a low cell.
    fn default() -> Self {
        Self {
            navigation_hover_s: 0.1,
            navigation_land_s: 60.0,
            p_lost: 0.05,
            sigma_m: 0.5,
            pose_stale_s: 0.3,
            pose_hover_s: 1.0,
            pose_land_s: 20.0,
            search_land_s: 120.0,
            walls_land_s: 5.0,
            drift_land_s: 1.5,
            sonars_hover_s: 0.5,
            sonars_land_s: 5.0,
            power_stale_s: 2.0,
            power_return_s: 10.0,
            return_volts: 3.5,
            return_s: 10.0,
            land_volts: 3.3,
            land_s: 2.0,
            home_reserve: 0.25,
            height_hold_s: 0.3,
            height_descend_s: 1.0,
            link_hover_s: 1.0,
            link_land_s: 5.0,
            tilt_deg: 60.0,
            tilt_s: 0.3,
        }
    }
}

impl Policy {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("failsafe.navigation_hover_s", self.navigation_hover_s, 0.0, 2.0)?;
        within("failsafe.navigation_land_s", self.navigation_land_s, 5.0, 600.0)?;
        within("failsafe.p_lost", self.p_lost, 0.001, 0.5)?;
        within("failsafe.sigma_m", self.sigma_m, 0.1, 2.0)?;
        within("failsafe.pose_stale_s", self.pose_stale_s, 0.1, 2.0)?;
        within("failsafe.pose_hover_s", self.pose_hover_s, 0.1, 5.0)?;
        within("failsafe.pose_land_s", self.pose_land_s, 2.0, 120.0)?;
        within("failsafe.search_land_s", self.search_land_s, 10.0, 300.0)?;
        within("failsafe.walls_land_s", self.walls_land_s, 1.0, 60.0)?;
        within("failsafe.drift_land_s", self.drift_land_s, 0.5, 60.0)?;
        within("failsafe.sonars_hover_s", self.sonars_hover_s, 0.1, 2.0)?;
        within("failsafe.sonars_land_s", self.sonars_land_s, 1.0, 30.0)?;
        within("failsafe.power_stale_s", self.power_stale_s, 1.0, 10.0)?;
        within("failsafe.power_return_s", self.power_return_s, 1.0, 60.0)?;
        within("failsafe.return_volts", self.return_volts, 3.2, 4.0)?;
        within("failsafe.return_s", self.return_s, 1.0, 60.0)?;
        within("failsafe.land_volts", self.land_volts, 3.0, self.return_volts)?;
        within("failsafe.land_s", self.land_s, 0.5, 20.0)?;
        within("failsafe.home_reserve", self.home_reserve, 0.1, 2.0)?;
        within("failsafe.height_hold_s", self.height_hold_s, 0.1, 1.0)?;
        within("failsafe.height_descend_s", self.height_descend_s, self.height_hold_s, 5.0)?;
        within("failsafe.link_hover_s", self.link_hover_s, 0.3, 5.0)?;
        within("failsafe.link_land_s", self.link_land_s, self.link_hover_s, 60.0)?;
        within("failsafe.tilt_deg", self.tilt_deg, 40.0, 80.0)?;
        within("failsafe.tilt_s", self.tilt_s, 0.1, 1.0)
    }
}

/// What the table says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Judgement {
    /// Causes that hold, as [`Cause::bit`]s, whether they act or not.
    pub causes: u32,
    /// The one that acts.
    pub cause: Cause,
    /// What it does.
    pub action: Action,
}

/// One row of the table: a cause that has lasted this long does this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Why.
    pub cause: Cause,
    /// How long it must have lasted, seconds.
    pub after_s: f32,
    /// How long it has lasted.
    pub lasted_s: f32,
    /// What is done.
    pub action: Action,
    /// What has to be so, in words.
    pub what: &'static str,
}

/// The table, with what `e` says about each row. Its order means nothing: the most severe wins.
#[must_use]
pub fn table(e: &Evidence, p: &Policy) -> [Row; 22] {
    let navigation = if e.autonomous { e.navigation_silent_s } else { 0.0 };
    let row = |cause, lasted_s, after_s, action, what| Row { cause, after_s, lasted_s, action, what };
    let ordered = e.operator.unwrap_or(Action::None);
    let order_s = if e.operator.is_some() { 1.0 } else { 0.0 };
    [
        row(Cause::NavigationSilent, navigation, p.navigation_hover_s, Action::Hover, "no fresh setpoint"),
        row(Cause::NavigationSilent, navigation, p.navigation_land_s, Action::Land, "no fresh setpoint"),
        row(Cause::SideSonarSilent, e.side_sonar_silent_s, 0.0, Action::None, "a side sonar is silent"),
        row(Cause::PoseUncertain, e.pose_uncertain_s, p.pose_hover_s, Action::Hover, "pose uncertain"),
        row(Cause::Lost, e.pose_uncertain_s, p.pose_land_s, Action::Descend, "pose uncertain"),
        row(Cause::Lost, e.searching_s, p.search_land_s, Action::Descend, "place searched for in vain"),
        row(
            Cause::Lost,
            e.few_walls_s,
            p.walls_land_s,
            Action::Descend,
            "pose uncertain and under two walls",
        ),
        row(Cause::Lost, e.adrift_s, p.drift_land_s, Action::Descend, "pose uncertain and velocity adrift"),
        row(
            Cause::AllSonarsSilent,
            e.all_sonars_silent_s,
            p.sonars_hover_s,
            Action::Hover,
            "all sonars silent",
        ),
        row(
            Cause::AllSonarsSilent,
            e.all_sonars_silent_s,
            p.sonars_land_s,
            Action::Land,
            "all sonars silent",
        ),
        row(
            Cause::BatteryReturn,
            e.home_uncovered_s,
            3.0,
            Action::Return,
            "way home and reserve not covered",
        ),
        row(Cause::BatteryReturn, e.charge_unknown_s, p.power_return_s, Action::Return, "charge unknown"),
        row(Cause::BatteryReturn, e.cell_low_s, p.return_s, Action::Return, "cell under the return voltage"),
        row(Cause::BatteryLand, e.cell_empty_s, p.land_s, Action::Land, "cell under the landing voltage"),
        row(Cause::HeightUnknown, e.height_silent_s, p.height_hold_s, Action::Hover, "down sonar silent"),
        row(
            Cause::HeightUnknown,
            e.height_silent_s,
            p.height_descend_s,
            Action::Descend,
            "down sonar silent",
        ),
        row(Cause::LinkDown, e.link_silent_s, p.link_hover_s, Action::Hover, "controller silent"),
        row(Cause::LinkDown, e.link_silent_s, p.link_land_s, Action::Land, "controller silent"),
        row(Cause::Tilt, e.tilt_s, p.tilt_s, Action::Cut, "tilted over"),
        row(Cause::Operator, order_s, 0.0, ordered, "the operator's order"),
        // A second failure takes away what the first one's answer relies on.
        row(
            Cause::Lost,
            e.pose_uncertain_s.min(e.all_sonars_silent_s),
            p.sonars_land_s,
            Action::Descend,
            "pose uncertain and all sonars silent",
        ),
        row(
            Cause::LinkDown,
            e.link_silent_s.min(e.pose_uncertain_s),
            p.link_land_s,
            Action::Descend,
            "controller silent and pose uncertain",
        ),
    ]
}

/// Judges the evidence: of all rows that hold, the most severe action, and of those the most severe cause.
///
/// On the ground nothing acts. The judgement is monotone: what lasts longer never makes it milder.
#[must_use]
pub fn judge(evidence: &Evidence, policy: &Policy) -> Judgement {
    let mut judged = Judgement { causes: 0, cause: Cause::None, action: Action::None };
    if !evidence.airborne {
        return judged;
    }
    for row in table(evidence, policy) {
        // Not a number is "for ever": what cannot be measured is not taken for good.
        let lasted = if row.lasted_s.is_nan() { f32::INFINITY } else { row.lasted_s };
        if lasted <= 0.0 || lasted < row.after_s {
            continue;
        }
        judged.causes |= row.cause.bit();
        if (row.action, row.cause) > (judged.action, judged.cause) {
            judged.action = row.action;
            judged.cause = row.cause;
        }
    }
    judged
}
