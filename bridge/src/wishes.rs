//! Wishes for pictures that come over the network: recorders that are no part of the drone (`docs/off-board.md`, *Video*). Pure:
//! time is an argument. Each holds for two seconds, so that whoever falls silent stops costing the drone anything.

use ipc_types::{Format, Wish};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// Longest JSON of a wish, bytes.
pub const MAX_WISH: usize = 1024;
/// A wish holds for so long, nanoseconds.
pub const WISH_LIFE_NS: u64 = 2_000_000_000;
/// Certificates whose wishes stand at a time: each has one.
pub const MAX_WISHES: usize = 16;
/// Bits a pixel: what the drone's own video sessions ask for at the same size and pace.
const BITS_A_PIXEL: f64 = 0.11;
/// Of a recorder.
const RECORDS: u32 = 1;
/// Of whoever keeps pictures for a while only, or looks.
const LOOKS: u32 = 0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(default)]
    video: Option<RawVideo>,
    #[serde(default)]
    still: bool,
    #[serde(default)]
    rolling: bool,
    #[serde(default)]
    key_requests: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawVideo {
    width: u32,
    height: u32,
    fps: u32,
}

impl RawVideo {
    fn format(&self) -> Result<Format, String> {
        let Self { width, height, fps } = *self;
        let pixels = f64::from(width) * f64::from(height) * f64::from(fps);
        let bitrate = (pixels * BITS_A_PIXEL).clamp(300_000.0, 6_000_000.0) as u32;
        let format = Format { width, height, fps, bitrate };
        if format.is_valid() {
            return Ok(format);
        }
        Err(format!(
            "video = {width}x{height} at {fps}/s: allowed are even sizes from 160x120 to {}x{}, 1 to 60 a second",
            ipc_types::MAX_PICTURE_WIDTH,
            ipc_types::MAX_PICTURE_HEIGHT
        ))
    }
}

#[derive(Debug, Clone, Copy)]
struct Kept {
    until_ns: u64,
    format: Option<Format>,
    still: bool,
    priority: u32,
    key_requests: u32,
}

/// The wish of each certificate, and what they come to together.
#[derive(Debug, Default)]
pub struct Wishes {
    kept: BTreeMap<String, Kept>,
    key_requests: u32,
}

impl Wishes {
    /// Takes what a certificate wishes at `now`, in place of what it wished before.
    ///
    /// # Errors
    /// One sentence; the wish before it stands until it ends.
    pub fn take(&mut self, now: u64, certificate: &str, json: &[u8]) -> Result<(), String> {
        let wrong = |error: serde_json::Error| format!("the wish is not understood: {error}");
        // A list would do for a structure, too.
        let fields: serde_json::Map<String, Value> = serde_json::from_slice(json).map_err(wrong)?;
        let raw = Raw::deserialize(Value::Object(fields)).map_err(wrong)?;
        let format = raw.video.as_ref().map(RawVideo::format).transpose()?;
        self.kept.retain(|_, kept| now < kept.until_ns);
        if format.is_none() && !raw.still {
            self.kept.remove(certificate);
            return Ok(());
        }
        if !self.kept.contains_key(certificate) && self.kept.len() >= MAX_WISHES {
            return Err(format!("{MAX_WISHES} others wish for pictures: there is no room for more"));
        }
        let kept = Kept {
            until_ns: now.saturating_add(WISH_LIFE_NS),
            format,
            still: raw.still,
            priority: if raw.rolling { LOOKS } else { RECORDS },
            key_requests: raw.key_requests,
        };
        let before = self.kept.insert(certificate.to_owned(), kept);
        // Who is new to the video has no frame before it.
        let known =
            before.is_some_and(|before| before.format.is_some() && before.key_requests == kept.key_requests);
        if format.is_some() && !known {
            self.key_requests = self.key_requests.wrapping_add(1);
        }
        Ok(())
    }

