//! What to ask the controller next, within what it can answer.
//!
//! Betaflight takes one command a pass of a 100 Hz task (FACTS 1), so commands are spread: a frame of channels
//! every 20 ms, one question between two frames, 90 commands a second in all.

/// A question to the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// Armed, modes, what blocks arming.
    Status,
    /// Receiver order.
    Map,
    /// Channels as the controller has them.
    Rc,
    /// Attitude.
    Attitude,
    /// Protocol version.
    Api,
    /// Firmware.
    Variant,
    /// Firmware version.
    Version,
    /// Order of the mode bits.
    Boxes,
    /// Battery and radio.
    Analog,
    /// Motor outputs.
    Motor,
}

impl Question {
    /// All, the most urgent at start first.
    pub const ALL: [Self; 10] = [
        Self::Status,
        Self::Map,
        Self::Rc,
        Self::Attitude,
        Self::Api,
        Self::Variant,
        Self::Version,
        Self::Boxes,
        Self::Analog,
        Self::Motor,
    ];

    /// Asked until answered, then never again on this connection.
    #[must_use]
    pub const fn once(self) -> bool {
        matches!(self, Self::Map | Self::Api | Self::Variant | Self::Version | Self::Boxes)
    }

    /// Time between two, nanoseconds: attitude 30 a second, status 5, power 2, the rest 0.5. With 50 frames
    /// that makes 88.
    const fn period_ns(self) -> u64 {
        match self {
            Self::Attitude => 33_333_333,
            Self::Analog => 500_000_000,
            Self::Rc | Self::Motor => 2_000_000_000,
            _ => 200_000_000,
        }
    }
}

/// Status while something is about to change.
const EAGER_NS: u64 = 100_000_000;
/// Commands a second that the budget refills.
const REFILL_HZ: i64 = 88;
const COST_NS: i64 = 1_000_000_000 / REFILL_HZ;
/// Most commands saved up: with the refill at most 90 in any second.
const SAVED: i64 = 2 * COST_NS;

/// When what is due.
#[derive(Debug, Clone)]
pub(crate) struct Schedule {
    due_ns: [u64; 10],
    credit_ns: i64,
    refilled_ns: u64,
}

impl Schedule {
    pub(crate) fn new(now: u64) -> Self {
        Self { due_ns: [now; 10], credit_ns: SAVED, refilled_ns: now }
    }

    /// Something was sent.
    pub(crate) fn spend(&mut self, now: u64) {
        self.refill(now);
        // Frames of channels are always sent; their debt keeps questions back.
        self.credit_ns = (self.credit_ns - COST_NS).max(-SAVED);
    }

    fn refill(&mut self, now: u64) {
        let passed = i64::try_from(now.saturating_sub(self.refilled_ns)).unwrap_or(SAVED);
        self.refilled_ns = now;
        self.credit_ns = self.credit_ns.saturating_add(passed).min(SAVED);
    }

    /// The most overdue question among those allowed, when the budget has room for it.
    pub(crate) fn next(&mut self, now: u64, allowed: impl Fn(Question) -> bool) -> Option<Question> {
        self.refill(now);
        if self.credit_ns < COST_NS {
            return None;
        }
        let due = |question: &Question| self.due_ns[*question as usize];
        Question::ALL
            .into_iter()
            .filter(|question| due(question) <= now && allowed(*question))
            .min_by_key(|question| due(question))
    }

    /// A question was sent.
    pub(crate) fn asked(&mut self, question: Question, now: u64, eager: bool) {
        let mut period = question.period_ns();
        if eager && question == Question::Status {
            period = EAGER_NS;
        }
        let due = &mut self.due_ns[question as usize];
        // Keeps the rate when a question came late, without a burst when it came very late.
        *due = (*due + period).max(now + period / 2);
    }

    /// Brings a question forward.
    pub(crate) fn hurry(&mut self, question: Question, now: u64) {
        let due = &mut self.due_ns[question as usize];
        *due = (*due).min(now);
    }
}
