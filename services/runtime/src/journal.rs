//! What a step took from its inputs: the raw material of `trace/<service>` and of the loss counters.

use ipc_types::{Drained, Header};
use std::cell::Cell;

/// Counters of one input. Shared between the input and the runtime that journals its steps.
#[derive(Debug, Default)]
pub struct InputStats {
    first: Cell<u64>,
    count: Cell<u32>,
    incarnation: Cell<u32>,
    last_publisher: Cell<(u32, u32)>,
    last_sequence: Cell<u64>,
    lost: Cell<u64>,
}

impl InputStats {
    /// Notes that a message was taken; a gap in the sequence of one incarnation is a loss.
    pub(crate) fn taken(&self, header: &Header) {
        let publisher = (header.publisher, header.incarnation);
        if self.last_publisher.get() == publisher {
            let gap = header.sequence.saturating_sub(self.last_sequence.get() + 1);
            self.lost.set(self.lost.get() + gap);
        }
        self.last_publisher.set(publisher);
        self.last_sequence.set(header.sequence);
        if self.count.get() == 0 {
            self.first.set(header.sequence);
        }
        self.count.set(self.count.get() + 1);
        self.incarnation.set(header.incarnation);
    }

    /// Messages that were overwritten before this input took them.
    pub fn lost(&self) -> u64 {
        self.lost.get()
    }

    /// What was taken since the last call.
    pub(crate) fn drain(&self) -> Drained {
        let drained =
            Drained { first: self.first.get(), count: self.count.get(), incarnation: self.incarnation.get() };
        self.first.set(0);
        self.count.set(0);
        drained
    }
}
