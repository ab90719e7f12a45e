//! What navigation knows of the building before it flies: read-only, shared between flights.

use crate::track::SHORTEST_M;
use floorplan::{DistanceField, Plan, Rooms, Sidecar};
use patrol::{Costmap, Limits, Progress, Round, Seen, Wishes};
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
    wishes: Wishes,
}

impl Atlas {
    /// Works out distances and costs for a vehicle of this radius. No-fly zones are not free.
    #[must_use]
    pub fn new(plan: Arc<Plan>, rooms: Rooms, sidecar: &Sidecar, radius_m: f32) -> Self {
        let open = plan.without(&sidecar.no_fly);
        let open = open.as_ref().unwrap_or(&plan);
        let limits = Limits { radius_m: radius_m.max(SHORTEST_M), ..Limits::default() };
        Self {
            field: DistanceField::of_not_free(open, FIELD_M),
            map: Costmap::new(open, &rooms, &sidecar.doors, &limits),
            pad: sidecar.pad.map(|pad| (pad.x, pad.y)),
            wishes: wishes(sidecar, &rooms),
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

    /// What is wanted of a round.
    #[must_use]
    pub fn wishes(&self) -> &Wishes {
        &self.wishes
    }

    /// Where a vehicle may fly by the plan alone.
    #[must_use]
    pub fn map(&self) -> &Costmap {
        &self.map
    }

    /// Rooms that a round from the pad leaves out by the plan alone, with the reason; `None` when the drone could not
    /// leave the pad at all. Works out a whole round: a second or two.
    #[must_use]
    pub fn left_out(&self) -> Option<Vec<(&str, String)>> {
        let pad = self.pad?;
        let seen = Seen::new(&self.map);
        let mut round = Round::new(&self.map, self.rooms.len(), pad, pad, &seen, &self.wishes);
        loop {
            match round.advance(&self.map, &seen, usize::MAX) {
                Progress::Working => {}
                Progress::Failed => return None,
                Progress::Done => break,
            }
        }
        let skipped = round.rooms().iter().enumerate().filter_map(|(room, plan)| Some((room, plan.skipped?)));
        Some(
            skipped
                .map(|(room, obstacle)| {
                    let name = self.rooms.name(room);
                    (name, obstacle.reason(name, self.map.doors()))
                })
                .collect(),
        )
    }

    /// The plan's hash as messages carry it.
    #[must_use]
    pub fn plan_hash(&self) -> u32 {
        let hash = self.plan.hash();
        (hash ^ (hash >> 32)) as u32
    }
}

/// The side file's round, with rooms by their number.
fn wishes(sidecar: &Sidecar, rooms: &Rooms) -> Wishes {
    let numbers = |names: &[String]| -> Vec<usize> {
        names.iter().filter_map(|name| (0..rooms.len()).find(|room| rooms.name(*room) == name)).collect()
    };
    let round = &sidecar.round;
    Wishes {
        first: numbers(&round.order),
        leave_out: numbers(&round.leave_out),
        points: round.points.iter().map(|point| Some((point.x, point.y))).collect(),
    }
}
