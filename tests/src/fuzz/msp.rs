//! The MSP decoder and the layouts of its messages.

use msp::messages::*;
use msp::{Decoder, Direction, Frame, Layout, Reader, Request, Version, encode, encode_request};

/// As large as the firmwares' own buffers and larger than any payload that is used.
const ROOM: usize = 512;
/// Smaller than a full set of channels: most frames are too large for it.
const LITTLE_ROOM: usize = 24;
/// Bytes around a payload at most: preamble, direction, header, check.
const AROUND: usize = 9;

#[derive(Debug, PartialEq, Eq)]
struct Owned {
    version: Version,
    direction: Direction,
    code: u16,
    flags: u8,
    payload: Vec<u8>,
}

impl Owned {
    fn of(frame: Frame<'_>) -> Self {
        let Frame { version, direction, code, flags, payload } = frame;
        Self { version, direction, code, flags, payload: payload.to_vec() }
    }

    /// Least and greatest number of bytes that it was: version 1 may announce little in a long header.
    fn length(&self) -> (usize, usize) {
        let payload = self.payload.len();
        match self.version {
            Version::V1 if payload < 255 => (payload + 6, payload + 8),
            Version::V1 => (payload + 8, payload + 8),
            Version::V2 => (payload + 9, payload + 9),
        }
    }
}

/// Any bytes in any split. The first byte says how long the pieces are.
///
/// A stream gives the same frames however it is cut; each frame, encoded again, is the frame; and every byte belongs
/// to a frame or is counted as refused.
pub fn msp_stream(data: &[u8]) -> bool {
    let Some((&cut, stream)) = data.split_first() else { return false };
    let mut decoder = Decoder::<ROOM>::new();
    let mut frames = Vec::new();
    for piece in stream.chunks(usize::from(cut).max(1)) {
        decoder.feed(piece, |frame| frames.push(Owned::of(frame)));
    }
    assert_eq!(frames, byte_by_byte(stream), "another split, other frames");
    for frame in &frames {
        encodes_again(frame, stream);
        layouts(&frame.payload);
    }
    every_byte_is_counted(decoder, &frames, stream.len());

    let mut little = Decoder::<LITTLE_ROOM>::new();
    little.feed(stream, |frame| assert!(Owned::of(frame).length().0 <= LITTLE_ROOM));
    layouts(stream);
    !frames.is_empty()
}

fn byte_by_byte(stream: &[u8]) -> Vec<Owned> {
    let mut decoder = Decoder::<ROOM>::new();
    let mut frames = Vec::new();
    for byte in stream {
        frames.extend(decoder.push(*byte).map(Owned::of));
        while let Some(frame) = decoder.pending() {
            frames.push(Owned::of(frame));
        }
    }
    frames
}

fn encodes_again(frame: &Owned, stream: &[u8]) {
    let mut out = vec![0; frame.payload.len() + AROUND];
    let written = encode(&mut out, frame.version, frame.direction, frame.code, &frame.payload);
    // What came in version 1 with the code 255 cannot be said: that code announces version 2 inside version 1.
    if frame.version == Version::V1 && frame.code == 255 {
        assert!(written.is_err());
        return;
    }
    let written = written.ok().and_then(|length| out.get(..length));
    let Some(written) = written else { panic!("{frame:?} does not encode: {written:?}") };
    let mut again = Vec::new();
    Decoder::<ROOM>::new().feed(written, |frame| again.push(Owned::of(frame)));
    // The encoder has no flags.
    let plain = Owned { flags: 0, payload: frame.payload.clone(), ..*frame };
    assert_eq!(again, [plain]);
    if frame.flags == 0 && frame.version == Version::V2 {
        assert!(stream.windows(written.len()).any(|window| window == written), "{written:?} never came");
    }
}

fn every_byte_is_counted(mut decoder: Decoder<ROOM>, frames: &[Owned], length: usize) {
    let mut late = Vec::new();
    // What waits for its end will have none.
    while decoder.in_frame() {
        decoder.abandon();
        while let Some(frame) = decoder.pending() {
            late.push(Owned::of(frame));
        }
    }
    let refused = decoder.refused().bytes as usize;
    let lengths = frames.iter().chain(&late).map(Owned::length);
    let (least, most) = lengths.fold((refused, refused), |sum, length| (sum.0 + length.0, sum.1 + length.1));
    assert!((least..=most).contains(&length), "{length} bytes came, {least} to {most} are accounted for");
}

fn read<'a, L: Layout<'a>>(payload: &'a [u8]) -> Option<L> {
    L::read(&mut Reader::new(payload)).ok()
}

/// Every layout reads every payload or refuses it; what has a writer is written as it was read.
fn layouts(payload: &[u8]) {
    read::<ApiVersionReply>(payload);
    read::<FcVariantReply>(payload);
    read::<FcVersionReply>(payload);
    read::<RxMapReply>(payload);
    read::<BoxIdsReply<'_>>(payload);
    read::<RawImuReply>(payload);
    read::<AttitudeReply>(payload);
    read::<AttitudeAndImuReply>(payload);
    read::<AltitudeReply>(payload);
    read::<MotorReply>(payload);
    read::<FailsafeConfigReply>(payload);
    if let Some(names) = read::<BoxNamesReply<'_>>(payload) {
        assert!(names.names().map(str::len).sum::<usize>() <= payload.len());
    }
    if let Some(analog) = read::<AnalogReply>(payload) {
        assert!((0.0..=656.0).contains(&analog.volts()));
    }
    if let Some(status) = read::<StatusReply>(payload) {
        // 32 modes and fifteen bytes more are all that the answer holds.
        assert!(![152, 153, usize::MAX].iter().any(|index| status.mode(*index)));
        assert!(status.arming.is_none_or(|arming| arming.arm_switch().is_none_or(u32::is_power_of_two)));
    }
    if let Some(rc) = read::<RcReply>(payload) {
        let channels = rc.channels_us.get(..rc.count.into());
        let Some(channels) = channels else { panic!("{rc:?} has more channels than it holds") };
        if let Ok(order) = SetRawRc::new(channels) {
            assert_eq!(order.channels_us(), channels);
            assert!(channels.iter().all(|us| (CHANNEL_MIN_US..=CHANNEL_MAX_US).contains(us)));
        }
    }
    if let Some(range) = read::<RangeFrame>(payload) {
        assert_eq!(written_and_read(&range), Some(range));
    }
    if let Some(flow) = read::<FlowFrame>(payload) {
        assert_eq!(written_and_read(&flow), Some(flow));
    }
}

fn written_and_read<R: Request + for<'a> Layout<'a>>(message: &R) -> Option<R> {
    let mut out = [0; 64];
    let length = encode_request(&mut out, Version::V2, message).ok()?;
    let mut again = None;
    Decoder::<64>::new().feed(out.get(..length)?, |frame| {
        assert_eq!(frame.code, R::CODE);
        again = R::read(&mut Reader::new(frame.payload)).ok();
    });
    again
}
