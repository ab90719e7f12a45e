//! How much memory a loader takes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, noting how much each thread holds at most. To be made the `#[global_allocator]` of whoever
/// runs the targets; without it their bounds on memory are not checked.
#[derive(Debug, Clone, Copy)]
pub struct Peak;

/// Of one thread. Signed: memory may be freed by another thread than took it.
#[derive(Clone, Copy)]
struct Held {
    now: isize,
    most: isize,
}

thread_local! {
    /// Neither initialised lazily nor dropped, so that the allocator may read it at any time.
    static HELD: Cell<Held> = const { Cell::new(Held { now: 0, most: 0 }) };
}

fn note(change: isize) {
    // A thread that is ending has no such variable any more.
    let _ = HELD.try_with(|held| {
        let Held { now, most } = held.get();
        let now = now.wrapping_add(change);
        held.set(Held { now, most: most.max(now) });
    });
}

/// Runs `load` and returns with its result the most that it held at any moment, bytes; 0 where [`Peak`] is not the
/// allocator.
pub fn peak_of<T>(load: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.get().now;
    HELD.set(Held { now: before, most: before });
    let loaded = load();
    (loaded, usize::try_from(HELD.get().most - before).unwrap_or(0))
}

#[allow(unsafe_code, reason = "there is no other way to see allocations")]
// SAFETY: every call goes to the system's allocator unchanged, which keeps the contract.
unsafe impl GlobalAlloc for Peak {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size() as isize);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size as isize - layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.realloc(memory, layout, size) }
    }
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        note(-(layout.size() as isize));
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}
