//! Takes a payload apart, number by number, little endian.

use core::fmt;

/// A payload ended before the part of it that is always there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooShort {
    /// Bytes that were there.
    pub length: usize,
    /// Bytes that the next field would have ended at.
    pub needed: usize,
}

impl fmt::Display for TooShort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the payload has {} bytes, at least {} are needed", self.length, self.needed)
    }
}
impl core::error::Error for TooShort {}

/// A position in a payload.
#[derive(Clone, Debug)]
pub struct Reader<'a> {
    payload: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// Reads from the start of `payload`.
    #[must_use]
    pub fn new(payload: &'a [u8]) -> Self {
        Self { payload, at: 0 }
    }

    /// Bytes not read yet.
    #[must_use]
    pub fn left(&self) -> usize {
        self.payload.len().saturating_sub(self.at)
    }

    /// The rest, which is then read.
    pub fn rest(&mut self) -> &'a [u8] {
        let rest = self.payload.get(self.at..).unwrap_or(&[]);
        self.at = self.payload.len();
        rest
    }

    /// The next `count` bytes.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn bytes(&mut self, count: usize) -> Result<&'a [u8], TooShort> {
        let end = self.at.saturating_add(count);
        let Some(bytes) = self.payload.get(self.at..end) else {
            return Err(TooShort { length: self.payload.len(), needed: end });
        };
        self.at = end;
        Ok(bytes)
    }

    /// The next `COUNT` bytes as an array.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn array<const COUNT: usize>(&mut self) -> Result<[u8; COUNT], TooShort> {
        let mut array = [0; COUNT];
        array.copy_from_slice(self.bytes(COUNT)?);
        Ok(array)
    }

    /// The next byte.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn u8(&mut self) -> Result<u8, TooShort> {
        self.array().map(u8::from_le_bytes)
    }

    /// The next two bytes.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn u16(&mut self) -> Result<u16, TooShort> {
        self.array().map(u16::from_le_bytes)
    }

    /// The next two bytes.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn i16(&mut self) -> Result<i16, TooShort> {
        self.array().map(i16::from_le_bytes)
    }

    /// The next four bytes.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn u32(&mut self) -> Result<u32, TooShort> {
        self.array().map(u32::from_le_bytes)
    }

    /// The next four bytes.
    ///
    /// # Errors
    /// The payload ends before.
    pub fn i32(&mut self) -> Result<i32, TooShort> {
        self.array().map(i32::from_le_bytes)
    }

    /// Two-byte numbers until the payload or `out` ends; returns how many.
    pub fn u16s(&mut self, out: &mut [u16]) -> usize {
        let mut count = 0;
        for slot in out {
            match self.u16() {
                Ok(value) => *slot = value,
                Err(_) => break,
            }
            count += 1;
        }
        count
    }
}
