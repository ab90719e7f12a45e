//! Typed ports: one API on two buses.
//!
//! Rules that hold on both, proved by `tests/conformance`:
//! - an [`Input`] keeps at most `depth` messages; when one more comes the oldest is dropped, and the gap
//!   in the sequence is counted as lost when the next is taken;
//! - an input that joins late gets the newest message of a live publisher, and nothing older;
//! - a message that is held ([`Guard`]) stays as it is until the guard is dropped;
//! - an input that had nothing more in a step of a service has nothing more until the next step;
//! - a [`Loan`] that is dropped unsent is not seen by anyone and uses up no sequence number;
//! - no port allocates after start.

use crate::counters::{InputStats, OutputStats};
use crate::lockstep::bus::{LockstepInput, LockstepOutput};
use crate::name_hash;
use crate::shm::{Refused, SharedInput, SharedLoan, SharedOutput, SharedSample};
use ipc_types::{Header, Message};
use std::cell::Cell;
use std::ops::{Deref, DerefMut};
use std::rc::Rc;

/// Depth of inputs and number of readers of one topic: the same on both buses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most messages that wait in one input.
    pub depth: usize,
    /// Most messages that one reader may hold at a time.
    pub held: usize,
    /// Most readers.
    pub readers: usize,
}

impl Limits {
    /// The larger the messages, the fewer places, as each is paid for by every publisher: (depth + held) * readers of them.
    #[must_use]
    pub const fn of<T: Message>() -> Self {
        match size_of::<T>() {
            // Raw pictures: read by the camera, and by a program that looks in.
            2_097_152.. => Self { depth: 1, held: 2, readers: 2 },
            // Particles: few and far between.
            524_288.. => Self { depth: 2, held: 2, readers: 6 },
            // Encoded video, of which each frame lost is a picture that stands still, and what viewers say.
            65_537.. => Self { depth: 8, held: 2, readers: 6 },
            _ => Self { depth: 16, held: 4, readers: 16 },
        }
    }
}

/// What all ports of one service share.
#[derive(Debug)]
pub(crate) struct StepContext {
    pub now: Cell<u64>,
    pub publisher: u32,
    pub incarnation: Cell<u32>,
}

impl StepContext {
    pub(crate) fn new(service: &str, incarnation: u32, now: u64) -> Rc<Self> {
        Rc::new(Self {
            now: Cell::new(now),
            publisher: name_hash(service),
            incarnation: Cell::new(incarnation),
        })
    }
}

pub(crate) enum InputKind<T: Message> {
    Shared(SharedInput<T>),
    Lockstep(LockstepInput<T>),
}

/// Where messages of one topic arrive.
pub struct Input<T: Message> {
    pub(crate) kind: InputKind<T>,
    pub(crate) stats: Rc<InputStats>,
}

impl<T: Message> Input<T> {
    /// The oldest message not yet taken.
    pub fn receive(&mut self) -> Option<Guard<T>> {
        if self.stats.is_empty() {
            return None;
        }
        let guard = match &mut self.kind {
            InputKind::Shared(input) => match input.receive() {
                Ok(sample) => sample.map(|sample| Guard(GuardKind::Shared(sample))),
                Err(Refused) => {
                    self.stats.failed();
                    None
                }
            },
            InputKind::Lockstep(input) => input.receive().map(|slot| Guard(GuardKind::Lockstep(slot))),
        };
        match &guard {
            Some(guard) => self.stats.taken(guard.header()),
            None => self.stats.empty(),
        }
        guard
    }

    /// Takes everything and returns the newest; `None` when nothing new has come.
    pub fn latest(&mut self) -> Option<Guard<T>> {
        let mut newest = None;
        while let Some(guard) = self.receive() {
            newest = Some(guard);
        }
        newest
    }

    /// Messages overwritten before they were taken.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.stats.lost()
    }
}

enum GuardKind<T: Message> {
    Shared(SharedSample<T>),
    Lockstep(Rc<T>),
}

/// A received message where it lies: nothing was copied. Dropping it gives the place back.
pub struct Guard<T: Message>(GuardKind<T>);

