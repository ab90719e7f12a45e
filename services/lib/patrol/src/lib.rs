//! Coverage of the free space, routes between rooms, the order of a round.
//!
//! A [`Costmap`] is where the vehicle may fly: the plan, the doors that were found shut, what was found
//! standing about. A [`RoutePlanner`] finds the way from here to there on it, a [`Round`] the places to
//! visit so that everything that can be seen is seen, and [`Seen`] keeps what was. Routes and rounds are
//! worked out in bounded slices, so that whoever flies by them never waits.
#![forbid(unsafe_code)]

mod costmap;
mod cover;
mod fan;
mod gates;
mod limits;
mod obstacle;
mod raster;
mod refine;
mod round;
mod route;
mod search;
mod seen;
mod smooth;
mod tour;
mod wishes;

pub use costmap::Costmap;
pub use limits::Limits;
pub use obstacle::Obstacle;
pub use raster::{Bits, Raster, SIDE, WORDS};
pub use round::{Progress, RoomPlan, Round, Stop};
pub use route::{Route, RoutePlanner, Step};
pub use seen::{Seen, Tally};
pub use wishes::Wishes;
