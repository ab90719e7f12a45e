//! The table over time.

use super::condition::{Condition, Evidence, Flags, Loss, Seen, Stage};
use super::policy::Policy;
use super::{Action, Cause, Judgement, Memory, judge};
use crate::held::Held;

/// Times the conditions, judges them, and keeps what only the ground ends. Allocates nothing.
#[derive(Clone, Debug)]
pub struct Failsafe {
    timers: [Held; Condition::ALL.len()],
    evidence: Evidence,
    memory: Memory,
    judged: Judgement,
    since_ns: u64,
}

impl Default for Failsafe {
    fn default() -> Self {
        Self {
            timers: [Held::default(); Condition::ALL.len()],
            evidence: Evidence::new(Stage::Grounded),
            memory: Memory::default(),
            judged: Judgement::NOTHING,
            since_ns: 0,
        }
    }
}

impl Failsafe {
    /// Goes on after a restart from what was said last: what only the ground ends goes on, the rest is timed anew.
    /// `since_ns`: when it began.
    #[must_use]
    pub fn resumed(cause: Cause, action: Action, since_ns: u64) -> Self {
        let memory = Memory::of(cause, action);
        if memory.is_empty() {
            return Self::default();
        }
        let judged = Judgement { cause, action, ..Judgement::NOTHING };
        Self { memory, judged, since_ns, ..Self::default() }
    }

    /// Judges what is so at `now`, in nanoseconds.
    pub fn step(&mut self, now: u64, flags: &Flags, stage: Stage, policy: &Policy) -> Judgement {
        let mut evidence = Evidence::new(stage);
        for (condition, timer) in Condition::ALL.iter().zip(&mut self.timers) {
            let lasted_s = match flags.seen(*condition) {
                Seen::Now(is_so) => {
                    let clear_s = condition.clear(policy).map_or(0.0, |(seconds, _)| seconds);
                    timer.update(now, is_so && condition.counts(stage), clear_s)
                }
                Seen::For(lasted_s) => lasted_s,
            };
            evidence.set(*condition, lasted_s);
        }
        let before = (self.judged.cause, self.judged.action);
        (self.judged, self.memory) = judge(&evidence, &self.memory, policy);
        self.evidence = evidence;
        if (self.judged.cause, self.judged.action) != before {
            self.since_ns = if self.judged.action == Action::None { 0 } else { now };
        }
        self.judged
    }

    /// What was judged last.
    #[must_use]
    pub fn judged(&self) -> Judgement {
        self.judged
    }

    /// Since when this cause does this, nanoseconds; 0 when nothing acts.
    #[must_use]
    pub fn since_ns(&self) -> u64 {
        self.since_ns
    }

    /// What would be done in the end if this were lost now for good, with all else as it is.
    #[must_use]
    pub fn if_lost(&self, loss: Loss, policy: &Policy) -> Action {
        let mut evidence = self.evidence;
        if loss.matters(evidence.stage) {
            evidence.set(loss.condition(), f32::INFINITY);
        }
        judge(&evidence, &self.memory, policy).0.action
    }
}
