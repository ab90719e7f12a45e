//! Configurations of zenoh: TLS 1.3 with certificates on both sides, nobody sought or found by multicast or gossip, and
//! nothing allowed but what stands here.

use crate::acl;
use crate::edit::{MAX_EDIT, MAX_PICTURE};
use crate::roles::Clients;
use crate::wishes::MAX_WISH;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

/// Larger messages are not put together, bytes: the largest that comes to a drone is a change with the picture of a plan.
const MAX_TO_DRONE: u64 = (MAX_EDIT + MAX_PICTURE + 4096) as u64;
/// The largest telemetry, a full set of particles, is 1.6 MB.
const MAX_TO_CLIENT: u64 = 4_194_304;
/// Longest JSON of an order or sticks, bytes.
pub const MAX_ORDER: usize = 4096;
/// Longest message of a video session, bytes.
pub const MAX_SIGNAL: usize = 65_536;
/// Connections that have not yet shown a certificate, at a time.
const MAX_STRANGERS: u32 = 16;

/// Certificates in memory, PEM.
#[derive(Clone, PartialEq, Eq)]
pub struct Identity {
    /// The authority's certificate.
    pub authority: String,
    /// The certificate.
    pub certificate: String,
    /// Its private key.
    pub key: String,
}

impl std::fmt::Debug for Identity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // Never the key: this may end in a log.
        f.write_str("Identity")
    }
}

fn base(mode: &str, lease_ms: u32, max_message: u64, max_connections: u32) -> Value {
    json!({
        "mode": mode,
        "scouting": {
            "multicast": { "enabled": false },
            "gossip": { "enabled": false },
        },
        "adminspace": { "enabled": false },
        "timestamping": { "enabled": false },
        "transport": {
            "unicast": {
                "open_timeout": 4000,
                "accept_timeout": 4000,
                "accept_pending": MAX_STRANGERS,
                "max_sessions": max_connections,
                "max_links": 1,
            },
            "link": {
                "protocols": ["tls"],
                "tx": {
                    "lease": lease_ms,
                    "keep_alive": 4,
                    // Who does not read for half a second is cut off, so that nothing waits for him.
                    "queue": { "congestion_control": { "block": { "wait_before_close": 500_000 } } },
                },
                "rx": { "max_message_size": max_message },
            },
            "shared_memory": { "enabled": false },
        },
    })
}

fn tls(identity: &Identity) -> Value {
    let encode = |text: &str| STANDARD.encode(text);
    json!({
        "root_ca_certificate_base64": encode(&identity.authority),
        "listen_certificate_base64": encode(&identity.certificate),
        "listen_private_key_base64": encode(&identity.key),
        "connect_certificate_base64": encode(&identity.certificate),
        "connect_private_key_base64": encode(&identity.key),
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    })
}

fn set(config: &mut Value, path: &[&str], value: Value) {
    let mut place = config;
    for part in path {
        place = &mut place[*part];
    }
    *place = value;
}

/// Nothing larger than an order is taken on the keys of orders and sticks, than a wish on those of wishes, nor than 64 KiB on
/// any.
fn sizes() -> Value {
    json!([
        { "id": "orders", "flows": ["ingress"], "messages": ["put", "query"], "size_limit": MAX_ORDER,
          "key_exprs": ["sereno/*/command/**", "sereno/*/sticks/**"] },
        { "id": "signals", "flows": ["ingress"], "messages": ["put", "query"], "size_limit": MAX_SIGNAL,
          "key_exprs": ["sereno/*/signal/**"] },
        { "id": "changes", "flows": ["ingress"], "messages": ["put", "query"],
          "size_limit": MAX_EDIT + MAX_PICTURE, "key_exprs": ["sereno/*/edit/**"] },
        { "id": "wishes", "flows": ["ingress"], "messages": ["put", "query"], "size_limit": MAX_WISH,
          "key_exprs": ["sereno/*/wish/**"] },
    ])
}

/// Where a drone is connected to.
#[must_use]
pub fn listening(
    drone: &str,
    clients: &Clients,
    identity: &Identity,
    endpoints: &[String],
    lease_ms: u32,
    max_connections: u32,
) -> String {
    let mut config = base("peer", lease_ms, MAX_TO_DRONE, max_connections);
    set(&mut config, &["transport", "link", "tls"], tls(identity));
    set(
        &mut config,
        &["listen"],
        json!({ "endpoints": endpoints, "exit_on_failure": true, "timeout_ms": 0 }),
    );
    set(&mut config, &["connect"], json!({ "endpoints": [] }));
    set(&mut config, &["access_control"], acl::of_drone(drone, clients));
    set(&mut config, &["low_pass_filter"], sizes());
    config.to_string()
}

