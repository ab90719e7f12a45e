//! `sim/...`: simulation only. No service but the scorer may read `sim/truth`.

use crate::field::{fields, message};

/// Most people that walk in a world.
pub const MAX_PEOPLE: usize = 16;

message! {
    /// The trigger of a ping group, from `sonar`'s simulator driver.
    pub struct Ping on "sim/ping" {
        /// Bit = index in the vehicle's list of sonars.
        pub sensors: u32,
        /// Counts from 1; the echo carries it back.
        pub ping: u32,
    }
}

fields! {
    /// What one simulated sensor heard.
    pub struct EchoReading {
        /// Width of the echo pulse, seconds (time of flight both ways); NaN when nothing came back.
        pub pulse_s: f32,
        /// Index in the vehicle's list of sonars.
        pub sensor: u8,
        /// 1 when the sensor answered at all (a dead one does not).
        pub answered: u8,
        /// Always zero.
        pub reserved: u16,
    }
}

message! {
    /// The echo pulses of one ping group, sent when the last one has ended.
    pub struct Echo on "sim/echo" {
        /// When the ping left, on the simulator's clock.
        pub ping_ns: u64,
        /// The ping that this answers.
        pub ping: u32,
        /// Filled readings; more than [`crate::MAX_SONARS`] is a broken message.
        pub count: u32,
        /// One entry a sensor.
        pub readings: [EchoReading; 16],
    }
}

fields! {
    /// A person in the world.
    pub struct PersonTruth {
        /// World frame.
        pub x_m: f32,
        /// World frame.
        pub y_m: f32,
    }
}

message! {
    /// The truth: measured by, never flown by.
    pub struct Truth on "sim/truth" {
        /// Simulated time since the simulator started.
        pub time_s: f64,
        /// Plan frame (the building as built).
        pub x_m: f32,
        /// Plan frame.
        pub y_m: f32,
        /// Above the floor: the lowest point of the airframe.
        pub z_m: f32,
        /// Right side down positive.
        pub roll_rad: f32,
        /// Nose down positive.
        pub pitch_rad: f32,
        /// Plan frame.
        pub yaw_rad: f32,
        /// Plan frame.
        pub velocity_x_m_s: f32,
        /// Plan frame.
        pub velocity_y_m_s: f32,
        /// Plan frame.
        pub velocity_z_m_s: f32,
        /// Distance from the airframe's cylinder to the nearest solid now; negative when inside.
        pub clearance_m: f32,
        /// Smallest clearance so far in flight.
        pub min_clearance_m: f32,
        /// Battery voltage at the terminals.
        pub volts: f32,
        /// Share of the charge left.
        pub charge: f32,
        /// Contacts so far (a touch, a hard or a tilted landing; one a touch until clear again).
        pub contacts: u32,
        /// 1 when the controller is armed.
        pub armed: u32,
        /// 1 when the skids touch the floor or the pad.
        pub on_ground: u32,
        /// Filled people.
        pub people_used: u32,
        /// Always zero.
        pub reserved: u32,
        /// Where people are.
        pub people: [PersonTruth; 16],
    }
}

fields! {
    /// A person as a camera sees one.
    pub struct PersonView {
        /// World frame.
        pub x_m: f32,
        /// World frame.
        pub y_m: f32,
        /// From the floor to the top of the head.
        pub height_m: f32,
        /// Where the person looks, radians from world x.
        pub heading_rad: f32,
    }
}

message! {
    /// Opens the simulated camera's shutter once, from `camera`'s simulator driver.
    pub struct Shutter on "sim/shutter" {
        /// Counts from 1; the picture carries it back.
        pub frame: u64,
        /// Pixels.
        pub width: u32,
        /// Pixels.
        pub height: u32,
    }
}

message! {
    /// What the simulated camera looks at, for the process that renders it: the answer to a shutter.
    pub struct View on "sim/view" {
        /// When the light falls in.
        pub capture_ns: u64,
        /// The shutter's number.
        pub frame: u64,
        /// Simulated time since the simulator started.
        pub time_s: f64,
        /// Seed of the world: the same plan, files, settings and seed give the same world.
        pub seed: u64,
        /// Bit = index in the world's list of doors: shut now.
        pub doors_shut: u64,
        /// Centre of mass, world frame.
        pub x_m: f32,
        /// World frame.
        pub y_m: f32,
        /// Above the floor.
        pub z_m: f32,
        /// Right side down positive.
        pub roll_rad: f32,
        /// Nose down positive.
        pub pitch_rad: f32,
        /// World frame.
        pub yaw_rad: f32,
        /// Filled people; more than [`MAX_PEOPLE`] is a broken message.
        pub people_used: u32,
        /// Pixels, as the shutter says.
        pub width: u32,
        /// Pixels, as the shutter says.
        pub height: u32,
        /// Always zero.
        pub reserved: u32,
        /// Those who walk.
        pub people: [PersonView; 16],
    }
}
