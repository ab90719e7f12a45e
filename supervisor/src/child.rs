//! One service: its process, its pipes, its log and its life.

use crate::life::Life;
use crate::log::Log;
use crate::protocol::ServiceRow;
use manifest::ServiceEntry;
use rustix::process::{Pid, Signal, kill_process_group, setpriority_process};
use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

/// Most that is read from a pipe in one turn, so that a chatterbox does not stop the loop.
const PIPE_SHARE: usize = 64 * 1024;

/// What every service is told by its environment.
#[derive(Debug, Clone)]
pub(crate) struct Surroundings {
    /// Manifest and overlays, separated by `:`.
    pub(crate) manifests: String,
    /// The run directory.
    pub(crate) run_dir: PathBuf,
    /// The notification socket.
    pub(crate) notify: PathBuf,
    /// Seed of the system.
    pub(crate) seed: u64,
}

/// One service.
#[derive(Debug)]
pub(crate) struct Child {
    pub(crate) entry: ServiceEntry,
    pub(crate) life: Life,
    pub(crate) log: Log,
    executable: PathBuf,
    process: Option<std::process::Child>,
    pipes: [Option<File>; 2],
    status: String,
    missed: u64,
    last_end: String,
    killed_because: Option<String>,
    last_line: String,
    /// Retained topics that the keeper offers to the next start.
    pub(crate) retained: Vec<String>,
    /// The next start is offered nothing.
    afresh: bool,
}

impl Child {
    pub(crate) fn new(entry: ServiceEntry, executable: PathBuf, life: Life, log: Log) -> Self {
        Self {
            entry,
            life,
            log,
            executable,
            process: None,
            pipes: [None, None],
            status: String::new(),
            missed: 0,
            last_end: String::new(),
            killed_because: None,
            last_line: String::new(),
            retained: Vec::new(),
            afresh: false,
        }
    }

    /// The next start is offered these topics.
    pub(crate) fn offer_retained(&mut self, topics: Vec<String>) {
        for topic in topics {
            // What was offered before and not replaced is still on offer: a service that dies while it starts finds it
            // again.
            if !(self.afresh || self.retained.contains(&topic)) {
                self.retained.push(topic);
            }
        }
    }

    /// The next start is offered nothing, whatever was kept of this one.
    pub(crate) fn forget_retained(&mut self) {
        self.retained.clear();
        self.afresh = true;
    }

    pub(crate) fn pid(&self) -> Option<u32> {
        self.process.as_ref().map(std::process::Child::id)
    }

    pub(crate) fn pipe(&self, stream: usize) -> Option<&File> {
        self.pipes[stream].as_ref()
    }

    pub(crate) fn said(&mut self, status: String) {
        self.status = status;
    }

    pub(crate) fn missed(&mut self, deadlines: u64) {
        self.missed = deadlines;
    }

