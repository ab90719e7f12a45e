//! What the simulator flies: a quadrotor, its battery, its sonars, the world around it and its flight controller.
#![forbid(unsafe_code)]

pub mod acoustics;
pub mod camera;
pub mod clutter;
pub mod controller;
pub mod people;
pub mod picture;
pub mod radio;
pub mod score;
pub mod simulation;
pub mod vehicle;
pub mod world;

#[cfg(test)]
mod testing;