impl<T: Message> Deref for Guard<T> {
    type Target = T;
    fn deref(&self) -> &T {
        match &self.0 {
            GuardKind::Shared(sample) => sample,
            GuardKind::Lockstep(slot) => slot,
        }
    }
}

pub(crate) enum OutputKind<T: Message> {
    Shared(Rc<SharedOutput<T>>),
    Lockstep(LockstepOutput<T>),
}

/// Where messages of one topic leave.
pub struct Output<T: Message> {
    pub(crate) kind: OutputKind<T>,
    pub(crate) context: Rc<StepContext>,
    pub(crate) sequence: Rc<Cell<u64>>,
    pub(crate) stats: Rc<OutputStats>,
}

impl<T: Message> Output<T> {
    /// A place to write the next message in. Its content is whatever was there before: every field that
    /// means something must be written. `None` (counted) when all places are in use.
    pub fn loan(&mut self) -> Option<Loan<T>> {
        let kind = match &self.kind {
            OutputKind::Shared(output) => output.loan().map(|loan| LoanKind::Shared(Rc::clone(output), loan)),
            OutputKind::Lockstep(output) => {
                output.loan().map(|slot| LoanKind::Lockstep(output.clone(), slot))
            }
        };
        if kind.is_none() {
            self.stats.refused();
        }
        Some(Loan {
            kind: kind?,
            context: Rc::clone(&self.context),
            sequence: Rc::clone(&self.sequence),
            stats: Rc::clone(&self.stats),
        })
    }

    /// Sends a copy: for small messages that are assembled elsewhere. False when no place was free.
    pub fn publish(&mut self, message: &T) -> bool {
        match self.loan() {
            Some(mut loan) => {
                *loan = *message;
                loan.send();
                true
            }
            None => false,
        }
    }

    /// What a message sent now is stamped with: `now` of the step, for expiries that are counted from it.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.context.now.get()
    }

    /// How often no place was free.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.stats.refusals()
    }

    /// Whether somebody may read what is sent now. In shared memory that cannot be excluded.
    pub(crate) fn is_heard(&self) -> bool {
        match &self.kind {
            OutputKind::Shared(_) => true,
            OutputKind::Lockstep(output) => output.has_readers(),
        }
    }
}

enum LoanKind<T: Message> {
    Shared(Rc<SharedOutput<T>>, SharedLoan<T>),
    Lockstep(LockstepOutput<T>, Rc<T>),
}

/// A message being written where it will be read.
pub struct Loan<T: Message> {
    kind: LoanKind<T>,
    context: Rc<StepContext>,
    sequence: Rc<Cell<u64>>,
    stats: Rc<OutputStats>,
}

impl<T: Message> Loan<T> {
    /// Fills in the header and hands the message over.
    pub fn send(mut self) {
        let sequence = self.sequence.get() + 1;
        self.sequence.set(sequence);
        *self.header_mut() = Header {
            stamp_ns: self.context.now.get(),
            sequence,
            publisher: self.context.publisher,
            incarnation: self.context.incarnation.get(),
        };
        let now = self.context.now.get();
        let whole = match self.kind {
            LoanKind::Shared(output, loan) => output.send(loan).is_ok(),
            LoanKind::Lockstep(output, slot) => {
                output.send(slot, now);
                true
            }
        };
        self.stats.sent(now, whole);
    }
}

impl<T: Message> Deref for Loan<T> {
    type Target = T;
    fn deref(&self) -> &T {
        match &self.kind {
            LoanKind::Shared(_, loan) => loan,
            LoanKind::Lockstep(_, slot) => slot,
        }
    }
}

impl<T: Message> DerefMut for Loan<T> {
    fn deref_mut(&mut self) -> &mut T {
        match &mut self.kind {
            LoanKind::Shared(_, loan) => loan,
            // The slot was taken out of the pool, so this is its only owner and nothing is copied.
            LoanKind::Lockstep(_, slot) => Rc::make_mut(slot),
        }
    }
}
