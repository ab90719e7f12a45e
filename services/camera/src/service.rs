//! The service: wishes in, video out.

use crate::config::{FILE, TEST_PATTERN};
use crate::simulated::Simulated;
use crate::source::Source;
use crate::{CameraConfig, EncodeError, Encoder, Pattern, Wishes, Y4m};
use ipc_types::{Format, Text, Video, Wish};
use runtime::{Input, Output, Ports, Service, Start, StartError};
use std::fmt::Write;

/// The source is said to be silent after so long without a frame, nanoseconds.
const SILENCE_NS: u64 = 1_000_000_000;
/// After a frame that did not fit its place the bitrate is cut to this share of what is wished for, for this long.
const CUT: (u32, u32) = (1, 3);
const CUT_NS: u64 = 5_000_000_000;

/// Encodes what the source gives, while somebody wants it.
pub struct Camera {
    wishes: Input<Wish>,
    videos: Output<Video>,
    source: Box<dyn Source>,
    state: Wishes,
    encoder: Encoder,
    key_pause_ns: u64,
    last_key_ns: Option<u64>,
    /// When a frame came last, or sleep ended.
    heard_ns: u64,
    cut_until_ns: u64,
    now: u64,
    last: Last,
    /// What the encoder said last that it could not do.
    trouble: Option<EncodeError>,
    failed: u64,
}

/// The last frame, for people.
#[derive(Clone, Copy, Default)]
struct Last {
    format: Format,
    encode_ns: u64,
    frames: u64,
}

impl Service for Camera {
    const NAME: &'static str = "camera";
    type Config = CameraConfig;

    fn start(config: CameraConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        // A simulated system wires the simulator's camera, whichever source is chosen.
        let simulated = if start.simulated { Some(Simulated::new(ports)?) } else { None };
        let source: Box<dyn Source> = match (config.source.as_str(), simulated) {
            (TEST_PATTERN, _) => Box::new(Pattern::default()),
            (FILE, _) => {
                let bytes = start.read(&config.file)?;
                Box::new(Y4m::parse(&config.file, bytes).map_err(StartError::invalid)?)
            }
            (_, Some(simulated)) => Box::new(simulated),
            (_, None) => {
                return Err(StartError::invalid(
                    "camera: source = \"simulator\" needs a simulated system (sereno up --sim); on a drone say \
                     \"test-pattern\" or \"file\": no driver of a real camera is in this build",
                ));
            }
        };
        Ok(Self {
            wishes: ports.input()?,
            videos: ports.output()?,
            source,
            state: Wishes::default(),
            encoder: Encoder::new(config.key_every_s),
            key_pause_ns: u64::from(config.key_pause_ms) * 1_000_000,
            last_key_ns: None,
            heard_ns: 0,
            cut_until_ns: 0,
            now: 0,
            last: Last::default(),
            trouble: None,
            failed: 0,
        })
    }

    fn step(&mut self, now: u64) {
        self.now = now;
        while let Some(wish) = self.wishes.receive() {
            self.state.take(&wish, now);
        }
        let wanted = self.state.wanted(now);
        let Some(frame) = self.source.frame(now, wanted.as_ref()) else {
            if wanted.is_none() {
                self.heard_ns = now;
            }
            return;
        };
        let Some(mut format) = wanted else { return };
        self.heard_ns = now;
        if now < self.cut_until_ns {
            format.bitrate = (format.bitrate / CUT.1 * CUT.0).max(50_000);
        }
        let rested = self.last_key_ns.is_none_or(|last| now.saturating_sub(last) >= self.key_pause_ns);
        let key = self.state.wants_key() && rested;
        let Some(mut video) = self.videos.loan() else { return };
        let began = runtime::monotonic_ns();
        match self.encoder.encode(frame, &format, key, video.bytes.as_mut_slice()) {
            // The encoder left a frame out.
            Ok(encoded) if encoded.length == 0 => {}
            Ok(encoded) => {
                video.capture_ns = frame.capture_ns;
                video.frame = frame.number;
                video.encode_ns = runtime::monotonic_ns() - began;
                video.format = Format { width: frame.width, height: frame.height, ..format };
                video.key = u32::from(encoded.key);
                video.length = encoded.length as u32;
                self.last =
                    Last { format: video.format, encode_ns: video.encode_ns, frames: self.last.frames + 1 };
                video.send();
                if encoded.key {
                    self.last_key_ns = Some(now);
                    self.state.key_sent();
                }
            }
            Err(error) => {
                if matches!(error, EncodeError::TooLarge { .. }) {
                    self.cut_until_ns = now + CUT_NS;
                }
                self.failed += 1;
                self.trouble = Some(error);
            }
        }
    }

    fn status(&self, text: &mut Text<96>) {
        let Last { format, encode_ns, frames } = self.last;
        // What does not fit is cut off.
        let _ = match (self.state.wanted(self.now), &self.trouble) {
            (None, _) => write!(text, "asleep, {frames} frames so far"),
            (Some(_), _) if self.now.saturating_sub(self.heard_ns) > SILENCE_NS => {
                write!(text, "the source gives no frames")
            }
            (Some(_), Some(trouble)) if self.failed > 0 && self.now < self.cut_until_ns => {
                write!(text, "{trouble}")
            }
            (Some(_), _) => write!(
                text,
                "{}x{} at {}/s, {} kbit/s, {:.1} ms a frame{}",
                format.width,
                format.height,
                format.fps,
                format.bitrate / 1000,
                encode_ns as f64 * 1e-6,
                if crate::HAS_ASSEMBLER { "" } else { ", built without nasm" }
            ),
        };
    }

    fn refused(&self) -> u64 {
        self.state.refused() + self.source.refused() + self.failed
    }
}
