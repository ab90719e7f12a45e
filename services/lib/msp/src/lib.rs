//! MultiWii Serial Protocol, versions 1 and 2 (thesis 3.3, figure 3.17 and table 3.3).
//!
//! | | preamble | direction | header | check |
//! |---|---|---|---|---|
//! | version 1 | `$M` | `<` `>` `!` | length u8, code u8 | XOR of header and payload |
//! | version 1, long | `$M` | | 255, code u8, length u16 | the same |
//! | version 2 | `$X` | | flags u8, code u16, length u16 | CRC-8 DVB-S2 of header and payload |
//!
//! All numbers are little endian. `<` goes to the controller, `>` comes from it, `!` is its refusal.
//!
//! [`Decoder`] turns a stream of bytes into [`Frame`]s, [`encode`] the other way. Neither knows any
//! message: a message is a type in [`messages`] that implements [`Request`] (its code, what it carries, what
//! comes back), so that a new one is one type and the codec stays as it is. Firmware versions append to
//! replies and some send less (FACTS 1): every layout reads the prefix it knows and ignores the tail.
//!
//! ```
//! use msp::{Decoder, Direction, Version, encode_request, messages::Attitude, parse_reply};
//!
//! let mut out = [0; 16];
//! let length = encode_request(&mut out, Version::V1, &Attitude).unwrap_or(0);
//! assert_eq!(&out[..length], b"$M<\x00\x6c\x6c");
//!
//! let mut decoder = Decoder::<64>::new();
//! let mut roll = None;
//! decoder.feed(b"noise$M>\x06\x6c\x0a\x00\xf6\xff\x5a\x00\x33", |frame| {
//!     assert_eq!(frame.direction, Direction::Reply);
//!     roll = parse_reply(&Attitude, frame.payload).ok().map(|attitude| attitude.roll_decidegrees);
//! });
//! assert_eq!(roll, Some(10));
//! ```
#![no_std]
#![forbid(unsafe_code)]

mod checksum;
mod decode;
mod encode;
pub mod messages;
mod reader;
mod request;

pub use checksum::{crc8_dvb_s2, xor};
pub use decode::{Decoder, Direction, Frame, Refused, Version};
pub use encode::{EncodeError, Writer, encode, encode_request};
pub use reader::{Reader, TooShort};
pub use request::{Layout, Request, parse_reply};
