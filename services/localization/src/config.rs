//! `config/localization.toml`.

use mcl::{Config, MotionConfig, PopulationConfig, ResampleConfig, SonarConfig, TrustConfig};
use runtime::{ConfigError, Validate, within};
use std::str::FromStr;

/// Defines a section that mirrors one of the filter's settings structures, so that files can hold it.
macro_rules! section {
    ($(#[$meta:meta])* $name:ident mirrors $of:ty { $( $(#[$fmeta:meta])* $field:ident : $ty:ty ),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name { $( $(#[$fmeta])* pub $field: $ty, )* }
        impl Default for $name {
            fn default() -> Self {
                let of = <$of>::default();
                Self { $( $field: of.$field, )* }
            }
        }
        impl $name {
            fn to_filter(&self) -> $of {
                <$of>::from_section(self)
            }
        }
        impl FromSection<$name> for $of {
            fn from_section(section: &$name) -> Self {
                Self { $( $field: section.$field, )* }
            }
        }
    };
}

trait FromSection<S> {
    fn from_section(section: &S) -> Self;
}

section! {
    /// How particles move; see [`mcl::MotionConfig`].
    MotionSection mirrors MotionConfig {
        /// m/s per √s.
        velocity_noise: f32,
        /// The same where the accelerometer feels the gusts, m/s per root second.
        felt_noise: f32,
        /// m per √s.
        position_noise: f32,
        /// m per √m.
        position_noise_per_m: f32,
        /// σ of the factor on the distance flown.
        distance_noise: f32,
        /// rad per √s.
        heading_noise: f32,
        /// rad per √m.
        heading_noise_per_m: f32,
        /// rad.
        heading_spread: f32,
        /// rad per √s.
        level_noise: f32,
        /// 1/s.
        drag: f32,
        /// m/s².
        blind_acceleration: f32,
        /// Least weight factor of a flow reading.
        flow_floor: f32,
    }
}

section! {
    /// How readings weigh particles; see [`mcl::SonarConfig`].
    SonarSection mirrors SonarConfig {
        /// Metres.
        sigma: f32,
        /// Metres a metre.
        sigma_per_m: f32,
        /// Probability.
        short: f32,
        /// Probability.
        missed: f32,
        /// Probability.
        random: f32,
        /// Probability.
        unexpected: f32,
        /// Exponent.
        temper: f32,
        /// Fraction of the best place's likelihood.
        floor: f32,
        /// Metres.
        max_range: f32,
        /// Radians.
        max_elevation: f32,
    }
}

section! {
    /// How many particles there are; see [`mcl::PopulationConfig`].
    PopulationSection mirrors PopulationConfig {
        /// Never fewer.
        min: usize,
        /// Never more.
        max: usize,
        /// Bound of KLD sampling.
        error: f32,
        /// Metres.
        bin: f32,
        /// Radians.
        heading_bin: f32,
        /// m/s.
        velocity_bin: f32,
    }
}

section! {
    /// When the estimate is no longer believed; see [`mcl::TrustConfig`].
    TrustSection mirrors TrustConfig {
        /// Exponent.
        temper: f32,
        /// Log odds a reading.
        raise: f32,
        /// Most that a reading too short for the place raises the log odds.
        raise_short: f32,
        /// Log odds a reading.
        lower: f32,
        /// Per second.
        hazard_per_s: f32,
        /// Per second.
        recovery_per_s: f32,
    }
}

/// What is known of the place at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StartFrom {
    /// It stands on the pad, or where `x_m`, `y_m` and `heading_deg` say.
    #[default]
    Pad,
    /// It stands somewhere in a room, with any heading.
    Room,
    /// It stands anywhere on the plan.
    Unknown,
}

/// Where the drone starts, and how well that is known.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StartSection {
    /// What is known.
    pub from: StartFrom,
    /// Name of the room, with `from = "room"`.
    pub room: String,
    /// Plan frame, metres; instead of the pad of the plan's sidecar file. All three or none.
    pub x_m: Option<f32>,
    /// Plan frame, metres.
    pub y_m: Option<f32>,
    /// Plan frame, degrees counter-clockwise from x.
    pub heading_deg: Option<f32>,
    /// Standard deviation of the place on the pad, metres.
    pub sigma_m: f32,
    /// Standard deviation of the heading on the pad, degrees.
    pub heading_sigma_deg: f32,
    /// Standard deviation of the level error, degrees, after what the ground says of it.
    pub level_sigma_deg: f32,
}

