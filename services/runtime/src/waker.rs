//! Waking a service that hears more than the bus: a network, whose messages another thread takes in.

use crate::StartError;
use rustix::event::{EventfdFlags, eventfd};
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::Arc;

/// Wakes the service that it belongs to: its next step comes at once, not at its tick. Any thread may ring it, as often
/// as it likes and without waiting: what rang before a step is one step. It says nothing; what there is to be
/// done waits in a queue of the service's own. In lockstep, where steps come by the simulated clock alone, it does nothing.
#[derive(Debug, Clone)]
pub struct Waker(Arc<OwnedFd>);

impl Waker {
    pub(crate) fn new() -> Result<Self, StartError> {
        let counter = eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC)
            .map_err(|error| StartError::invalid(format!("no event counter to be woken by: {error}")))?;
        Ok(Self(Arc::new(counter)))
    }

    /// Wakes the service.
    pub fn wake(&self) {
        // A counter that is full wakes as well as one that is not.
        let _ = rustix::io::write(&self.0, &1_u64.to_ne_bytes());
    }

    /// Whether it rang since the last call.
    pub(crate) fn rang(&self) -> bool {
        let mut count = [0; 8];
        rustix::io::read(&self.0, &mut count).is_ok()
    }

    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn many_rings_are_one_and_any_thread_may_ring() {
        let waker = Waker::new().unwrap();
        assert!(!waker.rang());
        let other = waker.clone();
        std::thread::spawn(move || (0..1000).for_each(|_| other.wake())).join().unwrap();
        assert!(waker.rang());
        assert!(!waker.rang());
    }
}
