//! The simulator service: one flight of `airframe` behind the ports of real devices.
//!
//! `flight` and `flow` open its serial lines as they open real ports (a pseudo-terminal each, [`PtyDevices`];
//! in lockstep, memory); `sonar` triggers pings and hears echoes over `sim/ping` and `sim/echo`. The truth
//! goes out on `sim/truth`, for scorers. The camera's picture is rendered by a second service, [`Scenery`].

mod config;
mod pty;
mod scenery;
mod service;
mod view;
mod world;

pub use config::{CameraConfig, Config};
pub use pty::PtyDevices;
pub use scenery::Scenery;
pub use service::Simulator;
pub use world::{build_world, start_place, world_pad};
