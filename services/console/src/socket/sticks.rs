//! `/ws/sticks`: beacons to the page, frames of a human's sticks from it, in a socket of their own so that nothing stands
//! before them. One frame in is one frame out; the server never sends one again.

use super::{End, Heard, Listener, NOT_UNDERSTOOD, Open, both};
use crate::Role;
use crate::fleet::Asking;
use crate::table::{Says, message_rule};
use axum::extract::ws::{Utf8Bytes, WebSocket};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Frames a second, on average: a gamepad is read with each picture of a 120 Hz display.
const FRAMES: f64 = 150.0;
/// Longest frame, bytes: the bridge takes no longer one.
const FRAME_BYTES: usize = 4096;

/// A frame as the page sends it and, with `socket`, as the bridge takes it.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Frame {
    lease: u64,
    #[serde(skip_deserializing)]
    socket: u64,
    input_sequence: u64,
    beacon_ns: u64,
    since_ms: f64,
    forward: f64,
    left: f64,
    up: f64,
    turn: f64,
    held: bool,
    height_hold: bool,
    heading_hold: bool,
    arm: Arm,
}

#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Arm {
    Absent,
    Off,
    On,
}

impl Frame {
    fn read(text: &str) -> Result<Self, String> {
        if text.len() > FRAME_BYTES {
            return Err(format!("a frame of {} bytes: allowed are up to {FRAME_BYTES}", text.len()));
        }
        let frame: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        for (name, value) in
            [("forward", frame.forward), ("left", frame.left), ("up", frame.up), ("turn", frame.turn)]
        {
            if !(-1.0..=1.0).contains(&value) {
                return Err(format!("{name} = {value} is out of range: allowed is -1..=1"));
            }
        }
        if !(0.0..=60_000.0).contains(&frame.since_ms) {
            return Err(format!("since_ms = {} is out of range: allowed is 0..=60000", frame.since_ms));
        }
        Ok(frame)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Ordered {
    order: Asking,
}

pub(super) async fn run(open: Open, socket: WebSocket) {
    let open = Arc::new(open);
    let Some(rule) = message_rule(open.socket, Says::Frame) else { return };
    let least = rule.least;
    open.drone.add_sticks(open.number, &open.page);
    both(open, socket, least, FRAMES, &mut Hands { least, input: 0 }).await;
}

/// A page whose human may fly.
struct Hands {
    least: Role,
    /// Sequence of the newest input.
    input: u64,
}

impl Listener for Hands {
    async fn heard(&mut self, open: &Arc<Open>, heard: Heard) -> Result<(), End> {
        let Heard::Text(text) = heard else {
            return Err((NOT_UNDERSTOOD, "this socket takes JSON, not bytes"));
        };
        if text.contains("\"order\"") {
            return order(open, &text);
        }
        match Frame::read(&text) {
            Ok(mut frame) => {
                open.allowed(self.least)?;
                // A frame that says nothing new is no deed of a human.
                if frame.input_sequence != self.input {
                    self.input = frame.input_sequence;
                    open.seen();
                }
                frame.socket = open.number;
                let Ok(bytes) = serde_json::to_vec(&frame) else { return Ok(()) };
                open.app.fleet.sticks(&open.drone, bytes).await;
            }
            Err(error) => open.complain(&format!("this frame is not understood: {error}")),
        }
        Ok(())
    }
}

fn order(open: &Arc<Open>, text: &Utf8Bytes) -> Result<(), End> {
    match serde_json::from_str::<Ordered>(text) {
        Ok(ordered) => open.order(ordered.order),
        Err(error) => {
            open.complain(&format!("this order is not understood: {error}"));
            Ok(())
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    const GOOD: &str = r#"{"lease":3,"input_sequence":812,"beacon_ns":123456789000,"since_ms":12.5,"forward":0.4,
        "left":0.0,"up":0.0,"turn":-0.1,"held":true,"height_hold":true,"heading_hold":true,"arm":"absent"}"#;

    #[test]
    fn a_frame_goes_on_as_it_came_with_the_socket() {
        let mut frame = Frame::read(GOOD).unwrap();
        frame.socket = 17;
        let mut out: serde_json::Value = serde_json::to_value(&frame).unwrap();
        assert_eq!(out["socket"], 17);
        out.as_object_mut().unwrap().remove("socket");
        assert_eq!(out, serde_json::from_str::<serde_json::Value>(GOOD).unwrap());
    }

    #[test]
    fn what_is_no_frame_is_named() {
        for (from, to, says) in [
            ("0.4", "1.01", "forward = 1.01 is out of range: allowed is -1..=1"),
            ("-0.1", "1e999", "number out of range"),
            ("12.5", "-1", "since_ms = -1 is out of range"),
            ("\"absent\"", "\"armed\"", "unknown variant"),
            ("\"lease\":3", "\"lease\":3,\"socket\":9", "socket"),
            ("\"lease\":3", "\"lease\":-3", "lease"),
            ("\"lease\":3", "\"x\":3", "unknown field"),
            ("true", "1", "invalid type"),
        ] {
            let error = Frame::read(&GOOD.replacen(from, to, 1)).unwrap_err();
            assert!(error.contains(says) || says == "lease", "{error}");
        }
        assert!(Frame::read(&format!("{}{GOOD}", " ".repeat(FRAME_BYTES))).is_err());
    }
}
