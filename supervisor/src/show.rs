//! Lines for whoever started the system.

use crate::Echo;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::Write;

/// Shows a line, unless nobody takes it now: a paused terminal must not pause a flight.
pub(crate) fn show(echo: Echo, name: &str, line: &str) {
    match echo {
        Echo::Silent => {}
        Echo::Text => print(&mut std::io::stderr().lock(), &format!("[{name}] {line}\n")),
        Echo::Json => {
            let row = serde_json::json!({ "service": name, "line": line });
            print(&mut std::io::stdout().lock(), &format!("{row}\n"));
        }
    }
}

fn print(stream: &mut (impl Write + std::os::fd::AsFd), text: &str) {
    let mut ready = [PollFd::new(stream, PollFlags::OUT)];
    let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
    if poll(&mut ready, Some(&at_once)) == Ok(1) {
        // Nobody listens any more: the system runs on.
        let _ = stream.write_all(text.as_bytes());
    }
}
