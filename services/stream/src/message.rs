//! What viewers and the drone say to each other, as JSON: session control (call, hang-up, error, status), network
//! (candidates) and media capabilities (offer, answer). One message has one key, which names it.

use ipc_types::Format;
use serde::{Deserialize, Serialize};

/// Longest session description, bytes: Chromium's answer to one video line has 2 to 3 thousand.
const SDP_BYTES: usize = 16_384;
/// Longest candidate, bytes.
const CANDIDATE_BYTES: usize = 1024;

/// How a viewer watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// As soon as it comes: for whoever flies. A lossy line makes it stutter.
    Pilot,
    /// As the browser likes: smoother, and some tens of milliseconds later.
    #[default]
    Watch,
}

/// The first word of a viewer.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Call {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Frames a second.
    pub fps: u32,
    /// How it watches.
    #[serde(default)]
    pub mode: Mode,
    /// Account of the viewer, written by its console; empty: that of the certificate.
    #[serde(default)]
    pub account: String,
}

/// A session description.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// SDP.
    pub sdp: String,
}

/// A way by which somebody may be reached, in the form of the browser's `RTCIceCandidateInit`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Candidate {
    /// The candidate's attribute (RFC 8839); empty: there are no more.
    pub candidate: String,
    /// Which media section.
    #[serde(default)]
    pub sdp_mid: Option<String>,
    /// Which media section, by number.
    #[serde(default, rename = "sdpMLineIndex")]
    pub sdp_m_line_index: Option<u16>,
    /// Fragment of the user name.
    #[serde(default)]
    pub username_fragment: Option<String>,
}

/// Why it ends.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reason {
    /// For people.
    #[serde(default)]
    pub reason: String,
}

/// What a viewer may say.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FromViewer {
    /// Wants video; said again, wants another picture.
    Call(Call),
    /// Takes the drone's offer.
    Answer(Description),
    /// One more way.
    Candidate(Candidate),
    /// Ends the session.
    HangUp(Reason),
}

/// A sentence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Sentence {
    /// For people.
    pub text: String,
}

/// The drone's offer, and the servers that the viewer may use besides.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Offer {
    /// SDP.
    pub sdp: String,
    /// In the form of the browser's `RTCIceServer`.
    pub servers: Vec<crate::IceServer>,
}

/// What is sent now.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Status {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Frames a second aimed at.
    pub fps: u32,
    /// Bits a second aimed at.
    pub bitrate: u32,
    /// `udp`, `tcp` or `turn`; empty while there is none.
    pub path: String,
    /// Account of whoever decides the picture.
    pub chosen_by: String,
    /// Milliseconds from the capture of the newest frame to its leaving the drone.
    pub age_ms: u32,
    /// Frames that this viewer lost because it was slow.
    pub dropped: u64,
}

/// What the drone may say.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ToViewer {
    /// What can be sent.
    Offer(Offer),
    /// One more way.
    Candidate(Candidate),
    /// The session has ended.
    HangUp(Reason),
    /// Something was refused; the session goes on.
    Error(Sentence),
    /// Once a second.
    Status(Status),
}

impl FromViewer {
    /// Reads a message.
    ///
    /// # Errors
    /// One sentence for the viewer.
    pub fn parse(text: &str) -> Result<Self, String> {
        let message: Self = serde_json::from_str(text).map_err(|error| {
            let what: String = error.to_string().chars().filter(|c| !c.is_control()).take(200).collect();
            format!("not a message that is known here: {what}")
        })?;
        let within = |field: &str, length: usize, most: usize| {
            if length <= most {
                Ok(())
            } else {
                Err(format!("{field} has {length} bytes: allowed is {most}"))
            }
        };
        match &message {
            Self::Call(call) if !call.format().is_valid() => Err(format!(
                "a picture of {}x{} at {} frames a second: allowed are even sizes from 160x120 to 1920x1080, at 1 to 60",
                call.width, call.height, call.fps
            )),
            Self::Call(call) => within("call.account", call.account.len(), 64).map(|()| message),
            Self::Answer(answer) => within("answer.sdp", answer.sdp.len(), SDP_BYTES).map(|()| message),
            Self::Candidate(candidate) => {
                within("candidate.candidate", candidate.candidate.len(), CANDIDATE_BYTES).map(|()| message)
            }
            Self::HangUp(reason) => within("hang_up.reason", reason.reason.len(), 256).map(|()| message),
        }
    }
}

