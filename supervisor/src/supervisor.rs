//! The loop: what has happened, what is due, what is asked.

mod requests;

use crate::above::Above;
use crate::child::{Child, Surroundings};
use crate::control::Control;
use crate::error::while_doing;
use crate::landing::{Descent, Landing, order_number};
use crate::life::{Action, Life};
use crate::log::Log;
use crate::notify::NotifySocket;
use crate::place::Place;
use crate::shared::SharedMemory;
use crate::show::show;
use crate::signals::SignalPipe;
use crate::warden::Post;
use crate::{Options, SupervisorError, default_run_dir};
use manifest::Manifest;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::Signal;
use signal_hook::consts::{SIGCHLD, SIGHUP, SIGINT, SIGTERM};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often retained topics are taken: a topic of 20 Hz is never more than one message behind.
const KEEP: Duration = Duration::from_millis(20);
/// The same while a restarted service waits for what was kept: adds this much to the time it is away.
const KEEP_STARTING: Duration = Duration::from_millis(2);
/// How often dead programs beside the services are cleaned up after: a topic has places for five publishers, and
/// people do not start and kill three command lines within a second.
const TIDY: Duration = Duration::from_secs(1);
/// A loop that overslept so long was stopped itself, and so probably was everybody else.
const OVERSLEPT: Duration = Duration::from_millis(200);
/// Patience with each service when there is a hurry.
const HURRY: Duration = Duration::from_millis(500);
/// Ahead of every service: a restart must not wait for those that still run.
const NICENESS: i32 = -19;

/// What the system is doing as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Running,
    Landing(Landing),
    Stopping { hurry: bool },
}

impl Phase {
    fn word(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Landing(_) => "landing",
            Self::Stopping { .. } => "stopping",
        }
    }
}

/// A running system.
pub(crate) struct Supervisor<S> {
    // Dropped in this order: the memory first, the run directory last.
    shared: S,
    control: Control,
    notify: NotifySocket,
    children: Vec<Child>,
    own_log: Log,
    manifest: Manifest,
    around: Surroundings,
    options: Options,
    phase: Phase,
    started: Instant,
    child_ends: SignalPipe,
    stop_signals: SignalPipe,
    warden: Post,
    place: Place,
}

impl<S: SharedMemory> Supervisor<S> {
    /// Takes the run directory, makes shared memory and sockets. No service is started yet.
    pub(crate) fn start(
        options: &Options,
        create: impl FnOnce(&Manifest, &runtime::shm::RunDir) -> Result<S, SupervisorError>,
    ) -> Result<Self, SupervisorError> {
        let mut paths = Vec::new();
        for path in &options.manifests {
            paths.push(std::path::absolute(path).map_err(while_doing(path.display().to_string()))?);
        }
        let (manifest, _) = load(&paths)?;
        let run_dir = options.run_dir.clone().unwrap_or_else(|| default_run_dir(&manifest.system.name));
        // From here on a signal ends the system in order.
        let child_ends = SignalPipe::new(&[SIGCHLD])?;
        let stop_signals = SignalPipe::new(&[SIGTERM, SIGINT, SIGHUP])?;
        let programs = match &options.programs {
            Some(programs) => programs.clone(),
            None => own_directory()?,
        };
        let place = Place::take(&run_dir, options.logs.as_deref())?;
        let prepared = prepare(options, paths, &place, create);
        let (shared, manifest, manifests, control, notify, warden) = match prepared {
            Ok(prepared) => prepared,
            Err(error) => {
                place.leave(&manifest);
                return Err(error);
            }
        };
        let now = Instant::now();
        let children = manifest.start_order().into_iter().map(|entry| {
            let life = Life::new(entry, options.start_limit, options.stop_limit, now);
            Child::new(entry.clone(), programs.join(&entry.run), life, Log::new(place.log(&entry.name)))
        });
        let children = children.collect();
        let around = Surroundings {
            manifests,
            run_dir: place.path().to_owned(),
            notify: place.notify(),
            seed: options.seed,
        };
        // A wish, as for the services.
        let _ = rustix::process::setpriority_process(None, NICENESS);
        Ok(Self {
            shared,
            control,
            notify,
            children,
            own_log: Log::new(place.log("supervisor")),
            manifest,
            around,
            options: options.clone(),
            phase: Phase::Running,
            started: now,
            child_ends,
            stop_signals,
            warden,
            place,
        })
    }

