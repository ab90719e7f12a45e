//! What navigation knows of the building before it flies: read-only, shared between flights.

use crate::track::SHORTEST_M;
use floorplan::{DistanceField, Plan, Rooms, Sidecar};
use patrol::{Costmap, Limits};
use std::sync::Arc;

/// Farther than this from what is not free counts as open, metres.
const FIELD_M: f32 = 2.0;

/// The plan and what follows from it.
#[derive(Debug)]
pub struct Atlas {
    plan: Arc<Plan>,
    rooms: Rooms,
    pad: Option<(f32, f32)>,
    field: DistanceField,
    map: Costmap,
}

impl Atlas {
    /// Works out distances and costs for a vehicle of this radius.
    #[must_use]
    pub fn new(plan: Arc<Plan>, rooms: Rooms, sidecar: &Sidecar, radius_m: f32) -> Self {
        let limits = Limits { radius_m: radius_m.max(SHORTEST_M), ..Limits::default() };
        Self {
            field: DistanceField::of_not_free(&plan, FIELD_M),
            map: Costmap::new(&plan, &rooms, &sidecar.doors, &limits),
            pad: sidecar.pad.map(|pad| (pad.x, pad.y)),
            plan,
            rooms,
        }
    }

    /// The plan itself.
    #[must_use]
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Distance to what is not free.
    #[must_use]
    pub fn field(&self) -> &DistanceField {
        &self.field
    }

    /// The rooms' names and areas.
    #[must_use]
    pub fn rooms(&self) -> &Rooms {
        &self.rooms
    }

    /// The pad, when the sidecar file names one.
    #[must_use]
    pub fn pad(&self) -> Option<(f32, f32)> {
        self.pad
    }

    /// Where a vehicle may fly by the plan alone.
    #[must_use]
    pub fn map(&self) -> &Costmap {
        &self.map
    }

    /// The plan's hash as messages carry it.
    #[must_use]
    pub fn plan_hash(&self) -> u32 {
        let hash = self.plan.hash();
        (hash ^ (hash >> 32)) as u32
    }
}
