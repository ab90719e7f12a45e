//! A drone's clock on this machine's: what is stamped there, in the time that is shown here.

/// Nanoseconds by which a drone's clock may jump before it is another start's: more than any message takes.
const ANOTHER_START_NS: i128 = 10_000_000_000;

/// The smallest difference between the two clocks that was seen: that of the message that took the shortest.
#[derive(Debug, Default)]
pub(crate) struct Clock(Option<i128>);

impl Clock {
    /// When that was, nanoseconds since 1970, of a message stamped `stamp_ns` that is heard at `now_ns`.
    pub(crate) fn unix_ns(&mut self, stamp_ns: u64, now_ns: u64) -> u64 {
        let seen = i128::from(now_ns) - i128::from(stamp_ns);
        let least = match self.0 {
            Some(least) if (seen - least).abs() < ANOTHER_START_NS => least.min(seen),
            _ => seen,
        };
        self.0 = Some(least);
        u64::try_from(i128::from(stamp_ns) + least).unwrap_or(now_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn the_quickest_message_tells_the_difference() {
        let mut clock = Clock::default();
        let base = 1_800_000_000 * S;
        assert_eq!(clock.unix_ns(5 * S, base + 300), base + 300);
        // One that took longer was said 1 s after the first all the same.
        assert_eq!(clock.unix_ns(6 * S, base + S + 90_000_000), base + S + 300);
        assert_eq!(clock.unix_ns(7 * S, base + 2 * S + 100), base + 2 * S + 100);
        assert_eq!(clock.unix_ns(8 * S, base + 3 * S + 900), base + 3 * S + 100);
    }

    #[test]
    fn another_start_is_another_clock() {
        let mut clock = Clock::default();
        let base = 1_800_000_000 * S;
        clock.unix_ns(500 * S, base);
        assert_eq!(clock.unix_ns(2 * S, base + S), base + S);
        assert_eq!(clock.unix_ns(u64::MAX, 0), 0, "nonsense is now");
    }
}
