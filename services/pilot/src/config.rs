//! The pilot's configuration.

use control::{
    ClimbConfig, HeadingConfig, HeightConfig, HoldConfig, LiftoffConfig, MotionConfig, Policy, RangeError,
    ShieldConfig, TouchDownConfig, VelocityConfig,
};
use runtime::{ConfigError, Validate, within};

/// Everything that may be set; see `deploy/config/pilot.toml`.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PilotConfig {
    /// Height of take-off and hover above the floor, metres.
    pub height_m: f32,
    /// Greatest height that is ever flown, metres: under the lintels of doors with the mast.
    pub max_height_m: f32,
    /// Least height that is asked for in flight, metres, or `height_m` where that is less: no sonar looks at what stands
    /// under and beside the drone when it comes down among desks.
    pub min_height_m: f32,
    /// Least distance kept to what is below in flight, metres.
    pub min_clearance_m: f32,
    /// Channels are not to be flown this long after they were made, seconds.
    pub expiry_s: f32,
    /// Take-off.
    pub take_off: TakeOffConfig,
    /// A stop that nobody answers lands the drone after this, seconds.
    pub stop_lands_s: f32,
    /// Landing.
    pub landing: LandingConfig,
    /// Flight by hand.
    pub manual: ManualConfig,
    /// Lift-off.
    pub liftoff: LiftoffConfig,
    /// Touch-down.
    pub touch_down: TouchDownConfig,
    /// Height estimator.
    pub height: HeightConfig,
    /// Height loop.
    pub climb: ClimbConfig,
    /// Velocity loop.
    pub velocity: VelocityConfig,
    /// Position loop.
    pub hold: HoldConfig,
    /// Heading loop.
    pub heading: HeadingConfig,
    /// Prediction between poses.
    pub motion: MotionConfig,
    /// Shield.
    pub shield: ShieldConfig,
    /// Failsafe table.
    pub failsafe: Policy,
}

/// Take-off.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TakeOffConfig {
    /// Longest wait for the controller to arm, seconds.
    pub arming_s: f32,
    /// Least volts a cell to start with.
    pub cell_volts: f32,
    /// First guess of the hover throttle, microseconds; 0 works it out from mass and motors.
    pub hover_us: f32,
    /// Climb from the ground, m/s.
    pub climb_m_s: f32,
}

/// Landing.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LandingConfig {
    /// Descent, m/s.
    pub descent_m_s: f32,
    /// Descent near the ground, m/s.
    pub slow_m_s: f32,
    /// Clearance under which the descent is slow, metres.
    pub slow_below_m: f32,
    /// Farthest from the place of landing at which it goes on down, metres.
    pub aside_m: f32,
    /// Longest wait for coming so near, and longest way to where floor was seen, seconds.
    pub patience_s: f32,
    /// Who cannot choose the place lands where floor was seen on the way, not farther than this, metres; 0: where it is.
    pub farthest_floor_m: f32,
}

/// Flight by hand.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ManualConfig {
    /// Speed at full deflection, m/s; never more than the vehicle's cruise.
    pub speed_m_s: f32,
    /// Climb and descent at full deflection, m/s.
    pub climb_m_s: f32,
    /// Turn at full deflection, degrees a second.
    pub turn_deg_s: f32,
    /// A stick so near to its middle is neutral.
    pub neutral: f32,
}

impl Default for ManualConfig {
    /// The pace of the rounds; a turn that moves no sonar's cone by more than its width between two of its pings; and the
    /// play of a worn gamepad's sticks.
    fn default() -> Self {
        Self { speed_m_s: 0.5, climb_m_s: 0.3, turn_deg_s: 45.0, neutral: 0.08 }
    }
}

