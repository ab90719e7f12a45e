//! `config/camera.toml`.

use runtime::{ConfigError, Validate, within};

/// Settings of the service.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraConfig {
    /// Where frames come from: `simulator`, `test-pattern` or `file`.
    pub source: String,
    /// For `file`: uncompressed video in Y4M form, 4:2:0, shown again and again.
    pub file: String,
    /// Key frames asked for sooner after each other than this come together, milliseconds.
    pub key_pause_ms: u32,
    /// A key frame comes at least so often, seconds: a recording can be entered there.
    pub key_every_s: f64,
}

/// Sources by name.
pub(crate) const SOURCES: [&str; 3] = [SIMULATOR, TEST_PATTERN, FILE];
pub(crate) const SIMULATOR: &str = "simulator";
pub(crate) const TEST_PATTERN: &str = "test-pattern";
pub(crate) const FILE: &str = "file";

impl Default for CameraConfig {
    fn default() -> Self {
        Self { source: SIMULATOR.to_owned(), file: String::new(), key_pause_ms: 300, key_every_s: 10.0 }
    }
}

impl Validate for CameraConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        if !SOURCES.contains(&self.source.as_str()) {
            return Err(ConfigError::range("source", &self.source, SOURCES.join(", ")));
        }
        if (self.source == FILE) == self.file.is_empty() {
            let allowed = "the name of a Y4M file for source = \"file\", and nothing for any other source";
            return Err(ConfigError::range("file", &self.file, allowed));
        }
        // A key frame is ten times as large as another: more than ten a second and nothing else fits the line.
        within("key_pause_ms", f64::from(self.key_pause_ms), 100.0..=5000.0)?;
        within("key_every_s", self.key_every_s, 0.5..=60.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_nonsense_is_refused_by_name() {
        assert_eq!(CameraConfig::default().validate(), Ok(()));
        for (config, word) in [
            (CameraConfig { source: "crystal ball".into(), ..CameraConfig::default() }, "source"),
            (CameraConfig { source: FILE.into(), ..CameraConfig::default() }, "file"),
            (CameraConfig { file: "a.y4m".into(), ..CameraConfig::default() }, "file"),
            (CameraConfig { key_pause_ms: 5, ..CameraConfig::default() }, "key_pause_ms"),
            (CameraConfig { key_every_s: f64::NAN, ..CameraConfig::default() }, "key_every_s"),
        ] {
            let error = config.validate().unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("allowed"), "{error}");
        }
    }
}
