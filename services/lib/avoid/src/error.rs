//! What a method refuses to be built with.

use thiserror::Error;

/// A parameter that makes no sense.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{method}: {field} is {value}, allowed is {allowed}")]
pub struct ConfigError {
    /// Name of the method.
    pub method: &'static str,
    /// Field of its configuration.
    pub field: &'static str,
    /// What it held.
    pub value: f32,
    /// What it may hold.
    pub allowed: &'static str,
}
