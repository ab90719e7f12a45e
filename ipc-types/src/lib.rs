//! The words the processes say to each other: one `#[repr(C)]` structure and one constant a topic.
//!
//! Nothing here does I/O or thinks. Every structure is plain old data without padding
//! ([`bytemuck::Pod`]), so that any bytes found in shared memory are *memory-safe* to look at;
//! whether they make sense is checked by the reader through the `*::from_code` conversions and the
//! [`Field::LAYOUT`] hash, a required attribute of every shared-memory service, so that a stale
//! binary fails at open and not in flight.
//!
//! Frames and units follow REP-103 and REP-105: metres, seconds, radians, right-handed; body x forward,
//! y left, z up; plan frame x right, y up from the map's origin, yaw counter-clockwise from +x.
//! Times are nanoseconds of `CLOCK_MONOTONIC` (or of the simulated clock in lockstep). A field that is
//! not SI carries its unit in its name. "Absent" is NaN for floats and 0 for times unless said otherwise.
#![forbid(unsafe_code)]

mod bytes;
mod camera;
mod code;
mod field;
mod flight;
mod health;
mod localization;
mod navigation;
mod operator;
mod pilot;
mod sensors;
mod sim;
mod text;
mod topics;
mod trace;

pub use bytes::Bytes;
pub use camera::*;
pub use field::{Field, Header, Message, layout_of_name, layout_step};
pub use flight::*;
pub use health::*;
pub use localization::*;
pub use navigation::*;
pub use operator::*;
pub use pilot::*;
pub use sensors::*;
pub use sim::*;
pub use text::Text;
pub use topics::{TopicVisitor, visit_all, visit_topic};
pub use trace::{MAX_RUNS, Run, Runs, Trace};

/// Seconds from `earlier` to `later`, negative when they are the other way round.
#[must_use]
pub fn seconds_between(earlier_ns: u64, later_ns: u64) -> f64 {
    (later_ns.wrapping_sub(earlier_ns).cast_signed()) as f64 * 1e-9
}

/// Nanoseconds in `seconds`, saturating at zero.
#[must_use]
pub fn nanoseconds(seconds: f64) -> u64 {
    (seconds * 1e9) as u64
}
