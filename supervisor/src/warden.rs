//! The warden: a second process of this executable that waits for the supervisor's death.
//!
//! A supervisor that is killed can land nothing. So before any service it starts a warden, which
//!
//! - is in a group of its own: Ctrl-C in the terminal does not reach it;
//! - holds one end of a pair of sockets, the *line*: an end of it without a good-bye means that the supervisor has died;
//! - shares the lock of the run directory: no other supervisor starts over what still flies;
//! - then lands what flies, ends the services and removes what is left, as a supervisor that stops does ([`serve`]).
//!
//! This is the supervisor's side of it: a warden that dies is replaced by another. If both die at once, the services
//! fly on by themselves until another supervisor is started, which ends them.

mod serve;
mod watch;

pub(crate) use serve::serve;

use crate::SupervisorError;
use crate::child::end_words;
use crate::place::{Place, WARDEN_NAME};
use manifest::RestartPolicy;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::BorrowedFd;
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};
use std::ffi::OsString;
use std::io::{ErrorKind, IoSlice, Read, Write};
use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// Set for the process that is to be the warden.
const WANTED: &str = "SERENO_WARDEN";
/// What the warden says on the line when it is at its post. Anything else is a sentence on why it is not.
const READY: u8 = 0x06;
/// What the supervisor says on the line before it leaves.
const GOODBYE: u8 = 0x04;
/// From its start to its being ready: it opens two topics.
const START_LIMIT: Duration = Duration::from_secs(15);
/// From good-bye to its end.
const END_LIMIT: Duration = Duration::from_secs(2);

/// Whether this process was started to be a warden.
pub(crate) fn is_wanted() -> bool {
    std::env::var_os(WANTED).is_some()
}

/// A warden, as its supervisor sees it.
#[derive(Debug)]
struct Warden {
    process: Child,
    line: UnixStream,
    said: Vec<u8>,
    began: Instant,
}

impl Warden {
    fn start(place: &Place, manifests: &str) -> std::io::Result<Self> {
        use runtime::env;
        let (line, theirs) = UnixStream::pair()?;
        give(&line, place.lock())?;
        line.set_nonblocking(true)?;
        let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
        // The very executable that runs here, whatever has been built in its place since.
        let process = Command::new("/proc/self/exe")
            .arg0(WARDEN_NAME)
            .args(arguments)
            .env(WANTED, "1")
            .env(env::MANIFEST, manifests)
            .env(env::RUN_DIR, place.path())
            .stdin(OwnedFd::from(theirs))
            .process_group(0)
            .spawn()?;
        Ok(Self { process, line, said: Vec::new(), began: Instant::now() })
    }

    fn is_ready(&self) -> bool {
        self.said.first() == Some(&READY)
    }

