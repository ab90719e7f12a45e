//! The last seconds of a drone's video, in memory: what an incident keeps of the time before it.

use super::unit::Unit;
use std::collections::VecDeque;
use std::sync::Arc;

/// Bytes of one drone at most: forty seconds at 4.8 Mb/s.
pub(super) const RING_BYTES: usize = 24 * 1024 * 1024;

/// Whole groups of pictures, each beginning with a key frame, of at least the span where so much has come.
#[derive(Debug)]
pub(super) struct Ring {
    span_ns: u64,
    most: usize,
    units: VecDeque<Arc<Unit>>,
    bytes: usize,
}

impl Ring {
    /// Of the last `span_ns` nanoseconds, in at most `most` bytes.
    pub(super) fn new(span_ns: u64, most: usize) -> Self {
        Self { span_ns, most, units: VecDeque::new(), bytes: 0 }
    }

    /// Adds the newest. Whatever comes before the first key frame is of no use.
    pub(super) fn push(&mut self, unit: &Arc<Unit>) {
        if self
            .units
            .back()
            .is_some_and(|last| last.source != unit.source || last.capture_ns >= unit.capture_ns)
        {
            // Another clock, or one that went backwards.
            self.clear();
        }
        if self.units.is_empty() && !unit.is_key() {
            return;
        }
        self.bytes += unit.sample.len();
        self.units.push_back(unit.clone());
        while self.bytes > self.most {
            // The next group, or nothing until one begins.
            match self.second_key() {
                Some(at) => self.drop_first(at),
                None => self.clear(),
            }
        }
        while let Some(at) = self.second_key()
            && self.units.get(at).is_some_and(|key| unit.capture_ns - key.capture_ns >= self.span_ns)
        {
            self.drop_first(at);
        }
    }

    fn second_key(&self) -> Option<usize> {
        self.units.iter().skip(1).position(|unit| unit.is_key()).map(|at| at + 1)
    }

    fn drop_first(&mut self, count: usize) {
        for unit in self.units.drain(..count.min(self.units.len())) {
            self.bytes -= unit.sample.len();
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.units.clear();
        self.bytes = 0;
    }

    /// What there is, the oldest first.
    pub(super) fn units(&self) -> impl Iterator<Item = &Arc<Unit>> {
        self.units.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::super::unit::tests::{DELTA, KEY, message};
    use super::*;

    fn unit(at_s: u64, key: bool) -> Arc<Unit> {
        Arc::new(
            Unit::read(&message(at_s, at_s * 1_000_000_000, 640, if key { KEY } else { DELTA }))
                .expect("good"),
        )
    }

    fn times(ring: &Ring) -> Vec<u64> {
        ring.units().map(|unit| unit.capture_ns / 1_000_000_000).collect()
    }

    #[test]
    fn it_holds_the_span_from_a_key_frame_on_and_not_much_more() {
        let mut ring = Ring::new(30_000_000_000, RING_BYTES);
        ring.push(&unit(5, false));
        assert!(times(&ring).is_empty(), "nothing to begin with");
        for at in 10..200 {
            ring.push(&unit(at, at % 10 == 0));
            let times = times(&ring);
            assert_eq!(times[0] % 10, 0, "begins with a key frame");
            assert!(at - times[0] <= 40, "{at}: {}", times[0]);
            assert!(at < 40 || at - times[0] >= 30, "{at}: {}", times[0]);
        }
    }

    #[test]
    fn bytes_are_bounded_and_another_clock_begins_anew() {
        let size = unit(0, false).sample.len();
        let mut ring = Ring::new(30_000_000_000, 12 * size);
        for at in 0..500 {
            ring.push(&unit(at, at == 0 || at == 100));
            assert!(ring.bytes <= 12 * size);
            assert_eq!(ring.bytes, ring.units().map(|unit| unit.sample.len()).sum::<usize>());
        }
        ring.push(&unit(1000, true));
        ring.push(&unit(900, true));
        assert_eq!(times(&ring), [900]);
    }
}
