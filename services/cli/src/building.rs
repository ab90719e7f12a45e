//! What is known of a building before anybody flies in it: where the pad is, which doors and rooms there are.

use anyhow::{Context, Result};
use floorplan::Pad;
use runtime::Start;

/// Where the pad is, and what a reader of the figures must know of the plan.
#[derive(Debug, Clone)]
pub struct Building {
    /// Where the drone starts and lands.
    pub pad: Pad,
    /// What was decided or is not known, one sentence each.
    pub remarks: Vec<String>,
}

impl Building {
    /// Looks at plan, side file and world file. The pad is what `pad` says (x, y, degrees), else the side file, else
    /// the world file, else the widest free place of the plan.
    ///
    /// # Errors
    /// A file is missing or wrong; the vehicle fits nowhere.
    pub fn survey(start: &Start, pad: Option<[f32; 3]>) -> Result<Self> {
        let (side, name) = (start.sidecar()?, start.sidecar_name());
        let given = pad.map(|[x, y, heading_deg]| Pad { x, y, heading_deg });
        let (pad, reason) = if let Some(pad) = given.or(start.pad()?) {
            (pad, if given.is_some() { "as ordered".to_owned() } else { format!("as {name} says") })
        } else if let Some(pad) = simulator::world_pad(start)? {
            (pad, format!("as {} says", start.system.world))
        } else {
            let plan = start.plan()?;
            let pad = floorplan::widest_place(&plan, start.vehicle.body.radius_m).with_context(|| {
                format!("{}: {} fits nowhere on it", start.system.plan, start.system.vehicle)
            })?;
            (pad, format!("the widest free place of the plan, for no {name}, world file or --pad names one"))
        };
        let mut remarks =
            vec![format!("pad at ({:.2}, {:.2}), {:.0} degrees: {reason}", pad.x, pad.y, pad.heading_deg)];
        if side.doors.is_empty() {
            remarks.push(format!(
                "no doors are known, for no {name} names any: none is shut, and none is named"
            ));
        }
        if side.rooms.is_empty() {
            remarks.push(format!("rooms are numbered as their shape parts them, for no {name} names any"));
        }
        Ok(Self { pad, remarks })
    }
}
