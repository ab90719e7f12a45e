//! `flow.toml`.

use runtime::{ConfigError, Validate, within};
use serde::Deserialize;

/// The configuration of `flow`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Frames of less quality are refused, 0..=255. Over a floor with little contrast the sensor under-reports
    /// motion before it falls silent.
    pub min_quality: u8,
    /// Frames taken at more tilt are refused, degrees: the picture is no longer of the ground below.
    pub max_tilt_deg: f64,
    /// Noise of one frame, radians a second.
    pub noise_rad_s: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { min_quality: 60, max_tilt_deg: 25.0, noise_rad_s: 0.055 }
    }
}

impl Validate for Config {
    fn validate(&self) -> Result<(), ConfigError> {
        within("max_tilt_deg", self.max_tilt_deg, 5.0..=45.0)?;
        within("noise_rad_s", self.noise_rad_s, 0.005..=1.0)
    }
}
