//! Faults as files: short flights in lockstep, each with what breaks and what must come of it.
//!
//! A scenario is a file of `tests/scenarios`: where, with what, which orders, which faults, and what is expected. It is
//! flown with every service of the manifest and judged by the simulator's truth. Where the drone is known not to do what
//! it should, the expectation stays and `known.toml` says what happens instead; a known shortfall that goes away is an
//! error too, so that the list stays true.

mod file;
mod fly;
mod guard;
mod judge;
mod run;
mod seen;

pub use file::{Expectation, Order, OrderAt, Scenario, load_all, load_known};
pub use fly::{Flown, fly};
pub use guard::{Guard, Link, Move};
pub use judge::failures;
pub use run::{Outcome, Report, Settings, Verdict, run};
pub use seen::{FailsafeSeen, Seen};
