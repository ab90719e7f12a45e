//! The configuration file. Unknown keys and values out of range are refused by name.

use crate::{Lifetime, RecordingConfig};
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// What is wrong with a configuration.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: std::io::Error,
    },
    /// It is not TOML, has an unknown key or a wrong type; the reason names line and key.
    #[error("{}: {reason}", .path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What the parser said.
        reason: String,
    },
    /// A value outside its range.
    #[error("{}: {key} = {value} is out of range: allowed is {allowed}", .path.display())]
    Range {
        /// The file.
        path: PathBuf,
        /// The key.
        key: &'static str,
        /// What it says.
        value: String,
        /// What it may say.
        allowed: &'static str,
    },
}

/// Where the page is served.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HttpsConfig {
    /// Address and port, `0.0.0.0:443` once installed for others.
    pub listen: SocketAddr,
    /// Address and port that only redirect to the above; absent: none.
    #[serde(default)]
    pub redirect: Option<SocketAddr>,
    /// The certificate chain, PEM.
    pub certificate: PathBuf,
    /// Its private key, PEM.
    pub key: PathBuf,
    /// The certificate of the authority that signed it, PEM, to be offered to devices that are to trust it; absent: none is.
    #[serde(default)]
    pub authority: Option<PathBuf>,
    /// Connections at the same time.
    pub connections: usize,
    /// Of them from one address.
    pub connections_an_address: usize,
}

/// How drones are reached.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZenohConfig {
    /// What `sereno certs client NAME` has written for this console: its identity, the authority, the drones' endpoints.
    pub client: PathBuf,
    /// Endpoints of the drones' bridges, or of a router, in place of those in that file: `tls/host:7447`.
    #[serde(default)]
    pub endpoints: Vec<String>,
}

/// How long a log-in lasts.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionConfig {
    /// Without a deed of its human, minutes.
    pub idle_min: u64,
    /// At most, hours.
    pub absolute_h: u64,
}

impl SessionConfig {
    /// In the directory's units.
    #[must_use]
    pub fn lifetime(&self) -> Lifetime {
        Lifetime { idle_ms: self.idle_min * 60_000, absolute_ms: self.absolute_h * 3_600_000 }
    }
}

/// Flights in the simulator before a plan or a round is flown.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RehearsalConfig {
    /// The program `sereno`; absent: the one beside the console's own program.
    pub program: Option<PathBuf>,
    /// The folder of `system.toml`, with vehicles and configurations; absent: where the program finds it.
    pub deploy: Option<PathBuf>,
}

/// All of it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConsoleConfig {
    /// Where everything is kept.
    pub data: PathBuf,
    /// The page's server.
    pub https: HttpsConfig,
    /// The way to the drones.
    pub zenoh: ZenohConfig,
    /// Log-ins.
    pub session: SessionConfig,
    /// Pictures that are kept.
    #[serde(default)]
    pub recording: RecordingConfig,
    /// Rehearsals.
    #[serde(default)]
    pub rehearsal: RehearsalConfig,
}

impl ConsoleConfig {
    /// Reads and checks a file; paths in it are meant from its folder.
    ///
    /// # Errors
    /// Names file, key, value and what is allowed.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|reason| ConfigError::Read { path: path.to_owned(), reason })?;
        let mut config: Self = toml::from_str(&text).map_err(|error| ConfigError::Syntax {
            path: path.to_owned(),
            reason: error.to_string().trim_end().replace('\n', " "),
        })?;
        config.validate(path)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        for file in
            [&mut config.data, &mut config.https.certificate, &mut config.https.key, &mut config.zenoh.client]
        {
            *file = folder.join(&*file);
        }
        let optional =
            [&mut config.rehearsal.program, &mut config.rehearsal.deploy, &mut config.https.authority];
        for file in optional.into_iter().flatten() {
            *file = folder.join(&*file);
        }
        Ok(config)
    }

    fn validate(&self, path: &Path) -> Result<(), ConfigError> {
        let fail = |key, value: String, allowed| {
            Err(ConfigError::Range { path: path.to_owned(), key, value, allowed })
        };
        if !(1..=24 * 60).contains(&self.session.idle_min) {
            return fail("session.idle_min", self.session.idle_min.to_string(), "1..=1440");
        }
        if !(1..=7 * 24).contains(&self.session.absolute_h) {
            return fail("session.absolute_h", self.session.absolute_h.to_string(), "1..=168");
        }
        if !(4..=4096).contains(&self.https.connections) {
            return fail("https.connections", self.https.connections.to_string(), "4..=4096");
        }
        if !(4..=self.https.connections).contains(&self.https.connections_an_address) {
            return fail(
                "https.connections_an_address",
                self.https.connections_an_address.to_string(),
                "4..=https.connections",
            );
        }
        if let Some((key, value, allowed)) = self.recording.wrong() {
            return fail(key, value, allowed);
        }
        if self.zenoh.endpoints.len() > 256 {
            return fail("zenoh.endpoints", format!("{} of them", self.zenoh.endpoints.len()), "up to 256");
        }
        for endpoint in &self.zenoh.endpoints {
            if !endpoint.starts_with("tls/") || endpoint.parse::<zenoh::config::EndPoint>().is_err() {
                return fail(
                    "zenoh.endpoints",
                    format!("{endpoint:?}"),
                    "tls/host:port, nothing without TLS",
                );
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    const SHIPPED: &str = include_str!("../../../deploy/config/console.toml");

    fn read(text: &str) -> Result<ConsoleConfig, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("console.toml");
        std::fs::write(&path, text).unwrap();
        ConsoleConfig::read(&path)
            .map_err(|error| error.to_string().replace(&path.display().to_string(), "F"))
    }

    #[test]
    fn the_shipped_file_is_good_and_listens_on_loopback_alone() {
        let config = read(SHIPPED).unwrap();
        assert!(config.https.listen.ip().is_loopback());
        assert!(config.https.redirect.is_none());
        assert!(config.recording.enabled, "this one is off the board");
        let bare = SHIPPED.split("[recording]").next().unwrap();
        assert!(!read(bare).unwrap().recording.enabled, "nothing is kept unless somebody says so");
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (from, to, says) in [
            (
                "idle_min = 240",
                "idle_min = 0",
                "F: session.idle_min = 0 is out of range: allowed is 1..=1440",
            ),
            (
                "connections = 256",
                "connections = 1",
                "F: https.connections = 1 is out of range: allowed is 4..=4096",
            ),
            ("# endpoints = [\"tls/", "endpoints = [\"tcp/", "nothing without TLS"),
            ("[session]", "[session]\nidel = 3", "idel"),
            (
                "retention_h = 720",
                "retention_h = 0",
                "F: recording.retention_h = 0 is out of range: allowed is 1..=8784",
            ),
            ("most_gib = 20", "most_gib = 0", "recording.most_gib = 0"),
            ("free_gib = 2", "free_gib = 0", "recording.free_gib = 0"),
            (
                "rolling_s = 30",
                "rolling_s = 3",
                "recording.rolling_s = 3 is out of range: allowed is 0, or 5..=120",
            ),
            ("enabled = true", "", "enabled"),
            ("enabled = true", "enabled = true\nkeep = true", "keep"),
            ("127.0.0.1:8443", "here", "invalid socket address"),
        ] {
            let text = SHIPPED.replacen(from, to, 1);
            assert_ne!(text, SHIPPED, "{from}");
            let error = read(&text).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
