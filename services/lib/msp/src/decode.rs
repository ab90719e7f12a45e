//! Bytes in, frames out.

use crate::checksum::{crc8_dvb_s2, xor};

/// Which framing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// `$M`, codes to 254, XOR.
    V1,
    /// `$X`, 16-bit codes, CRC-8.
    V2,
}

/// Who talks to whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// `<`: to the controller.
    Request,
    /// `>`: from the controller.
    Reply,
    /// `!`: the controller does not know the request or refuses it.
    Refusal,
}

impl Direction {
    /// The character on the line.
    #[must_use]
    pub const fn character(self) -> u8 {
        match self {
            Self::Request => b'<',
            Self::Reply => b'>',
            Self::Refusal => b'!',
        }
    }

    const fn from_character(character: u8) -> Option<Self> {
        match character {
            b'<' => Some(Self::Request),
            b'>' => Some(Self::Reply),
            b'!' => Some(Self::Refusal),
            _ => None,
        }
    }
}

/// A frame whose check byte was right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Its framing.
    pub version: Version,
    /// Who talks.
    pub direction: Direction,
    /// Message code.
    pub code: u16,
    /// Flags of version 2; 0 in version 1.
    pub flags: u8,
    /// What it carries.
    pub payload: &'a [u8],
}

/// What was thrown away since the decoder was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// Frames with a wrong check byte.
    pub checksum: u32,
    /// Frames that announced more than the buffer holds.
    pub oversize: u32,
    /// Bytes that belong to no frame, those of refused frames included.
    pub bytes: u32,
}

/// A streaming decoder with room for frames of at most `N` bytes, preamble and check byte included.
///
/// A frame that fails is not thrown away whole: its bytes after the `$` are looked through again, because a
/// lost byte makes a frame swallow the head of the next one.
///
/// A frame gives way to a whole one inside it when much of it would still have to come: a damaged length announces up to a
/// whole buffer, and would hold everything back until that has come, to hand it out as if it were new. (So a long
/// payload in which a whole frame stands cannot be carried; no message of MSP has one.)
#[derive(Clone, Debug)]
pub struct Decoder<const N: usize> {
    buffer: [u8; N],
    filled: usize,
    /// Bytes at the front that belong to the frame last handed out.
    spent: usize,
    refused: Refused,
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Where a frame stands in the buffer.
struct Found {
    version: Version,
    direction: Direction,
    code: u16,
    flags: u8,
    payload: usize,
    end: usize,
}

/// What comes with so few bytes more is waited for: two or three answers of a flight controller.
const SOON: usize = 32;

enum Head {
    /// May become a frame with more bytes; where it would end, once that is known.
    Incomplete(Option<usize>),
    /// The first so many bytes are no frame.
    Junk(usize),
    /// Announces more than the buffer holds.
    Oversize,
    /// The check byte is wrong.
    Broken,
    Complete(Found),
}

impl<const N: usize> Decoder<N> {
    /// An empty decoder.
    #[must_use]
    pub const fn new() -> Self {
        Self { buffer: [0; N], filled: 0, spent: 0, refused: Refused { checksum: 0, oversize: 0, bytes: 0 } }
    }

    /// Takes one byte; returns a frame when one is complete. After a broken frame several may be complete:
    /// call [`Self::pending`] until it returns `None`.
    pub fn push(&mut self, byte: u8) -> Option<Frame<'_>> {
        self.drop_front(self.spent);
        self.spent = 0;
        if self.filled == N {
            // Only when frames were left pending until the buffer overflowed: the oldest byte goes.
            self.discard(1);
        }
        if let Some(slot) = self.buffer.get_mut(self.filled) {
            *slot = byte;
            self.filled += 1;
        }
        self.pending()
    }

