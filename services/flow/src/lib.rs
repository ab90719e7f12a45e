//! `flow`: velocity over the ground from a down-looking optical-flow sensor that streams MSP v2 frames
//! (0x1F02 flow, 0x1F01 range) on a serial line. Optional: without the sensor the service idles and says so.
//!
//! The sensor counts the angle by which *the craft* seems to move over the ground. In the body frame (x
//! forward, y left; rates positive right side down, nose down), with D the distance along the axis,
//! ```text
//! x = v_x / D - w_pitch        v_x = D (x + w_pitch)
//! y = v_y / D + w_roll         v_y = D (y - w_roll)
//! ```
//! The rates are the mean over the frame's own interval, taken from the attitude at its two ends; a frame
//! therefore waits until an attitude from after its end has come. What is published is levelled: divided by the
//! cosine of the tilt in that direction.

mod config;
mod motion;
#[path = "../../flight/src/serial.rs"]
mod serial;
mod service;
mod tilt;

pub use config::Config;
pub use motion::{Motion, Sensor};
pub use serial::{SerialDevice, SerialPorts};
pub use service::Flow;
pub use tilt::{Tilt, TiltHistory};
