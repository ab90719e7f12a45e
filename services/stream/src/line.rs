//! Whether a viewer has a say in the rate that is encoded for all. Pure: time is an argument.

use crate::rate::{Bounds, Rate, Report};
use std::time::Duration;

/// Without a report for so long a viewer is stalled: browsers report once a second.
const SILENT: Duration = Duration::from_secs(3);
/// A line that is congested at the lowest rate for so long is left out: there is nothing left to give up for it.
const HOPELESS: Duration = Duration::from_secs(5);
/// For so long its reports must be good again, the first time; twice as long each time after, at most the longest.
const PROBATION: Duration = Duration::from_secs(3);
const LONGEST_PROBATION: Duration = Duration::from_secs(48);
/// What happened so long ago is forgotten.
const FORGOTTEN: Duration = Duration::from_secs(120);

/// A viewer's line.
#[derive(Clone, Debug)]
pub struct Line {
    rate: Rate,
    /// When it was last heard of; the connection itself counts.
    heard: Duration,
    /// Since when it is congested at the lowest rate.
    hopeless: Option<Duration>,
    /// Since when it is left out, and since when its reports are good.
    left_out: Option<Duration>,
    good: Option<Duration>,
    probation: Duration,
}

impl Line {
    /// A line that has just been connected.
    #[must_use]
    pub fn new(bounds: Bounds, now: Duration) -> Self {
        Self {
            rate: Rate::new(bounds),
            heard: now,
            hopeless: None,
            left_out: None,
            good: None,
            probation: PROBATION,
        }
    }

    /// A report has come.
    pub fn report(&mut self, now: Duration, report: &Report) {
        self.heard = now;
        self.rate.report(now, report);
        self.judge(now);
    }

    /// A frame could not leave in time.
    pub fn jam(&mut self, now: Duration) {
        self.rate.jam(now);
        self.judge(now);
    }

    /// Another size of picture is wanted.
    pub fn set_most(&mut self, most: u32) {
        self.rate.set_most(most);
    }

    /// Time passes.
    pub fn tick(&mut self, now: Duration) {
        if self.left_out.is_none() && now.saturating_sub(self.heard) >= SILENT {
            self.leave_out(now);
        }
    }

    /// Nothing is sent, as there is nothing to send: a viewer that gets nothing has nothing to report.
    pub fn idle(&mut self, now: Duration) {
        self.heard = now;
    }

    /// How long nothing was heard.
    #[must_use]
    pub fn silence(&self, now: Duration) -> Duration {
        now.saturating_sub(self.heard)
    }

    /// Bits a second that it carries.
    #[must_use]
    pub fn bits(&self) -> u32 {
        self.rate.bits()
    }

    /// Whether it is left out: it has no say, and gets key frames only.
    #[must_use]
    pub fn is_left_out(&self) -> bool {
        self.left_out.is_some()
    }

    fn judge(&mut self, now: Duration) {
        let congested = self.rate.is_congested();
        let Some(since) = self.left_out else {
            if !(congested && self.rate.is_least()) {
                self.hopeless = None;
            } else if now.saturating_sub(*self.hopeless.get_or_insert(now)) >= HOPELESS {
                self.leave_out(now);
            }
            return;
        };
        if congested {
            self.good = None;
        } else if now.saturating_sub(*self.good.get_or_insert(now)) >= self.probation {
            self.left_out = None;
            let long = now.saturating_sub(since) > FORGOTTEN;
            self.probation = if long { PROBATION } else { (self.probation * 2).min(LONGEST_PROBATION) };
        }
    }

    fn leave_out(&mut self, now: Duration) {
        (self.left_out, self.good, self.hopeless) = (Some(now), None, None);
    }
}

/// The rate for all: what the worst line that has a say carries, at most `wished`, at least `least`. `pilot`, the line of whoever
/// holds the sticks, decides alone. Lines are pairs of bits a second and whether they are left out.
#[must_use]
pub fn for_all(
    wished: u32,
    least: u32,
    pilot: Option<u32>,
    lines: impl IntoIterator<Item = (u32, bool)>,
) -> u32 {
    let worst = || lines.into_iter().filter(|(_, left_out)| !left_out).map(|(bits, _)| bits).min();
    let carried = pilot.or_else(worst).unwrap_or(wished);
    wished.min(carried).max(least.min(wished))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { least: 150_000, most: 1_000_000 };
    const GOOD: Report = Report { loss: 0.0, round_trip: Some(Duration::from_millis(5)) };
    const BAD: Report = Report { loss: 0.8, round_trip: None };

    fn seconds(at: u64) -> Duration {
        Duration::from_secs(at)
    }

    #[test]
    fn a_viewer_that_reports_nothing_is_left_out_until_it_does() {
        let mut line = Line::new(BOUNDS, seconds(100));
        line.tick(seconds(102));
        assert!(!line.is_left_out(), "it has just come");
        line.tick(seconds(103));
        assert!(line.is_left_out());
        assert_eq!(line.silence(seconds(110)), seconds(10));
        line.report(seconds(110), &GOOD);
        line.report(seconds(112), &GOOD);
        assert!(line.is_left_out(), "on probation");
        line.report(seconds(113), &GOOD);
        assert!(!line.is_left_out());
    }

    #[test]
    fn whoever_is_sent_nothing_is_not_taken_for_stalled() {
        let mut line = Line::new(BOUNDS, seconds(0));
        for now in 0..60 {
            line.idle(seconds(now));
            line.tick(seconds(now));
            assert!(!line.is_left_out() && line.silence(seconds(now)) == Duration::ZERO);
        }
        line.tick(seconds(62));
        assert!(line.is_left_out());
    }

    #[test]
    fn a_hopeless_line_is_left_out_and_comes_back_later_each_time() {
        let mut line = Line::new(BOUNDS, seconds(0));
        let mut now = 0;
        let mut away = Vec::new();
        for _ in 0..3 {
            while !line.is_left_out() {
                now += 1;
                line.report(seconds(now), &BAD);
            }
            let from = now;
            while line.is_left_out() {
                now += 1;
                line.report(seconds(now), &GOOD);
            }
            away.push(now - from);
        }
        assert!(away.is_sorted_by(|a, b| a < b), "{away:?}");
        // One bad report among good ones begins the probation anew.
        for _ in 0..20 {
            now += 1;
            line.report(seconds(now), &BAD);
        }
        assert!(line.is_left_out());
        for turn in 0..200 {
            now += 1;
            line.report(seconds(now), if turn % 5 == 0 { &BAD } else { &GOOD });
            assert!(line.is_left_out());
        }
    }

    #[test]
    fn the_worst_that_has_a_say_decides_and_a_pilot_alone() {
        let lines = [(800_000, false), (300_000, false), (150_000, true)];
        assert_eq!(for_all(1_000_000, 150_000, None, lines), 300_000);
        assert_eq!(for_all(200_000, 150_000, None, lines), 200_000, "never more than wished");
        assert_eq!(for_all(1_000_000, 150_000, Some(900_000), lines), 900_000);
        assert_eq!(for_all(1_000_000, 400_000, None, lines), 400_000, "never less than the least");
        assert_eq!(for_all(100_000, 150_000, None, lines), 100_000, "but what is wished");
        assert_eq!(for_all(1_000_000, 150_000, None, [(150_000, true)]), 1_000_000, "nobody has a say");
    }
}
