//! The shield against random command streams.
//!
//! A stream is ten seconds of commands that nobody in his right mind would give: straight at what is nearest, into the
//! gaps between two sonars, to and fro, nonsense. In each something is broken (or nothing), and the place that the pilot
//! is told is off by something. [`Commander`] stands in for navigation and [`Teller`] for localization, on their own
//! ports; flight, pilot, sonar and flow are the real ones, in lockstep, and the simulator's truth counts the contacts.

mod commander;
mod draw;
mod fly;
mod program;
mod teller;

pub use commander::Commander;
pub use draw::{Stream, draw};
pub use fly::{Course, Report, Settings, Touch, run};
pub use program::{Around, Kind, Program, Wish};
pub use teller::Teller;

/// Streams of one flight: with ten the take-off is a tenth of its time.
pub const STREAMS: usize = 10;
/// The first begins so long after the take-off, seconds: it has climbed and hovers.
pub const FIRST_S: f64 = 8.0;
/// One stream, and the next begins so much later, seconds: two of them hovering and whole again.
pub const STREAM_S: f64 = 10.0;
/// See [`STREAM_S`].
pub const PERIOD_S: f64 = 12.0;

/// The stream that is flown so long after the take-off.
#[must_use]
pub fn stream_at(flown_s: f64) -> Option<usize> {
    let since = flown_s - FIRST_S;
    let number = (since / PERIOD_S).floor();
    let flies = since >= 0.0 && since - number * PERIOD_S < STREAM_S && number < STREAMS as f64;
    flies.then_some(number as usize)
}
