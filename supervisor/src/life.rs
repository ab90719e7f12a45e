//! The life of one service as a table of states: what to do when it starts, beats, ends or is told to. Pure:
//! time is an argument, processes are somebody else's.

use manifest::{Restart, RestartPolicy, ServiceEntry};
use std::time::{Duration, Instant};

/// After how many short lives in a row a service is called failing.
const FAILING_AFTER: u32 = 3;

/// What follows when a process that was told to end has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Then {
    /// What the restart policy says.
    Policy,
    /// Start again at once.
    Respawn,
    /// Stay away until released.
    Hold,
    /// Nothing more.
    End,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// No process; one is to be started then.
    Waiting(Instant),
    /// A process that has not yet said that it is ready.
    Starting,
    /// A process that beats.
    Running,
    /// A process that was told to end, and when it is killed (`None`: it was).
    Dying(Option<Instant>, Then),
    /// No process by order of a human.
    Held,
    /// No process: policy or shutdown.
    Ended,
}

/// What the caller has to do to the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Start one.
    Spawn,
    /// Ask it to end (SIGTERM).
    Terminate,
    /// End it (SIGKILL): it was told to end and did not.
    Kill,
    /// End it (SIGKILL): it did not become ready in time.
    KillLate,
    /// End it (SIGKILL): it no longer beats.
    KillHung,
}

/// Time limits of a life.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// From spawn to ready.
    pub start: Duration,
    /// From being told to end to being killed.
    pub stop: Duration,
    /// Between two beats.
    pub heartbeat: Duration,
    /// Delays between restarts.
    pub policy: RestartPolicy,
}

/// The life of one service.
#[derive(Debug, Clone)]
pub struct Life {
    restart: Restart,
    limits: Limits,
    state: State,
    failures: u32,
    spawns: u32,
    restarts: u32,
    spawned_at: Option<Instant>,
    ready_at: Option<Instant>,
    beat_at: Option<Instant>,
}

impl Life {
    /// A service that is to be started now.
    #[must_use]
    pub fn new(entry: &ServiceEntry, start: Duration, stop: Duration, now: Instant) -> Self {
        let heartbeat = Duration::from_millis(entry.heartbeat_ms.into());
        Self {
            restart: entry.restart,
            limits: Limits { start, stop, heartbeat, policy: RestartPolicy::default() },
            state: State::Waiting(now),
            failures: 0,
            spawns: 0,
            restarts: 0,
            spawned_at: None,
            ready_at: None,
            beat_at: None,
        }
    }

    /// What is due by now. Each thing is said once.
    pub fn due(&mut self, now: Instant) -> Option<Action> {
        match self.state {
            State::Waiting(at) if now >= at => Some(Action::Spawn),
            State::Starting if self.spawned_at.is_some_and(|t| now >= t + self.limits.start) => {
                self.state = State::Dying(None, Then::Policy);
                Some(Action::KillLate)
            }
            State::Running if self.beat_at.is_some_and(|t| now >= t + self.limits.heartbeat) => {
                self.state = State::Dying(None, Then::Policy);
                Some(Action::KillHung)
            }
            State::Dying(Some(at), then) if now >= at => {
                self.state = State::Dying(None, then);
                Some(Action::Kill)
            }
            _ => None,
        }
    }

