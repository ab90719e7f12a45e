//! The drone's picture: raw frames in, H.264 out, asleep while nobody watches.
//!
//! Whoever wants video says so on `camera/wish`, again and again ([`Wishes`]). While somebody does, a source is asked for
//! frames ([`Source`]) and each becomes one access unit on `camera/video` ([`Encoder`]), with the time at which it was captured.
//! When the last wish has expired nothing is captured and nothing encoded. A wish for stills alone takes one frame a second and
//! makes a JPEG of it on `camera/still` ([`Stills`]); the encoder sleeps on.
//!
//! What the plan says that no camera may show is covered before anything is encoded ([`privacy`]).

mod config;
mod encoder;
mod pattern;
pub mod privacy;
mod service;
mod simulated;
mod source;
mod still;
mod wishes;
mod y4m;

pub use config::CameraConfig;
pub use encoder::{EncodeError, Encoded, Encoder};
pub use pattern::Pattern;
pub use service::Camera;
pub use source::{Frame, Source};
pub use still::{STILL_FORMAT, StillError, Stills, Taken};
pub use wishes::Wishes;
pub use y4m::{Y4m, Y4mError};

/// Whether the encoder was built with its assembler parts (x86 without `nasm`: no, and four times as slow).
pub const HAS_ASSEMBLER: bool = matches!(env!("CAMERA_ASSEMBLER").as_bytes(), b"yes");
