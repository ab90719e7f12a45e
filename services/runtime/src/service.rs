//! What a service is.

use crate::{Ports, Start, StartError, Validate};
use ipc_types::Text;

/// A struct with a configuration, typed ports and a step. Runs unchanged on both buses.
pub trait Service: Sized {
    /// Its name in the manifest, in topics (`health/NAME`) and on the command line.
    const NAME: &'static str;
    /// Its configuration file; unknown keys and bad ranges are refused.
    type Config: serde::de::DeserializeOwned + Default + Validate;

    /// Opens ports and files and allocates what the steps will need.
    ///
    /// # Errors
    /// A [`StartError`] says in one sentence what is missing or wrong.
    fn start(config: Self::Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError>;

    /// Drains the inputs, thinks, publishes. `now` is in nanoseconds of the bus's clock.
    fn step(&mut self, now: u64);

    /// One sentence for `sereno ps`.
    fn status(&self, _text: &mut Text<96>) {}

    /// Messages refused because they made no sense, since start.
    fn refused(&self) -> u64 {
        0
    }
}
