//! `camera/picture`, `camera/video`, `camera/still` and `camera/wish`: raw frames, what they are encoded to, and who wants
//! which.

use crate::Bytes;
use crate::field::{fields, message};

/// Widest picture, pixels.
pub const MAX_PICTURE_WIDTH: u32 = 1920;
/// Highest picture, pixels.
pub const MAX_PICTURE_HEIGHT: u32 = 1080;
/// Room for the three planes of the largest picture.
pub const PICTURE_BYTES: usize = 1920 * 1080 * 3 / 2;
/// Room for one encoded frame: a key frame of 1920x1080 at 8 Mb/s is about half of this.
pub const VIDEO_BYTES: usize = 262_144;
/// Room for one still picture: 640x480 of a cluttered room at quality 80 is about half of this.
pub const STILL_BYTES: usize = 131_072;
/// Widest still picture, pixels.
pub const MAX_STILL_WIDTH: u32 = 720;
/// For how long a wish may be obeyed after it was made, nanoseconds: who wants video says so again and again.
pub const WISH_LIFE_NS: u64 = 1_000_000_000;
/// A wish may be this much newer than the step that takes it, nanoseconds: a step reads the clock before its inputs.
const WISH_AHEAD_NS: u64 = 100_000_000;

message! {
    /// One raw frame, I420 in limited range (BT.601, luma 16 to 235): the luma plane of `stride` by `height` bytes, then the two chroma planes (blue
    /// difference, red difference) of half that stride and height each, one behind the other.
    pub struct Picture on "camera/picture" {
        /// When the light fell in: the middle of the exposure.
        pub capture_ns: u64,
        /// Number of the frame; grows.
        pub frame: u64,
        /// Pixels, even, at most [`MAX_PICTURE_WIDTH`].
        pub width: u32,
        /// Pixels, even, at most [`MAX_PICTURE_HEIGHT`].
        pub height: u32,
        /// Bytes from one line of luma to the next, even, at least `width`.
        pub stride: u32,
        /// 1: no colour in it (a night picture by infra-red light); both chroma planes are 128 throughout.
        pub monochrome: u32,
        /// The planes.
        pub planes: Bytes<3_110_400>,
    }
}

fields! {
    /// The size of a picture and its pace.
    pub struct Format {
        /// Pixels, even, 160 to [`MAX_PICTURE_WIDTH`].
        pub width: u32,
        /// Pixels, even, 120 to [`MAX_PICTURE_HEIGHT`].
        pub height: u32,
        /// Frames a second, 1 to 60.
        pub fps: u32,
        /// Bits a second, 50 000 to 20 000 000.
        pub bitrate: u32,
    }
}

message! {
    /// One H.264 access unit, constrained baseline, in Annex B form; a key frame carries its parameter sets.
    pub struct Video on "camera/video" {
        /// As the picture's.
        pub capture_ns: u64,
        /// As the picture's.
        pub frame: u64,
        /// What encoding it took, nanoseconds.
        pub encode_ns: u64,
        /// Size of this frame; pace and bitrate as aimed at now.
        pub format: Format,
        /// 1: can be decoded without any frame before it.
        pub key: u32,
        /// Filled bytes; more than [`VIDEO_BYTES`] is a broken message.
        pub length: u32,
        /// The access unit.
        pub bytes: Bytes<262_144>,
    }
}

message! {
    /// One still picture as JPEG (baseline, full range), at most [`MAX_STILL_WIDTH`] pixels wide: for whoever cannot decode
    /// [`Video`].
    pub struct Still on "camera/still" {
        /// As the picture's.
        pub capture_ns: u64,
        /// As the picture's.
        pub frame: u64,
        /// What encoding it took, nanoseconds.
        pub encode_ns: u64,
        /// Pixels.
        pub width: u32,
        /// Pixels.
        pub height: u32,
        /// Quality it was encoded with, 1 to 100: lower where the picture would not have fitted.
        pub quality: u32,
        /// Filled bytes; more than [`STILL_BYTES`] is a broken message.
        pub length: u32,
        /// The file.
        pub bytes: Bytes<131_072>,
    }
}

