//! What goes out for one command.

use msp::EncodeError;

/// The longest frame sent: version 2 with 18 channels is 45 bytes, and the filler.
pub const MAX_FRAME: usize = 64;
/// Between two commands. A controller that misses a byte takes the next one for the check byte: this one instead of the next
/// command's `$`, with which that would be lost too. Outside of a frame it says nothing to any firmware.
const FILLER: u8 = 0;

/// Puts the filler behind a command.
pub(crate) fn fill(out: &mut [u8; MAX_FRAME], length: usize) -> usize {
    match out.get_mut(length) {
        Some(slot) => {
            *slot = FILLER;
            length + 1
        }
        None => length,
    }
}

/// Why a frame of channels was not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// A channel out of range, or none.
    Channels(msp::messages::Refusal),
    /// It does not fit.
    Encode(EncodeError),
}
