//! Configuration files: unknown keys and values out of range are refused by name.

use crate::{StartError, fnv};
use manifest::plain;
use std::fmt::Display;
use std::ops::RangeInclusive;
use std::path::Path;

/// What is wrong with a configuration file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// A value outside its range.
    #[error("{}{field} = {value} is out of range: allowed is {allowed}", prefix(.file))]
    Range {
        /// The file, empty before it is known.
        file: String,
        /// The key.
        field: &'static str,
        /// What it says.
        value: String,
        /// What it may say.
        allowed: String,
    },
    /// Not TOML, an unknown key or a wrong type; the reason names line and key.
    #[error("{file}: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// What the parser said.
        reason: String,
    },
}

fn prefix(file: &str) -> String {
    if file.is_empty() { String::new() } else { format!("{file}: ") }
}

impl ConfigError {
    /// A value outside its range.
    pub fn range(field: &'static str, value: impl Display, allowed: impl Into<String>) -> Self {
        let value = plain(&value.to_string());
        Self::Range { file: String::new(), field, value, allowed: allowed.into() }
    }

    /// The same, naming the file.
    #[must_use]
    pub fn in_file(self, name: &str) -> Self {
        match self {
            Self::Range { field, value, allowed, .. } => {
                Self::Range { file: name.to_owned(), field, value, allowed }
            }
            Self::Syntax { reason, .. } => Self::Syntax { file: name.to_owned(), reason },
        }
    }
}

/// Checks a value against its range; NaN is never inside.
///
/// # Errors
/// [`ConfigError::Range`] naming the field, the value and the range.
pub fn within(field: &'static str, value: f64, allowed: RangeInclusive<f64>) -> Result<(), ConfigError> {
    if allowed.contains(&value) {
        Ok(())
    } else {
        Err(ConfigError::range(field, value, format!("{}..={}", allowed.start(), allowed.end())))
    }
}

/// A configuration that knows its own ranges.
pub trait Validate {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value out of range.
    fn validate(&self) -> Result<(), ConfigError>;
}

/// For services without a configuration.
impl Validate for () {
    fn validate(&self) -> Result<(), ConfigError> {
        Ok(())
    }
}

/// Parses and checks a configuration file.
///
/// # Errors
/// Names the file, the key, the value and what is allowed.
pub fn parse_config<C>(file: &str, text: &str) -> Result<C, ConfigError>
where
    C: serde::de::DeserializeOwned + Validate,
{
    let config: C = toml::from_str(text).map_err(|error| ConfigError::Syntax {
        file: file.to_owned(),
        reason: plain(&error.to_string().trim_end().replace('\n', " ")),
    })?;
    config.validate().map_err(|error| error.in_file(file))?;
    Ok(config)
}

/// The configuration in the file `name` below `root`, and the hash of its bytes for the journal; the default and 0 when
/// the manifest names none.
///
/// # Errors
/// When the file is missing or wrong.
pub(crate) fn read_config<C>(root: &Path, name: &str) -> Result<(C, u64), StartError>
where
    C: serde::de::DeserializeOwned + Default + Validate,
{
    if name.is_empty() {
        return Ok((C::default(), 0));
    }
    let path = root.join(name);
    let text = std::fs::read_to_string(&path)
        .map_err(|reason| StartError::Read { path: path.display().to_string(), reason })?;
    Ok((parse_config(name, &text)?, fnv(text.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(serde::Deserialize, Debug, Default)]
    #[serde(deny_unknown_fields, default)]
    struct Cruise {
        speed_m_s: f64,
    }
    impl Validate for Cruise {
        fn validate(&self) -> Result<(), ConfigError> {
            within("speed_m_s", self.speed_m_s, 0.1..=2.0)
        }
    }

    #[test]
    fn a_value_out_of_range_names_file_key_value_and_range() {
        let error = parse_config::<Cruise>("pilot.toml", "speed_m_s = 9").unwrap_err().to_string();
        assert_eq!(error, "pilot.toml: speed_m_s = 9 is out of range: allowed is 0.1..=2");
        assert!(parse_config::<Cruise>("pilot.toml", "speed_m_s = nan").is_err());
    }

    #[test]
    fn a_message_is_one_plain_line_whatever_the_file_says() {
        for text in ["\"a\\nb\" = 1", "\"\\u001b[2J\" = 1", "speed_m_s =\t1x", "speed_m_s = \"\u{7f}\""] {
            let error = parse_config::<Cruise>("pilot.toml", text).unwrap_err().to_string();
            assert!(!error.chars().any(char::is_control), "{error:?}");
        }
        let error = ConfigError::range("clutter", "full\r\nall is well", "none, light, full").to_string();
        assert_eq!(error, "clutter = full\\r\\nall is well is out of range: allowed is none, light, full");
    }

    #[test]
    fn an_unknown_key_is_refused_by_name() {
        let error = parse_config::<Cruise>("pilot.toml", "sped = 1").unwrap_err().to_string();
        assert!(error.starts_with("pilot.toml: ") && error.contains("sped"), "{error}");
    }
}
