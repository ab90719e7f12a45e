//! `flight.toml`.

use runtime::{ConfigError, Validate, within};
use serde::Deserialize;

/// Who owns arming (DESIGN 4).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// MSP is the receiver: Sereno arms on AUX1. Simulator and bench.
    Receiver,
    /// A radio owns arming and the override switch; Sereno sends the four sticks.
    Override,
}

impl Profile {
    /// As `flight/state` carries it.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::Receiver => 0,
            Self::Override => 1,
        }
    }
}

/// The configuration of `flight`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Who owns arming.
    pub profile: Profile,
    /// MSP framing of what is sent: 2 has the better check byte, and gives way to 1 where nobody answers to it (firmware
    /// before 2018); 1 is 1 from the first byte.
    pub msp_version: u8,
    /// Channels this old are not flown: level with the learned trim, seconds.
    pub level_after_s: f64,
    /// Channels this old: descend, seconds.
    pub descend_after_s: f64,
    /// Descent of the ladder, m/s. A touch at more than 0.7 m/s counts as a crash (DESIGN 5).
    pub descend_m_s: f64,
    /// Down sonar silent so long: hold the learned throttle, seconds.
    pub blind_hold_after_s: f64,
    /// Down sonar silent so long: descend without it, seconds.
    pub blind_descend_after_s: f64,
    /// Hover throttle assumed when nobody ever said one, microseconds.
    pub default_hover_us: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            profile: Profile::Receiver,
            msp_version: 2,
            level_after_s: 0.1,
            descend_after_s: 0.3,
            descend_m_s: 0.35,
            blind_hold_after_s: 0.3,
            blind_descend_after_s: 1.0,
            default_hover_us: 1450.0,
        }
    }
}

impl Validate for Config {
    fn validate(&self) -> Result<(), ConfigError> {
        if !(1..=2).contains(&self.msp_version) {
            return Err(ConfigError::range("msp_version", self.msp_version, "1..=2"));
        }
        // Below 50 ms one late message of the pilot would count as its death; beyond 200 ms a dead pilot's last
        // tilt would be flown for longer than a doorway is wide.
        within("level_after_s", self.level_after_s, 0.05..=0.2)?;
        within("descend_after_s", self.descend_after_s, 0.15..=1.0)?;
        if self.descend_after_s <= self.level_after_s {
            return Err(ConfigError::range(
                "descend_after_s",
                self.descend_after_s,
                "more than level_after_s",
            ));
        }
        within("descend_m_s", self.descend_m_s, 0.1..=0.6)?;
        within("blind_hold_after_s", self.blind_hold_after_s, 0.1..=1.0)?;
        within("blind_descend_after_s", self.blind_descend_after_s, 0.3..=3.0)?;
        within("default_hover_us", self.default_hover_us, 1200.0..=1700.0)
    }
}
