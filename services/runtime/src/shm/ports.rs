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

    /// The oldest message not yet taken. A publisher that vanished in the middle is no error of ours.
    pub(crate) fn receive(&mut self) -> Option<SharedSample<T>> {
        self.subscriber.receive().ok().flatten().map(SharedSample)
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

    pub(crate) fn send(&self, loan: SharedLoan<T>) {
        // A reader that vanished in the middle is no error of ours; the others have the message.
        let _ = loan.0.send();
        for notifier in &self.notifiers {
            let _ = notifier.notify();
        }
    }

    pub(crate) fn update_connections(&self) {
        use iceoryx2::port::update_connections::UpdateConnections;
        let _ = self.publisher.update_connections();
    }
}
