//! The shared-memory bus: iceoryx2 publish-subscribe and events (FACTS 6).
//!
//! The supervisor creates and holds every service ([`Holder`]); everybody else only opens them, with
//! retry: it is what makes SIGKILL at any moment survivable. Root directory and prefix are private to the
//! run directory, so that two systems, or a system and a test, never meet.

mod holder;
mod names;
mod node;
mod payload;
mod ports;
mod wait;

pub use holder::{Holder, ShmError};
pub use names::RunDir;
pub(crate) use node::SharedNode;
pub(crate) use ports::{Refused, SharedInput, SharedLoan, SharedOutput, SharedSample};
pub(crate) use wait::woken_within;
