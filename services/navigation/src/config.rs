//! What an installer may change about navigation.

use avoid::GridRules;
use core::fmt;
use core::str::FromStr;
use runtime::{ConfigError, Validate, within};
use serde::Deserialize;

/// How obstacles are avoided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Our Vector Field Histogram: cells widened by the airframe, certainty that fades, hysteresis.
    #[default]
    Vfh,
    /// The thesis's Vector Field Histogram with its grid (`docs/thesis-avoidance.md`).
    Thesis,
    /// A potential field (`docs/potential-fields.md`).
    Potential,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Vfh, Self::Thesis, Self::Potential];

    /// As it stands in the configuration and on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vfh => "vfh",
            Self::Thesis => "thesis",
            Self::Potential => "potential",
        }
    }

    /// How certainty grows and fades: the thesis's grid comes with its histogram.
    #[must_use]
    pub fn grid_rules(self) -> GridRules {
        match self {
            Self::Vfh | Self::Potential => GridRules::default(),
            Self::Thesis => GridRules::thesis(),
        }
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Method {
    type Err = String;

    /// The allowed ones, when it is none of them.
    fn from_str(word: &str) -> Result<Self, String> {
        Self::ALL
            .into_iter()
            .find(|method| method.name() == word)
            .ok_or_else(|| Self::ALL.map(Self::name).join(", "))
    }
}

/// `config/navigation.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NavigationConfig {
    /// How obstacles are avoided.
    pub avoid: Method,
    /// Height of the round above the floor, metres.
    pub height_m: f32,
    /// Speed in free space, metres a second; 0: the vehicle's own cruise.
    pub cruise_m_s: f32,
    /// Speed where the plan leaves the least clearance (doors), metres a second.
    pub door_m_s: f32,
    /// Fastest turn of the wished heading, radians a second.
    pub turn_rad_s: f32,
    /// The heading sweeps to either side by this, degrees, in this time there and back, seconds: eight cones leave
    /// gaps between them that are to be looked into.
    pub scan_deg: f32,
    /// See `scan_deg`.
    pub scan_s: f32,
    /// How far ahead on the route the drone aims, metres.
    pub look_ahead_m: f32,
    /// Clearance of the plan below which the planned path is followed rather than a valley, metres.
    pub narrow_m: f32,
    /// Free way kept between the airframe and what stands ahead, metres.
    pub stop_gap_m: f32,
    /// How long to wait for what blocks the way to move on, seconds.
    pub wait_s: f32,
    /// Without progress along the route for this long the way counts as blocked, seconds.
    pub stuck_s: f32,
    /// Routes tried to one place before it is left out.
    pub tries: u32,
    /// Over the pad means nearer than this, metres.
    pub pad_m: f32,
    /// Setpoints may be flown for this long, seconds.
    pub expiry_s: f32,
    /// A pose older than this is not flown by, seconds.
    pub pose_age_s: f32,
    /// Without an echo report for this long the drone stands, seconds.
    pub ranges_age_s: f32,
}

impl Default for NavigationConfig {
    fn default() -> Self {
        Self {
            avoid: Method::Vfh,
            height_m: 1.2,
            cruise_m_s: 0.0,
            door_m_s: 0.4,
            turn_rad_s: 1.0,
            scan_deg: 8.0,
            scan_s: 1.4,
            look_ahead_m: 1.0,
            narrow_m: 0.7,
            stop_gap_m: 0.6,
            wait_s: 16.0,
            stuck_s: 20.0,
            tries: 3,
            pad_m: 0.12,
            expiry_s: 0.3,
            pose_age_s: 0.4,
            ranges_age_s: 0.5,
        }
    }
}

impl NavigationConfig {
    /// The same, flown at the vehicle's own height where it has one.
    #[must_use]
    pub(crate) fn at_height(self, height_m: Option<f32>) -> Self {
        Self { height_m: height_m.unwrap_or(self.height_m), ..self }
    }
}

impl Validate for NavigationConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        let check = |field, value: f32, low, high| within(field, f64::from(value), low..=high);
        check("height_m", self.height_m, 0.5, 2.5)?;
        if self.cruise_m_s != 0.0 {
            within("cruise_m_s", f64::from(self.cruise_m_s), 0.1..=1.5).map_err(|_| {
                ConfigError::range("cruise_m_s", self.cruise_m_s, "0.1..=1.5, or 0 for the vehicle's")
            })?;
        }
        check("door_m_s", self.door_m_s, 0.05, 1.0)?;
        check("turn_rad_s", self.turn_rad_s, 0.1, 2.0)?;
        check("scan_deg", self.scan_deg, 0.0, 30.0)?;
        check("scan_s", self.scan_s, 1.0, 20.0)?;
        check("look_ahead_m", self.look_ahead_m, 0.4, 1.5)?;
        check("narrow_m", self.narrow_m, 0.0, 2.0)?;
        check("stop_gap_m", self.stop_gap_m, 0.1, 1.0)?;
        check("wait_s", self.wait_s, 0.0, 60.0)?;
        check("stuck_s", self.stuck_s, 3.0, 120.0)?;
        within("tries", f64::from(self.tries), 1.0..=10.0)?;
        check("pad_m", self.pad_m, 0.05, 0.5)?;
        check("expiry_s", self.expiry_s, 0.1, 0.5)?;
        check("pose_age_s", self.pose_age_s, 0.1, 2.0)?;
        check("ranges_age_s", self.ranges_age_s, 0.1, 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_in_range_and_the_shipped_file_says_the_same() {
        NavigationConfig::default().validate().unwrap();
        let text = include_str!("../../../deploy/config/navigation.toml");
        let shipped: NavigationConfig = runtime::parse_config("navigation.toml", text).unwrap();
        assert_eq!(shipped, NavigationConfig::default());
    }

    #[test]
    fn a_vehicle_that_has_a_height_is_flown_at_it() {
        assert_eq!(NavigationConfig::default().at_height(Some(0.8)).height_m, 0.8);
        assert_eq!(NavigationConfig::default().at_height(None), NavigationConfig::default());
    }

    #[test]
    fn a_value_out_of_range_and_an_unknown_key_are_refused_by_name() {
        let parse = |text| runtime::parse_config::<NavigationConfig>("n.toml", text).unwrap_err().to_string();
        assert!(parse("expiry_s = 5.0").contains("expiry_s"));
        assert!(parse("cruise_m_s = 9.0").contains("0 for the vehicle's"));
        assert!(parse("hight_m = 1.0").contains("hight_m"));
        assert!(parse("wait_s = nan").contains("wait_s"));
    }

    #[test]
    fn an_unknown_method_of_avoidance_is_refused_with_the_known_ones() {
        let said = runtime::parse_config::<NavigationConfig>("n.toml", "avoid = \"magnets\"").unwrap_err();
        let said = said.to_string();
        for method in Method::ALL {
            assert!(said.contains(method.name()), "{said}");
            let text = format!("avoid = \"{method}\"");
            let config: NavigationConfig = runtime::parse_config("n.toml", &text).unwrap();
            assert_eq!(config.avoid, method);
            assert_eq!(method.name().parse(), Ok(method));
        }
        assert!(said.contains("magnets"), "{said}");
        assert_eq!("VFH".parse::<Method>(), Err("vfh, thesis, potential".to_owned()));
    }
}
