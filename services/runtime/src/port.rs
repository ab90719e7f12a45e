//! Typed ports: one API on two buses.
//!
//! Rules that hold on both, proved by `tests/conformance.rs`:
//! - an [`Input`] keeps at most `depth` messages; when one more comes the oldest is dropped, and the gap
//!   in the sequence is counted as lost when the next is taken;
//! - an input that joins late gets the newest message of a live publisher, and nothing older;
//! - a message that is held ([`Guard`]) stays as it is until the guard is dropped;
//! - a [`Loan`] that is dropped unsent is not seen by anyone and uses up no sequence number;
//! - no port allocates after start.

use crate::device::{ByteDevice, Devices};
use crate::journal::{InputStats, OutputStats};
use crate::lockstep::bus::{Bus, LockstepInput, LockstepOutput};
use crate::shm::{Refused, SharedInput, SharedLoan, SharedNode, SharedOutput, SharedSample};
use crate::{StartError, access, fnv};
use ipc_types::{Header, Message};
use manifest::{Manifest, Subscription};
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
    /// Messages past 64 KiB are few and far between: their queues are short, as each place is paid for.
    #[must_use]
    pub const fn of<T: Message>() -> Self {
        if size_of::<T>() > 65_536 {
            Self { depth: 2, held: 2, readers: 6 }
        } else {
            Self { depth: 16, held: 4, readers: 16 }
        }
    }
}

/// What all ports of one service share.
#[derive(Debug)]
pub(crate) struct StepContext {
    pub now: Cell<u64>,
    pub publisher: u32,
    pub incarnation: u32,
}

impl StepContext {
    pub(crate) fn new(service: &str, incarnation: u32) -> Rc<Self> {
        Rc::new(Self { now: Cell::new(0), publisher: Self::publisher_of(service), incarnation })
    }

    /// What stands for a publisher's name in the header of its messages.
    pub(crate) fn publisher_of(service: &str) -> u32 {
        let hash = fnv(service.as_bytes());
        (hash ^ (hash >> 32)) as u32
    }
}

enum InputKind<T: Message> {
    Shared(SharedInput<T>),
    Lockstep(LockstepInput<T>),
}

/// Where messages of one topic arrive.
pub struct Input<T: Message> {
    kind: InputKind<T>,
    stats: Rc<InputStats>,
}

