//! What was lost and what was late: the counters that `health/<service>` reports.

use crate::journal::{Cursor, Taken};
use ipc_types::Header;
use std::cell::Cell;
use std::rc::Rc;

/// Counters of one input, and its place in the journal. Shared between the input and the runtime that reports them.
#[derive(Debug)]
pub(crate) struct InputStats {
    /// Number of the input in its service, from 0.
    port: u16,
    topic: u32,
    taken: Rc<Taken>,
    cursor: Cursor,
    last_publisher: Cell<(u32, u32)>,
    last_sequence: Cell<u64>,
    lost: Cell<u64>,
    failed: Cell<u64>,
}

impl InputStats {
    pub(crate) fn new(port: u16, topic: u32, taken: Rc<Taken>) -> Self {
        Self {
            port,
            topic,
            taken,
            cursor: Cursor::default(),
            last_publisher: Cell::default(),
            last_sequence: Cell::default(),
            lost: Cell::default(),
            failed: Cell::default(),
        }
    }

    /// Notes that shared memory refused to hand out a message.
    pub(crate) fn failed(&self) {
        self.failed.set(self.failed.get() + 1);
    }

    /// How often shared memory refused to hand out a message.
    pub(crate) fn failures(&self) -> u64 {
        self.failed.get()
    }

    /// Notes that there was nothing, or nothing more.
    pub(crate) fn empty(&self) {
        self.taken.dry(&self.cursor);
    }

    /// Whether the input is empty for the rest of this step.
    pub(crate) fn is_empty(&self) -> bool {
        self.taken.is_dry(&self.cursor)
    }

    /// Notes that a message was taken; a gap in the sequence of one incarnation is a loss.
    pub(crate) fn taken(&self, header: &Header) {
        let publisher = (header.publisher, header.incarnation);
        if self.last_publisher.get() == publisher {
            let gap = header.sequence.saturating_sub(self.last_sequence.get() + 1);
            self.lost.set(self.lost.get() + gap);
        }
        self.last_publisher.set(publisher);
        self.last_sequence.set(header.sequence);
        self.taken.note(&self.cursor, self.port, self.topic, header);
    }

    /// Messages that were overwritten before this input took them.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.get()
    }
}

/// Counters of one output. Shared between the output and the runtime that reports them.
#[derive(Debug, Default)]
pub(crate) struct OutputStats {
    /// Silence longer than this is a fault, nanoseconds; 0 for none.
    deadline_ns: u64,
    refused: Cell<u64>,
    failed: Cell<u64>,
    missed: Cell<u64>,
    /// When the last message was sent; `None` before the first, whose time nobody can promise.
    sent_ns: Cell<Option<u64>>,
    /// The present silence is counted already.
    overdue: Cell<bool>,
}

impl OutputStats {
    pub(crate) fn with_deadline(deadline_ns: u64) -> Self {
        Self { deadline_ns, ..Self::default() }
    }

    /// Notes that no place was free for a message.
    pub(crate) fn refused(&self) {
        self.refused.set(self.refused.get() + 1);
    }

    /// How often no place was free.
    pub(crate) fn refusals(&self) -> u64 {
        self.refused.get()
    }

    /// Messages that did not leave, or not to everybody.
    pub(crate) fn unsent(&self) -> u64 {
        self.refused.get() + self.failed.get()
    }

    /// Notes a message that was sent at `now`, `whole` when everybody has it.
    pub(crate) fn sent(&self, now: u64, whole: bool) {
        if !whole {
            self.failed.set(self.failed.get() + 1);
        }
        self.watch(now);
        self.sent_ns.set(Some(now));
        self.overdue.set(false);
    }

    /// Counts a silence that has become too long by `now`, once.
    pub(crate) fn watch(&self, now: u64) {
        let late = self.sent_ns.get().is_some_and(|sent| now.saturating_sub(sent) > self.deadline_ns);
        if late && self.deadline_ns > 0 && !self.overdue.replace(true) {
            self.missed.set(self.missed.get() + 1);
        }
    }

    /// Silences longer than the deadline.
    pub(crate) fn missed(&self) -> u64 {
        self.missed.get()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn each_silence_past_the_deadline_counts_once() {
        let output = OutputStats::with_deadline(100 * MS);
        output.watch(5_000 * MS);
        assert_eq!(output.missed(), 0, "nothing was promised before the first message");
        for step in 0..50 {
            output.sent(5_000 * MS + step * 100 * MS, true);
        }
        assert_eq!(output.missed(), 0, "just in time");
        let last = 9_900 * MS;
        output.watch(last + 100 * MS);
        assert_eq!(output.missed(), 0);
        for late in 101..400 {
            output.watch(last + late * MS);
        }
        assert_eq!(output.missed(), 1, "seen before it ends");
        output.sent(last + 400 * MS, true);
        assert_eq!(output.missed(), 1, "and not again at its end");
        output.sent(last + 501 * MS, true);
        assert_eq!(output.missed(), 2);
        let on_demand = OutputStats::with_deadline(0);
        on_demand.sent(0, true);
        on_demand.watch(u64::MAX);
        assert_eq!(on_demand.missed(), 0);
    }

    #[test]
    fn what_did_not_leave_is_counted() {
        let output = OutputStats::default();
        output.refused();
        output.sent(1, false);
        output.sent(2, true);
        assert_eq!((output.refusals(), output.unsent()), (1, 2));
    }
}
