//! For how long something has been so.

/// Counts for how long a condition has held, forgiving short interruptions when it is told to.
#[derive(Clone, Copy, Debug, Default)]
pub struct Held {
    since: Option<u64>,
    last_true: u64,
}

impl Held {
    /// Tells what is so now; answers for how many seconds it has been, 0 when it is not.
    ///
    /// A condition that was true counts as still true until it has been false for `clear_s`: what comes and
    /// goes with every message must not restart its clock each time.
    pub fn update(&mut self, now: u64, is_so: bool, clear_s: f32) -> f32 {
        if is_so {
            self.last_true = now;
            self.since.get_or_insert(now);
        } else if self.since.is_some() && seconds(self.last_true, now) >= clear_s {
            self.since = None;
        }
        self.seconds(now)
    }

    /// For how many seconds it has been so; 0 when it is not.
    #[must_use]
    pub fn seconds(&self, now: u64) -> f32 {
        self.since.map_or(0.0, |since| seconds(since, now))
    }

    /// Forgets.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// Seconds from `earlier` to `later`; 0 when they are the other way round.
pub(crate) fn seconds(earlier: u64, later: u64) -> f32 {
    later.saturating_sub(earlier) as f32 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::Held;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_short_interruption_does_not_restart_the_clock() {
        let mut held = Held::default();
        assert_eq!(held.update(1000 * MS, true, 0.5), 0.0);
        assert!((held.update(1400 * MS, false, 0.5) - 0.4).abs() < 1e-6);
        assert!((held.update(2000 * MS, true, 0.5) - 1.0).abs() < 1e-6);
        assert!(held.update(2600 * MS, false, 0.5) == 0.0);
    }
}
