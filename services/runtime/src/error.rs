//! Why a service could not start.

use crate::ConfigError;

/// Why a service could not start, in one sentence.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// A file is missing or unreadable.
    #[error("cannot read {path}: {reason}")]
    Read {
        /// The file.
        path: String,
        /// What the system said. Part of the sentence, so no source of it.
        reason: std::io::Error,
    },
    /// A configuration file is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The manifest is wrong, or does not know this service.
    #[error("{0}")]
    Manifest(String),
    /// A port that the manifest does not list.
    #[error("service {service} may not {action} {topic}: the manifest does not list it")]
    Port {
        /// The service that asked.
        service: String,
        /// `publish`, `subscribe` or `use device`.
        action: &'static str,
        /// The topic or device.
        topic: String,
    },
    /// Shared memory could not be opened.
    #[error("{0}")]
    SharedMemory(String),
    /// A device could not be used.
    #[error("device {name} at {path}: {reason}")]
    Device {
        /// The device's name in the manifest.
        name: String,
        /// Where it should be.
        path: String,
        /// Why not.
        reason: String,
    },
    /// The plan, the vehicle or another input of the service is wrong.
    #[error("{0}")]
    Invalid(String),
}

impl StartError {
    /// Any other reason, as a sentence.
    #[expect(clippy::needless_pass_by_value, reason = "taken whole, so that it stands in `map_err`")]
    pub fn invalid(reason: impl ToString) -> Self {
        Self::Invalid(reason.to_string())
    }
}
