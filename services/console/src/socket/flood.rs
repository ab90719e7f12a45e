//! How many messages a page may send: a token bucket. Pure: time is an argument.

use std::time::Duration;

/// Fills at its rate, holds two seconds' worth.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bucket {
    per_second: f64,
    tokens: f64,
    filled: Duration,
}

impl Bucket {
    pub(super) fn new(per_second: f64) -> Self {
        Self { per_second, tokens: 2.0 * per_second, filled: Duration::ZERO }
    }

    /// Whether one more may come at `now`, time since the socket's beginning.
    pub(super) fn take(&mut self, now: Duration) -> bool {
        let since = now.saturating_sub(self.filled).as_secs_f64();
        self.filled = self.filled.max(now);
        self.tokens = (self.tokens + since * self.per_second).min(2.0 * self.per_second);
        if self.tokens < 1.0 {
            return false;
        }
        self.tokens -= 1.0;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_is_borne_and_a_flood_is_not() {
        let mut bucket = Bucket::new(10.0);
        let at = Duration::from_millis;
        assert_eq!((0..30).filter(|_| bucket.take(at(0))).count(), 20);
        assert!(!bucket.take(at(50)));
        assert!(bucket.take(at(200)));
        let mut steady = Bucket::new(10.0);
        assert!((0..1000).all(|k| steady.take(at(100 * k))));
    }
}
