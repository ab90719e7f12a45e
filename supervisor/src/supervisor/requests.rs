//! What is asked on the control socket, and when it is refused.

use super::{Phase, Supervisor};
use crate::life::{Action, Life};
use crate::protocol::{Request, Response};
use crate::shared::SharedMemory;
use manifest::Criticality;
use rustix::process::Signal;
use std::time::Instant;

/// Requests of one connection answered in one turn: nobody keeps the loop from its services.
const REQUESTS: usize = 8;

impl<S: SharedMemory> Supervisor<S> {
    /// Answers requests.
    pub(super) fn serve(&mut self, now: Instant) {
        self.control.accept();
        for index in 0..self.control.connections.len() {
            for _ in 0..REQUESTS {
                let Some(request) = self.control.next_request(index) else { break };
                let response = match request {
                    Ok(request) => self.answer(request, now),
                    Err(reason) => Response::Refused { reason },
                };
                self.control.answer(index, &response);
            }
        }
        self.control.flush();
    }

    fn answer(&mut self, request: Request, now: Instant) -> Response {
        let done = |text: String| Response::Done { text };
        match request {
            Request::Ping => Response::Pong {
                pid: std::process::id(),
                system: self.manifest.system.name.clone(),
                run_dir: self.around.run_dir.to_string_lossy().into_owned(),
                manifests: self.around.manifests.split(':').map(str::to_owned).collect(),
                simulated: self.manifest.system.simulated,
            },
            Request::Ps => Response::Services {
                airborne: self.shared.airborne(),
                phase: self.phase.word().to_owned(),
                warden: self.warden.pid(),
                services: self.children.iter().map(|child| child.row(now)).collect(),
            },
            Request::Logs { service, lines } if service == "supervisor" => {
                Response::Logs { lines: self.own_log.tail(lines) }
            }
            Request::Logs { service, lines } => {
                match self.children.iter().find(|c| c.entry.name == service) {
                    Some(child) => Response::Logs { lines: child.log.tail(lines) },
                    None => self.no_such(&service),
                }
            }
            Request::Stop { now: at_once } => {
                if self.phase == Phase::Running || at_once {
                    self.stop_wanted(at_once, now);
                }
                done(self.phase.word().to_owned())
            }
            Request::Restart { service, in_flight } => {
                self.change(&service, in_flight, now, "restart", |life| life.restart(now))
            }
            Request::Reload => self.reload(now),
            Request::Hold { service, in_flight } => {
                self.change(&service, in_flight, now, "hold", |life| life.hold(now))
            }
            Request::Release { service } => {
                self.change(&service, true, now, "release", |life| life.release(now).map(|()| None))
            }
        }
    }

    fn no_such(&self, service: &str) -> Response {
        let names: Vec<&str> = self.children.iter().map(|c| c.entry.name.as_str()).collect();
        Response::Refused { reason: format!("there is no service {service}; there are {}", names.join(", ")) }
    }

    /// Starts everything anew, unless something flies.
    fn reload(&mut self, now: Instant) -> Response {
        if self.phase != Phase::Running {
            return Response::Refused { reason: format!("the system is {}", self.phase.word()) };
        }
        if self.shared.airborne() {
            return Response::Refused { reason: "the drone flies: land first".to_owned() };
        }
        for child in &mut self.children {
            // What was kept belongs to the plan and the pad that were.
            child.forget_retained();
            // Who is held stays so.
            if let Ok(Some(Action::Terminate)) = child.life.restart(now) {
                child.signal(Signal::TERM);
            }
        }
        self.say("everything starts anew by request");
        self.act(now);
        Response::Done { text: "everything starts anew".to_owned() }
    }

    /// Changes the life of a service by order of a human, unless that would drop the aircraft.
    fn change(
        &mut self,
        service: &str,
        in_flight: bool,
        now: Instant,
        verb: &str,
        how: impl FnOnce(&mut Life) -> Result<Option<Action>, &'static str>,
    ) -> Response {
        let refused = |reason: String| Response::Refused { reason };
        if self.phase != Phase::Running {
            return refused(format!("the system is {}", self.phase.word()));
        }
        let airborne = self.shared.airborne();
        let Some(child) = self.children.iter_mut().find(|c| c.entry.name == service) else {
            return self.no_such(service);
        };
        if airborne && !in_flight && child.entry.criticality == Criticality::Flight {
            return refused(format!(
                "{service} keeps the aircraft in the air: land first, or {verb} it with --in-flight"
            ));
        }
        match how(&mut child.life) {
            Ok(action) => {
                if action == Some(Action::Terminate) {
                    child.signal(Signal::TERM);
                }
                self.say(&format!("{service}: {verb} by request"));
                self.act(now);
                Response::Done { text: format!("{service}: {verb}") }
            }
            Err(why) => refused(format!("{service}: {why}")),
        }
    }
}
