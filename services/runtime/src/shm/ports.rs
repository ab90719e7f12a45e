//! Publishers and subscribers of one process.

use super::payload::Payload;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::ipc;
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut::SampleMut;
use ipc_types::Message;
use std::ops::{Deref, DerefMut};

/// Shared memory refused; counted by the caller, since there is nothing else to be done in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Refused;

/// A received message where it lies in shared memory.
pub(crate) struct SharedSample<T: Message>(Sample<ipc::Service, Payload<T>, ()>);

impl<T: Message> Deref for SharedSample<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0.payload().0
    }
}

pub(crate) struct SharedInput<T: Message> {
    subscriber: Subscriber<ipc::Service, Payload<T>, ()>,
}

impl<T: Message> SharedInput<T> {
    pub(crate) fn new(subscriber: Subscriber<ipc::Service, Payload<T>, ()>) -> Self {
        Self { subscriber }
    }

    /// The oldest message not yet taken. `Err` when shared memory refuses: a publisher that vanished in the middle, or
    /// too many messages held.
    pub(crate) fn receive(&mut self) -> Result<Option<SharedSample<T>>, Refused> {
        self.subscriber.receive().map(|sample| sample.map(SharedSample)).map_err(|_| Refused)
    }
}

/// A message being written in shared memory.
pub(crate) struct SharedLoan<T: Message>(SampleMut<ipc::Service, Payload<T>, ()>);

impl<T: Message> Deref for SharedLoan<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0.payload().0
    }
}

impl<T: Message> DerefMut for SharedLoan<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0.payload_mut().0
    }
}

pub(crate) struct SharedOutput<T: Message> {
    publisher: Publisher<ipc::Service, Payload<T>, ()>,
    notifiers: Vec<Notifier<ipc::Service>>,
}

impl<T: Message> SharedOutput<T> {
    pub(crate) fn new(
        publisher: Publisher<ipc::Service, Payload<T>, ()>,
        notifiers: Vec<Notifier<ipc::Service>>,
    ) -> Self {
        Self { publisher, notifiers }
    }

    pub(crate) fn loan(&self) -> Option<SharedLoan<T>> {
        let uninitialised = self.publisher.loan_uninit().ok()?;
        #[allow(unsafe_code, reason = "writing a large message twice is what a loan is there to avoid")]
        // SAFETY: the memory is a shared-memory segment, which the kernel hands out zeroed and which only ever
        // held messages of this type; `T` is `Pod`, so whatever bytes are there are a valid `T`.
        let sample = unsafe { uninitialised.assume_init() };
        Some(SharedLoan(sample))
    }

    /// `Err` when not every reader has it or could be woken: one that vanished in the middle, for instance. The others
    /// have the message.
    pub(crate) fn send(&self, loan: SharedLoan<T>) -> Result<(), Refused> {
        let mut all = loan.0.send().is_ok();
        for notifier in &self.notifiers {
            all &= notifier.notify().is_ok();
        }
        if all { Ok(()) } else { Err(Refused) }
    }

    pub(crate) fn update_connections(&self) {
        use iceoryx2::port::update_connections::UpdateConnections;
        let _ = self.publisher.update_connections();
    }
}
