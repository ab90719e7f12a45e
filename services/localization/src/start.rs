//! Where the drone starts: the system's pad, or what the configuration says.

use crate::StartSection;
use floorplan::{Cell, Plan};
use runtime::{Start, StartError};

/// A place and a heading in the plan frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) heading: f32,
}

pub(crate) fn place(config: &StartSection, start: &Start, plan: &Plan) -> Result<Place, StartError> {
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
