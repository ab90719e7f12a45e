//! Where the drone starts: the system's pad, what the configuration says, a room, or nobody knows.

use crate::{StartFrom, StartSection};
use floorplan::{Cell, Plan, Rooms};
use runtime::{Start, StartError};
use std::sync::Arc;

/// What is known at the start.
pub(crate) enum From {
    /// Place and heading.
    Pad(Place),
    /// The room, by its number.
    Room { rooms: Arc<Rooms>, room: usize },
    /// Nothing.
    Unknown,
}

pub(crate) fn from(config: &StartSection, start: &Start, plan: &Plan) -> Result<From, StartError> {
    match config.from {
        StartFrom::Pad => place(config, start, plan).map(From::Pad),
        StartFrom::Unknown => Ok(From::Unknown),
        StartFrom::Room => {
            let rooms =
                Rooms::of(&start.sidecar_name(), &start.sidecar()?, plan).map_err(StartError::invalid)?;
            let names = || (0..rooms.len()).map(|room| rooms.name(room));
            let room = names().position(|name| name == config.room).ok_or_else(|| {
                StartError::Invalid(format!(
                    "start.room is \"{}\"; rooms of {}: {}",
                    config.room,
                    start.system.plan,
                    names().collect::<Vec<_>>().join(", ")
                ))
            })?;
            Ok(From::Room { rooms: Arc::new(rooms), room })
        }
    }
}

/// A place and a heading in the plan frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) heading: f32,
}

fn place(config: &StartSection, start: &Start, plan: &Plan) -> Result<Place, StartError> {
    let from_config = match (config.x_m, config.y_m, config.heading_deg) {
        (Some(x), Some(y), Some(heading)) => Some(Place { x, y, heading: heading.to_radians() }),
        _ => None,
    };
    let place = match from_config {
        Some(place) => place,
        None => {
            let name = start.sidecar_name();
            let pad = start.pad()?.ok_or_else(|| {
                StartError::Invalid(format!(
                    "{name} names no pad; add `pad: {{x: ..., y: ..., heading_deg: ...}}`, or give pad = [x, y, degrees] \
                     in the manifest's [system], or start.x_m, start.y_m and start.heading_deg in the localization \
                     configuration"
                ))
            })?;
            Place { x: pad.x, y: pad.y, heading: pad.heading_rad() }
        }
    };
    match plan.cell_at(place.x, place.y) {
        Cell::Free => Ok(place),
        cell => Err(StartError::Invalid(format!(
            "the start at x = {}, y = {} is {} on the plan {}; choose a free place",
            place.x,
            place.y,
            if cell == Cell::Occupied { "inside a wall" } else { "outside the known area" },
            start.system.plan
        ))),
    }
}
