//! The world that is flown in: walls of the plan as they were built, things the plan does not show, doors,
//! people and the pad, as upright solids with a bottom and a top.
//!
//! The world frame is the plan frame; the *building* is what differs from the plan ([`AsBuilt`]), so that
//! the drone's plan is wrong by centimetres everywhere. Nothing here is shared with the drone's own
//! models: rays meet solids, not cells.

mod as_built;
mod build;
pub(crate) mod draw;
pub(crate) mod field;
mod file;
mod ground;
mod index;
mod query;
mod solid;
#[cfg(test)]
mod tests;
mod walls;

pub use as_built::AsBuilt;
pub(crate) use build::table as table_piece;
pub use file::{
    CarpetEntry, DoorEntry, PadEntry, PersonEntry, ShapeWord, SolidEntry, TableEntry, WorldError, WorldFile,
};
pub use ground::Ground;
pub use query::{Nearest, RayHit};
pub use solid::{Role, Shape, Solid, Surface};
pub(crate) use walls::{Edge, rectangles};

use crate::people::Crowd;
use index::Index;
use walls::Walls;

/// Height of the ceiling when the world file does not say, metres (DESIGN 6).
pub const CEILING_M: f32 = 2.6;
/// Underside of the wall over a door when the world file does not say, metres (DESIGN 6).
pub const LINTEL_M: f32 = 2.03;
/// Heights between which a solid blocks the patrol: 1.2 m with the airframe's own height and hover error.
pub const FLIGHT_BAND_M: (f32, f32) = (1.05, 1.45);
/// Clearances are not measured beyond this, metres.
pub const CLEARANCE_CAP_M: f32 = 1.5;

/// Where the drone starts and lands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PadPlace {
    /// Centre, world frame.
    pub x: f32,
    /// Centre, world frame.
    pub y: f32,
    /// Heading of the drone at the start, radians.
    pub heading: f32,
}

/// How much of the world the plan does not show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClutterLevel {
    /// Only what the world file says.
    None,
    /// A third of the objects and doors of full clutter, nobody walking.
    Light,
    /// One object per 15 m2, a fifth of the doors shut, three people.
    Full,
}

impl ClutterLevel {
    /// The word of the command line; `None` for any other.
    #[must_use]
    pub fn from_word(word: &str) -> Option<Self> {
        match word {
            "none" => Some(Self::None),
            "light" => Some(Self::Light),
            "full" => Some(Self::Full),
            _ => None,
        }
    }
}

/// A thing that the plan does not show, as people see it.
#[derive(Clone, Debug)]
pub struct Object {
    /// Name for people.
    pub name: String,
    /// Its outline from above; bottom and top span all its parts.
    pub outline: Solid,
}

/// A door of the plan.
#[derive(Clone, Debug)]
pub struct DoorPlace {
    /// Name for people.
    pub name: String,
    /// The middle of the opening, world frame.
    pub middle: (f32, f32),
    /// Direction from post to post, radians.
    pub heading: f32,
    /// Clear width, metres.
    pub width: f32,
    /// Whether a leaf stands in it.
    pub shut: bool,
}

/// Everything that is really there.
#[derive(Clone, Debug)]
pub struct World {
    name: String,
    pad: PadPlace,
    ceiling: f32,
    lintel: f32,
    built: AsBuilt,
    bounds: [f32; 4],
    walls: Walls,
    /// The walls' blocks first, then everything else that stands still.
    solids: Vec<Solid>,
    solid_index: Index,
    edges: Vec<Edge>,
    edge_index: Index,
    objects: Vec<Object>,
    doors: Vec<DoorPlace>,
    ground: Ground,
    flight_distance: Vec<f32>,
    crowd: Crowd,
}

impl World {
    /// Name of the world file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Where the drone starts and lands.
    #[must_use]
    pub fn pad(&self) -> PadPlace {
        self.pad
    }
    /// Height of the ceiling, metres.
    #[must_use]
    pub fn ceiling(&self) -> f32 {
        self.ceiling
    }
    /// How the building differs from its plan.
    #[must_use]
    pub fn as_built(&self) -> &AsBuilt {
        &self.built
    }
    /// Lowest x and y, highest x and y of the plan, world frame.
    #[must_use]
    pub fn bounds(&self) -> [f32; 4] {
        self.bounds
    }
    /// All solids that stand still, walls first.
    #[must_use]
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }
    /// What the plan does not show and stands still: furniture, clutter, shut doors.
    #[must_use]
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }
    /// The doors that the plan's side file names.
    #[must_use]
    pub fn doors(&self) -> &[DoorPlace] {
        &self.doors
    }
    /// The true floor.
    #[must_use]
    pub fn ground(&self) -> &Ground {
        &self.ground
    }
    /// Those who walk.
    #[must_use]
    pub fn people(&self) -> &Crowd {
        &self.crowd
    }
    /// Those who walk, for whoever lets somebody in.
    pub(crate) fn people_mut(&mut self) -> &mut Crowd {
        &mut self.crowd
    }
    /// Moves the people on to `now_s`, seconds since the world began; `drone` is where the drone is while it
    /// flies or stands, world frame.
    pub fn advance(&mut self, now_s: f64, drone: (f32, f32)) {
        self.crowd.advance(now_s, drone);
    }
}
