//! The numbers of the table, and their bounds.

use crate::check::{RangeError, within};

/// What is done when who held the sticks has lost them by his silence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OperatorLost {
    /// Hover until somebody takes over or orders something.
    #[default]
    Hold,
    /// Fly home and land.
    Return,
    /// Land here.
    Land,
}

impl OperatorLost {
    /// The word that the configuration uses.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Return => "return",
            Self::Land => "land",
        }
    }
}

/// The numbers of the table.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Policy {
    /// Navigation silent, beyond the expiry of its last setpoint: hover.
    pub navigation_hover_s: f32,
    /// Navigation silent: land.
    pub navigation_land_s: f32,
    /// Who holds the sticks silent: hover.
    pub operator_hover_s: f32,
    /// Who holds the sticks silent: he holds them no longer, and `operator_lost` is done.
    pub operator_lease_s: f32,
    /// What is done when who held the sticks has lost them by his silence.
    pub operator_lost: OperatorLost,
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
    /// The place on the plan was searched for in vain: come down.
    pub search_land_s: f32,
    /// Pose uncertain and fewer than two walls in echo: come down.
    pub walls_land_s: f32,
    /// Pose uncertain and adrift: come down.
    pub drift_land_s: f32,
    /// All side sonars silent: stop.
    pub sonars_hover_s: f32,
    /// All side sonars silent: land.
    pub sonars_land_s: f32,
    /// The way home and the reserve not covered: return.
    pub home_return_s: f32,
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
    /// Age above which the word of `flight` is stale, and so the controller silent.
    pub link_stale_s: f32,
    /// Flight controller silent: stop.
    pub link_hover_s: f32,
    /// Flight controller silent: land.
    pub link_land_s: f32,
    /// Tilt at which the motors are cut, degrees.
    pub tilt_deg: f32,
    /// For how long beyond `tilt_deg`.
    pub tilt_s: f32,
    /// What comes and goes with single messages has gone after so long without it.
    pub clear_s: f32,
    /// The same of the charge and the voltage: volts jump under load.
    pub battery_clear_s: f32,
    /// The same of the controller's link.
    pub link_clear_s: f32,
    /// The same of the tilt.
    pub tilt_clear_s: f32,
}

impl Default for Policy {
    /// DESIGN 4. Where it names no number: navigation, which restarts in well under a second, hovers at once
    /// and lands after a minute; the controller's link hovers after 1 s and lands after 5 s. The battery is told of
    /// twice a second: four messages in a row are not lost by chance; a charge that nobody knows is given as long to
    /// come back as a low cell; one that no longer covers the way home is looked at for three seconds, since the current
    /// jumps in gusts. A lost operator is a hover: nothing resumes by itself after manual control, and the battery brings it
    /// home in time. A condition has gone after half a second without it, in which even the battery, the slowest, is told of
    /// again; after three seconds for the charge and low volts, which recover while the load is low; after one message of
    /// the five a second for the link; after two attitudes for the tilt.
    fn default() -> Self {
        Self {
            navigation_hover_s: 0.1,
            navigation_land_s: 60.0,
            operator_hover_s: 0.25,
            operator_lease_s: 1.0,
            operator_lost: OperatorLost::Hold,
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
            home_return_s: 3.0,
            power_stale_s: 2.0,
            power_return_s: 10.0,
            return_volts: 3.5,
            return_s: 10.0,
            land_volts: 3.3,
            land_s: 2.0,
            home_reserve: 0.25,
            height_hold_s: 0.3,
            height_descend_s: 1.0,
            link_stale_s: 1.0,
            link_hover_s: 1.0,
            link_land_s: 5.0,
            tilt_deg: 60.0,
            tilt_s: 0.3,
            clear_s: 0.5,
            battery_clear_s: 3.0,
            link_clear_s: 0.2,
            tilt_clear_s: 0.05,
        }
    }
}

impl Policy {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("failsafe.navigation_hover_s", self.navigation_hover_s, 0.0, 2.0)?;
        within("failsafe.navigation_land_s", self.navigation_land_s, 5.0, 600.0)?;
        within("failsafe.operator_hover_s", self.operator_hover_s, 0.1, 1.0)?;
        within("failsafe.operator_lease_s", self.operator_lease_s, self.operator_hover_s, 5.0)?;
        within("failsafe.p_lost", self.p_lost, 0.001, 0.5)?;
        within("failsafe.sigma_m", self.sigma_m, 0.1, 2.0)?;
        within("failsafe.pose_stale_s", self.pose_stale_s, 0.1, 2.0)?;
        within("failsafe.pose_hover_s", self.pose_hover_s, 0.1, 5.0)?;
        within("failsafe.pose_land_s", self.pose_land_s, self.pose_hover_s.max(2.0), 120.0)?;
        within("failsafe.search_land_s", self.search_land_s, 10.0, 300.0)?;
        within("failsafe.walls_land_s", self.walls_land_s, 1.0, 60.0)?;
        within("failsafe.drift_land_s", self.drift_land_s, 0.5, 60.0)?;
        within("failsafe.sonars_hover_s", self.sonars_hover_s, 0.1, 2.0)?;
        within("failsafe.sonars_land_s", self.sonars_land_s, self.sonars_hover_s.max(1.0), 30.0)?;
        within("failsafe.home_return_s", self.home_return_s, 0.5, 30.0)?;
        within("failsafe.power_stale_s", self.power_stale_s, 1.0, 10.0)?;
        within("failsafe.power_return_s", self.power_return_s, 1.0, 60.0)?;
        within("failsafe.return_volts", self.return_volts, 3.2, 4.0)?;
        within("failsafe.return_s", self.return_s, 1.0, 60.0)?;
        within("failsafe.land_volts", self.land_volts, 3.0, self.return_volts)?;
        within("failsafe.land_s", self.land_s, 0.5, 20.0)?;
        within("failsafe.home_reserve", self.home_reserve, 0.1, 2.0)?;
        within("failsafe.height_hold_s", self.height_hold_s, 0.1, 1.0)?;
        within("failsafe.height_descend_s", self.height_descend_s, self.height_hold_s, 5.0)?;
        within("failsafe.link_stale_s", self.link_stale_s, 0.3, 3.0)?;
        within("failsafe.link_hover_s", self.link_hover_s, 0.3, 5.0)?;
        within("failsafe.link_land_s", self.link_land_s, self.link_hover_s, 60.0)?;
        within("failsafe.tilt_deg", self.tilt_deg, 40.0, 80.0)?;
        within("failsafe.tilt_s", self.tilt_s, 0.1, 1.0)?;
        within("failsafe.clear_s", self.clear_s, 0.1, 3.0)?;
        within("failsafe.battery_clear_s", self.battery_clear_s, 0.5, 30.0)?;
        within("failsafe.link_clear_s", self.link_clear_s, 0.0, 3.0)?;
        within("failsafe.tilt_clear_s", self.tilt_clear_s, 0.0, 0.5)
    }
}