impl ToViewer {
    /// As JSON; `None` when it cannot be said.
    #[must_use]
    pub fn to_json(&self) -> Option<String> {
        serde_json::to_string(self).ok()
    }

    /// A sentence about what went wrong.
    pub(crate) fn error(text: impl Into<String>) -> Self {
        Self::Error(Sentence { text: text.into() })
    }

    /// The end, and why.
    pub(crate) fn hang_up(reason: impl Into<String>) -> Self {
        Self::HangUp(Reason { reason: reason.into() })
    }
}

/// Bits that a pixel of a moving indoor picture takes: 1 Mbit/s at 640x480 and 30 frames a second.
const BITS_A_PIXEL: f64 = 0.11;

impl Call {
    /// What is wished of the camera.
    #[must_use]
    pub fn format(&self) -> Format {
        let pixels = f64::from(self.width) * f64::from(self.height) * f64::from(self.fps);
        let bitrate = (pixels * BITS_A_PIXEL).clamp(300_000.0, 6_000_000.0) as u32;
        Format { width: self.width, height: self.height, fps: self.fps, bitrate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_read_and_nonsense_gets_a_sentence() {
        let call =
            FromViewer::parse(r#"{"call":{"width":640,"height":480,"fps":30,"mode":"pilot"}}"#).unwrap();
        let FromViewer::Call(call) = call else { panic!("{call:?}") };
        assert_eq!((call.mode, call.format().bitrate), (Mode::Pilot, 1_013_760));
        let line = r#"{"candidate":{"candidate":"candidate:1 1 udp 1 127.0.0.1 9 typ host","sdpMid":"0","sdpMLineIndex":0}}"#;
        let FromViewer::Candidate(candidate) = FromViewer::parse(line).unwrap() else { panic!() };
        assert_eq!((candidate.sdp_mid.as_deref(), candidate.sdp_m_line_index), (Some("0"), Some(0)));
        assert_eq!(
            FromViewer::parse(r#"{"hang_up":{}}"#).unwrap(),
            FromViewer::HangUp(Reason { reason: String::new() })
        );
        let long = format!(r#"{{"answer":{{"sdp":"{}"}}}}"#, "x".repeat(20_000));
        for (text, word) in [
            ("", "not a message"),
            ("[1]", "not a message"),
            (r#"{"call":{"width":641,"height":480,"fps":30}}"#, "641x480"),
            (r#"{"call":{"width":640,"height":480,"fps":0}}"#, "at 0 frames"),
            (r#"{"call":{"width":640,"height":480,"fps":30,"mode":"fly"}}"#, "not a message"),
            (r#"{"call":{"width":-1,"height":480,"fps":30}}"#, "not a message"),
            (r#"{"dance":{}}"#, "not a message"),
            (&long, "answer.sdp has 20000 bytes"),
        ] {
            let error = FromViewer::parse(text).unwrap_err();
            assert!(error.contains(word), "{text}: {error}");
        }
    }

    proptest::proptest! {
        #[test]
        fn no_text_panics(text in ".{0,300}") {
            let _ = FromViewer::parse(&text);
        }
    }

    #[test]
    fn what_the_drone_says_has_one_key() {
        let json = |message: ToViewer| message.to_json().unwrap();
        assert_eq!(json(ToViewer::error("no")), r#"{"error":{"text":"no"}}"#);
        assert_eq!(json(ToViewer::hang_up("bye")), r#"{"hang_up":{"reason":"bye"}}"#);
        let candidate = Candidate {
            candidate: "c".into(),
            sdp_mid: None,
            sdp_m_line_index: Some(0),
            username_fragment: None,
        };
        let said = json(ToViewer::Candidate(candidate));
        assert!(said.contains(r#""sdpMLineIndex":0"#) && said.contains(r#""sdpMid":null"#), "{said}");
    }
}
