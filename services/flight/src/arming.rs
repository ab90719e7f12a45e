//! The arm switch on AUX1, by the rules that were measured (FACTS 1): the controller wants to see it low with
//! frames flowing, then high with nothing else in the way; after it disarmed by itself, low for more than
//! 1.2 s. In the air the switch stays high whatever else is unknown: low drops the aircraft.

/// AUX1 is held low this long before it goes high: fifteen frames, many more than the controller needs.
const LOW_NS: u64 = 300_000_000;
/// After a refused attempt.
const RETRY_NS: u64 = 500_000_000;
/// After the controller disarmed by itself: it re-arms after more than 1.2 s.
const AFTER_LOSS_NS: u64 = 1_300_000_000;
/// Armed within 135 ms of the switch, seen in the status up to 200 ms later.
const PATIENCE_NS: u64 = 1_000_000_000;
/// Answers in a row that must say "disarmed" before it is believed in the air.
const VOTES: u32 = 2;

/// What is known about the controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Evidence {
    /// Armed, by the newest status; `None` before the first.
    pub armed: Option<bool>,
    /// Counts statuses.
    pub statuses: u32,
    /// Nothing but the arm switch itself stands in the way; false when the status is old.
    pub clear: bool,
    /// The order of the receiver's channels is known and frames flow.
    pub ready: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Low since then, for at least so long.
    Low { since: u64, needed: u64 },
    /// High, waiting for the controller.
    Raised { since: u64 },
    /// Believed to be flying.
    Flying { seen: u32, votes: u32 },
}

/// Drives AUX1.
#[derive(Debug, Clone, Default)]
pub struct ArmSwitch {
    state: Option<State>,
}

impl ArmSwitch {
    /// Decides whether AUX1 is high now. `want`: motors are to run.
    pub fn step(&mut self, now: u64, want: bool, evidence: &Evidence) -> bool {
        let low = |needed| State::Low { since: now, needed };
        let flying = State::Flying { seen: evidence.statuses, votes: 0 };
        let state = match self.state {
            _ if !want => match self.state {
                Some(State::Low { since, needed }) => State::Low { since, needed },
                _ => low(LOW_NS),
            },
            // Started while motors are wanted: they may be turning, so the switch is high unless the
            // controller has said otherwise.
            None => {
                if evidence.armed == Some(false) {
                    low(LOW_NS)
                } else {
                    flying
                }
            }
            Some(State::Low { needed, .. }) if !evidence.ready => low(needed),
            Some(State::Low { since, needed }) => {
                if now.saturating_sub(since) >= needed && evidence.clear && evidence.armed == Some(false) {
                    State::Raised { since: now }
                } else {
                    State::Low { since, needed }
                }
            }
            Some(State::Raised { since }) => {
                if evidence.armed == Some(true) {
                    flying
                } else if now.saturating_sub(since) > PATIENCE_NS {
                    low(RETRY_NS)
                } else {
                    State::Raised { since }
                }
            }
            Some(State::Flying { seen, votes }) => {
                let votes = match evidence.armed {
                    _ if seen == evidence.statuses => votes,
                    Some(false) => votes + 1,
                    _ => 0,
                };
                if votes >= VOTES {
                    low(AFTER_LOSS_NS)
                } else {
                    State::Flying { seen: evidence.statuses, votes }
                }
            }
        };
        self.state = Some(state);
        !matches!(state, State::Low { .. })
    }

    /// Whether the aircraft is believed to be armed.
    #[must_use]
    pub fn flying(&self) -> bool {
        matches!(self.state, Some(State::Flying { .. }))
    }

    /// Whether statuses are worth asking for more often: something is about to change.
    #[must_use]
    pub fn eager(&self) -> bool {
        matches!(self.state, Some(State::Raised { .. } | State::Flying { votes: 1.., .. }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;
    const READY: Evidence = Evidence { armed: Some(false), statuses: 1, clear: true, ready: true };

    #[test]
    fn low_for_three_tenths_then_high() {
        let mut switch = ArmSwitch::default();
        assert!(!switch.step(0, false, &READY));
        assert!(!switch.step(299 * MS, true, &READY));
        assert!(switch.step(300 * MS, true, &READY));
        assert!(!switch.step(301 * MS, false, &READY), "disarming is immediate");
    }

    #[test]
    fn not_raised_while_something_else_blocks_or_the_order_is_unknown() {
        for (clear, ready) in [(false, true), (true, false)] {
            let mut switch = ArmSwitch::default();
            for t in 0..100 {
                assert!(!switch.step(t * 50 * MS, true, &Evidence { clear, ready, ..READY }));
            }
        }
    }

    #[test]
    fn started_in_the_air_it_is_high_at_once_and_stays() {
        let mut switch = ArmSwitch::default();
        assert!(switch.step(0, true, &Evidence::default()));
        assert!(switch.step(MS, true, &Evidence { armed: Some(true), statuses: 1, ..READY }));
        assert!(switch.step(2000 * MS, true, &Evidence { armed: Some(true), statuses: 9, ..READY }));
    }

    #[test]
    fn one_status_that_says_disarmed_does_not_drop_the_aircraft_two_do() {
        let mut switch = ArmSwitch::default();
        let seen = |armed, statuses| Evidence { armed: Some(armed), statuses, ..READY };
        assert!(switch.step(0, true, &seen(true, 1)));
        assert!(switch.step(MS, true, &seen(false, 2)) && switch.eager());
        assert!(switch.step(2 * MS, true, &seen(false, 2)), "the same status again is no second vote");
        assert!(switch.step(3 * MS, true, &seen(true, 3)) && !switch.eager());
        assert!(switch.step(4 * MS, true, &seen(false, 4)));
        assert!(!switch.step(5 * MS, true, &seen(false, 5)));
        assert!(!switch.step(1204 * MS, true, &seen(false, 9)), "more than 1.2 s low after a loss");
        assert!(switch.step(1306 * MS, true, &seen(false, 10)));
    }

    #[test]
    fn a_refused_attempt_is_tried_again_after_a_pause() {
        let mut switch = ArmSwitch::default();
        switch.step(0, false, &READY);
        assert!(switch.step(300 * MS, true, &READY));
        assert!(switch.step(1300 * MS, true, &READY));
        assert!(!switch.step(1301 * MS, true, &READY));
        assert!(!switch.step(1800 * MS, true, &READY));
        assert!(switch.step(1801 * MS, true, &READY));
    }
}
