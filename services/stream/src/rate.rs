//! How many bits a second a viewer's line carries, told by its reports. Pure: time is an argument.
//!
//! Two signs of congestion, as in Google's congestion control (draft-ietf-rmcat-gcc-02): losses (section 6: below 2 % the rate
//! grows, above 10 % it falls by half the share that was lost, between it stays, since lines of radio lose a few per cent however
//! little is sent), and a delay that has grown, which is a queue that fills (section 5.5: the rate falls to 0.85). The delay
//! here is the round trip of the reports against the least of the last half minute, not the gradient of arrivals: with one report a
//! second and one encoder for all there is nothing to gain from a quicker answer. The rate grows by equal steps, as everything
//! that shares a line fairly does (Chiu and Jain 1989; RFC 8698, section 4.3, with other words).

use std::time::Duration;

/// Share lost below which the rate grows, and above which it falls.
const LITTLE_LOSS: f64 = 0.02;
const MUCH_LOSS: f64 = 0.10;
/// A queue of so much delay is congestion: more than Wi-Fi's own jitter, less than a picture that is of no use.
const QUEUE: Duration = Duration::from_millis(120);
/// To what the rate falls for a queue, and for a frame that could not leave at all.
const AFTER_QUEUE: f64 = 0.85;
const AFTER_JAM: f64 = 0.7;
/// A second's growth, as a share of the highest rate: from the lowest to the highest in less than half a minute.
const STEP: f64 = 0.05;
/// The rate falls at most once in so long: until then the reports speak of what was sent before.
const FALL_PAUSE: Duration = Duration::from_millis(500);
/// Growth for a report that comes after a longer silence counts for no more than this.
const LONGEST_STEP: Duration = Duration::from_secs(2);
/// For how long a round trip counts as the least: a drone moves, and with it the line's own delay.
const MEMORY: Duration = Duration::from_secs(30);

/// What a viewer reports about a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Share of packets that were lost, 0 to 1.
    pub loss: f64,
    /// From drone to viewer and back; `None` when it could not be measured.
    pub round_trip: Option<Duration>,
}

/// What is to be held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Bits a second, however bad the line.
    pub least: u32,
    /// Bits a second, however good the line.
    pub most: u32,
}

/// The rate of one line.
#[derive(Clone, Debug)]
pub struct Rate {
    bounds: Bounds,
    bits: f64,
    /// The least round trip and when it was measured, of this half minute and the one before.
    least: [Option<Duration>; 2],
    turned: Duration,
    fell: Option<Duration>,
    heard: Option<Duration>,
    congested: bool,
}

impl Rate {
    /// A line that is believed to carry everything until it says otherwise: most are in the same building.
    #[must_use]
    pub fn new(bounds: Bounds) -> Self {
        Self {
            bounds,
            bits: f64::from(bounds.most),
            least: [None; 2],
            turned: Duration::ZERO,
            fell: None,
            heard: None,
            congested: false,
        }
    }

    /// Bits a second.
    #[must_use]
    pub fn bits(&self) -> u32 {
        self.bits as u32
    }

    /// Whether the last news was bad: losses, a queue, or a frame that could not leave.
    #[must_use]
    pub fn is_congested(&self) -> bool {
        self.congested
    }

    /// Whether it cannot fall any further.
    #[must_use]
    pub fn is_least(&self) -> bool {
        self.bits <= f64::from(self.bounds.least)
    }

    /// The highest rate is another one: a larger or smaller picture is wanted.
    pub fn set_most(&mut self, most: u32) {
        self.bounds.most = most.max(self.bounds.least);
        self.bits = self.bits.min(f64::from(self.bounds.most));
    }

    /// A report has come at `now`, counted from any beginning.
    pub fn report(&mut self, now: Duration, report: &Report) {
        let since = self.heard.map_or(Duration::ZERO, |heard| now.saturating_sub(heard)).min(LONGEST_STEP);
        self.heard = Some(now);
        let queued = report.round_trip.is_some_and(|trip| trip > self.least_trip(now, trip) + QUEUE);
        let loss = if report.loss.is_finite() { report.loss.clamp(0.0, 1.0) } else { 1.0 };
        self.congested = queued || loss > MUCH_LOSS;
        if loss > MUCH_LOSS {
            self.fall(now, 1.0 - loss / 2.0);
        } else if queued {
            self.fall(now, AFTER_QUEUE);
        } else if loss < LITTLE_LOSS {
            self.bits += f64::from(self.bounds.most) * STEP * since.as_secs_f64();
            self.bits = self.bits.min(f64::from(self.bounds.most));
        }
    }

    /// A frame could not leave in time: the line is full, whatever the viewer reports.
    pub fn jam(&mut self, now: Duration) {
        self.congested = true;
        self.fall(now, AFTER_JAM);
    }

    fn fall(&mut self, now: Duration, to: f64) {
        if self.fell.is_some_and(|fell| now.saturating_sub(fell) < FALL_PAUSE) {
            return;
        }
        self.fell = Some(now);
        self.bits = (self.bits * to).max(f64::from(self.bounds.least));
    }

