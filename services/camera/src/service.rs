//! The service: wishes in, video and stills out.

use crate::config::{FILE, TEST_PATTERN};
use crate::privacy::{Privacy, Viewpoint};
use crate::simulated::Simulated;
use crate::source::{Frame, Pace, Source};
use crate::{CameraConfig, EncodeError, Encoder, Pattern, STILL_FORMAT, StillError, Stills, Wishes, Y4m};
use ipc_types::{Format, LocalizationState, Pose, Still, Text, Video, Wish};
use manifest::CameraMount;
use runtime::{Input, Output, Ports, Service, Start, StartError};
use std::fmt::Write;

/// The source is said to be silent after so long without a frame, nanoseconds.
const SILENCE_NS: u64 = 1_000_000_000;
/// After a frame that did not fit its place the bitrate is cut to this share of what is wished for, for this long.
const CUT: (u32, u32) = (1, 3);
const CUT_NS: u64 = 5_000_000_000;
/// A frame that comes so much before the second is over is taken for the next still: the one after it would be later by more.
const STILL_EARLY_NS: u64 = 200_000_000;

/// Of a camera whose vehicle does not say how it looks: nearly half of the way round.
const WIDEST_RAD: f32 = 2.8;

/// Where a picture of this time was taken, as far as the drone knows.
fn viewpoint(pose: Option<&Pose>, mount: Option<&CameraMount>, capture_ns: u64) -> Option<Viewpoint> {
    let pose = pose?;
    let (sin, cos) = pose.heading_rad.sin_cos();
    let (forward, left) = mount.map_or((0.0, 0.0), |mount| (mount.x_m, mount.y_m));
    // The picture may be newer than the place or older: one is as bad as the other.
    let age_s = (pose.estimated_ns.abs_diff(capture_ns) as f64 * 1e-9) as f32;
    let state = LocalizationState::from_code(pose.state.to_le_bytes()[0]);
    let known = state == Some(LocalizationState::Tracking) && pose.searching == 0;
    known.then_some(Viewpoint {
        x: pose.x_m + forward * cos - left * sin,
        y: pose.y_m + forward * sin + left * cos,
        heading: pose.heading_rad,
        sigma_m: pose.sigma_m(),
        sigma_rad: pose.heading_sigma_rad,
        p_lost: pose.p_lost,
        age_s,
    })
}