    /// Runs until nothing is left.
    pub(crate) fn run(mut self) -> Result<(), SupervisorError> {
        self.say(&format!("{} in {}", self.manifest.system.name, self.place.path().display()));
        if let Some(pid) = self.warden.pid() {
            self.say(&format!("warden: process {pid}"));
        }
        let mut planned = Instant::now();
        let mut tidied = planned;
        let mut above = Above::ready(planned);
        loop {
            let now = Instant::now();
            above.beat(now);
            if now > planned + OVERSLEPT {
                self.say(&format!("overslept by {} ms", (now - planned).as_millis()));
                self.children.iter_mut().for_each(|child| child.life.forgive(now));
            }
            self.hear_services(now);
            self.reap(now);
            for _ in 0..self.stop_signals.take() {
                self.stop_wanted(false, now);
            }
            self.serve(now);
            if self.progress(now) {
                break;
            }
            self.act(now);
            self.shared.keep();
            if now >= tidied + TIDY {
                tidied = now;
                self.shared.tidy();
            }
            planned = self.wait()?;
        }
        self.say("stopped");
        let Self { shared, control, notify, children, warden, place, manifest, .. } = self;
        warden.dismiss();
        drop((shared, notify, children));
        place.leave(&manifest);
        // The last thing that a client who waits for the end sees.
        drop(control);
        Ok(())
    }

    /// Sleeps until something happens or is due; returns when it wanted to wake at the latest.
    fn wait(&self) -> Result<Instant, SupervisorError> {
        let starting = self.children.iter().any(|c| c.life.is_starting() && !c.retained.is_empty());
        let now = Instant::now();
        let keep = now + if starting { KEEP_STARTING } else { KEEP };
        let due = self.children.iter().filter_map(|c| c.life.deadline()).min();
        let until = due.map_or(keep, |due| due.min(keep));
        let mut fds = vec![
            PollFd::new(&self.child_ends.read, PollFlags::IN),
            PollFd::new(&self.stop_signals.read, PollFlags::IN),
            PollFd::new(&self.notify.socket, PollFlags::IN),
            PollFd::new(&self.control.listener, PollFlags::IN),
        ];
        for connection in &self.control.connections {
            let output = if connection.has_output() { PollFlags::OUT } else { PollFlags::empty() };
            fds.push(PollFd::new(&connection.stream, PollFlags::IN | output));
        }
        for child in &self.children {
            for stream in [0, 1] {
                fds.extend(child.pipe(stream).map(|pipe| PollFd::new(pipe, PollFlags::IN)));
            }
        }
        let patience = until.saturating_duration_since(now);
        let timeout =
            Timespec { tv_sec: patience.as_secs().cast_signed(), tv_nsec: patience.subsec_nanos().into() };
        match poll(&mut fds, Some(&timeout)) {
            // Everything is read without blocking, so it does not matter which one was ready.
            Ok(_) | Err(rustix::io::Errno::INTR) => Ok(until),
            Err(error) => Err(while_doing("poll")(error)),
        }
    }

    /// Notifications and log lines.
    fn hear_services(&mut self, now: Instant) {
        while let Some((pid, said)) = self.notify.receive() {
            let Some(child) = self.children.iter_mut().find(|c| c.pid() == Some(pid)) else { continue };
            if said.ready {
                child.life.ready(now);
            }
            if said.beat {
                child.life.beat(now);
            }
            if let Some(missed) = said.missed {
                child.missed(missed);
            }
            if let Some(status) = said.status {
                child.said(status);
            }
        }
        let (echo, seconds) = (self.options.echo, self.seconds(now));
        for child in &mut self.children {
            let name = child.entry.name.clone();
            for stream in [0, 1] {
                child.read_pipe(stream, seconds, |line| show(echo, &name, line));
            }
        }
    }

    /// Takes leave of processes that have ended, and keeps what they retained.
    fn reap(&mut self, now: Instant) {
        if self.child_ends.take() == 0 {
            return;
        }
        let (echo, seconds) = (self.options.echo, self.seconds(now));
        let mut news = Vec::new();
        for child in &mut self.children {
            let name = child.entry.name.clone();
            if let Some(end) = child.reap(now, seconds, |line| show(echo, &name, line)) {
                let word = child.life.word();
                child.offer_retained(self.shared.recover(&name));
                news.push(format!("{name}: {end}; {word}"));
            }
        }
        news.extend(self.warden.reap(now));
        news.iter().for_each(|text| self.say(text));
    }

    /// Starts, ends and kills what is due.
    fn act(&mut self, now: Instant) {
        let mut news = Vec::new();
        news.extend(self.warden.act(&self.place, &self.around.manifests, now));
        for child in &mut self.children {
            let name = &child.entry.name;
            match child.life.due(now) {
                Some(Action::Spawn) => match child.spawn(&self.around, now) {
                    Ok(pid) => {
                        let incarnation = child.life.incarnation() - 1;
                        news.push(format!("{}: process {pid}, start {incarnation}", child.entry.name));
                    }
                    Err(reason) => news.push(format!("{}: {reason}", child.entry.name)),
                },
                Some(Action::Kill) => {
                    news.push(format!("{name}: did not end when asked to; killed"));
                    child.kill("killed: did not end when asked to".to_owned());
                }
                Some(Action::KillLate) => {
                    let limit = self.options.start_limit.as_secs_f64();
                    news.push(format!("{name}: not ready after {limit} s; killed"));
                    child.kill(format!("killed: not ready after {limit} s"));
                }
                Some(Action::KillHung) => {
                    let limit = child.entry.heartbeat_ms;
                    news.push(format!("{name}: no heartbeat for {limit} ms; killed"));
                    child.kill(format!("killed: no heartbeat for {limit} ms"));
                }
                Some(Action::Terminate) => child.signal(Signal::TERM),
                None => {}
            }
        }
        news.iter().for_each(|text| self.say(text));
    }

