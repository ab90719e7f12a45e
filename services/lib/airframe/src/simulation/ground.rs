//! What lies under the airframe.

use crate::vehicle::{Ground, Quadrotor};
use crate::world::{PadPlace, Role, Solid, World};

/// Steps between two looks at the height below: 2.5 mm of way at half a metre a second.
const SURFACE_STEPS: u64 = 5;
/// Steps between two looks at what the flow sensor sees.
const TEXTURE_STEPS: u64 = 20;
/// Feet may press this deep into a surface and still stand on it, metres.
const PRESS_M: f64 = 0.03;
/// A person nearer than this walks through the flow sensor's picture, metres.
const PERSON_M: f32 = 0.7;

/// Remembers the ground between looks.
#[derive(Clone, Debug)]
pub(super) struct GroundWatch {
    surface_m: f64,
    soft: bool,
    moving: bool,
    carpets: Vec<Solid>,
}

impl GroundWatch {
    pub(super) fn new(world: &World, place: PadPlace) -> Self {
        let carpets = world.solids().iter().filter(|s| s.role == Role::SoftFloor).copied().collect();
        let surface_m = f64::from(world.surface_below(place.x, place.y, 0.05));
        Self { surface_m, soft: false, moving: false, carpets }
    }

    pub(super) fn look(&mut self, world: &World, craft: &Quadrotor, step: u64) {
        let place = craft.motion().position;
        let (x, y) = (place.x as f32, place.y as f32);
        if step.is_multiple_of(SURFACE_STEPS) {
            let feet = place.z - craft.shape().foot_drop_m + PRESS_M;
            self.surface_m = f64::from(world.surface_below(x, y, feet as f32));
        }
        if step.is_multiple_of(TEXTURE_STEPS) {
            self.soft = self.carpets.iter().any(|carpet| carpet.outline_distance(x, y) <= 0.0);
            self.moving = world.people().people().iter().any(|person| {
                let solid = person.solid();
                person.walks() && (solid.x - x).hypot(solid.y - y) < PERSON_M
            });
        }
    }

    pub(super) fn surface_m(&self) -> f64 {
        self.surface_m
    }

    pub(super) fn under_flow(&self) -> Ground {
        Ground { surface_m: self.surface_m, soft: self.soft, moving: self.moving, contrast: 1.0 }
    }
}
