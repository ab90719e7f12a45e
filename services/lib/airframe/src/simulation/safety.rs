//! The safety pilot of a flight: what he sees of it, and his radio.

use super::Simulation;
use crate::radio::{SafetyPilot, Sight};

impl Simulation {
    /// He looks, and the radio sends.
    pub(super) fn radio_sends(&mut self) {
        let sight = self.sight();
        if let Some(pilot) = &mut self.radio {
            self.controller.radio(self.now_ns, &pilot.step(&sight));
        }
    }

    /// Whether the system asks the safety pilot to arm; nothing to whoever has no radio.
    pub fn ask_to_arm(&mut self, asked: bool) {
        self.asked_to_arm = asked;
    }

    /// Who holds the radio, if there is one.
    #[must_use]
    pub fn safety_pilot(&self) -> Option<&SafetyPilot> {
        self.radio.as_ref()
    }

    fn sight(&self) -> Sight {
        let motion = self.craft.motion();
        let (sin, cos) = motion.angles().2.sin_cos();
        let v = motion.velocity;
        Sight {
            time_s: self.now_ns as f64 * 1e-9,
            height_m: self.craft.lowest_m(),
            climb_m_s: v.z,
            velocity_m_s: [cos * v.x + sin * v.y, cos * v.y - sin * v.x],
            tilt_rad: motion.tilt(),
            armed: self.controller.is_armed(),
            asked: self.asked_to_arm,
        }
    }
}
