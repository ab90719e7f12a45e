//! What one flight is made of.

use crate::controller::{FailsafeSettings, Firmware};
use crate::radio::SafetyPilot;
use crate::world::ClutterLevel;

/// Where the drone stands when the flight begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartPlace {
    /// On the pad, as its heading says.
    #[default]
    Pad,
    /// Somewhere on free floor that can be flown to from the pad, any heading.
    Room,
}

/// What one flight is made of besides plan, world file and vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Unmapped things, shut doors, people.
    pub clutter: ClutterLevel,
    /// Of everything.
    pub seed: u64,
    /// Which firmware the flight controller plays.
    pub firmware: Firmware,
    /// Whether the flight controller has a magnetometer. Without, its heading begins at the compass's arbitrary zero and
    /// then drifts with the gyro's bias (up to 2.75 degrees a minute) and scale.
    pub magnetometer: bool,
    /// A radio as its receiver, with MSP frames beside it, and who holds the radio; otherwise MSP is the receiver.
    pub radio: Option<SafetyPilot>,
    /// How its failsafe is set.
    pub failsafe: FailsafeSettings,
    /// Where the drone stands at first.
    pub start: StartPlace,
    /// Share of the battery's charge at the start.
    pub charge: f64,
    /// Sonars that never answer: bit = index in the vehicle's list.
    pub dead_sonars: u32,
    /// Carried off once in flight by so much, metres; 0: never.
    pub displaced_m: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            clutter: ClutterLevel::Full,
            seed: 0,
            firmware: Firmware::default(),
            magnetometer: true,
            radio: None,
            failsafe: FailsafeSettings::default(),
            start: StartPlace::default(),
            charge: 1.0,
            dead_sonars: 0,
            displaced_m: 0.0,
        }
    }
}
