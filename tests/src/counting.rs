//! An allocator that notes what is allocated, and from where, while a test watches.
//!
//! Crates that count are either without call stacks (`stats_alloc`, `allocation-counter`) or end the process at
//! the first find (`assert_no_alloc`, whose licence is not on our list either); a test must name every place.

use crate::checkout;
use std::alloc::{GlobalAlloc, Layout, System};
use std::backtrace::Backtrace;
use std::cell::Cell;
use std::sync::{Mutex, PoisonError};

/// The system's allocator, noting. To be made the `#[global_allocator]` of a test.
#[derive(Debug, Clone, Copy)]
pub struct Noting;

/// One allocation while somebody was watched.
#[derive(Debug)]
pub struct Allocation {
    /// Who was watched.
    pub who: &'static str,
    /// How much was asked for.
    pub bytes: usize,
    stack: Backtrace,
}

thread_local! {
    /// Neither initialised lazily nor dropped, so that the allocator may read it at any time.
    static WATCHED: Cell<Option<&'static str>> = const { Cell::new(None) };
}
static NOTED: Mutex<Vec<Allocation>> = Mutex::new(Vec::new());

/// From now on allocations of this thread are noted as those of `who`; with `None` no longer.
pub fn watch(who: Option<&'static str>) {
    WATCHED.set(who);
}

/// Takes what was noted of `who`.
#[must_use]
pub fn noted(who: &str) -> Vec<Allocation> {
    let mut noted = NOTED.lock().unwrap_or_else(PoisonError::into_inner);
    noted.extract_if(.., |allocation| allocation.who == who).collect()
}

fn note(bytes: usize) {
    // A panic allocates while it holds the lock that taking a call stack needs.
    if std::thread::panicking() {
        return;
    }
    // A thread that is ending has no such variable any more.
    let Ok(Some(who)) = WATCHED.try_with(Cell::take) else { return };
    // Nobody is watched while this allocates itself.
    let allocation = Allocation { who, bytes, stack: Backtrace::force_capture() };
    NOTED.lock().unwrap_or_else(PoisonError::into_inner).push(allocation);
    WATCHED.set(Some(who));
}

#[allow(unsafe_code, reason = "there is no other way to see allocations")]
// SAFETY: every call goes to the system's allocator unchanged, which keeps the contract.
unsafe impl GlobalAlloc for Noting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        note(size);
        // SAFETY: as above.
        unsafe { System.realloc(memory, layout, size) }
    }
    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

impl Allocation {
    /// The functions and lines of the services and their libraries that led to it, innermost first. Empty in a
    /// build without line tables.
    #[must_use]
    pub fn places(&self) -> Vec<String> {
        let Ok(checkout) = checkout().canonicalize() else { return Vec::new() };
        let text = self.stack.to_string();
        let mut places = Vec::new();
        let mut function = "";
        for line in text.lines().map(str::trim) {
            let Some(file) = line.strip_prefix("at ") else {
                function = line.split_once(": ").map_or(line, |(_, name)| name);
                continue;
            };
            // Files are named in full, or from the working directory.
            let file = file.strip_prefix(&*checkout.to_string_lossy()).unwrap_or(file);
            let file = file.trim_start_matches(['.', '/']);
            if file.starts_with("services/runtime/src/lockstep/mod.rs") {
                // What follows called the step.
                break;
            }
            if file.starts_with("services/") {
                places.push(format!("{function} at {file}"));
            }
        }
        places
    }
}

#[cfg(test)]
mod tests {
    use super::{Noting, noted, watch};

    #[global_allocator]
    static ALLOCATOR: Noting = Noting;

    #[test]
    fn what_is_allocated_while_watched_is_noted() {
        drop(std::hint::black_box(vec![0_u8; 10]));
        watch(Some("this"));
        let mut made = std::hint::black_box(Vec::<u64>::with_capacity(2));
        made.extend([1, 2, 3]);
        watch(None);
        drop(std::hint::black_box(vec![0_u8; 10]));
        let noted: Vec<_> = noted("this").iter().map(|allocation| allocation.bytes).collect();
        assert_eq!(noted, [16, 32]);
    }
}
