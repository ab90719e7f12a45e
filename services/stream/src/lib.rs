//! The drone's video to browsers, by WebRTC, in the roles of the thesis (3.3): a viewer calls with the picture it wants, the
//! drone offers, the viewer answers, candidates go both ways, and either hangs up.
//!
//! There is one encoder. What it encodes is decided by one viewer ([`Choice`]): whoever holds the sticks, or else whoever
//! has watched for longest; the others are told. Each viewer has a task and a short queue of its own ([`session`]): one that is
//! slow loses frames and gets a key frame, and nobody else notices.

mod choice;
mod config;
mod feedback;
mod hub;
mod message;
mod peer;
mod service;
mod session;

pub use choice::{Choice, Party};
pub use config::{IceServer, StreamConfig};
pub use message::{Call, Candidate, FromViewer, Mode, ToViewer};
pub use service::Stream;
