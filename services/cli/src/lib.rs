//! What the command line shares with the tests: where the system's files are, and whole flights.
#![forbid(unsafe_code)]

pub mod building;
pub mod flight;
pub mod interrupt;
pub mod orders;
pub mod place;
pub mod witness;