impl Default for PilotConfig {
    fn default() -> Self {
        Self {
            height_m: 1.2,
            max_height_m: 1.6,
            min_height_m: 0.9,
            min_clearance_m: 0.3,
            expiry_s: 0.12,
            stop_lands_s: 30.0,
            take_off: TakeOffConfig::default(),
            manual: ManualConfig::default(),
            landing: LandingConfig::default(),
            liftoff: LiftoffConfig::default(),
            touch_down: TouchDownConfig::default(),
            height: HeightConfig::default(),
            climb: ClimbConfig::default(),
            velocity: VelocityConfig::default(),
            hold: HoldConfig::default(),
            heading: HeadingConfig::default(),
            motion: MotionConfig::default(),
            shield: ShieldConfig::default(),
            failsafe: Policy::default(),
        }
    }
}

impl Default for TakeOffConfig {
    fn default() -> Self {
        // The controller's boot grace is 5 s and its status comes five times a second (FACTS 1); arming itself
        // takes 0.3 s of switch low and 135 ms.
        Self { arming_s: 3.0, cell_volts: 3.6, hover_us: 0.0, climb_m_s: 0.4 }
    }
}

impl Default for LandingConfig {
    fn default() -> Self {
        Self {
            descent_m_s: 0.35,
            slow_m_s: 0.2,
            slow_below_m: 0.4,
            aside_m: 0.2,
            patience_s: 8.0,
            farthest_floor_m: 2.0,
        }
    }
}

impl PilotConfig {
    /// The same, flown at the vehicle's own height where it has one.
    ///
    /// # Errors
    /// The vehicle wants to be flown higher than is ever flown here.
    pub(crate) fn at_height(self, height_m: Option<f32>) -> Result<Self, ConfigError> {
        let Some(height_m) = height_m else { return Ok(self) };
        within("the vehicle's limits.height_m", f64::from(height_m), 0.5..=f64::from(self.max_height_m))?;
        Ok(Self { height_m, ..self })
    }
}

/// A range error of the control library as the runtime reports it.
fn named(error: &RangeError) -> ConfigError {
    ConfigError::range(error.field, error.value, format!("{}..={}", error.low, error.high))
}