impl Default for StartSection {
    fn default() -> Self {
        Self {
            from: StartFrom::Pad,
            room: String::new(),
            x_m: None,
            y_m: None,
            heading_deg: None,
            sigma_m: 0.05,
            heading_sigma_deg: 4.0,
            level_sigma_deg: 0.9,
        }
    }
}

/// Which particle filter follows the drone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FilterKind {
    /// [`mcl::Filter`].
    #[default]
    Sereno,
    /// The thesis's own, plain: [`mcl::thesis::Filter`].
    Thesis,
}

impl FromStr for FilterKind {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "sereno" => Ok(Self::Sereno),
            "thesis" => Ok(Self::Thesis),
            _ => Err("allowed is sereno or thesis".to_owned()),
        }
    }
}

/// Settings of the service.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocalizationConfig {
    /// Which filter. The thesis's takes no more from below than the bounds of the population and the trust.
    pub filter: FilterKind,
    /// Poses a second, at most one a step.
    pub pose_hz: f64,
    /// Without a ping for so long the set is moved by tilt and flow alone, seconds.
    pub silent_s: f64,
    /// A kept set older than this is no place to go on from, seconds.
    pub max_age_s: f64,
    /// Where the drone starts.
    pub start: StartSection,
    /// How particles move.
    pub motion: MotionSection,
    /// How readings weigh them.
    pub sonar: SonarSection,
    /// How many there are.
    pub population: PopulationSection,
    /// Share of the effective sample size below which ancestors are drawn.
    pub resample_threshold: f32,
    /// When the estimate is no longer believed.
    pub trust: TrustSection,
}

impl Default for LocalizationConfig {
    fn default() -> Self {
        Self {
            filter: FilterKind::default(),
            pose_hz: 50.0,
            silent_s: 0.2,
            max_age_s: 5.0,
            start: StartSection::default(),
            motion: MotionSection::default(),
            sonar: SonarSection::default(),
            population: PopulationSection::default(),
            resample_threshold: ResampleConfig::default().threshold,
            trust: TrustSection::default(),
        }
    }
}

impl LocalizationConfig {
    /// The filter's part of the settings.
    #[must_use]
    pub fn filter_config(&self) -> Config {
        Config {
            motion: self.motion.to_filter(),
            sonar: self.sonar.to_filter(),
            population: self.population.to_filter(),
            resample: ResampleConfig { threshold: self.resample_threshold },
            trust: self.trust.to_filter(),
        }
    }
}

impl Validate for LocalizationConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        within("pose_hz", self.pose_hz, 20.0..=100.0)?;
        within("silent_s", self.silent_s, 0.1..=1.0)?;
        within("max_age_s", self.max_age_s, 0.5..=30.0)?;
        let start = &self.start;
        let given = [start.x_m, start.y_m, start.heading_deg].iter().flatten().count();
        if given != 0 && given != 3 {
            return Err(ConfigError::range(
                "start",
                format!("{given} of x_m, y_m and heading_deg"),
                "all three of them, or none to start on the plan's pad",
            ));
        }
        if given != 0 && start.from != StartFrom::Pad {
            return Err(ConfigError::range(
                "start.from",
                "a search",
                "pad, where x_m, y_m and heading_deg are given",
            ));
        }
        if self.filter == FilterKind::Thesis && start.from != StartFrom::Pad {
            return Err(ConfigError::range("start.from", "a search", "pad, with filter = \"thesis\""));
        }
        if start.room.is_empty() == (start.from == StartFrom::Room) {
            return Err(ConfigError::range(
                "start.room",
                format!("\"{}\"", start.room),
                "the name of a room with from = \"room\", empty otherwise",
            ));
        }
        for (field, value) in [("start.x_m", start.x_m), ("start.y_m", start.y_m)] {
            within(field, value.map_or(0.0, f64::from), -10_000.0..=10_000.0)?;
        }
        within("start.heading_deg", start.heading_deg.map_or(0.0, f64::from), -360.0..=360.0)?;
        within("start.sigma_m", f64::from(start.sigma_m), 0.01..=1.0)?;
        within("start.heading_sigma_deg", f64::from(start.heading_sigma_deg), 0.5..=45.0)?;
        within("start.level_sigma_deg", f64::from(start.level_sigma_deg), 0.1..=5.0)?;
        self.filter_config()
            .check()
            .map_err(|e| ConfigError::range(e.field, e.value, format!("{}..={}", e.low, e.high)))
    }
}