    /// A signal or a request to stop.
    fn stop_wanted(&mut self, at_once: bool, now: Instant) {
        Above::stopping("stopping");
        self.phase = match self.phase {
            Phase::Running if self.shared.airborne() && !at_once => {
                Above::status("landing");
                self.say("landing first; a second signal stops at once");
                Phase::Landing(Landing::new(self.options.land_limit, order_number(), now))
            }
            Phase::Running => {
                self.say("stopping");
                Phase::Stopping { hurry: at_once }
            }
            Phase::Landing(_) | Phase::Stopping { .. } => {
                self.say("stopping at once");
                Phase::Stopping { hurry: true }
            }
        };
    }

    /// Takes landing and stopping further. True when nothing is left.
    fn progress(&mut self, now: Instant) -> bool {
        if let Phase::Landing(landing) = &mut self.phase {
            match landing.due(self.shared.airborne(), now) {
                Some(Descent::Order(order)) => self.shared.land(order),
                Some(Descent::Landed) => self.stop_landed("landed; stopping"),
                Some(Descent::Late) => self.stop_landed("not landed in time; stopping all the same"),
                None => {}
            }
        }
        let Phase::Stopping { hurry } = self.phase else { return false };
        for child in self.children.iter_mut().filter(|c| c.pid().is_none()) {
            let _ = child.life.stop(Duration::ZERO, now);
        }
        let limit = if hurry { HURRY } else { self.options.stop_limit };
        // One by one, the last started first; all together in a hurry.
        let at_a_time = if hurry { usize::MAX } else { 1 };
        for child in self.children.iter_mut().rev().filter(|c| c.pid().is_some()).take(at_a_time) {
            if child.life.stop(limit, now) == Some(Action::Terminate) {
                child.signal(Signal::TERM);
            }
        }
        self.children.iter().all(|c| c.pid().is_none())
    }

    fn stop_landed(&mut self, why: &str) {
        self.say(why);
        self.phase = Phase::Stopping { hurry: false };
    }

    fn seconds(&self, now: Instant) -> f64 {
        now.saturating_duration_since(self.started).as_secs_f64()
    }

    /// A line of the supervisor's own log.
    fn say(&mut self, text: &str) {
        let seconds = self.seconds(Instant::now());
        self.own_log.push(text, seconds);
        show(self.options.echo, "supervisor", text);
    }
}

type Prepared<S> = (S, Manifest, String, Control, NotifySocket, Post);

/// Everything that is made inside the run directory.
fn prepare<S>(
    options: &Options,
    mut paths: Vec<PathBuf>,
    place: &Place,
    create: impl FnOnce(&Manifest, &runtime::shm::RunDir) -> Result<S, SupervisorError>,
) -> Result<Prepared<S>, SupervisorError> {
    if !options.changes.is_empty() {
        let path = place.changes();
        std::fs::write(&path, &options.changes).map_err(while_doing(path.display().to_string()))?;
        paths.push(path);
    }
    let (manifest, manifests) = load(&paths)?;
    let shared = create(&manifest, &place.run)?;
    let control = Control::bind(&place.control())?;
    let notify = NotifySocket::bind(&place.notify())?;
    // Last, as whoever is there from now on ends in order.
    let warden = Post::fill(place, &manifests)?;
    Ok((shared, manifest, manifests, control, notify, warden))
}

/// The manifest and, for the services, the paths it was read from.
fn load(paths: &[PathBuf]) -> Result<(Manifest, String), SupervisorError> {
    let mut names = Vec::new();
    for path in paths {
        let name = path.to_str().filter(|name| !name.contains(':'));
        names.push(name.ok_or_else(|| {
            SupervisorError::Manifest(format!("{}: a manifest's path may not contain ':'", path.display()))
        })?);
    }
    let names = names.join(":");
    let (manifest, _) =
        runtime::load_manifest(&names).map_err(|e| SupervisorError::Manifest(e.to_string()))?;
    Ok((manifest, names))
}

fn own_directory() -> Result<PathBuf, SupervisorError> {
    let own = std::env::current_exe().map_err(while_doing("own executable"))?;
    Ok(own.parent().unwrap_or(Path::new("/")).to_owned())
}
