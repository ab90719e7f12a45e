//! Navigation.
#![forbid(unsafe_code)]
pub mod blockage;
pub mod config;
pub mod place;
pub mod senses;
pub mod steer;
pub mod track;
