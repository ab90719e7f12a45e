//! The warden's own process: waits, and when the supervisor has died lands, ends and clears away.

use super::watch::{Limits, Task, Watch};
use super::{GOODBYE, READY};
use crate::error::while_doing;
use crate::landing::order_number;
use crate::log::Log;
use crate::place::{Place, WARDEN_NAME, orphans};
use crate::shared::SharedMemory;
use crate::show::show;
use crate::signals::SignalPipe;
use crate::{Options, SupervisorError};
use manifest::Manifest;
use runtime::shm::RunDir;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};
use rustix::process::{Signal, kill_process};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::fs::File;
use std::io::{ErrorKind, IoSliceMut, Read, Write};
use std::mem::MaybeUninit;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

/// How often the pilot's state is taken while the supervisor lives: so old at most is what is known if the pilot dies
/// with it.
const IDLE: Duration = Duration::from_secs(1);
/// How often is looked while something is to be done.
const GLANCE: Duration = Duration::from_millis(20);

/// What the line says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    Silent,
    Goodbye,
    Broken,
}

/// Is the warden until the supervisor says good-bye or has died and nothing of its system is left. Returns the exit code:
/// zero after a good-bye.
pub(crate) fn serve<S: SharedMemory>(
    options: &Options,
    open: impl FnOnce(&Manifest, &RunDir) -> Result<S, SupervisorError>,
) -> i32 {
    let line = match std::io::stdin().as_fd().try_clone_to_owned() {
        Ok(line) => UnixStream::from(line),
        Err(_) => return 1,
    };
    match Warden::take_post(options, &line, open) {
        Ok(warden) => warden.keep_watch(line),
        Err(error) => {
            // The supervisor passes it on.
            let _ = (&line).write_all(error.to_string().as_bytes());
            1
        }
    }
}

struct Warden<S> {
    shared: S,
    manifest: Manifest,
    watch: Watch,
    /// Why the services were ended.
    outcome: &'static str,
    log: Log,
    options: Options,
    began: Instant,
    signals: SignalPipe,
    place: Place,
}

impl<S: SharedMemory> Warden<S> {
    fn take_post(
        options: &Options,
        line: &UnixStream,
        open: impl FnOnce(&Manifest, &RunDir) -> Result<S, SupervisorError>,
    ) -> Result<Self, SupervisorError> {
        // Wishes: a name by which people find it, and to be the last whom a machine without memory kills.
        let _ = std::fs::write("/proc/self/comm", WARDEN_NAME);
        let _ = std::fs::write("/proc/self/oom_score_adj", "-1000");
        let signals = SignalPipe::new(&[SIGTERM, SIGINT, SIGHUP])?;
        let variable = |name: &str| {
            std::env::var_os(name).ok_or_else(|| SupervisorError::Warden(format!("{name} is not set")))
        };
        let lock = take_lock(line).map_err(while_doing("lock of the run directory"))?;
        line.set_nonblocking(true).map_err(while_doing("line to the supervisor"))?;
        let run = RunDir::new(variable(runtime::env::RUN_DIR)?);
        let manifests = variable(runtime::env::MANIFEST)?;
        let (manifest, _) = runtime::load_manifest(&manifests.to_string_lossy())
            .map_err(|error| SupervisorError::Manifest(error.to_string()))?;
        let shared = open(&manifest, &run)?;
        let place = Place::inherit(run, options.logs.as_deref(), lock);
        let limits = Limits { land: options.land_limit, stop: options.stop_limit };
        let services = manifest.start_order().into_iter().map(|entry| entry.name.clone());
        Ok(Self {
            shared,
            watch: Watch::new(limits, services),
            outcome: "",
            log: Log::new(place.log("warden")),
            options: options.clone(),
            began: Instant::now(),
            signals,
            manifest,
            place,
        })
    }

    fn keep_watch(mut self, mut line: UnixStream) -> i32 {
        // A supervisor that has died in the meantime is found out at once.
        let _ = line.write_all(&[READY]);
        loop {
            self.shared.keep();
            // A signal is the supervisor's to obey as long as it lives.
            self.signals.take();
            match hear(&mut line) {
                Line::Silent => wait(&[&line, &self.signals.read], IDLE),
                Line::Goodbye => return 0,
                Line::Broken => break,
            }
        }
        self.take_over();
        1
    }

