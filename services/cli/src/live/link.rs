//! Whether the drone is heard, and whether what it says of itself is to be asked anew. Pure: time is an argument.

use std::time::{Duration, Instant};

/// A pose comes twenty times a second, and a lost bridge is noticed by zenoh within two seconds.
const SILENCE: Duration = Duration::from_secs(3);
/// Between two questions.
const AGAIN: Duration = Duration::from_secs(4);
/// Services start one after the other: the first answer may be the old one still.
const QUESTIONS: u8 = 2;

/// What has become of the drone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Change {
    Silent,
    Back,
}

/// The way to the drone.
#[derive(Debug)]
pub(crate) struct Link {
    heard: Instant,
    silent: bool,
    start: Option<u64>,
    questions: u8,
    ask_at: Instant,
}

impl Link {
    pub(crate) const fn new(now: Instant) -> Self {
        Self { heard: now, silent: false, start: None, questions: 0, ask_at: now }
    }

    /// A message came.
    pub(crate) fn hear(&mut self, now: Instant) -> Option<Change> {
        self.heard = now;
        if !std::mem::take(&mut self.silent) {
            return None;
        }
        self.questions = QUESTIONS;
        self.ask_at = now;
        Some(Change::Back)
    }

    /// Which start of its localization the drone tells of: another means that it may have another plan.
    pub(crate) fn start(&mut self, start: Option<u64>, now: Instant) {
        if start.is_none() || start == self.start {
            return;
        }
        if self.start.is_some() {
            self.questions = QUESTIONS;
            self.ask_at = now;
        }
        self.start = start;
    }

    /// Nothing has come for a while; said once.
    pub(crate) fn look(&mut self, now: Instant) -> Option<Change> {
        if self.silent || now.saturating_duration_since(self.heard) < SILENCE {
            return None;
        }
        self.silent = true;
        Some(Change::Silent)
    }

    /// Whether to ask the drone now what it says of itself. Who does not answer is asked again.
    pub(crate) fn asks(&mut self, now: Instant) -> bool {
        let asks = self.questions > 0 && !self.silent && now >= self.ask_at;
        if asks {
            self.ask_at = now + AGAIN;
        }
        asks
    }

    /// It has answered.
    pub(crate) fn answered(&mut self) {
        self.questions = self.questions.saturating_sub(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_said_once_and_so_is_its_end() {
        let began = Instant::now();
        let at = |seconds: f64| began + Duration::from_secs_f64(seconds);
        let mut link = Link::new(began);
        assert_eq!(link.hear(at(0.1)), None);
        assert_eq!(link.look(at(3.0)), None, "2.9 s are no silence yet");
        assert_eq!(link.look(at(3.2)), Some(Change::Silent));
        assert_eq!(link.look(at(9.0)), None, "once");
        assert!(!link.asks(at(9.0)), "who is silent is not asked");
        assert_eq!(link.hear(at(10.0)), Some(Change::Back));
        assert_eq!(link.hear(at(10.1)), None);
        assert_eq!(link.look(at(12.0)), None);
    }

    #[test]
    fn who_comes_back_or_starts_anew_is_asked_until_it_has_answered_twice() {
        let began = Instant::now();
        let at = |seconds: f64| began + Duration::from_secs_f64(seconds);
        let mut link = Link::new(began);
        link.start(Some(7), at(0.0));
        link.start(None, at(0.1));
        link.start(Some(7), at(0.2));
        assert!(!link.asks(at(0.3)), "the first start was asked about already");
        link.start(Some(8), at(1.0));
        assert!(link.asks(at(1.0)));
        assert!(!link.asks(at(2.0)), "not without a pause");
        link.hear(at(4.9));
        assert!(link.asks(at(5.0)), "it did not answer");
        link.answered();
        link.hear(at(9.0));
        assert!(link.asks(at(9.0)), "once more, as the first answer may be the old one");
        link.answered();
        assert!(!link.asks(at(60.0)));
        link.look(at(61.0));
        link.hear(at(62.0));
        assert!(link.asks(at(62.0)), "and after a silence");
    }
}
