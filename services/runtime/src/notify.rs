//! Plain `sd_notify` messages: READY, WATCHDOG, STATUS, STOPPING.
//!
//! On a socket of our own that never blocks: a supervisor that stalls must not stall a flight-critical loop,
//! and a lost heartbeat is made up for by the next.

use ipc_types::Text;
use std::fmt::Write;
use std::os::unix::net::UnixDatagram;

/// The way to whoever watches this process; silent when nobody does.
pub(crate) struct Notifier(Option<UnixDatagram>);

impl Notifier {
    /// As `NOTIFY_SOCKET` says.
    pub(crate) fn from_environment() -> Self {
        let Some(path) = std::env::var_os("NOTIFY_SOCKET") else { return Self(None) };
        let connected = UnixDatagram::unbound().and_then(|socket| {
            socket.connect(&path)?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        });
        Self(connected.ok())
    }

    /// Says something now, or not at all.
    pub(crate) fn say(&self, text: &str) {
        if let Some(socket) = &self.0 {
            // A full queue or a dead supervisor: nothing that this process could do about it.
            let _ = socket.send(text.as_bytes());
        }
    }

    /// A heartbeat with one sentence and the deadlines missed so far (`X_` marks what is not `sd_notify`'s own).
    /// Allocates nothing.
    pub(crate) fn beat(&self, status: &Text<96>, missed: u64) {
        let mut text = Text::<160>::default();
        // What does not fit is cut at a character; a whole status and a number of 20 digits fit.
        let _ = write!(text, "WATCHDOG=1\nX_MISSED={missed}\nSTATUS={status}");
        self.say(text.as_str());
    }
}
