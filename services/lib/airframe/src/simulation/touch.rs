//! Whether the airframe touches anything, and what that does to it.

use crate::vehicle::{Push, Quadrotor, TOUCH_LIMIT_M_S, TOUCH_LIMIT_RAD};
use crate::world::{CLEARANCE_CAP_M, World};
use nalgebra::Vector3;

/// Steps between two measurements of clearance by how much there was: half of the way that a craft at 2 m/s
/// needs to come into contact.
const FAR_M: f32 = 0.3;
const FAR_STEPS: u64 = 20;
const NEAR_STEPS: u64 = 5;
/// A touch is over when this much clearance is back, metres.
const CLEAR_M: f32 = 0.01;
/// Higher than this above the surface below, the craft is in flight, metres.
const AIRBORNE_M: f64 = 0.05;
/// Offset of the differences that tell where a solid is, metres.
const PROBE_M: f32 = 0.02;

/// Clearance, contacts, and the solid that pushes.
#[derive(Clone, Debug)]
pub(super) struct Touch {
    clearance: f32,
    least: f32,
    contacts: u32,
    inside: bool,
    on_ground: bool,
    /// The landing in progress is counted as a contact.
    hard: bool,
    push: Option<Push>,
}

impl Touch {
    pub(super) fn new() -> Self {
        Self {
            clearance: CLEARANCE_CAP_M,
            least: CLEARANCE_CAP_M,
            contacts: 0,
            inside: false,
            on_ground: true,
            hard: false,
            push: None,
        }
    }

    pub(super) fn look(&mut self, world: &World, craft: &Quadrotor, surface_m: f64, step: u64) {
        let lowest = craft.lowest_m();
        self.floor(craft, lowest, surface_m);
        let every = if self.inside {
            1
        } else if self.clearance < FAR_M {
            NEAR_STEPS
        } else {
            FAR_STEPS
        };
        if step.is_multiple_of(every) {
            self.solids(world, craft, lowest > surface_m + AIRBORNE_M);
        }
    }

    /// The floor, the pad or whatever is stood on: a landing, or too fast or too tilted for one.
    fn floor(&mut self, craft: &Quadrotor, lowest: f64, surface_m: f64) {
        let motion = craft.motion();
        self.on_ground = craft.touching() || lowest <= surface_m;
        let hard =
            self.on_ground && (motion.velocity.z < -TOUCH_LIMIT_M_S || motion.tilt() > TOUCH_LIMIT_RAD);
        if hard && !self.hard {
            self.contacts += 1;
        }
        // One landing is one contact, however it bounces.
        self.hard = hard || self.hard && lowest <= surface_m + AIRBORNE_M;
    }

    fn solids(&mut self, world: &World, craft: &Quadrotor, airborne: bool) {
        let place = craft.motion().position;
        let (x, y, cover) = (place.x as f32, place.y as f32, craft.cover());
        let (bottom, height, radius) = (cover.bottom_m as f32, cover.height_m as f32, cover.radius_m as f32);
        let measure =
            |dx: f32, dy: f32, dz: f32| world.clearance(x + dx, y + dy, bottom + dz, height, radius);
        self.clearance = measure(0.0, 0.0, 0.0);
        if airborne {
            self.least = self.least.min(self.clearance);
        }
        if self.clearance > 0.0 {
            self.push = None;
            self.inside &= self.clearance < CLEAR_M;
            return;
        }
        if !self.inside {
            self.inside = true;
            self.contacts += 1;
        }
        let slope = |plus: f32, minus: f32| f64::from(plus - minus);
        let away = Vector3::new(
            slope(measure(PROBE_M, 0.0, 0.0), measure(-PROBE_M, 0.0, 0.0)),
            slope(measure(0.0, PROBE_M, 0.0), measure(0.0, -PROBE_M, 0.0)),
            slope(measure(0.0, 0.0, PROBE_M), measure(0.0, 0.0, -PROBE_M)),
        );
        let normal = away.try_normalize(1e-4).or_else(|| (-craft.motion().velocity).try_normalize(1e-3));
        self.push = normal.map(|normal| Push { normal, depth_m: f64::from(-self.clearance) });
    }

    pub(super) fn push(&self) -> Option<Push> {
        self.push
    }
    pub(super) fn clearance_m(&self) -> f32 {
        self.clearance
    }
    pub(super) fn min_clearance_m(&self) -> f32 {
        self.least
    }
    pub(super) fn contacts(&self) -> u32 {
        self.contacts
    }
    pub(super) fn on_ground(&self) -> bool {
        self.on_ground
    }
}