message! {
    /// Somebody wants video, for a second: while nobody does, nothing is rendered, captured or encoded.
    pub struct Wish on "camera/wish" {
        /// Not to be obeyed at or after this time; at most [`WISH_LIFE_NS`] after the stamp.
        pub expiry_ns: u64,
        /// What is wanted; zero throughout in a wish for stills alone, which no encoder need wake for.
        pub format: Format,
        /// Whoever says more decides the format; between equals the larger picture does.
        pub priority: u32,
        /// Counts the key frames that this publisher has asked for.
        pub key_requests: u32,
        /// 1: a JPEG a second is wanted on `camera/still`, besides the video of `format` or in its place.
        pub still: u32,
        /// Zero.
        pub reserved: u32,
    }
}

message! {
    /// What a viewer says to the drone about one video session. See `docs/off-board.md`.
    pub struct SignalIn on "signal/in" {
        /// The session, chosen by the viewer's side.
        pub session: crate::Text<32>,
        /// Name of the certificate by which it came.
        pub certificate: crate::Text<32>,
        /// Account of the viewer.
        pub account: crate::Text<32>,
        /// Role of the account, capped by that of the certificate.
        pub role: crate::Text<16>,
        /// JSON.
        pub body: crate::Text<65_536>,
    }
}

message! {
    /// What the drone says to a viewer about its video session.
    pub struct SignalOut on "signal/out" {
        /// As in [`SignalIn`].
        pub session: crate::Text<32>,
        /// As in [`SignalIn`]: who is to get it.
        pub certificate: crate::Text<32>,
        /// JSON.
        pub body: crate::Text<65_536>,
    }
}

/// The three planes of a picture: luma, blue difference, red difference.
pub type Planes<'a> = [&'a [u8]; 3];

impl Picture {
    /// The planes, each exactly as long as width, height and stride say; `None` when those make no sense.
    #[must_use]
    pub fn planes(&self) -> Option<Planes<'_>> {
        let (luma, chroma) = self.plane_sizes()?;
        let (y, rest) = self.planes.as_slice().split_at_checked(luma)?;
        let (u, rest) = rest.split_at_checked(chroma)?;
        Some([y, u, rest.get(..chroma)?])
    }

    /// The planes, to be written.
    pub fn planes_mut(&mut self) -> Option<[&mut [u8]; 3]> {
        let (luma, chroma) = self.plane_sizes()?;
        let (y, rest) = self.planes.as_mut_slice().split_at_mut_checked(luma)?;
        let (u, rest) = rest.split_at_mut_checked(chroma)?;
        Some([y, u, rest.get_mut(..chroma)?])
    }

    fn plane_sizes(&self) -> Option<(usize, usize)> {
        let even = |n: u32| n > 0 && n.is_multiple_of(2);
        let fits = self.width <= MAX_PICTURE_WIDTH
            && self.height <= MAX_PICTURE_HEIGHT
            && (self.width..=2 * MAX_PICTURE_WIDTH).contains(&self.stride);
        if !(fits && even(self.width) && even(self.height) && even(self.stride)) {
            return None;
        }
        let luma = self.stride as usize * self.height as usize;
        (luma + luma / 2 <= PICTURE_BYTES).then_some((luma, luma / 4))
    }
}

impl Video {
    /// The access unit; empty when the length makes no sense.
    #[must_use]
    pub fn access_unit(&self) -> &[u8] {
        self.bytes.as_slice().get(..self.length as usize).unwrap_or(&[])
    }
}

impl Still {
    /// The JPEG file; empty when the length makes no sense.
    #[must_use]
    pub fn jpeg(&self) -> &[u8] {
        self.bytes.as_slice().get(..self.length as usize).unwrap_or(&[])
    }
}

impl Format {
    /// Whether this is no format at all: zero throughout.
    #[must_use]
    pub fn is_none(&self) -> bool {
        (self.width, self.height, self.fps, self.bitrate) == (0, 0, 0, 0)
    }

    /// Whether this can be captured and encoded.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        (160..=MAX_PICTURE_WIDTH).contains(&self.width)
            && (120..=MAX_PICTURE_HEIGHT).contains(&self.height)
            && self.width.is_multiple_of(2)
            && self.height.is_multiple_of(2)
            && (1..=60).contains(&self.fps)
            && (50_000..=20_000_000).contains(&self.bitrate)
    }
}

