//! How a process lives: typed ports, clock, heartbeat, configuration, logging, shutdown.
//!
//! A service is a struct with a configuration, typed ports and [`Service::step`]. It never sleeps, never
//! reads a clock and never opens a socket that it was not given. This crate runs the same struct on two
//! buses:
//!
//! - **shared memory** ([`main`]): its own process, iceoryx2 publish-subscribe and events, woken by data
//!   or by its tick, heartbeats out;
//! - **lockstep** ([`Lockstep`]): all services in one process on a simulated clock, deterministic from
//!   one seed, many times faster than real time.
//!
//! Both have one port API ([`Input`], [`Output`]) with equal depth, overflow (oldest dropped, counted),
//! history and late-joiner rules; `tests/conformance` runs one suite on both.
//!
//! This is the only services-side crate that knows iceoryx2.

mod access;
mod config;
mod counters;
mod device;
mod error;
mod health;
mod instance;
mod journal;
mod lockstep;
mod notify;
pub mod orders;
mod port;
mod ports;
mod process;
mod service;
pub mod shm;
mod start;
mod waker;

pub use config::{ConfigError, Validate, parse_config, within};
pub use device::{ByteDevice, DeviceError, Devices, MemoryDevice, NoDevices};
pub use error::StartError;
pub use instance::Instance;
pub use journal::Journal;
pub use lockstep::{Lockstep, Replay};
pub use port::{Guard, Input, Limits, Loan, Output};
pub use ports::Ports;
pub use process::{Tool, env, known_topics, load_manifest, main, monotonic_ns};
pub use service::Service;
pub use start::{Cache, Start};
pub use waker::Waker;

/// FNV-1a hash of bytes: for names, configurations and plans, never for secrets.
#[must_use]
pub fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// What stands for a name in messages, of a publisher in headers and of a topic in the step journal: its FNV-1a hash,
/// folded to 32 bits.
#[must_use]
pub fn name_hash(name: &str) -> u32 {
    let hash = fnv(name.as_bytes());
    (hash ^ (hash >> 32)) as u32
}

/// One step of the SplitMix64 generator: turns any seed into well-mixed ones (Steele, Lea, Flood 2014).
#[must_use]
pub fn mix_seed(seed: u64, salt: u64) -> u64 {
    let mut z =
        seed.wrapping_add(salt.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
