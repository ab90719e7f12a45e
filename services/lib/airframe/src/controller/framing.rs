//! MSP v1 and v2 frames as a flight controller reads and writes them.
//!
//! Deliberately not the `msp` crate: a codec that is tested against itself proves nothing.

/// Largest payload that a port accepts (Betaflight's MSP input buffer).
pub(crate) const LARGEST_PAYLOAD: usize = 192;

/// A whole request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Request {
    pub(crate) code: u16,
    pub(crate) length: usize,
    /// Native v2: the answer goes out in the same framing.
    pub(crate) v2: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Idle,
    Dollar,
    Version,
    /// Fixed part of the header; how many bytes of it are in.
    Header(usize),
    Payload(usize),
    Checksum,
}

/// Reads requests byte by byte.
#[derive(Clone, Debug)]
pub(crate) struct Decoder {
    state: State,
    /// Native v2 is understood at all.
    knows_v2: bool,
    v2: bool,
    header: [u8; 5],
    length: usize,
    code: u16,
    payload: [u8; LARGEST_PAYLOAD],
    sum: u8,
}

impl Decoder {
    pub(crate) fn new(knows_v2: bool) -> Self {
        Self {
            state: State::Idle,
            knows_v2,
            v2: false,
            header: [0; 5],
            length: 0,
            code: 0,
            payload: [0; LARGEST_PAYLOAD],
            sum: 0,
        }
    }

    /// Payload of the request that [`Self::push`] has just returned.
    pub(crate) fn payload(&self) -> &[u8] {
        &self.payload[..self.length]
    }

    /// Takes one byte; a request when it completes one.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Request> {
        match self.state {
            State::Idle => {
                if byte == b'$' {
                    self.state = State::Dollar;
                }
            }
            State::Dollar => {
                self.v2 = byte == b'X' && self.knows_v2;
                self.state = if byte == b'M' || self.v2 { State::Version } else { State::Idle };
            }
            State::Version => {
                self.sum = 0;
                self.state = if byte == b'<' { State::Header(0) } else { State::Idle };
            }
            State::Header(at) => self.header(at, byte),
            State::Payload(at) => {
                self.add(byte);
                self.payload[at] = byte;
                self.state = if at + 1 == self.length { State::Checksum } else { State::Payload(at + 1) };
            }
            State::Checksum => {
                self.state = State::Idle;
                if byte == self.sum {
                    return Some(Request { code: self.code, length: self.length, v2: self.v2 });
                }
            }
        }
        None
    }

    fn header(&mut self, at: usize, byte: u8) {
        self.add(byte);
        self.header[at] = byte;
        let whole = if self.v2 { 5 } else { 2 };
        if at + 1 < whole {
            self.state = State::Header(at + 1);
            return;
        }
        let h = &self.header;
        if self.v2 {
            self.code = u16::from_le_bytes([h[1], h[2]]);
            self.length = usize::from(u16::from_le_bytes([h[3], h[4]]));
        } else {
            self.length = usize::from(h[0]);
            self.code = u16::from(h[1]);
        }
        self.state = match self.length {
            0 => State::Checksum,
            1..=LARGEST_PAYLOAD => State::Payload(0),
            _ => {
                self.length = 0;
                State::Idle
            }
        };
    }

    fn add(&mut self, byte: u8) {
        self.sum = if self.v2 { crc8(self.sum, byte) } else { self.sum ^ byte };
    }
}

/// CRC-8 DVB-S2: polynomial 0xD5, no reflection.
fn crc8(crc: u8, byte: u8) -> u8 {
    let mut crc = crc ^ byte;
    for _ in 0..8 {
        crc = if crc & 0x80 != 0 { crc << 1 ^ 0xD5 } else { crc << 1 };
    }
    crc
}

/// Writes a v2 frame; returns its length, 0 when it does not fit.
pub(crate) fn encode_v2(direction: u8, code: u16, payload: &[u8], out: &mut [u8]) -> usize {
    let total = payload.len() + 9;
    let Ok(length) = u16::try_from(payload.len()) else { return 0 };
    if out.len() < total {
        return 0;
    }
    out[..3].copy_from_slice(&[b'$', b'X', direction]);
    out[3] = 0;
    out[4..6].copy_from_slice(&code.to_le_bytes());
    out[6..8].copy_from_slice(&length.to_le_bytes());
    out[8..total - 1].copy_from_slice(payload);
    out[total - 1] = out[3..total - 1].iter().fold(0, |crc, byte| crc8(crc, *byte));
    total
}

/// Writes a v1 frame; returns its length, 0 when it does not fit.
pub(crate) fn encode_v1(direction: u8, code: u16, payload: &[u8], out: &mut [u8]) -> usize {
    let total = payload.len() + 6;
    let (Ok(length), Ok(code)) = (u8::try_from(payload.len()), u8::try_from(code)) else { return 0 };
    if out.len() < total {
        return 0;
    }
    out[..3].copy_from_slice(&[b'$', b'M', direction]);
    out[3] = length;
    out[4] = code;
    out[5..total - 1].copy_from_slice(payload);
    out[total - 1] = out[3..total - 1].iter().fold(0, |sum, byte| sum ^ byte);
    total
}

#[cfg(test)]
mod tests {
    use super::*;

    fn requests(bytes: &[u8]) -> Vec<(u16, Vec<u8>)> {
        requests_of(bytes, true)
    }

    fn requests_of(bytes: &[u8], knows_v2: bool) -> Vec<(u16, Vec<u8>)> {
        let mut decoder = Decoder::new(knows_v2);
        let mut all = Vec::new();
        for byte in bytes {
            if let Some(request) = decoder.push(*byte) {
                all.push((request.code, decoder.payload().to_vec()));
            }
        }
        all
    }

    /// The check value of CRC-8/DVB-S2 over "123456789" is 0xBC in every catalogue.
    #[test]
    fn the_crc_has_its_published_check_value() {
        assert_eq!(b"123456789".iter().fold(0, |crc, byte| crc8(crc, *byte)), 0xBC);
    }

    #[test]
    fn known_requests_are_read() {
        // MSP_API_VERSION, as every configurator sends it first.
        assert_eq!(requests(b"$M<\x00\x01\x01"), [(1, vec![])]);
        assert_eq!(requests(b"$X<\x00\x64\x00\x00\x00\x8f"), [(100, vec![])]);
    }

    #[test]
    fn an_old_firmware_passes_over_version_two() {
        let both = b"$X<\x00\x64\x00\x00\x00\x8f$M<\x00\x6c\x6c";
        assert_eq!(requests_of(both, false), [(108, vec![])]);
        assert_eq!(requests_of(both, true).len(), 2);
    }

    #[test]
    fn garbage_and_broken_sums_are_passed_over() {
        assert_eq!(requests(b"\xff$$M$M<\x00\x01\x02$M<\x00\x6c\x6c"), [(108, vec![])]);
        assert_eq!(requests(b"$X<\x00\x64\x00\xff\xff$M<\x00\x6c\x6c"), [(108, vec![])]);
    }
}
