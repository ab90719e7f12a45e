//! The truth, for scorers.

use super::Simulation;

/// The truth of one moment; see `sim/truth` for the fields' meaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthState {
    /// Seconds since the flight began.
    pub time_s: f64,
    /// World frame, centre of mass, metres.
    pub x_m: f32,
    /// World frame, centre of mass, metres.
    pub y_m: f32,
    /// Lowest point of the airframe above the floor, metres.
    pub z_m: f32,
    /// Right side down positive.
    pub roll_rad: f32,
    /// Nose down positive.
    pub pitch_rad: f32,
    /// Counter-clockwise from world x.
    pub yaw_rad: f32,
    /// World frame.
    pub velocity_m_s: [f32; 3],
    /// Airframe's cylinder to the nearest solid; negative when inside; at most 1.5 m.
    pub clearance_m: f32,
    /// Smallest clearance so far while airborne; 1.5 m before the first take-off.
    pub min_clearance_m: f32,
    /// At the battery's terminals.
    pub volts: f32,
    /// Share of the charge left.
    pub charge: f32,
    /// Touches so far.
    pub contacts: u32,
    /// The controller is armed.
    pub armed: bool,
    /// Feet or rim touch a surface.
    pub on_ground: bool,
}

impl Simulation {
    /// The truth now.
    #[must_use]
    pub fn truth(&self) -> TruthState {
        let motion = self.craft.motion();
        let (roll, pitch, yaw) = motion.angles();
        TruthState {
            time_s: self.now_ns as f64 * 1e-9,
            x_m: motion.position.x as f32,
            y_m: motion.position.y as f32,
            z_m: self.craft.lowest_m() as f32,
            roll_rad: roll as f32,
            pitch_rad: pitch as f32,
            yaw_rad: yaw as f32,
            velocity_m_s: [motion.velocity.x as f32, motion.velocity.y as f32, motion.velocity.z as f32],
            clearance_m: self.touch.clearance_m(),
            min_clearance_m: self.touch.min_clearance_m(),
            volts: self.craft.battery().volts() as f32,
            charge: self.craft.battery().charge() as f32,
            contacts: self.touch.contacts(),
            armed: self.is_powered() && self.controller.is_armed(),
            on_ground: self.touch.on_ground(),
        }
    }
}
