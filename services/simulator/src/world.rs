//! The world of a flight, for the simulator and for scorers.

use crate::Config;
use airframe::simulation::Simulation;
use airframe::world::{World, WorldFile};
use floorplan::{DistanceField, Pad, Sidecar};
use runtime::{Start, StartError};

/// The world that the simulator with this configuration and this start flies in: the same seed gives the
/// same world, so that a scorer needs no copy of it. `start.seed` must be the simulator's own
/// (`Start::service_seed(seed, "simulator")`).
///
/// # Errors
/// Missing or wrong files, a blocked pad.
pub fn build_world(config: &Config, start: &Start) -> Result<World, StartError> {
    let plan = start.plan()?;
    let file = world_file(start)?;
    let pad = start.pad()?;
    if let (Some(pad), Some(entry)) = (pad, &file.pad)
        && (pad.x, pad.y, pad.heading_deg) != (entry.x_m, entry.y_m, entry.heading_deg)
    {
        return Err(StartError::Invalid(format!(
            "{}: pad is at ({}, {}), {} degrees, but the system's is at ({}, {}), {} degrees: the drone would be lost \
             from the start; name it in one of the two",
            start.system.world, entry.x_m, entry.y_m, entry.heading_deg, pad.x, pad.y, pad.heading_deg
        )));
    }
    if let Some(pad) = pad {
        let radius_m = start.vehicle.body.radius_m;
        // Where it stands it must fit by the plan; what the world adds is checked against the world.
        let field = DistanceField::of_not_free(&plan, 2.0 * radius_m);
        plan.check_pad(&field, pad.x, pad.y, radius_m).map_err(StartError::invalid)?;
    }
    let side = Sidecar { pad, ..start.sidecar()? };
    World::build(&plan, &side, &file, config.clutter(), start.seed).map_err(StartError::invalid)
}

/// Where the simulator puts the drone down at first in a world of [`build_world`], with the same configuration and start:
/// for whoever has to tell localization the room, or to score.
///
/// # Errors
/// A configuration that names what the vehicle does not have.
pub fn start_place(config: &Config, start: &Start, world: &World) -> Result<Pad, StartError> {
    let options = config.options(&start.vehicle, start.seed)?;
    let place = Simulation::start_place(world, &start.vehicle, &options);
    Ok(Pad { x: place.x, y: place.y, heading_deg: place.heading.to_degrees() })
}

/// The pad that the system's world file names, if it names one: for whoever decides the system's pad before it
/// starts. Localization and navigation read no world files.
///
/// # Errors
/// When the world file is missing or wrong.
pub fn world_pad(start: &Start) -> Result<Option<Pad>, StartError> {
    let pad = world_file(start)?.pad;
    Ok(pad.map(|pad| Pad { x: pad.x_m, y: pad.y_m, heading_deg: pad.heading_deg }))
}

fn world_file(start: &Start) -> Result<WorldFile, StartError> {
    let name = &start.system.world;
    if name.is_empty() {
        return Ok(WorldFile::default());
    }
    let bytes = start.read(name)?;
    let text = String::from_utf8(bytes).map_err(|_| StartError::invalid(format!("{name} is not text")))?;
    let file = WorldFile::parse(name, &text).map_err(StartError::invalid)?;
    let hash = format!("{:016x}", start.plan()?.hash());
    if file.plan_hash.as_ref().is_none_or(|placed| *placed == hash) {
        return Ok(file);
    }
    Ok(WorldFile {
        name: file.name,
        ceiling_m: file.ceiling_m,
        lintel_m: file.lintel_m,
        file: file.file,
        ..WorldFile::default()
    })
}
