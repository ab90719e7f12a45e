//! Messages in, bytes out, into memory of the caller.

use crate::checksum::{crc8_dvb_s2, xor};
use crate::decode::{Direction, Version};
use crate::request::Request;
use core::fmt;

/// Why a frame could not be written. Nothing was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncodeError {
    /// The output is too small.
    NoRoom {
        /// Bytes of the output.
        room: usize,
    },
    /// The payload is longer than a length field can say (65535).
    TooLong {
        /// Bytes of the payload.
        length: usize,
    },
    /// Version 1 has codes to 254 only (255 announces version 2 inside version 1).
    CodeTooLarge {
        /// The code.
        code: u16,
    },
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoRoom { room } => write!(f, "the frame does not fit into {room} bytes"),
            Self::TooLong { length } => {
                write!(f, "a payload of {length} bytes; at most 65535 can be announced")
            }
            Self::CodeTooLarge { code } => write!(f, "code {code} in version 1; allowed 0..=254"),
        }
    }
}
impl core::error::Error for EncodeError {}

/// Writes a payload, number by number, little endian.
#[derive(Debug)]
pub struct Writer<'a> {
    out: &'a mut [u8],
    used: usize,
    overflow: bool,
}

impl<'a> Writer<'a> {
    /// Writes into `out`.
    #[must_use]
    pub fn new(out: &'a mut [u8]) -> Self {
        Self { out, used: 0, overflow: false }
    }

    /// Appends bytes as they are. Once something did not fit, nothing more is written.
    pub fn bytes(&mut self, bytes: &[u8]) {
        let end = self.used + bytes.len();
        match self.out.get_mut(self.used..end) {
            Some(slot) if !self.overflow => {
                slot.copy_from_slice(bytes);
                self.used = end;
            }
            _ => self.overflow = true,
        }
    }

    /// Appends a byte.
    pub fn u8(&mut self, value: u8) {
        self.bytes(&[value]);
    }

    /// Appends two bytes.
    pub fn u16(&mut self, value: u16) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends two bytes.
    pub fn i16(&mut self, value: i16) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends four bytes.
    pub fn u32(&mut self, value: u32) {
        self.bytes(&value.to_le_bytes());
    }

    /// Appends four bytes.
    pub fn i32(&mut self, value: i32) {
        self.bytes(&value.to_le_bytes());
    }

    /// Bytes written; `None` when not everything fitted.
    #[must_use]
    pub fn finish(self) -> Option<usize> {
        (!self.overflow).then_some(self.used)
    }
}

/// Writes one frame to the front of `out` and returns its length. Version 1 uses the long header from 255
/// bytes on.
///
/// # Errors
/// The payload is too long, the output too small, or the code too large for version 1.
pub fn encode(
    out: &mut [u8],
    version: Version,
    direction: Direction,
    code: u16,
    payload: &[u8],
) -> Result<usize, EncodeError> {
    let room = out.len();
    let Ok(length) = u16::try_from(payload.len()) else {
        return Err(EncodeError::TooLong { length: payload.len() });
    };
    let mut writer = Writer::new(out);
    writer.u8(b'$');
    match version {
        Version::V1 => {
            let code8 = match u8::try_from(code) {
                Ok(code8) if code8 < 255 => code8,
                _ => return Err(EncodeError::CodeTooLarge { code }),
            };
            writer.bytes(&[b'M', direction.character()]);
            match u8::try_from(length) {
                Ok(short) if short < 255 => writer.bytes(&[short, code8]),
                _ => {
                    writer.bytes(&[255, code8]);
                    writer.u16(length);
                }
            }
        }
        Version::V2 => {
            writer.bytes(&[b'X', direction.character(), 0]);
            writer.u16(code);
            writer.u16(length);
        }
    }
    writer.bytes(payload);
    let Some(end) = writer.finish() else { return Err(EncodeError::NoRoom { room }) };
    let checked = out.get(3..end).unwrap_or(&[]);
    let sum = match version {
        Version::V1 => xor(checked),
        Version::V2 => crc8_dvb_s2(checked),
    };
    match out.get_mut(end) {
        Some(slot) => *slot = sum,
        None => return Err(EncodeError::NoRoom { room }),
    }
    Ok(end + 1)
}

/// Longest payload of any [`Request`]: 18 channels of two bytes, with room to grow.
const MAX_REQUEST: usize = 64;

/// Writes a request to the front of `out` and returns the length of the frame.
///
/// # Errors
/// As [`encode`]; also when the request writes more than 64 bytes.
pub fn encode_request<R: Request>(
    out: &mut [u8],
    version: Version,
    request: &R,
) -> Result<usize, EncodeError> {
    let mut payload = [0; MAX_REQUEST];
    let mut writer = Writer::new(&mut payload);
    request.write(&mut writer);
    let Some(length) = writer.finish() else { return Err(EncodeError::NoRoom { room: MAX_REQUEST }) };
    encode(out, version, Direction::Request, R::CODE, payload.get(..length).unwrap_or(&[]))
}
