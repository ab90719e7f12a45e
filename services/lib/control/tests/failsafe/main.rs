//! The failsafe table against DESIGN 4, over every set of flags, over time, and as it is printed.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod design;
mod flags;
mod numbers;
mod over_time;
mod printed;
mod sequences;
