//! The console's zenoh session: the file that `sereno certs` has written, and what a console that waits for drones needs.

use crate::config::ZenohConfig;
use serde_json::{Value, json};
use std::path::PathBuf;

/// What is wrong with the way to the drones.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The client's file.
    #[error("{}: {reason}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// Zenoh cannot be started with it.
    #[error("zenoh cannot be started with {}: {reason}", .path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What zenoh says.
        reason: String,
    },
}

/// A session, and the name in the certificate with which it speaks.
pub(super) struct Link {
    pub(super) session: zenoh::Session,
    pub(super) certificate: String,
}

pub(super) async fn open(config: &ZenohConfig) -> Result<Link, LinkError> {
    let wrong = |reason: String| LinkError::File { path: config.client.clone(), reason };
    let text = std::fs::read_to_string(&config.client).map_err(|error| wrong(error.to_string()))?;
    let mut zenoh = zenoh::Config::from_json5(&text).map_err(|error| wrong(error.to_string()))?;
    let certificate = name_of(&zenoh).ok_or_else(|| {
        wrong("metadata.certificate must be the common name in this console's certificate".to_owned())
    })?;
    let mut settings = vec![
        // A peer that nobody connects to: it keeps trying each endpoint for ever, and drones may come and go.
        ("mode", json!("peer")),
        ("listen/endpoints", json!([])),
        ("connect/timeout_ms", json!(-1)),
        ("connect/exit_on_failure", json!(false)),
        (
            "connect/retry",
            json!({ "period_init_ms": 250, "period_max_ms": 2000, "period_increase_factor": 2 }),
        ),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        ("transport/link/tls/enable_mtls", json!(true)),
        ("transport/link/protocols", json!(["tls"])),
        // A drone that is switched off is missed after two seconds.
        ("transport/link/tx/lease", json!(2000)),
    ];
    if !config.endpoints.is_empty() {
        settings.push(("connect/endpoints", json!(config.endpoints)));
    }
    for (key, value) in settings {
        zenoh.insert_json5(key, &value.to_string()).map_err(|error| wrong(format!("{key}: {error}")))?;
    }
    let session = zenoh::open(zenoh)
        .await
        .map_err(|error| LinkError::Open { path: config.client.clone(), reason: error.to_string() })?;
    Ok(Link { session, certificate })
}

fn name_of(zenoh: &zenoh::Config) -> Option<String> {
    let metadata: Value = serde_json::from_str(&zenoh.get_json("metadata").ok()?).ok()?;
    let name = metadata.get("certificate")?.as_str()?;
    crate::role::is_drone_name(name).then(|| name.to_owned())
}