impl<T: Message> Input<T> {
    /// The oldest message not yet taken.
    pub fn receive(&mut self) -> Option<Guard<T>> {
        let guard = match &mut self.kind {
            InputKind::Shared(input) => match input.receive() {
                Ok(sample) => sample.map(|sample| Guard(GuardKind::Shared(sample))),
                Err(Refused) => {
                    self.stats.failed();
                    None
                }
            },
            InputKind::Lockstep(input) => input.receive().map(|slot| Guard(GuardKind::Lockstep(slot))),
        }?;
        self.stats.taken(guard.header());
        Some(guard)
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

enum OutputKind<T: Message> {
    Shared(Rc<SharedOutput<T>>),
    Lockstep(LockstepOutput<T>),
}

/// Where messages of one topic leave.
pub struct Output<T: Message> {
    kind: OutputKind<T>,
    context: Rc<StepContext>,
    sequence: Rc<Cell<u64>>,
    stats: Rc<OutputStats>,
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
            incarnation: self.context.incarnation,
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

pub(crate) enum BusKind {
    Shared(Rc<SharedNode>),
    Lockstep(Rc<Bus>),
}

/// The ports of one service, checked against the manifest as they are opened.
pub struct Ports {
    pub(crate) bus: BusKind,
    pub(crate) service: String,
    pub(crate) manifest: Rc<Manifest>,
    pub(crate) context: Rc<StepContext>,
    pub(crate) inputs: Vec<Rc<InputStats>>,
    pub(crate) outputs: Vec<Rc<OutputStats>>,
    /// Topics that were opened, to read or to publish.
    pub(crate) opened: Vec<String>,
    pub(crate) devices: Box<dyn Devices>,
    /// Topics for which the keeper holds something for this start of the service.
    pub(crate) retained: Vec<String>,
    /// Topics of `retained` that the keeper did not hand over in time.
    pub(crate) forgotten: Vec<&'static str>,
}

impl Ports {
    fn refuse(&self, action: &'static str, topic: &str) -> StartError {
        StartError::Port { service: self.service.clone(), action, topic: topic.to_owned() }
    }

    /// An input of the topic of `T`, as deep as the manifest says.
    ///
    /// # Errors
    /// When the manifest does not list the topic for this service or wants it deeper than [`Limits::of`], or shared
    /// memory refuses.
    pub fn input<T: Message>(&mut self) -> Result<Input<T>, StartError> {
        self.input_of(T::TOPIC)
    }

    /// An input of one topic of a family, such as `health/sonar`.
    ///
    /// # Errors
    /// As [`Ports::input`].
    pub fn input_of<T: Message>(&mut self, topic: &str) -> Result<Input<T>, StartError> {
        let most = Limits::of::<T>().depth;
        let subscription = access::subscription(&self.manifest, &self.service, topic, most);
        let Some(Subscription { depth, wake }) = subscription else {
            return Err(self.refuse("subscribe", topic));
        };
        if !(1..=most).contains(&depth) {
            return Err(StartError::Manifest(format!(
                "{}: service.{}.subscribes.\"{topic}\".depth = {depth}: allowed is 1 to {most} for messages of this size",
                self.manifest.file, self.service
            )));
        }
        let kind = match &self.bus {
            BusKind::Shared(node) => InputKind::Shared(node.input(topic, depth)?),
            BusKind::Lockstep(bus) => InputKind::Lockstep(bus.input(topic, depth, &self.service, wake)),
        };
        self.opened.push(topic.to_owned());
        let stats = Rc::new(InputStats::default());
        self.inputs.push(Rc::clone(&stats));
        Ok(Input { kind, stats })
    }

    /// The output of the topic of `T`.
    ///
    /// # Errors
    /// When the manifest does not list the topic for this service, or shared memory refuses.
    pub fn output<T: Message>(&mut self) -> Result<Output<T>, StartError> {
        self.output_of(T::TOPIC)
    }

    /// The output of one topic of a family, such as `health/sonar`.
    ///
    /// # Errors
    /// As [`Ports::output`].
    pub fn output_of<T: Message>(&mut self, topic: &str) -> Result<Output<T>, StartError> {
        if !access::may_publish(&self.manifest, &self.service, topic) {
            return Err(self.refuse("publish", topic));
        }
        let kind = match &self.bus {
            BusKind::Shared(node) => OutputKind::Shared(node.output(topic, &self.manifest)?),
            BusKind::Lockstep(bus) => OutputKind::Lockstep(bus.output(topic)),
        };
        let stats =
            Rc::new(OutputStats::with_deadline(access::deadline_ns(&self.manifest, &self.service, topic)));
        self.opened.push(topic.to_owned());
        self.outputs.push(Rc::clone(&stats));
        Ok(Output { kind, context: Rc::clone(&self.context), sequence: Rc::new(Cell::new(0)), stats })
    }

    /// Checks that the service has opened every topic that the manifest lists for it: the picture of the wiring is
    /// only worth something if it shows what is, no more and no less. Devices are left out, as a vehicle may lack one.
    ///
    /// # Errors
    /// Names the first that was not opened.
    pub(crate) fn check_all_opened(&self) -> Result<(), StartError> {
        let Some(entry) = self.manifest.services.get(&self.service) else { return Ok(()) };
        let read = entry.subscribes.keys().map(|topic| ("subscribes", topic));
        let published = entry.publishes.keys().map(|topic| ("publishes", topic));
        match read.chain(published).find(|(_, topic)| !self.opened.contains(topic)) {
            None => Ok(()),
            Some((how, topic)) => Err(StartError::Manifest(format!(
                "{}: service.{}.{how}.\"{topic}\": the service does not open it; the manifest must not list it",
                self.manifest.file, self.service
            ))),
        }
    }

    /// Whether the manifest gives this service the device.
    #[must_use]
    pub fn has_device(&self, name: &str) -> bool {
        access::device(&self.manifest, &self.service, name).is_some()
    }

    /// The device that the manifest calls `name` for this service.
    ///
    /// # Errors
    /// When the manifest does not list it, or there can be no such device.
    pub fn device(&mut self, name: &str) -> Result<Box<dyn ByteDevice>, StartError> {
        let Some(path) = access::device(&self.manifest, &self.service, name) else {
            return Err(self.refuse("use device", name));
        };
        match &self.bus {
            BusKind::Lockstep(bus) => Ok(bus.device(name)),
            BusKind::Shared(node) => {
                let path = node.device_path(path)?;
                self.devices.device(name, &path)
            }
        }
    }

    /// After a restart: the last valid sample of a retained topic, from the keeper. `None` at the first
    /// start, and when nothing was ever published.
    ///
    /// # Errors
    /// When shared memory refuses.
    pub fn retained<T: Message>(&mut self) -> Result<Option<Box<T>>, StartError> {
        if !self.retained.iter().any(|topic| topic == T::TOPIC) {
            return Ok(None);
        }
        let kept = match &self.bus {
            BusKind::Shared(node) => node.retained()?,
            BusKind::Lockstep(bus) => bus.retained(),
        };
        if kept.is_none() {
            self.forgotten.push(T::TOPIC);
        }
        Ok(kept)
    }
}
