//! Prints `docs/failsafes.md` from the failsafe table.
#![allow(clippy::print_stdout, reason = "this is what it is for")]

fn main() {
    print!("{}", control::failsafe_page(&control::Policy::default()));
}
