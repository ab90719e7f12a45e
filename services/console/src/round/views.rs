//! What is read of a drone's messages.

use serde::Deserialize;

/// What is read of `pilot/state`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
#[allow(missing_docs, reason = "the message's own fields")]
pub struct PilotView {
    pub phase: u8,
    pub cause: u8,
    pub action: u8,
    pub holder: String,
}

/// What is read of `navigation/patrol`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
#[allow(missing_docs, reason = "the message's own fields")]
pub struct PatrolView {
    pub started_ns: u64,
    pub state: u8,
    pub pad_x_m: Option<f64>,
    pub pad_y_m: Option<f64>,
    pub coverage: Option<f64>,
    pub rooms: Vec<RoomView>,
    pub text: String,
}

/// What is read of one room.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
#[allow(missing_docs, reason = "the message's own fields")]
pub struct RoomView {
    pub name: String,
    pub reason: String,
    pub seen: Option<f64>,
    pub state: u8,
}

/// What is read of `localization/pose`.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
#[allow(missing_docs, reason = "the message's own fields")]
pub struct PoseView {
    pub x_m: Option<f64>,
    pub y_m: Option<f64>,
    pub heading_rad: Option<f64>,
    pub searching: u32,
}

/// Where the drone is, plan frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "the message's own fields")]
pub struct Place {
    pub x_m: f64,
    pub y_m: f64,
    pub heading_rad: f64,
}
