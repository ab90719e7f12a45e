//! The plan of the building: occupancy grid, ray and cone casting, distance field, named rooms.
//!
//! A plan comes as bytes in the form that ROS map_server reads (a yaml header and a PGM or PNG picture)
//! and becomes a [`Plan`]: a raster of free, occupied and unknown cells in the plan frame (x right, y up
//! from the lower left corner of the picture, metres). Everything else answers questions about it:
//! [`Plan::cast_ray`] and [`cast_cone`] what a sonar would hear, [`ConeTable`] the same from memory,
//! [`DistanceField`] how far the next wall is, [`Sidecar`] and [`Rooms`] what the places are called.
#![forbid(unsafe_code)]

mod cast;
mod cone_table;
mod distance;
mod drawing;
mod error;
mod header;
mod leap;
mod picture;
mod plan;
mod rooms;
mod sidecar;
mod surface;
mod widest;

pub use cast::{ConeModel, Hit, cast_cone};
pub use cone_table::ConeTable;
pub use distance::DistanceField;
pub use drawing::{DRAWN_CELL_M, Drawing, Reading, picture_of_plan, plan_of_drawing};
pub use error::PlanError;
pub use header::{PictureMode, PlanHeader};
pub use plan::{Cell, MAX_CELLS, MAX_SIDE, Plan};
pub use rooms::{MAX_ROOMS, Rooms};
pub use sidecar::{Area, Door, NamedArea, Pad, RoundOrder, RoundPoint, Sidecar};
pub use widest::widest_place;
