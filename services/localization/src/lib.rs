//! Says where the drone is: the particle filter of [`mcl`] around the topics of the house.
//!
//! The particle set is a message. An update reads the last set through the service's own subscription and
//! writes the next into a fresh loan; nothing is converted, and a restarted process goes on from the set
//! that the keeper holds.

mod attitude;
mod clutter;
mod config;
mod flow;
mod kalman;
mod news;
mod plain;
mod pose;
mod predict;
mod rate;
mod seek;
mod service;
mod set;
mod start;
mod sweep;
mod tally;
mod velocity;

pub use attitude::{Attitudes, Mean};
pub use config::{
    FilterKind, LocalizationConfig, MotionSection, PopulationSection, SonarSection, StartFrom, StartSection,
    TrustSection,
};
pub use flow::Flows;
pub use service::Localization;
