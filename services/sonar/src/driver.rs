//! What fires sensors and listens.

use ipc_types::MAX_SONARS;

/// What one sensor gave back after a ping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// Width of the echo pulse, seconds: the time of flight both ways.
    Pulse(f32),
    /// The sensor worked and heard nothing.
    NoEcho,
    /// Not a sound: broken, unplugged.
    Silent,
}

/// The answers to one trigger.
#[derive(Clone, Copy, Debug)]
pub struct Collected {
    /// When the ping left.
    pub ping_ns: u64,
    /// By index in the vehicle's list of sonars; `None` for sensors that said nothing of this ping.
    pub answers: [Option<Answer>; MAX_SONARS],
}

/// Fires sensors and collects their echoes, without ever waiting.
pub trait SonarDriver {
    /// Fires the sensors of `group` (bit = index in the vehicle's list) together. Echoes of an earlier
    /// trigger that were not collected are gone. False when the driver could not.
    fn trigger(&mut self, group: u32, now: u64) -> bool;

    /// The answers to the last trigger, once, as soon as the last sensor is done.
    fn collect(&mut self, now: u64) -> Option<Collected>;

    /// Answers that made no sense, since start.
    fn refused(&self) -> u64;
}