impl Wish {
    /// Whether it makes sense: video in a format that can be encoded, stills, or both.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.still <= 1 && (self.wants_video() || (self.wants_still() && self.format.is_none()))
    }

    /// Whether video is wanted, in `format`.
    #[must_use]
    pub fn wants_video(&self) -> bool {
        self.format.is_valid()
    }

    /// Whether stills are wanted.
    #[must_use]
    pub fn wants_still(&self) -> bool {
        self.still == 1
    }

    /// Whether it may be obeyed at `now_ns`: it makes sense, has not expired and does not claim to be for ever.
    #[must_use]
    pub fn counts(&self, now_ns: u64) -> bool {
        let made_ns = self.header.stamp_ns;
        self.is_valid()
            && made_ns <= now_ns.saturating_add(WISH_AHEAD_NS)
            && now_ns < self.expiry_ns
            && self.expiry_ns <= made_ns.saturating_add(WISH_LIFE_NS)
    }

    /// Whether this goes before `other`.
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        let rank = |wish: &Self| {
            let format = wish.format;
            (wish.priority, u64::from(format.width) * u64::from(format.height), format.fps, format.bitrate)
        };
        rank(self) > rank(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_as_long_as_the_picture_says_and_nonsense_has_none() {
        let mut picture = bytemuck::allocation::zeroed_box::<Picture>();
        let sizes = |p: &Picture| p.planes().map(|planes| planes.map(<[u8]>::len));
        assert_eq!(sizes(&picture), None);
        (picture.width, picture.height, picture.stride) = (640, 480, 648);
        assert_eq!(sizes(&picture), Some([648 * 480, 324 * 240, 324 * 240]));
        (picture.width, picture.height, picture.stride) = (1920, 1080, 1920);
        assert_eq!(sizes(&picture), Some([1920 * 1080, 960 * 540, 960 * 540]));
        for (width, height, stride) in [
            (1922, 2, 1922),
            (641, 480, 642),
            (640, 481, 640),
            (640, 480, 638),
            (1920, 1080, 1922),
            (2, 0, 2),
        ] {
            (picture.width, picture.height, picture.stride) = (width, height, stride);
            assert_eq!(sizes(&picture), None, "{width}x{height}, {stride}");
        }
    }

    #[test]
    fn a_wish_counts_for_a_second_and_who_says_more_decides() {
        let format = Format { width: 640, height: 480, fps: 30, bitrate: 1_000_000 };
        let made = 5_000_000_000;
        let mut wish = Wish { expiry_ns: made + WISH_LIFE_NS, format, ..Wish::default() };
        wish.header.stamp_ns = made;
        assert!(wish.counts(made) && wish.counts(made + WISH_LIFE_NS - 1));
        assert!(!wish.counts(made + WISH_LIFE_NS), "expired");
        assert!(!wish.counts(made - WISH_AHEAD_NS - 1), "from the future");
        wish.expiry_ns += 1;
        assert!(!wish.counts(made), "for longer than anybody may");
        let larger = Wish { format: Format { width: 1280, height: 720, ..format }, ..wish };
        let holder = Wish { priority: 1, ..wish };
        assert!(larger.beats(&wish) && !wish.beats(&larger) && holder.beats(&larger) && !wish.beats(&wish));
        assert!(!Format { width: 641, ..format }.is_valid() && !Format { fps: 0, ..format }.is_valid());
    }

    #[test]
    fn a_wish_for_stills_alone_counts_and_wants_no_video() {
        let format = Format { width: 640, height: 480, fps: 30, bitrate: 1_000_000 };
        let made = 5_000_000_000;
        let mut wish = Wish { expiry_ns: made + WISH_LIFE_NS, still: 1, ..Wish::default() };
        wish.header.stamp_ns = made;
        assert!(wish.counts(made) && wish.wants_still() && !wish.wants_video());
        let both = Wish { format, ..wish };
        assert!(both.counts(made) && both.wants_still() && both.wants_video());
        for nonsense in [
            Wish { still: 0, ..wish },
            Wish { still: 2, ..both },
            Wish { format: Format { width: 641, ..format }, ..wish },
            Wish { format: Format { fps: 15, ..Format::default() }, ..wish },
        ] {
            assert!(!nonsense.counts(made), "{nonsense:?}");
        }
    }
}