    /// Takes what it says; false when it will say no more.
    fn hear(&mut self) -> bool {
        let mut buffer = [0_u8; 256];
        loop {
            match self.line.read(&mut buffer) {
                Ok(0) => return false,
                Ok(count) => self.said.extend(buffer.iter().take(count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return error.kind() == ErrorKind::WouldBlock,
            }
        }
    }

    /// Waits until it says something more or nothing ever again, at most until `deadline`.
    fn wait(&self, deadline: Instant) {
        let patience = deadline.saturating_duration_since(Instant::now());
        let timeout =
            Timespec { tv_sec: patience.as_secs().cast_signed(), tv_nsec: patience.subsec_nanos().into() };
        // Interrupted by a signal: the caller looks at the clock.
        let _ = poll(&mut [PollFd::new(&self.line, PollFlags::IN)], Some(&timeout));
    }

    /// Ends it at once.
    fn kill(&mut self) {
        // It may have ended a moment ago.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }

    /// How it ended, if it has, in its own words or the operating system's.
    fn end(&mut self) -> Option<String> {
        let status = self.process.try_wait().ok()??;
        self.hear();
        let own = String::from_utf8_lossy(&self.said);
        Some(if self.is_ready() || own.is_empty() { end_words(status) } else { own.trim_end().to_owned() })
    }
}

/// Puts a descriptor on the line, for whoever reads it first.
fn give(line: &UnixStream, lock: BorrowedFd<'_>) -> std::io::Result<()> {
    let descriptors = [lock];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut control = SendAncillaryBuffer::new(&mut space);
    control.push(SendAncillaryMessage::ScmRights(&descriptors));
    // A descriptor travels with a byte at least.
    sendmsg(line, &[IoSlice::new(b"\n")], &mut control, SendFlags::NOSIGNAL)?;
    Ok(())
}

/// The warden's post, which is never empty for long.
#[derive(Debug)]
pub(crate) struct Post {
    warden: Option<Warden>,
    /// When another one is started.
    next: Instant,
    failures: u32,
    policy: RestartPolicy,
}

impl Post {
    /// Starts the first warden and waits until it is ready: nothing may fly before.
    pub(crate) fn fill(place: &Place, manifests: &str) -> Result<Self, SupervisorError> {
        let failed = |why: String| SupervisorError::Warden(why);
        let mut warden = Warden::start(place, manifests).map_err(|error| failed(error.to_string()))?;
        let deadline = warden.began + START_LIMIT;
        while warden.hear() && !warden.is_ready() && Instant::now() < deadline {
            warden.wait(deadline);
        }
        if !warden.is_ready() {
            let slow = Instant::now() >= deadline;
            // Whoever hangs up is about to end.
            let _ = if slow { warden.process.kill() } else { Ok(()) };
            let _ = warden.process.wait();
            let late = || format!("not ready after {} s", START_LIMIT.as_secs());
            return Err(failed(if slow { late() } else { warden.end().unwrap_or_else(late) }));
        }
        let policy = RestartPolicy::default();
        Ok(Self { next: warden.began, warden: Some(warden), failures: 0, policy })
    }

    /// Process id of the warden, when there is one.
    pub(crate) fn pid(&self) -> Option<u32> {
        self.warden.as_ref().map(|warden| warden.process.id())
    }

    /// To be called after a child has ended: a sentence when it was the warden.
    pub(crate) fn reap(&mut self, now: Instant) -> Option<String> {
        let warden = self.warden.as_mut()?;
        let end = warden.end()?;
        if warden.is_ready() && now.saturating_duration_since(warden.began) >= self.policy.healthy {
            self.failures = 0;
        }
        self.failures = self.failures.saturating_add(1);
        self.next = now + self.policy.delay(self.failures);
        self.warden = None;
        Some(format!("warden: {end}; another one follows"))
    }

    /// Starts another warden if there is none, ends one that does not become ready; a sentence on that.
    pub(crate) fn act(&mut self, place: &Place, manifests: &str, now: Instant) -> Option<String> {
        if let Some(warden) = &mut self.warden {
            warden.hear();
            if !warden.is_ready() && now >= warden.began + START_LIMIT {
                // Reaped like any other.
                let _ = warden.process.kill();
            }
            return None;
        }
        if now < self.next {
            return None;
        }
        match Warden::start(place, manifests) {
            Ok(warden) => {
                let news = format!("warden: process {}", warden.process.id());
                self.warden = Some(warden);
                Some(news)
            }
            Err(error) => {
                self.failures = self.failures.saturating_add(1);
                self.next = now + self.policy.delay(self.failures);
                Some(format!("warden: cannot be started: {error}"))
            }
        }
    }

    /// Sends the warden away: nothing is left to be watched. Returns when it has ended.
    pub(crate) fn dismiss(self) {
        let Some(mut warden) = self.warden else { return };
        // If it has ended already, so much the better.
        let _ = warden.line.write_all(&[GOODBYE]);
        let deadline = Instant::now() + END_LIMIT;
        while warden.hear() && Instant::now() < deadline {
            warden.wait(deadline);
        }
        if Instant::now() >= deadline {
            warden.kill();
        }
        // Who has hung up is about to end.
        let _ = warden.process.wait();
    }
}
