//! What the simulator flies: a quadrotor, its battery, its sonars, the world around it and its flight controller.
#![forbid(unsafe_code)]

pub mod acoustics;
pub mod clutter;
pub mod people;
pub mod world;
pub mod controller;
pub mod vehicle;

#[cfg(test)]
mod testing;
