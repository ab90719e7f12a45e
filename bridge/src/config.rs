//! `bridge.toml`.

use runtime::{ConfigError, Validate, within};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Most endpoints of each kind.
const MAX_ENDPOINTS: usize = 8;

/// What the bridge is told. Paths are relative to the manifest's directory.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BridgeConfig {
    /// Directory of the certificates that `sereno certs` makes.
    pub certificates: String,
    /// Where clients may connect: `tls/ADDRESS:PORT`, no other protocol.
    pub listen: Vec<String>,
    /// Zenoh routers to connect to: `tls/HOST:PORT`.
    pub connect: Vec<String>,
    /// Who is silent for so long is gone, milliseconds.
    pub lease_ms: u32,
    /// Most connections at a time.
    pub max_connections: u32,
    /// How often the drone tells its clock, Hz.
    pub beacon_hz: f64,
    /// Orders a second that one certificate may give in the long run; as many again at once.
    pub orders_hz: f64,
    /// Sticks a second that one certificate may send.
    pub sticks_hz: f64,
    /// Most messages a second of a topic that is not in `rates_hz`.
    pub default_hz: f64,
    /// Most messages a second by topic; 0: it is sent to whoever asks for it, and to nobody else.
    pub rates_hz: BTreeMap<String, f64>,
}

impl Default for BridgeConfig {
    fn default() -> Self {
        let rates = [
            ("localization/pose", 20.0),
            ("localization/particles", 2.0),
            ("navigation/grid", 5.0),
            ("navigation/polar", 5.0),
            ("navigation/patrol", 2.0),
            ("navigation/setpoint", 10.0),
            ("sonar/ranges", 17.0),
            ("pilot/state", 20.0),
            ("pilot/channels", 10.0),
            ("flight/attitude", 15.0),
            ("camera/video", 60.0),
            ("camera/still", 2.0),
        ];
        Self {
            certificates: "certs".to_owned(),
            listen: vec!["tls/127.0.0.1:7447".to_owned()],
            connect: Vec::new(),
            lease_ms: 2000,
            max_connections: 32,
            beacon_hz: 20.0,
            orders_hz: 10.0,
            sticks_hz: 100.0,
            default_hz: 5.0,
            rates_hz: rates.into_iter().map(|(topic, hz)| (topic.to_owned(), hz)).collect(),
        }
    }
}

fn endpoints(field: &'static str, endpoints: &[String]) -> Result<(), ConfigError> {
    if endpoints.len() > MAX_ENDPOINTS {
        return Err(ConfigError::range(field, endpoints.len(), format!("at most {MAX_ENDPOINTS} endpoints")));
    }
    for endpoint in endpoints {
        let address = endpoint.strip_prefix("tls/").unwrap_or("");
        let port = address
            .rsplit_once(':')
            .filter(|(host, _)| !host.is_empty())
            .map(|(_, port)| port.parse::<u16>());
        let plain = address.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-._:[]".contains(&byte));
        if !(plain && matches!(port, Some(Ok(_)))) {
            return Err(ConfigError::range(field, endpoint, "tls/HOST:PORT, as tls/127.0.0.1:7447"));
        }
    }
    Ok(())
}

impl Validate for BridgeConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        if self.certificates.is_empty() {
            return Err(ConfigError::range("certificates", "\"\"", "a directory"));
        }
        endpoints("listen", &self.listen)?;
        endpoints("connect", &self.connect)?;
        within("lease_ms", f64::from(self.lease_ms), 500.0..=2000.0)?;
        within("max_connections", f64::from(self.max_connections), 1.0..=256.0)?;
        within("beacon_hz", self.beacon_hz, 5.0..=50.0)?;
        within("orders_hz", self.orders_hz, 1.0..=100.0)?;
        within("sticks_hz", self.sticks_hz, 20.0..=500.0)?;
        within("default_hz", self.default_hz, 0.0..=60.0)?;
        for (topic, hz) in &self.rates_hz {
            if ipc_types::visit_topic(topic, &mut Known).is_none() {
                return Err(ConfigError::range("rates_hz", topic, "the name of a topic"));
            }
            within("rates_hz", *hz, 0.0..=60.0)?;
        }
        Ok(())
    }
}

struct Known;

impl ipc_types::TopicVisitor for Known {
    type Output = ();
    fn visit<T: ipc_types::Message>(&mut self) {}
}

impl BridgeConfig {
    /// Shortest time between two messages of a topic, nanoseconds; `None` when it is sent on demand only.
    #[must_use]
    pub fn period_ns(&self, topic: &str) -> Option<u64> {
        let hz = self.rates_hz.get(topic).copied().unwrap_or(self.default_hz);
        (hz > 0.0).then(|| (1e9 / hz) as u64)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use runtime::parse_config;

    #[test]
    fn the_defaults_are_in_range_and_listen_to_this_machine_alone() {
        let config = BridgeConfig::default();
        config.validate().unwrap();
        assert!(config.listen.iter().all(|endpoint| endpoint.starts_with("tls/127.0.0.1:")));
    }

    #[test]
    fn what_is_not_tls_or_out_of_range_is_refused_by_name() {
        for (text, said) in [
            (
                "listen = [\"tcp/127.0.0.1:7447\"]",
                "bridge.toml: listen = tcp/127.0.0.1:7447 is out of range: allowed is tls/",
            ),
            ("listen = [\"tls/127.0.0.1\"]", "listen"),
            ("listen = [\"tls/127.0.0.1:99999\"]", "listen"),
            ("connect = [\"tls/hub:7447#enable_mtls=false\"]", "connect"),
            ("lease_ms = 10000", "lease_ms = 10000 is out of range: allowed is 500..=2000"),
            ("[rates_hz]\n'localization/poze' = 3", "rates_hz = localization/poze"),
            ("[rates_hz]\n'localization/pose' = 1000", "rates_hz = 1000"),
            ("password = \"x\"", "password"),
        ] {
            let error = parse_config::<BridgeConfig>("bridge.toml", text).unwrap_err().to_string();
            assert!(error.starts_with("bridge.toml: ") && error.contains(said), "{error}");
        }
    }
}
