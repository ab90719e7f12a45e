//! What the warden does, as a table of states: waiting, looking, landing, ending. Pure: time is an argument, processes
//! and shared memory are somebody else's.

use crate::landing::{Descent, Landing};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

/// How long a pilot that is said to be on the ground is listened to before that is believed: it speaks five times a
/// second, and what is known may be as old as the warden itself.
const LOOK: Duration = Duration::from_millis(600);
/// Patience with each service when there is a hurry.
const HURRY: Duration = Duration::from_millis(500);

/// Time limits of the warden's work.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Of a landing.
    pub(crate) land: Duration,
    /// From being told to end to being killed, for each service.
    pub(crate) stop: Duration,
}

/// What is to be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Task {
    /// It flies: say so. Orders follow.
    Land,
    /// Tell the pilot to land.
    Order(u32),
    /// Nothing flies any more, or nobody waits any longer: say so. The ends follow.
    End(&'static str),
    /// Tell the processes of a service to end (SIGTERM).
    Terminate(String),
    /// They did not (SIGKILL).
    Kill(String),
    /// Nothing is left but files.
    Leave,
}

#[derive(Debug)]
enum State {
    /// The supervisor lives.
    Waiting,
    /// It has died; whether something flies is still to be heard, until then.
    Looking(Instant),
    Landing(Landing),
    Ending,
    Over,
}

/// One service on its way to its end.
#[derive(Debug)]
struct Ending {
    service: String,
    /// When it is killed; absent while it has not been told to end.
    kill_at: Option<Instant>,
}

/// The warden's work.
#[derive(Debug)]
pub(crate) struct Watch {
    limits: Limits,
    state: State,
    /// In the order in which they are ended.
    services: Vec<Ending>,
    hurry: bool,
}

impl Watch {
    /// While the supervisor lives; `services` in the order in which it starts them.
    pub(crate) fn new(limits: Limits, services: impl DoubleEndedIterator<Item = String>) -> Self {
        let services = services.rev().map(|service| Ending { service, kill_at: None }).collect();
        Self { limits, state: State::Waiting, services, hurry: false }
    }

    /// The supervisor has died.
    pub(crate) fn orphaned(&mut self, now: Instant) {
        if matches!(self.state, State::Waiting) {
            self.state = State::Looking(now + LOOK);
        }
    }

    /// Somebody does not want to wait. Means nothing while the supervisor lives: it is its to say.
    pub(crate) fn hurry(&mut self) {
        self.hurry |= !matches!(self.state, State::Waiting);
    }

    /// Whether it is time to look which processes are left.
    pub(crate) fn is_ending(&self) -> bool {
        matches!(self.state, State::Ending)
    }

    /// What is due by now; to be asked until there is nothing more. `order` is the number of a new order, `living` the
    /// services that have processes, of interest when [`Watch::is_ending`].
    pub(crate) fn due(
        &mut self,
        airborne: bool,
        order: u32,
        living: &BTreeSet<String>,
        now: Instant,
    ) -> Option<Task> {
        match &mut self.state {
            State::Waiting | State::Over => None,
            State::Looking(_) | State::Landing(_) if self.hurry => self.end("told not to wait"),
            State::Looking(_) if airborne => {
                self.state = State::Landing(Landing::new(self.limits.land, order, now));
                Some(Task::Land)
            }
            State::Looking(until) if now >= *until => self.end("nothing flies"),
            State::Looking(_) => None,
            State::Landing(landing) => match landing.due(airborne, now)? {
                Descent::Order(order) => Some(Task::Order(order)),
                Descent::Landed => self.end("landed"),
                Descent::Late => self.end("not landed in time"),
            },
            State::Ending => self.next_end(living, now),
        }
    }

    fn end(&mut self, why: &'static str) -> Option<Task> {
        self.state = State::Ending;
        Some(Task::End(why))
    }

    /// One by one, the last started first; all together in a hurry.
    fn next_end(&mut self, living: &BTreeSet<String>, now: Instant) -> Option<Task> {
        self.services.retain(|ending| living.contains(&ending.service));
        for service in living {
            // Of no service that is known here: nobody needs it.
            if !self.services.iter().any(|ending| ending.service == *service) {
                self.services.insert(0, Ending { service: service.clone(), kill_at: None });
            }
        }
        if self.services.is_empty() {
            self.state = State::Over;
            return Some(Task::Leave);
        }
        let patience = if self.hurry { self.limits.stop.min(HURRY) } else { self.limits.stop };
        let at_a_time = if self.hurry { usize::MAX } else { 1 };
        for ending in self.services.iter_mut().take(at_a_time) {
            // A hurry shortens what was granted before it.
            ending.kill_at = ending.kill_at.map(|at| at.min(now + patience));
            match ending.kill_at {
                None => {
                    ending.kill_at = Some(now + patience);
                    return Some(Task::Terminate(ending.service.clone()));
                }
                Some(at) if now >= at => {
                    // Again and again: what it starts in the meantime is killed too.
                    ending.kill_at = Some(now + patience);
                    return Some(Task::Kill(ending.service.clone()));
                }
                Some(_) => {}
            }
        }
        None
    }
}

#[cfg(test)]
mod tests;
