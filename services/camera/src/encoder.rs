//! H.264, constrained baseline, by openh264: no frame waits for another, so that the delay is the encoding alone.

use crate::source::Frame;
use ipc_types::Format;
use openh264::encoder::{
    BitRate, Complexity, Encoder as Codec, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, Profile,
    RateControlMode, UsageType,
};
use openh264::formats::YUVSource;
use openh264::{OpenH264API, Timestamp};
use openh264_sys2::{
    ENCODER_OPTION, ENCODER_OPTION_BITRATE, ENCODER_OPTION_FRAME_RATE, ENCODER_OPTION_MAX_BITRATE,
    ENCODER_OPTION_TRACE_LEVEL, SBitrateInfo, SPATIAL_LAYER_ALL, WELS_LOG_QUIET,
};

/// Why a frame was not encoded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// What the library says.
    #[error("the encoder failed: {0}")]
    Codec(String),
    /// An access unit that is larger than its place.
    #[error("a frame of {width}x{height} at {bitrate} bit/s does not fit into {room} bytes")]
    TooLarge {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// Bits a second aimed at.
        bitrate: u32,
        /// Bytes.
        room: usize,
    },
}

/// An encoded frame, in the place that was given for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// Bytes written; 0: the encoder left the frame out.
    pub length: usize,
    /// Can be decoded without any frame before it.
    pub key: bool,
}

/// One encoder for one picture size at a time.
pub struct Encoder {
    codec: Option<(Codec, Tuning)>,
    key_every_s: f64,
}

/// What an encoder was last told.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Tuning {
    size: (u32, u32),
    fps: u32,
    bitrate: u32,
}

struct Planes<'a>(Frame<'a>);

impl YUVSource for Planes<'_> {
    fn dimensions(&self) -> (usize, usize) {
        (self.0.width as usize, self.0.height as usize)
    }
    fn strides(&self) -> (usize, usize, usize) {
        let stride = self.0.stride as usize;
        (stride, stride / 2, stride / 2)
    }
    fn y(&self) -> &[u8] {
        self.0.planes[0]
    }
    fn u(&self) -> &[u8] {
        self.0.planes[1]
    }
    fn v(&self) -> &[u8] {
        self.0.planes[2]
    }
}

fn failed(error: &openh264::Error) -> EncodeError {
    EncodeError::Codec(error.to_string())
}

impl Encoder {
    /// An encoder that sends a key frame at least every `key_every_s` seconds.
    #[must_use]
    pub fn new(key_every_s: f64) -> Self {
        Self { codec: None, key_every_s }
    }

    /// Whether the next frame of this size is a key frame in any case, since an encoder begins with one.
    #[must_use]
    pub fn begins_with(&self, width: u32, height: u32) -> bool {
        self.codec.as_ref().is_none_or(|(_, tuning)| tuning.size != (width, height))
    }

    /// Encodes a frame into `out`, at pace and bitrate of `format`; the size is the frame's own. Allocates when the size is
    /// another than before, and nothing otherwise beyond what the library does.
    ///
    /// # Errors
    /// What the library refuses, and frames that do not fit; the next frame is a key frame then.
    pub fn encode(
        &mut self,
        frame: Frame<'_>,
        format: &Format,
        key: bool,
        out: &mut [u8],
    ) -> Result<Encoded, EncodeError> {
        let result = self.try_encode(frame, format, key, out);
        if result.is_err() {
            // Nobody knows what it believes to have sent.
            self.codec = None;
        }
        result
    }

