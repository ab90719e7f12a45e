//! MSP frames beside a radio: what the override switch makes of them.

use super::personality::MspOverride;

/// Value that a channel without any frame reads: the least that counts as a pulse.
const NOTHING_US: u16 = 885;
/// The most that does.
const MOST_US: u16 = 2115;

/// The sticks of the frames so far, in the firmware's order: roll, pitch, yaw, throttle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Companion {
    sticks_us: [u16; 4],
    heard_ns: Option<u64>,
    /// Frames have come without a pause since then.
    steady_ns: u64,
}

impl Companion {
    pub(crate) fn new() -> Self {
        Self { sticks_us: [NOTHING_US; 4], heard_ns: None, steady_ns: 0 }
    }

    /// A frame.
    pub(crate) fn hear(&mut self, now_ns: u64, sticks_us: [u16; 4], rule: MspOverride) {
        let pause_ns = match rule {
            MspOverride::WhileFresh { stale_ns, .. } => stale_ns,
            MspOverride::Unknown | MspOverride::Held => u64::MAX,
        };
        if self.heard_ns.is_none_or(|heard| now_ns.saturating_sub(heard) > pause_ns) {
            self.steady_ns = now_ns;
        }
        self.heard_ns = Some(now_ns);
        self.sticks_us = sticks_us.map(|us| us.clamp(NOTHING_US, MOST_US));
    }

    /// What replaces the radio's sticks while the switch is up.
    pub(crate) fn sticks(&self, now_ns: u64, rule: MspOverride) -> Option<[u16; 4]> {
        let used = match rule {
            MspOverride::Unknown => false,
            MspOverride::Held => true,
            MspOverride::WhileFresh { stale_ns, steady_ns } => {
                self.heard_ns.is_some_and(|heard| now_ns.saturating_sub(heard) <= stale_ns)
                    && now_ns.saturating_sub(self.steady_ns) >= steady_ns
            }
        };
        used.then_some(self.sticks_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn held_for_ever_and_at_the_stops_before_the_first_frame() {
        let mut companion = Companion::new();
        assert_eq!(companion.sticks(5, MspOverride::Held), Some([885; 4]));
        companion.hear(10 * MS, [1500, 1500, 1500, 3000], MspOverride::Held);
        assert_eq!(companion.sticks(1_000_000 * MS, MspOverride::Held), Some([1500, 1500, 1500, 2115]));
        assert_eq!(companion.sticks(11 * MS, MspOverride::Unknown), None);
    }

    #[test]
    fn while_fresh_and_steady() {
        let rule = MspOverride::WhileFresh { stale_ns: 300 * MS, steady_ns: 500 * MS };
        let mut companion = Companion::new();
        assert_eq!(companion.sticks(5, rule), None);
        for frame in 0..=26 {
            companion.hear(frame * 20 * MS, [1400; 4], rule);
        }
        assert_eq!(companion.sticks(499 * MS, rule), None);
        assert_eq!(companion.sticks(520 * MS, rule), Some([1400; 4]));
        assert_eq!(companion.sticks(820 * MS, rule), Some([1400; 4]));
        assert_eq!(companion.sticks(821 * MS, rule), None);
        // After a pause it must be steady anew.
        companion.hear(900 * MS, [1400; 4], rule);
        assert_eq!(companion.sticks(900 * MS, rule), None);
    }
}
