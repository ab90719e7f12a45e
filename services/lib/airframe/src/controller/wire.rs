//! A serial line at 115200 baud: a pseudo-terminal has none, so its time is added here.

use std::collections::VecDeque;

/// Nanoseconds a byte: ten bits at 115200 baud (FACTS 1: 86.8 us).
pub const BYTE_NS: u64 = 86_806;
/// Bytes that may be under way; what is written beyond is lost, as in a driver whose buffer is full.
const CAPACITY: usize = 4096;

/// Bytes under way in one direction.
#[derive(Clone, Debug)]
pub struct Wire {
    bytes: VecDeque<u8>,
    /// When the first byte under way is through.
    first_ns: u64,
    lost: u64,
}

impl Default for Wire {
    fn default() -> Self {
        Self::new()
    }
}

impl Wire {
    /// An idle line.
    #[must_use]
    pub fn new() -> Self {
        Self { bytes: VecDeque::with_capacity(CAPACITY), first_ns: 0, lost: 0 }
    }

    /// Queues `bytes` behind those under way.
    pub fn send(&mut self, now_ns: u64, bytes: &[u8]) {
        if self.bytes.is_empty() {
            self.first_ns = now_ns + BYTE_NS;
        }
        let room = CAPACITY - self.bytes.len();
        self.bytes.extend(bytes.iter().take(room));
        self.lost += bytes.len().saturating_sub(room) as u64;
    }

    /// The next byte that is through by `now_ns`.
    pub fn next(&mut self, now_ns: u64) -> Option<u8> {
        if self.first_ns > now_ns {
            return None;
        }
        let byte = self.bytes.pop_front()?;
        self.first_ns += BYTE_NS;
        Some(byte)
    }

    /// All that is through by `now_ns` and fits.
    pub fn receive(&mut self, now_ns: u64, out: &mut [u8]) -> usize {
        let mut count = 0;
        while count < out.len() {
            let Some(byte) = self.next(now_ns) else { break };
            out[count] = byte;
            count += 1;
        }
        count
    }

    /// Nothing under way.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.bytes.is_empty()
    }
    /// Bytes dropped since the start.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_takes_87_microseconds_and_they_queue() {
        let mut wire = Wire::new();
        wire.send(1_000_000, &[1, 2, 3]);
        let mut out = [0; 8];
        assert_eq!(wire.receive(1_000_000, &mut out), 0);
        assert_eq!(wire.receive(1_000_000 + 2 * BYTE_NS, &mut out), 2);
        wire.send(1_000_000 + 2 * BYTE_NS, &[4]);
        assert_eq!(wire.receive(1_000_000 + 3 * BYTE_NS, &mut out), 1);
        assert_eq!(wire.receive(1_000_000 + 4 * BYTE_NS, &mut out), 1);
        assert_eq!(out[0], 4);
    }

    #[test]
    fn a_full_line_loses_and_counts() {
        let mut wire = Wire::new();
        wire.send(0, &[0; 5000]);
        assert_eq!(wire.lost(), 5000 - 4096);
    }
}
