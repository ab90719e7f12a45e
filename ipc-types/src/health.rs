//! `health/<service>` and `trace/<service>`.

use crate::Text;
use crate::field::{fields, message};

/// Most ports a service may have.
pub const MAX_PORTS: usize = 24;

message! {
    /// How a service is doing, by a real clock: never an input to flying.
    pub struct Health on "health" {
        /// Steps since start.
        pub steps: u64,
        /// Messages lost to overflow on this service's inputs since start.
        pub lost: u64,
        /// Messages refused because they made no sense, since start.
        pub refused: u64,
        /// Receives that shared memory refused since start.
        pub unheard: u64,
        /// Messages that found no free place, or that not every reader got, since start.
        pub unsent: u64,
        /// Silences longer than the deadline that the manifest sets for a published topic, since start.
        pub missed: u64,
        /// Longest step since the last report, nanoseconds.
        pub longest_step_ns: u64,
        /// Mean step since the last report, nanoseconds.
        pub mean_step_ns: u64,
        /// Latest start of a step after its due time since the last report, nanoseconds.
        pub lateness_ns: u64,
        /// Process id; 0 in lockstep.
        pub pid: u32,
        /// Always zero.
        pub reserved: u32,
        /// One sentence.
        pub status: Text<96>,
    }
}

fields! {
    /// What one step took from one input.
    pub struct Drained {
        /// Sequence of the first message taken; 0 when none was.
        pub first: u64,
        /// How many were taken.
        pub count: u32,
        /// Incarnation of their publisher.
        pub incarnation: u32,
    }
}

message! {
    /// The step journal: with it a recording of many processes can be flown again, bit for bit.
    pub struct Trace on "trace" {
        /// Step number, from 1; 0 is the entry made at start.
        pub step: u64,
        /// `now` of the step.
        pub now_ns: u64,
        /// Seed the service was started with.
        pub seed: u64,
        /// Hash of the configuration bytes.
        pub config: u64,
        /// Hash of the plan bytes; 0 for services that read none.
        pub plan: u64,
        /// Inputs, in the order they were opened.
        pub ports: u32,
        /// Always zero.
        pub reserved: u32,
        /// One entry an input.
        pub drained: [Drained; 24],
    }
}
