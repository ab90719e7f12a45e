//! The world of a flight, for the simulator and for scorers.

use crate::Config;
use airframe::world::{World, WorldFile};
use runtime::{Start, StartError};

/// The world that the simulator with this configuration and this start flies in: the same seed gives the
/// same world, so that a scorer needs no copy of it. `start.seed` must be the simulator's own
/// (`Start::service_seed(seed, "simulator")`).
///
/// # Errors
/// Missing or wrong files, a blocked pad.
pub fn build_world(config: &Config, start: &Start) -> Result<World, StartError> {
    let plan = start.plan()?;
    let side = start.sidecar()?;
    let file = world_file(start)?;
    World::build(&plan, &side, &file, config.clutter(), start.seed).map_err(StartError::invalid)
}

fn world_file(start: &Start) -> Result<WorldFile, StartError> {
    let name = &start.system.world;
    if name.is_empty() {
        return Ok(WorldFile::default());
    }
    let bytes = start.read(name)?;
    let text = String::from_utf8(bytes).map_err(|_| StartError::invalid(format!("{name} is not text")))?;
    WorldFile::parse(name, &text).map_err(StartError::invalid)
}