    /// When [`Life::due`] has something to say at the earliest.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        match self.state {
            State::Waiting(at) => Some(at),
            State::Starting => self.spawned_at.map(|t| t + self.limits.start),
            State::Running => self.beat_at.map(|t| t + self.limits.heartbeat),
            State::Dying(at, _) => at,
            State::Held | State::Ended => None,
        }
    }

    /// A process was started.
    pub fn spawned(&mut self, now: Instant) {
        self.restarts += u32::from(self.spawns > 0);
        self.spawns += 1;
        self.spawned_at = Some(now);
        self.ready_at = None;
        self.beat_at = None;
        self.state = State::Starting;
    }

    /// No process could be started: a short life.
    pub fn spawn_failed(&mut self, now: Instant) {
        self.spawned_at = Some(now);
        self.ready_at = None;
        self.end_by_policy(false, now);
    }

    /// The process says that it is ready.
    pub fn ready(&mut self, now: Instant) {
        if self.state == State::Starting {
            self.state = State::Running;
            self.ready_at = Some(now);
            self.beat_at = Some(now);
        }
    }

    /// The process beats.
    pub fn beat(&mut self, now: Instant) {
        if self.state == State::Running {
            self.beat_at = Some(now);
        }
    }

    /// Nobody could have heard a beat for a while: the wait begins anew.
    pub fn forgive(&mut self, now: Instant) {
        if self.beat_at.is_some() {
            self.beat_at = Some(now);
        }
        if self.state == State::Starting {
            self.spawned_at = Some(now);
        }
    }

    /// The process ended and was reaped.
    pub fn ended(&mut self, success: bool, now: Instant) {
        let then = if let State::Dying(_, then) = self.state { then } else { Then::Policy };
        match then {
            Then::Policy => self.end_by_policy(success, now),
            Then::Respawn => {
                self.failures = 0;
                self.state = State::Waiting(now);
            }
            Then::Hold => self.state = State::Held,
            Then::End => self.state = State::Ended,
        }
    }

    fn end_by_policy(&mut self, success: bool, now: Instant) {
        // From when it was ready: a start that takes long and fails is no health.
        if self.ready_at.is_some_and(|t| now.saturating_duration_since(t) >= self.limits.policy.healthy) {
            self.failures = 0;
        }
        let again = match self.restart {
            Restart::Always => true,
            Restart::OnFailure => !success,
            Restart::Never => false,
        };
        if again {
            self.failures = self.failures.saturating_add(1);
            self.state = State::Waiting(now + self.limits.policy.delay(self.failures));
        } else {
            self.state = State::Ended;
        }
    }

    /// A human wants a new process.
    ///
    /// # Errors
    /// When the service is held.
    pub fn restart(&mut self, now: Instant) -> Result<Option<Action>, &'static str> {
        match self.state {
            State::Held | State::Dying(_, Then::Hold) => Err("it is held; release it instead"),
            State::Waiting(_) | State::Ended => {
                self.failures = 0;
                self.state = State::Waiting(now);
                Ok(None)
            }
            State::Starting | State::Running => Ok(Some(self.die(Then::Respawn, self.limits.stop, now))),
            State::Dying(at, _) => {
                self.state = State::Dying(at, Then::Respawn);
                Ok(None)
            }
        }
    }

    /// A human wants no process until it is released.
    ///
    /// # Errors
    /// When the service is held already.
    pub fn hold(&mut self, now: Instant) -> Result<Option<Action>, &'static str> {
        match self.state {
            State::Held | State::Dying(_, Then::Hold) => Err("it is held already"),
            State::Waiting(_) | State::Ended => {
                self.state = State::Held;
                Ok(None)
            }
            State::Starting | State::Running => Ok(Some(self.die(Then::Hold, self.limits.stop, now))),
            State::Dying(at, _) => {
                self.state = State::Dying(at, Then::Hold);
                Ok(None)
            }
        }
    }

    /// A human no longer wants it held.
    ///
    /// # Errors
    /// When the service is not held.
    pub fn release(&mut self, now: Instant) -> Result<(), &'static str> {
        match self.state {
            State::Held => self.state = State::Waiting(now),
            State::Dying(at, Then::Hold) => self.state = State::Dying(at, Then::Respawn),
            _ => return Err("it is not held"),
        }
        self.failures = 0;
        Ok(())
    }

    /// The system stops: end, and stay away. `limit` bounds the patience.
    pub fn stop(&mut self, limit: Duration, now: Instant) -> Option<Action> {
        match self.state {
            State::Waiting(_) | State::Held | State::Ended => {
                self.state = State::Ended;
                None
            }
            State::Starting | State::Running => Some(self.die(Then::End, limit, now)),
            State::Dying(at, _) => {
                self.state = State::Dying(at.map(|at| at.min(now + limit)), Then::End);
                None
            }
        }
    }

    fn die(&mut self, then: Then, limit: Duration, now: Instant) -> Action {
        self.state = State::Dying(Some(now + limit), then);
        Action::Terminate
    }

    /// Whether a process is being awaited that is not ready yet.
    #[must_use]
    pub fn is_starting(&self) -> bool {
        self.state == State::Starting
    }

    /// The state in one word: waiting, failing, starting, running, stopping, held or ended.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self.state {
            State::Waiting(_) | State::Starting if self.failures >= FAILING_AFTER => "failing",
            State::Waiting(_) => "waiting",
            State::Starting => "starting",
            State::Running => "running",
            State::Dying(..) => "stopping",
            State::Held => "held",
            State::Ended => "ended",
        }
    }

    /// Which start the next process is, from 0.
    #[must_use]
    pub fn incarnation(&self) -> u32 {
        self.spawns
    }

    /// Processes started after the first.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Time since the last spawn.
    #[must_use]
    pub fn age(&self, now: Instant) -> Option<Duration> {
        self.spawned_at.map(|t| now.saturating_duration_since(t))
    }

    /// Time since the last beat.
    #[must_use]
    pub fn beat_age(&self, now: Instant) -> Option<Duration> {
        self.beat_at.map(|t| now.saturating_duration_since(t))
    }
}

#[cfg(test)]
mod tests;