impl Validate for PilotConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        let f = f64::from;
        within("max_height_m", f(self.max_height_m), 0.8..=2.5)?;
        within("height_m", f(self.height_m), 0.5..=f(self.max_height_m))?;
        within("min_height_m", f(self.min_height_m), 0.3..=1.5)?;
        within("min_clearance_m", f(self.min_clearance_m), 0.1..=0.6)?;
        // flight's ladder calls channels stale after 100 ms at the earliest, at the latest it must see it.
        within("expiry_s", f(self.expiry_s), 0.06..=0.2)?;
        within("stop_lands_s", f(self.stop_lands_s), 5.0..=300.0)?;
        within("manual.speed_m_s", f(self.manual.speed_m_s), 0.1..=1.0)?;
        within("manual.climb_m_s", f(self.manual.climb_m_s), 0.05..=0.5)?;
        within("manual.turn_deg_s", f(self.manual.turn_deg_s), 5.0..=90.0)?;
        within("manual.neutral", f(self.manual.neutral), 0.02..=0.3)?;
        within("take_off.arming_s", f(self.take_off.arming_s), 1.0..=15.0)?;
        within("take_off.cell_volts", f(self.take_off.cell_volts), 3.3..=4.1)?;
        if self.take_off.hover_us != 0.0 {
            within("take_off.hover_us", f(self.take_off.hover_us), 1120.0..=1800.0)?;
        }
        within("take_off.climb_m_s", f(self.take_off.climb_m_s), 0.1..=0.8)?;
        within("landing.descent_m_s", f(self.landing.descent_m_s), 0.15..=0.5)?;
        within("landing.slow_m_s", f(self.landing.slow_m_s), 0.1..=0.35)?;
        within("landing.slow_below_m", f(self.landing.slow_below_m), 0.2..=0.8)?;
        within("landing.aside_m", f(self.landing.aside_m), 0.05..=0.5)?;
        within("landing.patience_s", f(self.landing.patience_s), 1.0..=30.0)?;
        within("landing.farthest_floor_m", f(self.landing.farthest_floor_m), 0.0..=4.0)?;
        self.liftoff
            .validate()
            .and_then(|()| self.touch_down.validate())
            .and_then(|()| self.height.validate())
            .and_then(|()| self.climb.validate())
            .and_then(|()| self.velocity.validate())
            .and_then(|()| self.hold.validate())
            .and_then(|()| self.heading.validate())
            .and_then(|()| self.motion.validate())
            .and_then(|()| self.shield.validate())
            .and_then(|()| self.failsafe.validate())
            .map_err(|error| named(&error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use runtime::parse_config;

    #[test]
    fn the_file_that_is_shipped_says_the_defaults() {
        let text = include_str!("../../../deploy/config/pilot.toml");
        let shipped: PilotConfig = parse_config("pilot.toml", text).unwrap();
        assert_eq!(shipped, PilotConfig::default());
    }

    #[test]
    fn a_vehicle_that_has_a_height_is_flown_at_it_under_the_ceiling() {
        assert_eq!(PilotConfig::default().at_height(Some(0.8)).unwrap().height_m, 0.8);
        assert_eq!(PilotConfig::default().at_height(None).unwrap(), PilotConfig::default());
        let error = PilotConfig::default().at_height(Some(2.0)).unwrap_err().to_string();
        assert!(error.contains("limits.height_m = 2") && error.contains("0.5..=1.6"), "{error}");
    }

    #[test]
    fn each_time_of_the_failsafe_table_is_the_key_that_it_names() {
        let usual = PilotConfig::default().failsafe;
        let set = |key: &str, seconds: f32| {
            parse_config::<PilotConfig>("pilot.toml", &format!("[failsafe]\n{key} = {seconds:?}"))
                .unwrap()
                .failsafe
        };
        let mut moved = 0;
        for row in control::TABLE.iter().filter(|row| !row.after.key.is_empty()) {
            let seconds = 1.05 * (row.after.seconds)(&usual);
            assert_eq!((row.after.seconds)(&set(row.after.key, seconds)), seconds, "{}", row.after.key);
            moved += 1;
        }
        for condition in control::Condition::ALL {
            if let Some((seconds, key)) = condition.clear(&usual) {
                assert_eq!(condition.clear(&set(key, 1.05 * seconds)), Some((1.05 * seconds, key)));
                moved += 1;
            }
        }
        assert!(moved > 30, "{moved}");
    }

    #[test]
    fn what_is_done_of_a_lost_operator_is_one_of_three_words() {
        for lost in [control::OperatorLost::Hold, control::OperatorLost::Return, control::OperatorLost::Land]
        {
            let text = format!("[failsafe]\noperator_lost = \"{}\"", lost.word());
            assert_eq!(
                parse_config::<PilotConfig>("pilot.toml", &text).unwrap().failsafe.operator_lost,
                lost
            );
        }
        let error =
            parse_config::<PilotConfig>("pilot.toml", "[failsafe]\noperator_lost = \"hope\"").unwrap_err();
        assert!(error.to_string().contains("hold"), "{error}");
    }

    #[test]
    fn unknown_keys_and_bad_ranges_are_refused_by_name() {
        let error = parse_config::<PilotConfig>("pilot.toml", "[velocity]\nmax_tilt_deg = 40.0").unwrap_err();
        let error = error.to_string();
        assert!(
            error.contains("pilot.toml: velocity.max_tilt_deg = 40") && error.contains("3..=15"),
            "{error}"
        );
        let error = parse_config::<PilotConfig>("pilot.toml", "heigth_m = 1.2").unwrap_err().to_string();
        assert!(error.contains("heigth_m"), "{error}");
        assert!(parse_config::<PilotConfig>("pilot.toml", "height_m = 1.9").is_err());
    }
}
