//! The navigation service: where to fly next, around what is near, along the round.
//!
//! Twenty times a second it moves the certainty grid under the drone, enters the new echoes, asks the Vector
//! Field Histogram for a direction, and wishes a velocity, a heading and a height for the next 0.3 s. The
//! pilot and its shield decide what becomes of the wish.
//!
//! - [`place`], [`senses`]: what is believed of poses and echoes
//! - [`track`], [`steer`]: following a planned line and giving way
//! - [`fence`]: the speed towards what is near
//! - [`blockage`]: when a way counts as blocked
//! - [`mission`]: commands, phases of the pilot, the pad
//! - [`journey`]: planning in slices, what was seen, what is left out and why; survives a restart
//! - `aside`: stepping aside for people in narrow places
//! - `firm`: waiting where the velocity is known
//! - `setbacks`: where the way was blocked before
//! - [`atlas`]: what is known of the building
//! - [`core`]: all of it together, without ports
//!
//! Nothing here allocates after start but the planning slices of [`journey`].
#![forbid(unsafe_code)]

mod aside;
pub mod atlas;
pub mod blockage;
pub mod config;
pub mod core;
pub mod explore;
pub mod fence;
mod firm;
pub mod journey;
pub mod mission;
mod obstruct;
pub mod place;
mod report;
pub mod senses;
mod service;
mod setbacks;
pub mod steer;
pub mod track;
mod trim;
mod words;

pub use service::{Navigation, atlas_of};
