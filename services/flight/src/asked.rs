//! Questions on their way to the controller, and what their answers tell about the line.

use crate::schedule::Question;

/// A question that was not answered by then is lost; the slowest answer of a sound line took a tenth of it.
const LOST_NS: u64 = 250_000_000;
/// One that nobody waits for is given longer, nearly until it is due again: its answer measures a slow line.
const PATIENT_NS: u64 = 450_000_000;
/// Questions on the way at once, attitudes aside; with the frames far below the controller's 192-byte buffer.
const MOST_OUTSTANDING: usize = 3;
/// From a question to its answer on a sound line, at most: 9 bytes there and 25 back in 3 ms, a pass of the controller's
/// task in 10. The quickest of a few takes less, and a sound line is held up by nothing.
const SOUND_TRIP_NS: u64 = 13_000_000;
/// Newest round trips that are remembered, of some seven a second: so many late ones in a row are no hiccup.
const TRIPS: usize = 3;

/// Which questions are on their way.
///
/// The attitude is different: it is asked for again whether or not the last answer came. An answer that a bad line lost is
/// not worth waiting for (a quarter of a second without attitude is a wall), and since all that is sent stays below
/// what the controller takes in a second, questions that are answered late cannot pile up.
#[derive(Debug, Clone, Default)]
pub(crate) struct Asked {
    sent_ns: [Option<u64>; 10],
    trips_ns: [u64; TRIPS],
    trips: usize,
}

impl Asked {
    /// Whether this may be asked now.
    pub(crate) fn free(&self, question: Question) -> bool {
        question == Question::Attitude || self.sent_ns[question as usize].is_none() && self.room()
    }

    fn room(&self) -> bool {
        let attitude = self.sent_ns[Question::Attitude as usize].is_some();
        self.sent_ns.iter().flatten().count() - usize::from(attitude) < MOST_OUTSTANDING
    }

    pub(crate) fn sent(&mut self, now: u64, question: Question) {
        self.sent_ns[question as usize] = Some(now);
    }

    /// Nothing that was asked will be answered.
    pub(crate) fn forget(&mut self) {
        self.sent_ns = [None; 10];
    }

    /// An answer came; false when nobody had asked.
    pub(crate) fn answered(&mut self, now: u64, question: Question) -> bool {
        let slot = &mut self.sent_ns[question as usize];
        let Some(sent_ns) = *slot else { return false };
        if question == Question::Attitude {
            // More may be on their way: the slot empties with time.
            return true;
        }
        *slot = None;
        // The controller answers in order: what was asked before this and is not answered never will be.
        for other in Question::ALL.into_iter().filter(|other| *other != Question::Attitude) {
            let slot = &mut self.sent_ns[other as usize];
            if slot.is_some_and(|asked_ns| asked_ns < sent_ns) {
                *slot = None;
            }
        }
        if patience_ns(question) == PATIENT_NS {
            self.trips_ns[self.trips % TRIPS] = now.saturating_sub(sent_ns);
            self.trips = self.trips.wrapping_add(1);
        }
        true
    }

    /// Gives up what will not be answered any more.
    pub(crate) fn expire(&mut self, now: u64) {
        for question in Question::ALL {
            let slot = &mut self.sent_ns[question as usize];
            if slot.is_some_and(|sent_ns| now.saturating_sub(sent_ns) >= patience_ns(question)) {
                *slot = None;
            }
        }
    }

    /// How long bytes are held up on the way back, beyond what a sound line takes: half of the quickest of the newest
    /// round trips.
    pub(crate) fn held_up_ns(&self) -> u64 {
        let known = self.trips_ns.get(..self.trips.min(TRIPS)).unwrap_or(&[]);
        known.iter().min().map_or(0, |trip_ns| trip_ns.saturating_sub(SOUND_TRIP_NS) / 2)
    }
}

/// What is asked for again and again can wait: nothing is asked twice meanwhile, so that its answer is its own. A `flight`
/// that begins in the air cannot.
fn patience_ns(question: Question) -> u64 {
    match question {
        Question::Attitude | Question::Status | Question::Analog | Question::Motor => PATIENT_NS,
        _ => LOST_NS,
    }
}

/// Attitude and accelerometer asked for in one and never answered for so long, some twenty times: the firmware does not
/// know it.
const UNANSWERED_NS: u64 = 750_000_000;

/// Whether the attitude is asked for together with the accelerometer.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Together {
    answered: bool,
    refused: bool,
    since_ns: Option<u64>,
}

impl Together {
    pub(crate) fn wanted(&mut self, now: u64) -> bool {
        let in_vain = self.since_ns.is_some_and(|since| now.saturating_sub(since) >= UNANSWERED_NS);
        self.refused |= in_vain && !self.answered;
        !self.refused
    }

    pub(crate) fn asked(&mut self, now: u64) {
        self.since_ns.get_or_insert(now);
    }

    /// The firmware answered, or refused.
    pub(crate) fn answered(&mut self, understood: bool) {
        self.answered |= understood;
        self.refused |= !understood;
    }

    /// What was asked so far was in a framing that is not understood.
    pub(crate) fn forget(&mut self) {
        self.since_ns = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn an_attitude_that_does_not_come_keeps_no_question_back() {
        let mut asked = Asked::default();
        for question in [Question::Status, Question::Analog, Question::Rc] {
            asked.sent(0, question);
        }
        assert!(!asked.free(Question::Motor) && asked.free(Question::Attitude));
        asked.sent(MS, Question::Attitude);
        assert!(asked.free(Question::Attitude));
        assert!(asked.answered(30 * MS, Question::Attitude) && asked.answered(31 * MS, Question::Attitude));
        asked.expire(482 * MS);
        assert!(!asked.answered(483 * MS, Question::Attitude), "nobody asked");
        assert!(asked.free(Question::Motor));
    }

    #[test]
    fn answers_come_in_order() {
        let mut asked = Asked::default();
        asked.sent(0, Question::Status);
        asked.sent(20 * MS, Question::Motor);
        asked.sent(40 * MS, Question::Analog);
        assert!(asked.answered(60 * MS, Question::Motor));
        assert!(asked.free(Question::Status), "lost: what was asked later has been answered");
        assert!(!asked.free(Question::Analog));
        assert!(!asked.answered(61 * MS, Question::Status));
    }

    #[test]
    fn a_slow_line_is_measured_and_a_sound_one_holds_nothing_up() {
        let mut asked = Asked::default();
        assert_eq!(asked.held_up_ns(), 0);
        for trip in [30, 12, 25] {
            asked.sent(0, Question::Analog);
            asked.answered(trip * MS, Question::Analog);
        }
        assert_eq!(asked.held_up_ns(), 0);
        for at in 0..3 {
            asked.sent(at * 1_000 * MS, Question::Motor);
            asked.expire((at * 1_000 + 320) * MS);
            assert!(asked.answered((at * 1_000 + 323 + at) * MS, Question::Motor));
        }
        assert_eq!(asked.held_up_ns(), 155 * MS);
    }

    #[test]
    fn two_questions_in_one_are_given_up_when_they_are_refused_or_never_answered() {
        let mut together = Together::default();
        together.asked(0);
        assert!(together.wanted(749 * MS));
        let mut answered = together;
        answered.answered(true);
        assert!(!together.wanted(750 * MS) && answered.wanted(9_000 * MS));
        answered.answered(false);
        assert!(!answered.wanted(9_001 * MS));
    }
}
