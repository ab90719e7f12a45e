//! What a console keeps of the pictures, and for how long.

use serde::Deserialize;

/// The section `[recording]`. Without it nothing is kept: a drone stores no pictures unless somebody says so.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordingConfig {
    /// Whether pictures are kept at all; false on a drone.
    pub enabled: bool,
    /// Each recording is erased after so many hours, those of incidents too.
    #[serde(default = "retention_h")]
    pub retention_h: u64,
    /// All recordings together are no larger, GiB: the oldest go first, those of incidents never for that.
    #[serde(default = "most_gib")]
    pub most_gib: u64,
    /// Nothing is recorded while the disk has less than this free, GiB.
    #[serde(default = "free_gib")]
    pub free_gib: u64,
    /// Seconds before an incident that its mark keeps; 0: none.
    #[serde(default = "rolling_s")]
    pub rolling_s: u64,
}

fn retention_h() -> u64 {
    720
}

fn most_gib() -> u64 {
    20
}

fn free_gib() -> u64 {
    2
}

fn rolling_s() -> u64 {
    30
}

impl Default for RecordingConfig {
    fn default() -> Self {
        Self {
            enabled: false,
            retention_h: retention_h(),
            most_gib: most_gib(),
            free_gib: free_gib(),
            rolling_s: rolling_s(),
        }
    }
}

/// Bytes of a GiB.
const GIB: u64 = 1024 * 1024 * 1024;

impl RecordingConfig {
    /// The first value outside its range: key, value and what is allowed.
    pub(crate) fn wrong(&self) -> Option<(&'static str, String, &'static str)> {
        if !(1..=8784).contains(&self.retention_h) {
            return Some(("recording.retention_h", self.retention_h.to_string(), "1..=8784"));
        }
        if !(1..=10_000).contains(&self.most_gib) {
            return Some(("recording.most_gib", self.most_gib.to_string(), "1..=10000"));
        }
        if !(1..=1_000_000).contains(&self.free_gib) {
            return Some(("recording.free_gib", self.free_gib.to_string(), "1..=1000000"));
        }
        if self.rolling_s != 0 && !(5..=120).contains(&self.rolling_s) {
            return Some(("recording.rolling_s", self.rolling_s.to_string(), "0, or 5..=120"));
        }
        None
    }

    pub(super) fn most_bytes(&self) -> u64 {
        self.most_gib * GIB
    }

    pub(super) fn free_bytes(&self) -> u64 {
        self.free_gib * GIB
    }

    pub(super) fn retention_ms(&self) -> u64 {
        self.retention_h * 3_600_000
    }

    pub(super) fn rolling_ns(&self) -> u64 {
        self.rolling_s * 1_000_000_000
    }
}