/// How a drone connects to a router.
#[must_use]
pub fn connecting(
    drone: &str,
    clients: &Clients,
    identity: &Identity,
    endpoint: &str,
    lease_ms: u32,
) -> String {
    let mut config = base("client", lease_ms, MAX_TO_DRONE, 1);
    set(&mut config, &["transport", "link", "tls"], tls(identity));
    set(
        &mut config,
        &["connect"],
        json!({ "endpoints": [endpoint], "exit_on_failure": true, "timeout_ms": 0 }),
    );
    set(&mut config, &["access_control"], acl::of_drone(drone, clients));
    set(&mut config, &["low_pass_filter"], sizes());
    config.to_string()
}

/// The whole configuration of a program that speaks to drones. One endpoint is connected to as a client, several at
/// the same time as a peer that nobody connects to.
#[must_use]
pub fn client(
    name: &str,
    drones: &[String],
    endpoints: &[&str],
    authority: &str,
    certificate: &str,
    key: &str,
) -> String {
    let mode = if endpoints.len() == 1 { "client" } else { "peer" };
    let mut config = base(mode, 2000, MAX_TO_CLIENT, 64);
    let identity = Identity { authority: authority.into(), certificate: certificate.into(), key: key.into() };
    set(&mut config, &["transport", "link", "tls"], tls(&identity));
    set(&mut config, &["connect"], json!({ "endpoints": endpoints }));
    set(&mut config, &["listen"], json!({ "endpoints": [] }));
    set(&mut config, &["metadata"], json!({ "certificate": name, "drones": drones }));
    readable(
        "A complete configuration of zenoh for one program, with its private key: keep it to yourself.\n\
         // `metadata` is for the program: the name that ends the keys of its orders, and the drones there were.",
        &config,
    )
}

/// The configuration of a router between drones and programs, which checks their certificates as a drone would.
#[must_use]
pub fn router(
    name: &str,
    endpoints: &[&str],
    clients: &Clients,
    authority: &str,
    certificate: &str,
    key: &str,
) -> String {
    let mut config = base("router", 2000, MAX_TO_CLIENT, 256);
    let identity = Identity { authority: authority.into(), certificate: certificate.into(), key: key.into() };
    set(&mut config, &["transport", "link", "tls"], tls(&identity));
    set(&mut config, &["listen"], json!({ "endpoints": endpoints }));
    set(&mut config, &["connect"], json!({ "endpoints": [] }));
    set(&mut config, &["metadata"], json!({ "certificate": name }));
    set(&mut config, &["access_control"], acl::of_router(clients));
    set(&mut config, &["low_pass_filter"], sizes());
    readable(
        "For `zenohd --config`: a router that lets each certificate do what its role allows. Written by `sereno certs`\n\
         // from clients.toml: write it again and restart the router when that changes. Holds its private key.",
        &config,
    )
}

fn readable(comment: &str, config: &Value) -> String {
    // A value of this shape can always be written.
    format!("// {comment}\n{}\n", serde_json::to_string_pretty(config).unwrap_or_default())
}

/// A configuration that was written here, without its comment.
fn parse(text: &str) -> Option<Value> {
    let json: String = text.lines().filter(|line| !line.starts_with("//")).collect();
    serde_json::from_str(&json).ok()
}

/// The endpoints in a configuration that [`client`] or [`router`] wrote.
#[must_use]
pub fn endpoints_of(text: &str) -> Option<Vec<String>> {
    let config = parse(text)?;
    for part in ["connect", "listen"] {
        let endpoints: Vec<String> = config[part]["endpoints"]
            .as_array()?
            .iter()
            .filter_map(|e| e.as_str().map(str::to_owned))
            .collect();
        if !endpoints.is_empty() {
            return Some(endpoints);
        }
    }
    None
}

/// What a configuration says of its owner.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Owner {
    /// Name of its certificate.
    pub certificate: String,
    /// The drones there were when it was written.
    pub drones: Vec<String>,
}

/// Who a configuration that [`client`] wrote belongs to.
#[must_use]
pub fn owner_of(text: &str) -> Option<Owner> {
    let config = parse(text)?;
    let metadata = &config["metadata"];
    let drones =
        metadata["drones"].as_array()?.iter().filter_map(|drone| drone.as_str().map(str::to_owned)).collect();
    Some(Owner { certificate: metadata["certificate"].as_str()?.to_owned(), drones })
}
