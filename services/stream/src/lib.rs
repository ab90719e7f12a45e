//! The drone's video to browsers, by WebRTC, in the roles of the thesis (3.3): a viewer calls with the picture it wants, the
//! drone offers, the viewer answers, candidates go both ways, and either hangs up.
//!
//! There is one encoder. What it encodes is decided by one viewer ([`Choice`]): whoever holds the sticks, or else whoever
//! has watched for longest; the others are told. Each viewer has a task and a short queue of its own ([`session`]): one that is
//! slow loses frames and gets a key frame, and nobody else notices. The bitrate follows the worst of the lines that have a say
//! ([`Line`]); the pilot's decides alone.

mod choice;
mod config;
mod feedback;
mod hub;
mod line;
mod message;
mod peer;
mod rate;
mod reports;
mod service;
mod session;
mod viewer;

pub use choice::{Choice, Party};
pub use config::{IceServer, StreamConfig};
pub use line::{Line, for_all};
pub use message::{Call, Candidate, FromViewer, Mode, ToViewer};
pub use rate::{Bounds, Rate, Report};
pub use service::Stream;
