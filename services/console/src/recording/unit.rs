//! Access units of `camera/video` as they come over the network, read with care: who sends them may be broken.

use ipc_types::{Format, Header, VIDEO_BYTES, Video};
use std::mem::offset_of;

/// NAL units in one access unit at most; a camera's has about five.
const MOST_NALS: usize = 256;
/// Types of NAL units (ITU-T H.264, table 7-1).
const SLICE: u8 = 1;
const IDR: u8 = 5;
const SPS: u8 = 7;
const PPS: u8 = 8;
const DELIMITER: u8 = 9;

/// What a decoder must know before the first picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Parameters {
    /// Sequence parameter set, without start code.
    pub(super) sps: Vec<u8>,
    /// Picture parameter set, without start code.
    pub(super) pps: Vec<u8>,
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    /// Publisher and incarnation.
    pub(super) source: (u32, u32),
    /// Its number; one that is missing was lost.
    pub(super) sequence: u64,
    /// When the light fell in, nanoseconds of the drone's clock.
    pub(super) capture_ns: u64,
    /// Pixels.
    pub(super) width: u16,
    /// Pixels.
    pub(super) height: u16,
    /// With it decoding can begin; absent in all others.
    pub(super) parameters: Option<Parameters>,
    /// Its NAL units, each behind its length in four bytes, big endian; parameter sets left out.
    pub(super) sample: Vec<u8>,
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk::<N>().copied()
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    number(bytes, at).map(u32::from_le_bytes)
}

fn long(bytes: &[u8], at: usize) -> Option<u64> {
    number(bytes, at).map(u64::from_le_bytes)
}

impl Unit {
    /// Reads a message: the bytes of [`Video`], cut after `length` bytes of its last field or whole.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn read(message: &[u8]) -> Result<Self, &'static str> {
        const FORMAT: usize = offset_of!(Video, format);
        const HEADER: usize = offset_of!(Video, header);
        let short = "a message that is too short";
        let bytes = message.get(offset_of!(Video, bytes)..).ok_or(short)?;
        let length = word(message, offset_of!(Video, length)).ok_or(short)? as usize;
        if length > VIDEO_BYTES || bytes.len() > VIDEO_BYTES {
            return Err("a picture that is too long");
        }
        let annex_b = bytes.get(..length).ok_or("a picture that breaks off")?;
        let field = |at: usize| word(message, at).ok_or(short);
        let format = Format {
            width: field(FORMAT + offset_of!(Format, width))?,
            height: field(FORMAT + offset_of!(Format, height))?,
            fps: field(FORMAT + offset_of!(Format, fps))?,
            bitrate: field(FORMAT + offset_of!(Format, bitrate))?,
        };
        if !format.is_valid() {
            return Err("a size or pace that no camera has");
        }
        let size = |pixels: u32| u16::try_from(pixels).map_err(|_| "a size that no camera has");
        let (sample, parameters) = nals(annex_b)?;
        Ok(Self {
            source: (
                field(HEADER + offset_of!(Header, publisher))?,
                field(HEADER + offset_of!(Header, incarnation))?,
            ),
            sequence: long(message, HEADER + offset_of!(Header, sequence)).ok_or(short)?,
            capture_ns: long(message, offset_of!(Video, capture_ns)).ok_or(short)?,
            width: size(format.width)?,
            height: size(format.height)?,
            parameters,
            sample,
        })
    }

    /// Whether decoding can begin with it.
    pub(super) fn is_key(&self) -> bool {
        self.parameters.is_some()
    }
}

/// Where the next start code (0, 0, 1) begins.
fn start_code(bytes: &[u8]) -> Option<usize> {
    bytes.windows(3).position(|three| three == [0, 0, 1])
}

