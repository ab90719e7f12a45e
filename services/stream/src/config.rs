//! `config/stream.toml`.

use runtime::{ConfigError, Validate, within};
use serde::{Deserialize, Serialize};
use std::net::IpAddr;

/// A STUN or TURN server, in the form of the browser's `RTCIceServer`.
#[derive(Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IceServer {
    /// `stun:HOST:PORT`, `turn:HOST:PORT?transport=udp` or `tcp`.
    pub urls: Vec<String>,
    /// For TURN.
    #[serde(default)]
    pub username: String,
    /// For TURN.
    #[serde(default)]
    pub credential: String,
}

/// Without the credential, which belongs into no log.
impl std::fmt::Debug for IceServer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("IceServer").field("urls", &self.urls).field("username", &self.username).finish()
    }
}

/// Settings of the service.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StreamConfig {
    /// Addresses that media sockets are bound to, a socket a viewer each.
    pub addresses: Vec<IpAddr>,
    /// Whether UDP is offered, which is best; some networks let none through.
    pub udp: bool,
    /// Whether TCP is offered.
    pub tcp: bool,
    /// Only by way of a TURN server.
    pub relay_only: bool,
    /// STUN and TURN servers, for the drone and for viewers.
    pub servers: Vec<IceServer>,
    /// Most viewers at a time.
    pub viewers: u32,
    /// Bits a second that are sent however bad the lines are, and however good.
    pub bitrate_least: u32,
    /// See there.
    pub bitrate_most: u32,
}

impl Default for StreamConfig {
    fn default() -> Self {
        Self {
            addresses: vec![IpAddr::from([127, 0, 0, 1])],
            udp: true,
            tcp: true,
            relay_only: false,
            servers: Vec::new(),
            viewers: 8,
            bitrate_least: 150_000,
            bitrate_most: 6_000_000,
        }
    }
}

impl Validate for StreamConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        within("addresses (how many)", self.addresses.len() as f64, 1.0..=8.0)?;
        within("servers (how many)", self.servers.len() as f64, 0.0..=8.0)?;
        if !(self.udp || self.tcp || self.relay_only) {
            return Err(ConfigError::range("tcp", false, "true where udp = false"));
        }
        within("viewers", f64::from(self.viewers), 1.0..=32.0)?;
        within("bitrate_least", f64::from(self.bitrate_least), 50_000.0..=20_000_000.0)?;
        within("bitrate_most", f64::from(self.bitrate_most), f64::from(self.bitrate_least)..=20_000_000.0)?;
        for server in &self.servers {
            let known = |url: &String| {
                url.len() <= 256 && ["stun:", "turn:", "turns:"].iter().any(|scheme| url.starts_with(scheme))
            };
            if let Some(url) = server.urls.iter().find(|url| !known(url)) {
                return Err(ConfigError::range(
                    "servers.urls",
                    url,
                    "stun:HOST:PORT, turn:HOST:PORT, turns:HOST:PORT",
                ));
            }
            let relays = server.urls.iter().any(|url| url.starts_with("turn"));
            if relays && (server.username.is_empty() || server.credential.is_empty()) {
                let allowed = "a name and a credential for a TURN server";
                return Err(ConfigError::range("servers.username", &server.username, allowed));
            }
        }
        // The drone itself reaches a relay by UDP only; viewers reach it by whatever its address says.
        let by_udp = |url: &String| url.starts_with("turn:") && !url.ends_with("transport=tcp");
        if self.relay_only && !self.servers.iter().any(|server| server.urls.iter().any(by_udp)) {
            let allowed = "false, or a TURN server by UDP among servers (turn:HOST:PORT)";
            return Err(ConfigError::range("relay_only", true, allowed));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_loopback_and_nonsense_is_refused_without_its_secret() {
        let default = StreamConfig::default();
        assert_eq!(default.validate(), Ok(()));
        assert!(default.addresses.iter().all(IpAddr::is_loopback));
        let server = |url: &str, username: &str, credential: &str| IceServer {
            urls: vec![url.into()],
            username: username.into(),
            credential: credential.into(),
        };
        for (config, word) in [
            (StreamConfig { addresses: vec![], ..default.clone() }, "addresses"),
            (StreamConfig { viewers: 0, ..default.clone() }, "viewers"),
            (StreamConfig { servers: vec![server("http://x", "", "")], ..default.clone() }, "servers.urls"),
            (
                StreamConfig { servers: vec![server("turn:x", "me", "")], ..default.clone() },
                "servers.username",
            ),
            (StreamConfig { relay_only: true, ..default.clone() }, "relay_only"),
            (
                StreamConfig {
                    relay_only: true,
                    servers: vec![server("turn:x?transport=tcp", "me", "hush")],
                    ..default.clone()
                },
                "relay_only",
            ),
            (StreamConfig { bitrate_least: 10, ..default.clone() }, "bitrate_least"),
            (StreamConfig { bitrate_most: 100_000, ..default.clone() }, "bitrate_most"),
        ] {
            let error = config.validate().unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("allowed"), "{error}");
        }
        assert!(!format!("{:?}", server("turn:x", "me", "hush")).contains("hush"));
    }
}
