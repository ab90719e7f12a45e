//! Signals as something that `poll` can wait for.

use crate::error::{SupervisorError, while_doing};
use signal_hook::{SigId, low_level};
use std::io::Read;
use std::os::unix::net::UnixStream;

/// Signals as bytes in a socket; unregistered when dropped.
pub(crate) struct SignalPipe {
    pub(crate) read: UnixStream,
    ids: Vec<SigId>,
}

impl SignalPipe {
    pub(crate) fn new(signals: &[i32]) -> Result<Self, SupervisorError> {
        let (read, write) = UnixStream::pair().map_err(while_doing("signal pipe"))?;
        read.set_nonblocking(true).map_err(while_doing("signal pipe"))?;
        let mut pipe = Self { read, ids: Vec::new() };
        for signal in signals {
            let write = write.try_clone().map_err(while_doing("signal pipe"))?;
            pipe.ids.push(low_level::pipe::register(*signal, write).map_err(while_doing("signal handler"))?);
        }
        Ok(pipe)
    }

    /// How many signals came since the last look.
    pub(crate) fn take(&mut self) -> usize {
        let mut buffer = [0_u8; 64];
        let mut count = 0;
        while let Ok(n) = self.read.read(&mut buffer) {
            if n == 0 {
                break;
            }
            count += n;
        }
        count
    }
}

impl Drop for SignalPipe {
    fn drop(&mut self) {
        for id in self.ids.drain(..) {
            low_level::unregister(id);
        }
    }
}
