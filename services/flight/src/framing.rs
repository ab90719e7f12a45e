//! Which framing the controller understands: version 2 is tried first for its better check byte, and version 1 where
//! nobody answers to that (firmware before 2018).

use msp::Version;

/// First answers take up to 25 ms; an aircraft in the air that hears no frames falls after 300 ms (FACTS 1).
const FIRST_NS: u64 = 60_000_000;
/// From then on each is tried for as long as a question may take.
const AGAIN_NS: u64 = 250_000_000;
/// A controller that was heard by version 1 first is asked so often whether it knows 2 as well...
const PROBES: u8 = 3;
/// ... with this in between.
const PROBE_NS: u64 = 1_000_000_000;

/// What is spoken, and how sure that is.
#[derive(Debug, Clone)]
pub(crate) struct Framing {
    version: Version,
    /// The configuration wants version 1 and nothing else.
    pinned: bool,
    /// The controller has answered on this connection.
    heard: bool,
    /// The first change of version has been tried.
    turned: bool,
    /// When the version was chosen, or last answered to.
    since_ns: u64,
    /// Something was asked in it.
    asked: bool,
    probes: u8,
    probed_ns: u64,
}

impl Framing {
    pub(crate) fn new(now: u64, msp_version: u8) -> Self {
        let pinned = msp_version == 1;
        Self {
            version: if pinned { Version::V1 } else { Version::V2 },
            pinned,
            heard: false,
            turned: false,
            since_ns: now,
            asked: false,
            probes: 0,
            probed_ns: now,
        }
    }

    /// The port opened again: most likely with the same controller behind it.
    pub(crate) fn reopened(&self, now: u64) -> Self {
        Self { version: self.version, ..Self::new(now, if self.pinned { 1 } else { 2 }) }
    }

    pub(crate) fn version(&self) -> Version {
        self.version
    }

    pub(crate) fn asked(&mut self) {
        self.asked = true;
    }

    /// An answer came.
    pub(crate) fn answered(&mut self, now: u64, version: Version) {
        // The first answer decides; later ones only for the better.
        if !self.pinned && (!self.heard || version == Version::V2) {
            self.version = version;
        }
        self.heard = true;
        self.since_ns = now;
    }

    /// Changes to the other version when nobody answers to this one; true when it did. `silent`: the link is.
    pub(crate) fn turn(&mut self, now: u64, silent: bool) -> bool {
        let patience = if self.heard || self.turned { AGAIN_NS } else { FIRST_NS };
        let heard = self.heard && !silent;
        if self.pinned || heard || !self.asked || now.saturating_sub(self.since_ns) < patience {
            return false;
        }
        self.version = if self.version == Version::V2 { Version::V1 } else { Version::V2 };
        (self.since_ns, self.asked, self.turned) = (now, false, true);
        true
    }

    /// Whether to ask now if version 2 is understood as well.
    pub(crate) fn probe(&mut self, now: u64) -> bool {
        let possible = !self.pinned && self.heard && self.version == Version::V1 && self.probes < PROBES;
        if !possible || now.saturating_sub(self.probed_ns) < PROBE_NS {
            return false;
        }
        self.probes += 1;
        self.probed_ns = now;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn version_two_as_long_as_it_is_answered() {
        let mut framing = Framing::new(0, 2);
        framing.asked();
        assert!(!framing.turn(59 * MS, false));
        framing.answered(59 * MS, Version::V2);
        assert!(!framing.turn(900 * MS, false) && !framing.probe(5_000 * MS));
        assert_eq!(framing.version(), Version::V2);
        // Silent for a second: another board may be there now.
        assert!(framing.turn(1_100 * MS, true));
        assert_eq!(framing.version(), Version::V1);
    }

    #[test]
    fn an_old_firmware_is_heard_by_version_one_and_kept() {
        let mut framing = Framing::new(0, 2);
        assert!(!framing.turn(100 * MS, true), "nothing was asked yet");
        framing.asked();
        assert!(framing.turn(101 * MS, false));
        framing.asked();
        framing.answered(130 * MS, Version::V1);
        assert!(!framing.turn(800 * MS, false));
        let probes = (0..100).filter(|second| framing.probe((2 + second) * 1_000 * MS)).count();
        assert_eq!((probes, framing.version()), (3, Version::V1));
        // The port went and came: it begins with what it knows.
        assert_eq!(framing.reopened(9).version(), Version::V1);
    }

    #[test]
    fn whoever_was_only_late_is_spoken_to_by_version_two_after_all() {
        let mut framing = Framing::new(0, 2);
        framing.asked();
        assert!(framing.turn(70 * MS, false));
        framing.answered(90 * MS, Version::V1);
        assert!(framing.probe(1_100 * MS));
        framing.answered(1_120 * MS, Version::V2);
        assert_eq!(framing.version(), Version::V2);
    }

    #[test]
    fn the_configuration_may_want_version_one() {
        let mut framing = Framing::new(0, 1);
        framing.asked();
        assert!(!framing.turn(5_000 * MS, true) && !framing.probe(9_000 * MS));
        framing.answered(5_000 * MS, Version::V2);
        assert_eq!(framing.version(), Version::V1);
    }
}
