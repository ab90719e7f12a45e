//! `flight`: the only service that talks to the flight controller, and the last line when the others are
//! silent (DESIGN 4).
//!
//! Channels go out 50 times a second before anything else; in between the controller is asked for attitude,
//! status and power. When `pilot/channels` goes stale, `flight` flies the [`Ladder`] itself: level, then down
//! under its own small height loop on the down sonar, then motors off. Frames never stop while this lives: a
//! stop drops the aircraft after 0.32 s (FACTS 1). The same ladder is taken while the controller tells no attitude, or
//! too late. A `flight` that is started again in the air therefore asks
//! for the status and the receiver's order first and goes on within a few passes of the controller's task,
//! with the arm switch high.
//!
//! [`Core`] is everything without ports; [`Flight`] gives it those of the runtime.

mod arming;
mod asked;
mod beat;
mod config;
mod core;
mod descent;
mod felt;
mod frame;
mod framing;
mod ladder;
mod link;
mod order;
mod outbox;
mod plausible;
mod said;
mod schedule;
mod serial;
mod service;
mod stick;
mod wish;
mod words;

pub use arming::{ArmSwitch, Evidence};
pub use config::{Config, Profile};
pub use core::Core;
pub use descent::{Descent, DescentStep};
pub use frame::{FrameError, MAX_FRAME};
pub use ladder::{Decision, Ladder, View};
pub use link::Link;
pub use order::{ReceiverOrder, throttle_of};
pub use outbox::Outbox;
pub use said::{AttitudeSample, Counts, Identity, Said};
pub use schedule::Question;
pub use serial::{SerialDevice, SerialPorts};
pub use service::Flight;
pub use stick::StickLaw;
pub use wish::{Wish, neutral};
pub use words::{flag_name, write_blocks};
