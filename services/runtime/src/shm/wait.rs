//! Waiting for a message or a tick, whichever is first.

use crate::Waker;
use iceoryx2::port::listener::Listener;
use iceoryx2::service::ipc;
use iceoryx2_bb_posix::file_descriptor::FileDescriptorBased;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::BorrowedFd;

/// Waits until somebody wakes the listener or rings the waker, or for `wait_ns`; true when it was woken. A signal ends it early.
///
/// The listener's own `timed_wait` sets a receive timeout on its socket, which the kernel rounds up to its clock
/// ticks: on a kernel of 250 Hz a tick of 5 ms came every 9. `poll` is as exact as the machine's timers.
pub(crate) fn woken_within(listener: &Listener<ipc::Service>, waker: Option<&Waker>, wait_ns: u64) -> bool {
    if wait_ns > 0 {
        #[allow(unsafe_code, reason = "iceoryx2 does not lend its descriptor in a safer way")]
        // SAFETY: the descriptor belongs to the listener, which is borrowed for longer than `socket` lives.
        let socket = unsafe { BorrowedFd::borrow_raw(listener.file_descriptor().native_handle()) };
        let timeout =
            Timespec { tv_sec: (wait_ns / 1_000_000_000) as i64, tv_nsec: (wait_ns % 1_000_000_000) as _ };
        // An interrupted wait is a signal: the caller looks at its `stop` next.
        let message = PollFd::from_borrowed_fd(socket, PollFlags::IN);
        let _ = match waker {
            None => poll(&mut [message], Some(&timeout)),
            Some(waker) => {
                let ring = PollFd::from_borrowed_fd(waker.descriptor(), PollFlags::IN);
                poll(&mut [message, ring], Some(&timeout))
            }
        };
    }
    let mut woken = waker.is_some_and(Waker::rang);
    let _ = listener.try_wait(|_| woken = true);
    woken
}
