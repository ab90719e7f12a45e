//! The delay as it is measured: what comes later than it should lengthens the way to a stop.

use crate::held::seconds;

/// Time in which a late message is forgotten, seconds: what was late a moment ago may be again.
const KEPT_S: f32 = 3.0;
/// Ages that the braking law's own reaction time covers, seconds: a ping is heard of when its group has ended (60 ms) and at
/// the next step; an attitude comes thirty times a second and takes 5 ms on the line.
const PING_S: f32 = 0.12;
const ATTITUDE_S: f32 = 0.06;
/// More is no delay but silence, which the failsafes see to, seconds.
const MOST_S: f32 = 1.0;

/// The worst age of the last seconds of one kind of message, beyond what is usual.
#[derive(Clone, Copy, Debug, Default)]
struct Late {
    worst_s: f32,
    at_ns: u64,
}

impl Late {
    fn take(&mut self, now: u64, late_s: f32) {
        if late_s.is_finite() && late_s >= self.worst_at(now) {
            (self.worst_s, self.at_ns) = (late_s.min(MOST_S), now);
        }
    }

    /// It fades, so that one late message is not for ever.
    fn worst_at(&self, now: u64) -> f32 {
        self.worst_s * (1.0 - seconds(self.at_ns, now) / KEPT_S).max(0.0)
    }
}

/// How much later than usual pings and attitudes come.
#[derive(Clone, Copy, Debug, Default)]
pub struct Delay {
    ping: Late,
    attitude: Late,
}

impl Delay {
    /// A ping that left so long ago, seconds, was heard of now.
    pub fn ping(&mut self, now: u64, age_s: f32) {
        self.ping.take(now, age_s - PING_S);
    }

    /// The attitude is so old now, seconds.
    pub fn attitude(&mut self, now: u64, age_s: f32) {
        self.attitude.take(now, age_s - ATTITUDE_S);
    }

    /// Seconds to be added to the braking law's delay.
    #[must_use]
    pub fn more_s(&self, now: u64) -> f32 {
        self.ping.worst_at(now).max(0.0) + self.attitude.worst_at(now).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn what_is_usual_adds_nothing_and_what_is_late_fades() {
        let mut delay = Delay::default();
        delay.ping(S, 0.08);
        delay.attitude(S, 0.04);
        assert_eq!(delay.more_s(S), 0.0);
        delay.ping(2 * S, 0.32);
        delay.attitude(2 * S, 0.16);
        assert!((delay.more_s(2 * S) - 0.3).abs() < 1e-5);
        delay.ping(2 * S + S / 10, 0.09);
        let later = delay.more_s(3 * S);
        assert!(later > 0.15 && later < 0.25, "one in time does not make up for one that was late: {later}");
        assert!((delay.more_s(3 * S + S / 2) - 0.15).abs() < 1e-5, "half of it in half of three seconds");
        assert_eq!(delay.more_s(6 * S), 0.0);
        delay.attitude(7 * S, f32::INFINITY);
        delay.attitude(7 * S, f32::NAN);
        assert_eq!(delay.more_s(7 * S), 0.0, "silence is the failsafes' affair");
    }
}