    /// The next frame that is already complete.
    pub fn pending(&mut self) -> Option<Frame<'_>> {
        self.drop_front(self.spent);
        self.spent = 0;
        loop {
            match head::<N>(self.buffer.get(..self.filled).unwrap_or(&[])) {
                Head::Incomplete(end) => {
                    let inside = self.inside(end?)?;
                    self.give_way(inside);
                }
                Head::Junk(count) => self.discard(count),
                Head::Oversize => {
                    self.refused.oversize = self.refused.oversize.wrapping_add(1);
                    self.discard(1);
                }
                Head::Broken => {
                    self.refused.checksum = self.refused.checksum.wrapping_add(1);
                    self.discard(1);
                }
                Head::Complete(found) => {
                    // The same however late the bytes are looked at.
                    if let Some(inside) = self.inside(found.end) {
                        self.give_way(inside);
                        continue;
                    }
                    self.spent = found.end;
                    return Some(Frame {
                        version: found.version,
                        direction: found.direction,
                        code: found.code,
                        flags: found.flags,
                        payload: self.buffer.get(found.payload..found.end - 1).unwrap_or(&[]),
                    });
                }
            }
        }
    }

    /// Takes many bytes and hands each frame to `on_frame`.
    pub fn feed(&mut self, bytes: &[u8], mut on_frame: impl FnMut(Frame<'_>)) {
        for &byte in bytes {
            if let Some(frame) = self.push(byte) {
                on_frame(frame);
                while let Some(frame) = self.pending() {
                    on_frame(frame);
                }
            }
        }
    }

    /// Gives up on a frame that has begun: for a line that fell quiet in the middle of one. What came after
    /// its first byte is looked through again; call [`Self::pending`] for what that finds.
    pub fn abandon(&mut self) {
        self.drop_front(self.spent);
        self.spent = 0;
        if self.filled > 0 {
            self.discard(1);
        }
    }

    /// Forgets everything on the way: the line was closed and opened again. The counts stay.
    pub fn clear(&mut self) {
        self.filled = 0;
        self.spent = 0;
    }

    /// Whether bytes of an unfinished frame wait for the rest.
    #[must_use]
    pub fn in_frame(&self) -> bool {
        self.filled > self.spent
    }

    /// What was thrown away so far.
    #[must_use]
    pub fn refused(&self) -> Refused {
        self.refused
    }

    fn discard(&mut self, count: usize) {
        self.refused.bytes = self.refused.bytes.wrapping_add(count as u32);
        self.drop_front(count);
    }

    fn drop_front(&mut self, count: usize) {
        let count = count.min(self.filled);
        if count > 0 {
            self.buffer.copy_within(count..self.filled, 0);
            self.filled -= count;
        }
    }

    /// Where a whole frame stands in the one at the front, which would go on to `end` for a while.
    fn inside(&self, end: usize) -> Option<usize> {
        let last = end.checked_sub(SOON)?.min(self.filled);
        let bytes = self.buffer.get(..last)?;
        (1..last).find(|from| {
            let rest = bytes.get(*from..).unwrap_or(&[]);
            rest.first() == Some(&b'$') && matches!(head::<N>(rest), Head::Complete(_))
        })
    }

    /// The first bytes are a frame that will not be: another one stands in it, at `inside`.
    fn give_way(&mut self, inside: usize) {
        self.refused.checksum = self.refused.checksum.wrapping_add(1);
        self.discard(inside);
    }
}

/// What stands at the front of `bytes`, for a buffer of `N`.
fn head<const N: usize>(bytes: &[u8]) -> Head {
    let Some(&first) = bytes.first() else { return Head::Incomplete(None) };
    if first != b'$' {
        return Head::Junk(bytes.iter().position(|byte| *byte == b'$').unwrap_or(bytes.len()));
    }
    let version = match bytes.get(1) {
        None => return Head::Incomplete(None),
        Some(b'M') => Version::V1,
        Some(b'X') => Version::V2,
        Some(_) => return Head::Junk(1),
    };
    let direction = match bytes.get(2) {
        None => return Head::Incomplete(None),
        Some(&character) => match Direction::from_character(character) {
            Some(direction) => direction,
            None => return Head::Junk(1),
        },
    };
    let (code, flags, payload, length) = match (version, bytes) {
        (Version::V1, [_, _, _, 255, code, low, high, ..]) => {
            (u16::from(*code), 0, 7, usize::from(u16::from_le_bytes([*low, *high])))
        }
        (Version::V1, [_, _, _, length, code, ..]) if *length != 255 => {
            (u16::from(*code), 0, 5, usize::from(*length))
        }
        (Version::V2, [_, _, _, flags, code0, code1, length0, length1, ..]) => (
            u16::from_le_bytes([*code0, *code1]),
            *flags,
            8,
            usize::from(u16::from_le_bytes([*length0, *length1])),
        ),
        _ => return Head::Incomplete(None),
    };
    let end = payload + length + 1;
    if end > N {
        return Head::Oversize;
    }
    let (Some(checked), Some(check)) = (bytes.get(3..end - 1), bytes.get(end - 1)) else {
        return Head::Incomplete(Some(end));
    };
    let sum = match version {
        Version::V1 => xor(checked),
        Version::V2 => crc8_dvb_s2(checked),
    };
    if sum != *check {
        return Head::Broken;
    }
    Head::Complete(Found { version, direction, code, flags, payload, end })
}