    /// Brings the system to its end in place of the supervisor.
    fn take_over(mut self) {
        self.watch.orphaned(Instant::now());
        self.place.held_by_warden("looking whether anything flies");
        self.say("the supervisor has died without a good-bye");
        loop {
            self.shared.keep();
            if self.signals.take() > 0 {
                self.watch.hurry();
            }
            if self.progress() {
                break;
            }
            wait(&[&self.signals.read], GLANCE);
        }
        self.say("stopped");
        let Self { shared, manifest, place, outcome, .. } = self;
        drop(shared);
        place.leave(&manifest);
        let last =
            format!("{WARDEN_NAME}: the supervisor had died; {outcome}; everything has been stopped\n");
        // Perhaps nobody listens any more.
        let _ = std::io::stderr().write_all(last.as_bytes());
    }

    /// Does what is due. True when nothing is left.
    fn progress(&mut self) -> bool {
        loop {
            let left = if self.watch.is_ending() { orphans(self.place.path()) } else { Vec::new() };
            let living = left.iter().map(|(_, service)| service.clone()).collect();
            let now = Instant::now();
            let Some(task) = self.watch.due(self.shared.airborne(), order_number(), &living, now) else {
                return false;
            };
            let signal = |service: &str, signal| {
                for (pid, _) in left.iter().filter(|(_, owner)| owner == service) {
                    // It may have ended a moment ago.
                    let _ = kill_process(*pid, signal);
                }
            };
            match task {
                Task::Land => {
                    self.place.held_by_warden("landing");
                    self.say("it flies: landing; a signal to this process stops at once");
                }
                Task::Order(order) => self.shared.land(order),
                Task::End(why) => {
                    self.place.held_by_warden("stopping everything");
                    self.say(&format!("{why}; stopping"));
                    self.outcome = why;
                }
                Task::Terminate(service) => signal(&service, Signal::TERM),
                Task::Kill(service) => {
                    self.say(&format!("{service}: did not end when asked to; killed"));
                    signal(&service, Signal::KILL);
                }
                Task::Leave => return true,
            }
        }
    }

    fn say(&mut self, text: &str) {
        self.log.push(text, self.began.elapsed().as_secs_f64());
        show(self.options.echo, "warden", text);
    }
}

/// The descriptor that the supervisor put on the line before it started this process.
fn take_lock(line: &UnixStream) -> rustix::io::Result<File> {
    let mut byte = [0_u8; 1];
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut control = RecvAncillaryBuffer::new(&mut space);
    recvmsg(line, &mut [IoSliceMut::new(&mut byte)], &mut control, RecvFlags::CMSG_CLOEXEC)?;
    let given = control.drain().find_map(|message| match message {
        RecvAncillaryMessage::ScmRights(mut descriptors) => descriptors.next(),
        _ => None,
    });
    given.map(File::from).ok_or(rustix::io::Errno::BADF)
}

/// What the line says now.
fn hear(line: &mut UnixStream) -> Line {
    let mut byte = [0_u8; 1];
    loop {
        return match line.read(&mut byte) {
            Ok(0) => Line::Broken,
            Ok(_) if byte == [GOODBYE] => Line::Goodbye,
            Ok(_) => continue,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if error.kind() == ErrorKind::WouldBlock => Line::Silent,
            // Reset: the supervisor died with something unread.
            Err(_) => Line::Broken,
        };
    }
}

/// Waits until one of them can be read, at most `limit`.
fn wait(streams: &[&UnixStream], limit: Duration) {
    let timeout = Timespec { tv_sec: limit.as_secs().cast_signed(), tv_nsec: limit.subsec_nanos().into() };
    let mut fds: Vec<PollFd<'_>> = streams.iter().map(|stream| PollFd::new(*stream, PollFlags::IN)).collect();
    // Interrupted by a signal: the caller looks at everything anyway.
    let _ = poll(&mut fds, Some(&timeout));
}
