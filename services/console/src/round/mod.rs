//! Follows a drone's round from what it says of itself, and writes the report when it has landed. Pure: time is an argument.

mod follower;
mod report;
#[cfg(test)]
mod tests;
mod views;

pub use follower::{Follower, News};
pub use report::{Event, Report, Room, Span};
pub use views::{PatrolView, PilotView, Place, PoseView, RoomView};