/// The NAL units of an access unit in Annex B form, as a sample of MP4; and its parameter sets when it is a key frame.
fn nals(annex_b: &[u8]) -> Result<(Vec<u8>, Option<Parameters>), &'static str> {
    let mut sample = Vec::with_capacity(annex_b.len() + 64);
    let (mut sps, mut pps) = (None, None);
    let (mut pictures, mut keys, mut count) = (0, 0, 0);
    let begin = start_code(annex_b).ok_or("a picture without a start code")?;
    let mut rest = annex_b.get(begin + 3..).unwrap_or_default();
    while !rest.is_empty() {
        let end = start_code(rest);
        let (nal, next) = match end {
            Some(at) => (rest.get(..at), rest.get(at + 3..)),
            None => (Some(rest), None),
        };
        let mut nal = nal.unwrap_or_default();
        // Zeros before a start code belong to it.
        while let Some((&0, shorter)) = nal.split_last() {
            nal = shorter;
        }
        rest = next.unwrap_or_default();
        let Some(&head) = nal.first() else { continue };
        count += 1;
        if head & 0x80 != 0 || count > MOST_NALS {
            return Err("a picture that is no H.264");
        }
        match head & 0x1f {
            SPS => sps = Some(nal.to_vec()),
            PPS => pps = Some(nal.to_vec()),
            DELIMITER => {}
            kind => {
                pictures += u32::from(matches!(kind, SLICE | IDR));
                keys += u32::from(kind == IDR);
                // No NAL unit is longer than the message, which is bounded.
                sample.extend_from_slice(&(nal.len() as u32).to_be_bytes());
                sample.extend_from_slice(nal);
            }
        }
    }
    if pictures == 0 {
        return Err("a picture with nothing in it");
    }
    let parameters = match (sps, pps) {
        // A decoder reads profile and level from the first four bytes.
        (Some(sps), Some(pps)) if keys > 0 && sps.len() >= 4 => Some(Parameters { sps, pps }),
        _ => None,
    };
    Ok((sample, parameters))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A message with these bytes for a picture; numbers as a camera gives them.
    pub(in crate::recording) fn message(
        sequence: u64,
        capture_ns: u64,
        width: u32,
        annex_b: &[u8],
    ) -> Vec<u8> {
        let mut bytes = vec![0; offset_of!(Video, bytes)];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        put(offset_of!(Video, header) + offset_of!(Header, sequence), &sequence.to_le_bytes());
        put(offset_of!(Video, capture_ns), &capture_ns.to_le_bytes());
        let format = offset_of!(Video, format);
        put(format + offset_of!(Format, width), &width.to_le_bytes());
        put(format + offset_of!(Format, height), &480_u32.to_le_bytes());
        put(format + offset_of!(Format, fps), &15_u32.to_le_bytes());
        put(format + offset_of!(Format, bitrate), &1_000_000_u32.to_le_bytes());
        put(offset_of!(Video, length), &(annex_b.len() as u32).to_le_bytes());
        bytes.extend_from_slice(annex_b);
        bytes
    }

    pub(in crate::recording) const KEY: &[u8] =
        &[0, 0, 0, 1, 0x67, 0x42, 0xc0, 0x1f, 9, 0, 0, 0, 1, 0x68, 0xce, 0, 0, 0, 1, 0x65, 1, 2, 3];
    pub(in crate::recording) const DELTA: &[u8] = &[0, 0, 1, 0x09, 0xf0, 0, 0, 0, 1, 0x41, 4, 5];

    #[test]
    fn a_key_frame_has_its_parameters_and_a_sample_has_lengths() {
        let key = Unit::read(&message(7, 99, 640, KEY)).expect("good");
        assert_eq!((key.sequence, key.capture_ns, key.width, key.height), (7, 99, 640, 480));
        assert_eq!(key.sample, [0, 0, 0, 4, 0x65, 1, 2, 3]);
        let parameters = key.parameters.expect("a key frame");
        assert_eq!(
            (&parameters.sps[..], &parameters.pps[..]),
            (&[0x67, 0x42, 0xc0, 0x1f, 9][..], &[0x68, 0xce][..])
        );
        let delta = Unit::read(&message(8, 100, 640, DELTA)).expect("good");
        assert!(!delta.is_key());
        assert_eq!(delta.sample, [0, 0, 0, 3, 0x41, 4, 5]);
    }

    #[test]
    fn junk_is_refused_and_nothing_panics() {
        let good = message(1, 1, 640, KEY);
        for end in 0..good.len() {
            assert!(Unit::read(&good[..end]).is_err(), "{end}");
        }
        assert!(Unit::read(&message(1, 1, 641, KEY)).is_err());
        assert!(Unit::read(&message(1, 1, 640, &[0, 0, 1, 0x67, 1, 2, 3])).is_err(), "no picture");
        assert!(Unit::read(&message(1, 1, 640, &[0, 0, 1, 0xe5, 1])).is_err(), "the forbidden bit");
        assert!(Unit::read(&message(1, 1, 640, &[0; 300])).is_err());
        assert!(Unit::read(&message(1, 1, 640, &[0, 0, 1, 0x41, 1].repeat(MOST_NALS + 1))).is_err());
        let mut long = good.clone();
        long[offset_of!(Video, length)..][..4].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(Unit::read(&long).is_err());
        // Each bit turned round, one after the other.
        for bit in 0..good.len() * 8 {
            let mut broken = good.clone();
            broken[bit / 8] ^= 1 << (bit % 8);
            let _ = Unit::read(&broken);
        }
        let mut state = 1_u32;
        for _ in 0..20_000 {
            let junk: Vec<u8> = (0..state % 400)
                .map(|k| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223 + k);
                    // Many zeros and ones, so that there are start codes.
                    (state >> 24) as u8 & [0xff, 0x01, 0x00][state as usize % 3]
                })
                .collect();
            let _ = Unit::read(&message(1, 1, 640, &junk));
            state = state.wrapping_add(7);
        }
    }
}
