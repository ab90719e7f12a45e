//! The pilot: decides who moves the drone, and flies it.
//!
//! [`PilotCore`] is the whole of it without ports: messages in, [`ipc_types::Channels`] and
//! [`ipc_types::PilotState`] out, time as an argument. [`Pilot`] gives it ports.
#![forbid(unsafe_code)]

mod command;
mod config;
mod core;
mod evidence;
mod flying;
mod ground;
mod inputs;
mod manual;
mod phases;
mod report;
mod resume;
mod senses;
mod service;
mod standing;

pub use crate::config::{LandingConfig, ManualConfig, PilotConfig, TakeOffConfig};
pub use crate::core::{Craft, PilotCore};
pub use crate::service::Pilot;
