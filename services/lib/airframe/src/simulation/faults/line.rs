//! A serial line that loses, changes, doubles and holds up bytes.

use super::LineFault;
use rand::{Rng, RngExt};
use std::collections::VecDeque;

/// Bytes that may be held up; more than any delay gathers at 115200 baud. What comes beyond is lost.
const CAPACITY: usize = 65_536;

/// One direction of a line.
#[derive(Clone, Debug, Default)]
pub(in crate::simulation) struct Way {
    held: VecDeque<(u64, u8)>,
}

impl Way {
    /// Whether bytes would only pass through.
    pub(in crate::simulation) fn is_empty(&self) -> bool {
        self.held.is_empty()
    }

    /// Bytes that come in at `now_ns`, with what happens to them.
    pub(in crate::simulation) fn take<R: Rng + ?Sized>(
        &mut self,
        now_ns: u64,
        bytes: &[u8],
        faults: &[LineFault],
        random: &mut R,
    ) {
        for byte in bytes {
            let mut byte = *byte;
            let (mut copies, mut ready_ns) = (1, now_ns);
            for fault in faults {
                match fault {
                    LineFault::Flipped { share } if random.random::<f64>() < *share => {
                        byte ^= 1 << random.random_range(0..8_u32);
                    }
                    LineFault::Lost { share } if random.random::<f64>() < *share => copies = 0,
                    LineFault::Doubled { share } if random.random::<f64>() < *share => copies *= 2,
                    LineFault::Delayed { seconds } => ready_ns += (seconds * 1e9) as u64,
                    LineFault::Silent => copies = 0,
                    LineFault::Flipped { .. } | LineFault::Lost { .. } | LineFault::Doubled { .. } => {}
                }
            }
            // Bytes never overtake each other.
            let ready_ns = self.held.back().map_or(ready_ns, |(before, _)| ready_ns.max(*before));
            for _ in 0..copies {
                if self.held.len() < CAPACITY {
                    self.held.push_back((ready_ns, byte));
                }
            }
        }
    }

    /// The next byte that is held up no longer.
    pub(in crate::simulation) fn next(&mut self, now_ns: u64) -> Option<u8> {
        let (ready_ns, byte) = *self.held.front()?;
        if ready_ns > now_ns {
            return None;
        }
        self.held.pop_front();
        Some(byte)
    }
}
