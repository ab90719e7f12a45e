//! When a way counts as blocked: something stands in it and does not move on, or there is no progress.

/// Progress along the route that restarts the clock, metres.
const PROGRESS_M: f32 = 0.2;
/// A way that is free for this long is free, seconds: a person's coat flickers.
const CLEAR_S: f32 = 0.7;

/// What to do about the way ahead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Go on.
    Go,
    /// Stand and wait for it to move on.
    Wait,
    /// It stands there for good: find another way.
    Blocked,
    /// Nothing stands there and still the drone does not get on: find another way.
    Stuck,
}

/// Watches the way ahead.
#[derive(Clone, Debug, Default)]
pub struct Blockage {
    waited_s: f32,
    clear_s: f32,
    still_s: f32,
    furthest_m: f32,
}

impl Blockage {
    /// Forgets everything: a new route.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The same, but for what stood in the way for so long before a restart, seconds: if it still does, that counts.
    pub fn resume(&mut self, waited_s: f32) {
        *self = Self { waited_s: waited_s.clamp(0.0, 600.0), ..Self::default() };
    }

    /// For how long something has stood in the way, seconds.
    #[must_use]
    pub fn waited_s(&self) -> f32 {
        self.waited_s
    }

    /// Whether something stands in the way and is waited for.
    #[must_use]
    pub fn waiting(&self) -> bool {
        self.waited_s > 0.0
    }

    /// One decision: `blocked` as steering saw it, `along_m` the progress on the route.
    pub fn watch(&mut self, dt_s: f32, blocked: bool, along_m: f32, wait_s: f32, stuck_s: f32) -> Verdict {
        let dt_s = dt_s.clamp(0.0, 0.5);
        if along_m > self.furthest_m + PROGRESS_M {
            self.furthest_m = along_m;
            self.still_s = 0.0;
        } else {
            self.still_s += dt_s;
        }
        if blocked {
            self.waited_s += dt_s;
            self.clear_s = 0.0;
        } else {
            self.clear_s += dt_s;
            if self.clear_s >= CLEAR_S {
                self.waited_s = 0.0;
            }
        }
        if self.waited_s >= wait_s && blocked {
            Verdict::Blocked
        } else if self.still_s >= stuck_s {
            Verdict::Stuck
        } else if blocked {
            Verdict::Wait
        } else {
            Verdict::Go
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_passer_by_is_waited_for_and_a_wall_is_not() {
        let mut blockage = Blockage::default();
        let mut along = 0.0;
        for _ in 0..60 {
            assert_eq!(blockage.watch(0.05, true, along, 4.0, 12.0), Verdict::Wait);
        }
        for _ in 0..20 {
            along += 0.025;
            assert_eq!(blockage.watch(0.05, false, along, 4.0, 12.0), Verdict::Go);
        }
        let waited =
            (0..200).take_while(|_| blockage.watch(0.05, true, along, 4.0, 12.0) == Verdict::Wait).count();
        assert!((78..=81).contains(&waited), "the clock started afresh: {waited}");
        assert_eq!(blockage.watch(0.05, true, along, 4.0, 12.0), Verdict::Blocked);
    }

    #[test]
    fn a_flickering_echo_does_not_restart_the_clock() {
        let mut blockage = Blockage::default();
        let verdicts: Vec<Verdict> =
            (0..200).map(|i| blockage.watch(0.05, i % 5 != 0, 0.0, 4.0, 12.0)).collect();
        assert!(verdicts.contains(&Verdict::Blocked));
    }

    #[test]
    fn no_progress_without_a_reason_counts_too() {
        let mut blockage = Blockage::default();
        let go = (0..1000).take_while(|_| blockage.watch(0.05, false, 0.1, 4.0, 12.0) == Verdict::Go).count();
        assert!((235..=242).contains(&go), "{go}");
        assert_eq!(blockage.watch(0.05, false, 0.1, 4.0, 12.0), Verdict::Stuck);
    }
}