/// Encodes what the source gives, while somebody wants it.
pub struct Camera {
    wishes: Input<Wish>,
    poses: Input<Pose>,
    pose: Option<Pose>,
    mount: Option<CameraMount>,
    /// On a plan with privacy zones.
    privacy: Option<Privacy>,
    videos: Output<Video>,
    stills: Output<Still>,
    source: Box<dyn Source>,
    state: Wishes,
    encoder: Encoder,
    still: Taker,
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

/// Makes stills at their pace.
#[derive(Default)]
struct Taker {
    stills: Stills,
    pace: Pace,
    taken: u64,
    failed: u64,
    trouble: Option<StillError>,
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
        let mount = start.vehicle.camera;
        let view_rad = mount.map_or(WIDEST_RAD, |mount| mount.field_of_view_rad);
        Ok(Self {
            wishes: ports.input()?,
            poses: ports.input()?,
            pose: None,
            mount,
            privacy: Privacy::new(start.plan()?, &start.sidecar()?.privacy, view_rad),
            videos: ports.output()?,
            stills: ports.output()?,
            source,
            state: Wishes::default(),
            encoder: Encoder::new(config.key_every_s),
            still: Taker::default(),
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
        while let Some(pose) = self.poses.receive() {
            self.pose = Some(*pose);
        }
        let wanted = self.state.wanted(now);
        let still = self.state.wants_still(now);
        let captured = wanted.or_else(|| still.then_some(STILL_FORMAT));
        let Some(frame) = self.source.frame(now, captured.as_ref()) else {
            if captured.is_none() {
                self.heard_ns = now;
            }
            return;
        };
        self.heard_ns = now;
        let frame = match &mut self.privacy {
            Some(privacy) => {
                privacy.look(viewpoint(self.pose.as_ref(), self.mount.as_ref(), frame.capture_ns));
                privacy.cover(frame)
            }
            None => frame,
        };
        if let Some(format) = wanted {
            let cut = now < self.cut_until_ns;
            let bitrate = if cut { (format.bitrate / CUT.1 * CUT.0).max(50_000) } else { format.bitrate };
            let rested = self.last_key_ns.is_none_or(|last| now.saturating_sub(last) >= self.key_pause_ns);
            let filming = Filming {
                videos: &mut self.videos,
                encoder: &mut self.encoder,
                last: &mut self.last,
                format: Format { bitrate, ..format },
                key: self.state.wants_key() && rested,
            };
            match filming.film(frame) {
                Ok(true) => {
                    self.last_key_ns = Some(now);
                    self.state.key_sent();
                }
                Ok(false) => {}
                Err(error) => {
                    if matches!(error, EncodeError::TooLarge { .. }) {
                        self.cut_until_ns = now + CUT_NS;
                    }
                    self.failed += 1;
                    self.trouble = Some(error);
                }
            }
        }
        if still && self.still.pace.is_due(now, 1, STILL_EARLY_NS) {
            self.still.take(&mut self.stills, &frame);
        }
    }

    fn status(&self, text: &mut Text<96>) {
        let Last { format, encode_ns, frames } = self.last;
        // What does not fit is cut off.
        let stills = self.state.wants_still(self.now);
        let silent_ns = self.now.saturating_sub(self.heard_ns);
        let _ = match (self.state.wanted(self.now), &self.trouble) {
            (None, _) if !stills => write!(text, "asleep, {frames} frames so far"),
            (None, _) if silent_ns > 3 * SILENCE_NS => write!(text, "the source gives no frames"),
            (None, _) => match &self.still.trouble {
                Some(trouble) => write!(text, "{trouble}"),
                None => write!(text, "a still a second, {} so far", self.still.taken),
            },
            (Some(_), _) if silent_ns > SILENCE_NS => write!(text, "the source gives no frames"),
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
        self.state.refused() + self.source.refused() + self.failed + self.still.failed
    }
}

/// What it takes to encode one frame, while the source still holds it.
struct Filming<'a> {
    videos: &'a mut Output<Video>,
    encoder: &'a mut Encoder,
    last: &'a mut Last,
    format: Format,
    key: bool,
}

impl Filming<'_> {
    /// Encodes a frame and sends it; whether it was a key frame.
    fn film(self, frame: Frame<'_>) -> Result<bool, EncodeError> {
        let Some(mut video) = self.videos.loan() else { return Ok(false) };
        let began = runtime::monotonic_ns();
        let encoded = self.encoder.encode(frame, &self.format, self.key, video.bytes.as_mut_slice())?;
        if encoded.length == 0 {
            // The encoder left a frame out.
            return Ok(false);
        }
        video.capture_ns = frame.capture_ns;
        video.frame = frame.number;
        video.encode_ns = runtime::monotonic_ns() - began;
        video.format = Format { width: frame.width, height: frame.height, ..self.format };
        video.key = u32::from(encoded.key);
        video.length = encoded.length as u32;
        let frames = self.last.frames + 1;
        *self.last = Last { format: video.format, encode_ns: video.encode_ns, frames };
        video.send();
        Ok(encoded.key)
    }
}

impl Taker {
    /// Makes a still of a frame and sends it.
    fn take(&mut self, stills: &mut Output<Still>, frame: &Frame<'_>) {
        let Some(mut still) = stills.loan() else { return };
        let began = runtime::monotonic_ns();
        match self.stills.take(frame, still.bytes.as_mut_slice()) {
            Ok(taken) => {
                still.capture_ns = frame.capture_ns;
                still.frame = frame.number;
                still.encode_ns = runtime::monotonic_ns() - began;
                (still.width, still.height) = (taken.width, taken.height);
                still.quality = u32::from(taken.quality);
                still.length = taken.length as u32;
                still.send();
                self.taken += 1;
                self.trouble = None;
            }
            Err(error) => {
                self.failed += 1;
                self.trouble = Some(error);
            }
        }
    }
}
