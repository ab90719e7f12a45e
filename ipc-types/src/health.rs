//! `health/<service>`.

use crate::Text;
use crate::field::message;

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
        /// Longest step since the last report, its journal included, nanoseconds.
        pub longest_step_ns: u64,
        /// Mean step since the last report, its journal included, nanoseconds.
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