    fn try_encode(
        &mut self,
        frame: Frame<'_>,
        format: &Format,
        key: bool,
        out: &mut [u8],
    ) -> Result<Encoded, EncodeError> {
        let wanted = Tuning { size: (frame.width, frame.height), fps: format.fps, bitrate: format.bitrate };
        if self.codec.as_ref().is_none_or(|(_, tuning)| tuning.size != wanted.size) {
            self.codec = Some((start(&wanted, self.key_every_s)?, wanted));
        }
        let Some((codec, tuning)) = &mut self.codec else {
            return Err(EncodeError::Codec("no encoder".to_owned()));
        };
        if *tuning != wanted {
            retune(codec, tuning, &wanted)?;
        }
        if key {
            codec.force_intra_frame();
        }
        let stamp = Timestamp::from_millis(frame.capture_ns / 1_000_000);
        let stream = codec.encode_at(&Planes(frame), stamp).map_err(|error| failed(&error))?;
        let key = matches!(stream.frame_type(), FrameType::IDR);
        let mut length = 0;
        for layer in (0..stream.num_layers()).filter_map(|index| stream.layer(index)) {
            for unit in (0..layer.nal_count()).filter_map(|index| layer.nal_unit(index)) {
                let place = out.get_mut(length..length + unit.len()).ok_or(EncodeError::TooLarge {
                    width: wanted.size.0,
                    height: wanted.size.1,
                    bitrate: wanted.bitrate,
                    room: PLACE,
                })?;
                place.copy_from_slice(unit);
                length += unit.len();
            }
        }
        Ok(Encoded { length, key })
    }
}

/// What an access unit must fit into.
const PLACE: usize = ipc_types::VIDEO_BYTES;

fn start(tuning: &Tuning, key_every_s: f64) -> Result<Codec, EncodeError> {
    let frames = (f64::from(tuning.fps) * key_every_s).round().max(1.0) as u32;
    let config = EncoderConfig::new()
        .profile(Profile::Baseline)
        .usage_type(UsageType::CameraVideoRealTime)
        .rate_control_mode(RateControlMode::Bitrate)
        .bitrate(BitRate::from_bps(tuning.bitrate))
        .max_frame_rate(FrameRate::from_hz(tuning.fps as f32))
        .intra_frame_period(IntraFramePeriod::from_num_frames(frames))
        .complexity(Complexity::Low)
        // A frame left out would be a picture that stands still: rather a coarser one.
        .skip_frames(false)
        // Key frames come when they are asked for: one in a turn of the drone would only be late.
        .scene_change_detect(false)
        .num_threads(1);
    let mut codec =
        Codec::with_api_config(OpenH264API::from_source(), config).map_err(|error| failed(&error))?;
    let mut quiet = WELS_LOG_QUIET;
    // It would write to the log that it may exceed the bitrate where no frame is left out, which is meant.
    set(&mut codec, ENCODER_OPTION_TRACE_LEVEL, &mut quiet)?;
    Ok(codec)
}

/// Sets an option of an encoder; `value` must be of the type that the option takes (codec_app_def.h).
fn set<T>(codec: &mut Codec, option: ENCODER_OPTION, value: &mut T) -> Result<(), EncodeError> {
    #[allow(unsafe_code, reason = "openh264 has no safe way to change a running encoder")]
    // SAFETY: the three callers pass what codec_app_def.h says for their option: an int, an `SBitrateInfo`, a float; the
    // library reads it during the call only.
    let code = unsafe { codec.raw_api().set_option(option, (&raw mut *value).cast()) };
    if code == 0 {
        Ok(())
    } else {
        Err(EncodeError::Codec(format!("option {option} is refused (code {code})")))
    }
}

/// Changes bitrate and pace of an encoder that runs, without a key frame.
fn retune(codec: &mut Codec, tuning: &mut Tuning, wanted: &Tuning) -> Result<(), EncodeError> {
    let mut bitrate = SBitrateInfo { iLayer: SPATIAL_LAYER_ALL, iBitrate: wanted.bitrate.cast_signed() };
    let mut fps = wanted.fps as f32;
    // The bitrate may never exceed its own limit: whichever grows is set first.
    let order = if wanted.bitrate > tuning.bitrate {
        [ENCODER_OPTION_MAX_BITRATE, ENCODER_OPTION_BITRATE]
    } else {
        [ENCODER_OPTION_BITRATE, ENCODER_OPTION_MAX_BITRATE]
    };
    for option in order {
        set(codec, option, &mut bitrate)?;
    }
    if wanted.fps != tuning.fps {
        set(codec, ENCODER_OPTION_FRAME_RATE, &mut fps)?;
    }
    *tuning = *wanted;
    Ok(())
}