    /// The least round trip of the last half minute or a little more, this one among them.
    fn least_trip(&mut self, now: Duration, trip: Duration) -> Duration {
        if now.saturating_sub(self.turned) > MEMORY {
            self.least = [None, self.least[0]];
            self.turned = now;
        }
        self.least[0] = Some(self.least[0].map_or(trip, |least| least.min(trip)));
        self.least.iter().flatten().min().copied().unwrap_or(trip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { least: 150_000, most: 1_000_000 };

    fn seconds(at: u64) -> Duration {
        Duration::from_secs(at)
    }

    fn report(loss: f64, trip_ms: u64) -> Report {
        Report { loss, round_trip: Some(Duration::from_millis(trip_ms)) }
    }

    #[test]
    fn losses_above_a_tenth_halve_their_share_and_a_few_per_cent_change_nothing() {
        let mut rate = Rate::new(BOUNDS);
        rate.report(seconds(1), &report(0.05, 10));
        assert_eq!((rate.bits(), rate.is_congested()), (1_000_000, false), "a radio's own losses");
        rate.report(seconds(2), &report(0.4, 10));
        assert_eq!((rate.bits(), rate.is_congested()), (800_000, true));
        rate.report(seconds(2) + FALL_PAUSE / 2, &report(0.4, 10));
        assert_eq!(rate.bits(), 800_000, "once for the same losses");
        rate.report(seconds(4), &report(0.05, 10));
        assert_eq!((rate.bits(), rate.is_congested()), (800_000, false));
    }

    #[test]
    fn it_grows_by_equal_steps_and_stays_within_its_bounds() {
        let mut rate = Rate::new(BOUNDS);
        for at in 1..60 {
            rate.report(seconds(at), &report(1.0, 10));
        }
        assert_eq!((rate.bits(), rate.is_least()), (150_000, true));
        let mut before = rate.bits();
        for at in 60..65 {
            rate.report(seconds(at), &report(0.0, 10));
            assert_eq!(rate.bits() - before, 50_000, "at {at}");
            before = rate.bits();
        }
        // After a silence of an hour no more than for two seconds.
        rate.report(seconds(4000), &report(0.0, 10));
        assert_eq!(rate.bits() - before, 100_000);
        for at in 4001..4100 {
            rate.report(seconds(at), &report(0.0, 10));
        }
        assert_eq!(rate.bits(), 1_000_000);
        rate.set_most(400_000);
        assert_eq!(rate.bits(), 400_000);
        rate.set_most(10);
        assert_eq!(rate.bits(), 150_000, "never below the least");
    }

    #[test]
    fn a_queue_that_fills_is_congestion_and_a_long_line_is_not() {
        let mut far = Rate::new(BOUNDS);
        for at in 1..20 {
            far.report(seconds(at), &report(0.0, 400));
        }
        assert_eq!((far.bits(), far.is_congested()), (1_000_000, false), "far away, but no queue");
        far.report(seconds(20), &report(0.0, 600));
        assert_eq!((far.bits(), far.is_congested()), (850_000, true));
        // The line itself has become longer: after a while that is its new delay.
        for at in 21..100 {
            far.report(seconds(at), &report(0.0, 600));
        }
        assert!(!far.is_congested() && far.bits() > 850_000, "{}", far.bits());
    }

    #[test]
    fn a_frame_that_cannot_leave_counts_and_nonsense_is_the_worst() {
        let mut rate = Rate::new(BOUNDS);
        rate.jam(seconds(1));
        assert_eq!((rate.bits(), rate.is_congested()), (700_000, true));
        rate.report(seconds(3), &Report { loss: f64::NAN, round_trip: None });
        assert_eq!(rate.bits(), 350_000);
        rate.report(seconds(5), &Report { loss: -3.0, round_trip: None });
        assert_eq!(rate.bits(), 450_000);
    }

    /// A line that carries 400 kbit/s and queues the rest for half a second, as seen from its reports: the rate settles near
    /// what it carries, and the loss it causes on the way is short.
    #[test]
    fn it_settles_on_what_a_line_carries() {
        let mut rate = Rate::new(BOUNDS);
        let (mut queue_bits, carried) = (0.0, 400_000.0);
        let mut late = Vec::new();
        for at in 1..120 {
            let offered = f64::from(rate.bits()) + queue_bits - carried;
            let dropped = (offered - carried / 2.0).max(0.0);
            queue_bits = offered.clamp(0.0, carried / 2.0);
            let trip = Duration::from_secs_f64(0.01 + queue_bits / carried);
            rate.report(
                seconds(at),
                &Report { loss: dropped / f64::from(rate.bits()), round_trip: Some(trip) },
            );
            if at > 30 {
                late.push(f64::from(rate.bits()));
            }
        }
        let mean = late.iter().sum::<f64>() / late.len() as f64;
        assert!((300_000.0..450_000.0).contains(&mean), "{mean}");
    }
}