    /// Starts a process.
    pub(crate) fn spawn(&mut self, around: &Surroundings, now: Instant) -> Result<u32, String> {
        use runtime::env;
        let heartbeat_us = u64::from(self.entry.heartbeat_ms) * 1000;
        let spawned = Command::new(&self.executable)
            .env(env::MANIFEST, &around.manifests)
            .env(env::RUN_DIR, &around.run_dir)
            .env(env::SEED, around.seed.to_string())
            .env(env::INCARNATION, self.life.incarnation().to_string())
            .env(env::RETAINED, self.retained.join(","))
            .env(env::SUPERVISED, &around.run_dir)
            .env(env::SERVICE, &self.entry.name)
            .env("NOTIFY_SOCKET", &around.notify)
            .env("WATCHDOG_USEC", heartbeat_us.to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // A group of its own: Ctrl-C in the terminal reaches the supervisor alone, which lands first.
            .process_group(0)
            .spawn();
        let mut process = match spawned {
            Ok(process) => process,
            Err(error) => {
                let reason = format!("cannot start {}: {error}", self.executable.display());
                self.last_end.clone_from(&reason);
                self.life.spawn_failed(now);
                return Err(reason);
            }
        };
        let pid = process.id();
        // Scheduling is a wish: without the permission the service runs as an ordinary process.
        let _ = setpriority_process(Some(Pid::from_child(&process)), niceness(self.entry.priority));
        let out = process.stdout.take().map(OwnedFd::from);
        let err = process.stderr.take().map(OwnedFd::from);
        self.pipes = [out, err].map(|pipe| {
            let pipe = pipe?;
            // A blocking pipe would stop the loop; such a pipe is not read at all.
            rustix::io::ioctl_fionbio(&pipe, true).ok()?;
            Some(File::from(pipe))
        });
        self.process = Some(process);
        self.afresh = false;
        self.status.clear();
        self.missed = 0;
        self.last_line.clear();
        self.killed_because = None;
        self.life.spawned(now);
        Ok(pid)
    }

    /// Sends a signal to the process and whatever it started.
    pub(crate) fn signal(&self, signal: Signal) {
        if let Some(process) = &self.process {
            // It may have ended a moment ago: the reaper will see.
            let _ = kill_process_group(Pid::from_child(process), signal);
        }
    }

    /// Ends the process at once and remembers why.
    pub(crate) fn kill(&mut self, because: String) {
        self.killed_because = Some(because);
        self.signal(Signal::KILL);
    }

    /// Takes what the process printed; `line` is called with every whole line.
    pub(crate) fn read_pipe(&mut self, stream: usize, seconds: f64, mut line: impl FnMut(&str)) {
        let mut taken = 0;
        let mut buffer = [0_u8; 4096];
        let last_line = &mut self.last_line;
        let mut note = |text: &str| {
            if !text.trim().is_empty() {
                text.trim().clone_into(last_line);
            }
            line(text);
        };
        while let Some(pipe) = &mut self.pipes[stream] {
            match pipe.read(&mut buffer) {
                Ok(0) => {
                    self.log.flush(stream, seconds, &mut note);
                    self.pipes[stream] = None;
                }
                Ok(count) => {
                    self.log.feed(stream, &buffer[..count], seconds, &mut note);
                    taken += count;
                    if taken >= PIPE_SHARE {
                        return;
                    }
                }
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => return,
                Err(_) => self.pipes[stream] = None,
            }
        }
    }

    /// Reaps the process if it has ended: what it printed last is taken, what it started is ended too.
    /// Returns a sentence on the end.
    pub(crate) fn reap(&mut self, now: Instant, seconds: f64, mut line: impl FnMut(&str)) -> Option<String> {
        let process = self.process.as_mut()?;
        let group = Pid::from_child(process);
        let status = process.try_wait().ok()??;
        self.process = None;
        let _ = kill_process_group(group, Signal::KILL);
        for stream in [0, 1] {
            self.read_pipe(stream, seconds, &mut line);
            self.log.flush(stream, seconds, &mut line);
            self.pipes[stream] = None;
        }
        self.life.ended(status.success(), now);
        self.last_end = self.killed_because.take().unwrap_or_else(|| end_words(status));
        if !status.success() && status.signal().is_none() && !self.last_line.is_empty() {
            self.last_end = format!("{}: {}", self.last_end, self.last_line);
        }
        Some(self.last_end.clone())
    }

    pub(crate) fn row(&self, now: Instant) -> ServiceRow {
        let seconds = |d: std::time::Duration| d.as_secs_f64();
        ServiceRow {
            name: self.entry.name.clone(),
            state: self.life.word().to_owned(),
            pid: self.pid(),
            incarnation: self.life.incarnation().checked_sub(1),
            restarts: self.life.restarts(),
            age_s: self.life.age(now).map(seconds),
            heartbeat_age_s: self.pid().and(self.life.beat_age(now)).map(seconds),
            missed_deadlines: self.missed,
            criticality: self.entry.criticality.word().to_owned(),
            status: self.status.clone(),
            last_end: self.last_end.clone(),
        }
    }
}

/// Priorities 1..=99 on the scale of ordinary scheduling, -1..=-19; 0 stays ordinary.
fn niceness(priority: u8) -> i32 {
    -(i32::from(priority) * 19).div_euclid(99)
}

pub(crate) fn end_words(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (_, Some(signal)) => match Signal::from_named_raw(signal) {
            Some(Signal::KILL) => "killed (signal 9)".to_owned(),
            Some(Signal::TERM) => "terminated (signal 15)".to_owned(),
            Some(Signal::SEGV) => "memory fault (signal 11)".to_owned(),
            Some(Signal::ABORT) => "aborted (signal 6)".to_owned(),
            Some(Signal::BUS) => "bus error (signal 7; is /dev/shm full?)".to_owned(),
            _ => format!("signal {signal}"),
        },
        _ => "ended".to_owned(),
    }
}
