//! `config/sonar.toml`.

use crate::HealthRules;
use runtime::{ConfigError, Validate, within};

/// Settings of the service.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SonarConfig {
    /// Time from one group's ping to the next group's, milliseconds. 60 is the datasheet's shortest: an
    /// echo from farther away than the reach must have died down.
    pub slot_ms: u32,
    /// Air temperature, degrees Celsius: 10 degrees change a range by 1.8 %.
    pub temperature_c: f64,
    /// Faults in a row after which a sensor counts as silent.
    pub silent_after: u32,
    /// Answers in a row after which it no longer does.
    pub good_after: u32,
    /// The very same range so many times in a row, while other sensors see things move, means that a
    /// sensor is stuck.
    pub stuck_after: u32,
}

impl Default for SonarConfig {
    fn default() -> Self {
        Self { slot_ms: 60, temperature_c: 20.0, silent_after: 3, good_after: 3, stuck_after: 40 }
    }
}

impl SonarConfig {
    pub(crate) fn health_rules(&self) -> HealthRules {
        HealthRules {
            silent_after: self.silent_after,
            good_after: self.good_after,
            stuck_after: self.stuck_after,
        }
    }
}

impl Validate for SonarConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        // Above 200 ms a drone at cruise speed outruns its sonars.
        within("slot_ms", f64::from(self.slot_ms), 60.0..=200.0)?;
        within("temperature_c", self.temperature_c, -20.0..=60.0)?;
        within("silent_after", f64::from(self.silent_after), 1.0..=20.0)?;
        within("good_after", f64::from(self.good_after), 1.0..=20.0)?;
        within("stuck_after", f64::from(self.stuck_after), 10.0..=1000.0)
    }
}