    /// What is to be wished of the camera at `now`, without times; `None` when nobody wishes for anything.
    #[must_use]
    pub fn wanted(&mut self, now: u64) -> Option<Wish> {
        self.kept.retain(|_, kept| now < kept.until_ns);
        let with_video = self.kept.values().filter_map(|kept| {
            let format = kept.format?;
            Some(Wish { format, priority: kept.priority, ..Wish::default() })
        });
        let first = with_video.reduce(|best, wish| if wish.beats(&best) { wish } else { best });
        let still = self.kept.values().any(|kept| kept.still);
        if first.is_none() && !still {
            return None;
        }
        Some(Wish { key_requests: self.key_requests, still: u32::from(still), ..first.unwrap_or_default() })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    const START: u64 = 50_000_000_000;
    const RECORD: &str = r#"{"video":{"width":1280,"height":720,"fps":15},"still":false}"#;

    #[test]
    fn a_wish_holds_for_two_seconds_and_the_recorder_goes_before_who_only_keeps_a_while() {
        let mut wishes = Wishes::default();
        assert!(wishes.wanted(START).is_none());
        wishes.take(START, "desk", RECORD.as_bytes()).unwrap();
        let larger = r#"{"video":{"width":1920,"height":1080,"fps":30},"still":true,"rolling":true}"#;
        wishes.take(START + 1, "hall", larger.as_bytes()).unwrap();
        let wanted = wishes.wanted(START + 1).unwrap();
        assert_eq!((wanted.format.width, wanted.format.fps, wanted.priority, wanted.still), (1280, 15, 1, 1));
        assert_eq!(wanted.format.bitrate, 1_520_640);
        let wanted = wishes.wanted(START + WISH_LIFE_NS).unwrap();
        assert_eq!((wanted.format.width, wanted.priority), (1920, 0), "the recorder has fallen silent");
        assert!(wishes.wanted(START + 1 + WISH_LIFE_NS).is_none());
    }

    #[test]
    fn stills_alone_wake_no_encoder_and_nothing_withdraws() {
        let mut wishes = Wishes::default();
        wishes.take(START, "desk", br#"{"video":null,"still":true}"#).unwrap();
        let mut wanted = wishes.wanted(START).unwrap();
        wanted.header.stamp_ns = START;
        wanted.expiry_ns = START + 1;
        assert!(wanted.counts(START) && !wanted.wants_video() && wanted.wants_still());
        wishes.take(START, "desk", br#"{"video":null,"still":false}"#).unwrap();
        assert!(wishes.wanted(START).is_none());
    }

    #[test]
    fn a_key_frame_is_asked_for_by_who_is_new_and_by_who_lost_something() {
        let mut wishes = Wishes::default();
        let mut keys = |certificate: &str, requests: u32, at: u64| {
            let json = format!(
                r#"{{"video":{{"width":640,"height":480,"fps":30}},"still":false,"key_requests":{requests}}}"#
            );
            wishes.take(at, certificate, json.as_bytes()).unwrap();
            wishes.wanted(at).unwrap().key_requests
        };
        let first = keys("desk", 7, START);
        assert_eq!(keys("desk", 7, START + 1), first, "the same wish again");
        assert_eq!(keys("desk", 8, START + 2), first + 1);
        assert_eq!(keys("hall", 8, START + 3), first + 2);
        assert_eq!(keys("desk", 8, START + 4), first + 2);
    }

    #[test]
    fn nonsense_is_refused_and_memory_is_bounded() {
        let mut wishes = Wishes::default();
        for (json, said) in [
            ("", "not understood"),
            ("[]", "not understood"),
            (r#"{"video":{"width":1280,"height":720},"still":false}"#, "fps"),
            (r#"{"video":null,"still":true,"priority":9}"#, "priority"),
            (r#"{"video":{"width":1281,"height":720,"fps":15},"still":false}"#, "1281x720 at 15/s: allowed"),
            (r#"{"video":{"width":4294967295,"height":4294967295,"fps":4294967295}}"#, "allowed"),
            (r#"{"video":{"width":-2,"height":720,"fps":15}}"#, "not understood"),
        ] {
            let error = wishes.take(START, "desk", json.as_bytes()).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        assert!(wishes.wanted(START).is_none());
        for number in 0..MAX_WISHES {
            wishes.take(START, &format!("c{number}"), RECORD.as_bytes()).unwrap();
        }
        assert!(wishes.take(START, "late", RECORD.as_bytes()).unwrap_err().contains("no room"));
        wishes.take(START, "c0", RECORD.as_bytes()).unwrap();
        wishes.take(START + WISH_LIFE_NS, "late", RECORD.as_bytes()).unwrap();
    }
}
