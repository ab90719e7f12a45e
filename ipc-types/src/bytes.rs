//! Room for bytes inside a message.

use crate::field::{Field, layout_of_name, layout_step};
use core::fmt::{self, Write};

/// Room for `N` bytes whose meaning the message says. Shown by its size alone.
#[repr(transparent)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Bytes<const N: usize>([u8; N]);

impl<const N: usize> Bytes<N> {
    /// All of them.
    #[must_use]
    pub const fn as_slice(&self) -> &[u8] {
        &self.0
    }

    /// All of them, to be written.
    pub const fn as_mut_slice(&mut self) -> &mut [u8] {
        &mut self.0
    }
}

impl<const N: usize> fmt::Debug for Bytes<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{N} bytes")
    }
}

impl<const N: usize> Field for Bytes<N> {
    const LAYOUT: u64 = layout_step(layout_of_name("bytes"), N as u64);
    fn write_json(&self, out: &mut dyn Write) -> fmt::Result {
        write!(out, "\"{N} bytes\"")
    }
    fn write_schema(out: &mut dyn Write) -> fmt::Result {
        write!(out, "{{\"const\":\"{N} bytes\"}}")
    }
}
