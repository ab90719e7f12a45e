//! `trace/<service>`: the step journal.

use crate::field::{Field, fields, layout_of_name, layout_step, message};
use core::fmt::{self, Write};

/// Most runs of one step. A step usually takes one run from an input, or two when the publisher was started again
/// meanwhile. The pilot reads most: one run from each of eight inputs with one publisher, and eight from
/// `operator/command`, eight deep, when people give orders in turn. That makes 16; half as many again are to spare.
pub const MAX_RUNS: usize = 24;

fields! {
    /// Messages with consecutive sequences that one step took from one input, one after the other.
    pub struct Run {
        /// Sequence of the first message.
        pub first: u64,
        /// Their publisher, as in the header.
        pub publisher: u32,
        /// Which start of their publisher, as in the header.
        pub incarnation: u32,
        /// FNV-1a hash of the topic's name, folded to 32 bits.
        pub topic: u32,
        /// The input, numbered from 0 in the order in which the service opens them; [`Run::KEEPER`] for what the
        /// keeper handed over at start.
        pub port: u16,
        /// How many messages; 0 in places that are not used.
        pub count: u16,
    }
}

impl Run {
    /// In place of an input's number: a retained sample, which the keeper hands over at start.
    pub const KEEPER: u16 = u16::MAX;

    /// Sequences of the messages.
    #[must_use]
    pub fn sequences(&self) -> core::ops::Range<u64> {
        self.first..self.first.saturating_add(self.count.into())
    }
}

/// The runs of one step, in the order in which their first messages were taken; the first with a count of 0 ends
/// the list.
#[repr(transparent)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Runs([Run; MAX_RUNS]);

impl Runs {
    /// Replaces the list by as many of `runs` as fit. Allocates nothing.
    pub fn set(&mut self, runs: &[Run]) {
        for (index, place) in self.0.iter_mut().enumerate() {
            *place = runs.get(index).copied().unwrap_or_default();
        }
    }

    /// The runs that there are.
    #[must_use]
    pub fn as_slice(&self) -> &[Run] {
        let end = self.0.iter().position(|run| run.count == 0).unwrap_or(MAX_RUNS);
        &self.0[..end]
    }
}

impl fmt::Debug for Runs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.as_slice()).finish()
    }
}

impl Field for Runs {
    const LAYOUT: u64 = layout_step(layout_of_name("runs"), <[Run; MAX_RUNS]>::LAYOUT);
    fn write_json(&self, out: &mut dyn Write) -> fmt::Result {
        out.write_char('[')?;
        for (i, run) in self.as_slice().iter().enumerate() {
            if i > 0 {
                out.write_char(',')?;
            }
            run.write_json(out)?;
        }
        out.write_char(']')
    }
    fn write_schema(out: &mut dyn Write) -> fmt::Result {
        out.write_str("{\"type\":\"array\",\"items\":")?;
        Run::write_schema(out)?;
        write!(out, ",\"maxItems\":{MAX_RUNS}}}")
    }
}

message! {
    /// The step journal: says which messages each step took, so that with the messages themselves a recording of
    /// many processes can be flown again, bit for bit.
    pub struct Trace on "trace" {
        /// Step number, from 1; 0 is the entry made at start.
        pub step: u64,
        /// `now` of the step.
        pub now_ns: u64,
        /// Seed the service was started with; the same in each entry, so that who joins late knows it.
        pub seed: u64,
        /// FNV-1a hash of the bytes of the configuration file; 0 when none was read.
        pub config: u64,
        /// Hash of the plan bytes; 0 for services that read none.
        pub plan: u64,
        /// Inputs that the service has.
        pub ports: u32,
        /// Messages taken that `runs` had no place for, the last of their inputs; 0 in a step that can be flown again.
        pub truncated: u32,
        /// What was taken; empty when nothing was. Messages of one input stand in the order in which they were
        /// taken. Whoever takes from several inputs in turn continues their runs: the order between inputs is not kept.
        pub runs: Runs,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_ends_with_the_first_unused_place() {
        let run = |first| Run { first, count: 2, ..Run::default() };
        let mut trace = Trace::default();
        assert!(trace.runs.as_slice().is_empty());
        let many: Vec<_> = (0..MAX_RUNS as u64 + 3).map(run).collect();
        trace.runs.set(&many);
        assert_eq!(trace.runs.as_slice().len(), MAX_RUNS);
        trace.runs.set(&many[4..6]);
        let firsts: Vec<_> = trace.runs.as_slice().iter().map(|run| run.first).collect();
        assert_eq!(firsts, [4, 5]);
        assert_eq!(run(7).sequences().collect::<Vec<_>>(), [7, 8]);
    }

    #[test]
    fn json_shows_the_runs_that_there_are() {
        let mut text = String::new();
        let mut trace = Trace::default();
        trace.runs.set(&[Run { first: 9, count: 2, port: 3, ..Run::default() }]);
        assert!(trace.write_json(&mut text).is_ok());
        let list = r#""runs":[{"first":9,"publisher":0,"incarnation":0,"topic":0,"port":3,"count":2}]}"#;
        assert!(text.ends_with(list), "{text}");
    }
}
