//! The other end of the control socket, for the command line.

use crate::place::{control_socket, warden_at_work};
use crate::protocol::{Request, Response, ServiceRow};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The supervisor answers within one turn of its loop.
const PATIENCE: Duration = Duration::from_secs(5);
/// How often a wait looks again.
const GLANCE: Duration = Duration::from_millis(10);

/// Why there is no good answer.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Nobody listens.
    #[error("no system runs in {}: {source}", .run_dir.display())]
    NotRunning {
        /// Where one was looked for.
        run_dir: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The supervisor has died, and its warden brings the system to its end.
    #[error("{}: nobody takes orders here any more: it is in the hands of {warden}", .run_dir.display())]
    Orphaned {
        /// The run directory.
        run_dir: PathBuf,
        /// Process id and what it does.
        warden: String,
    },
    /// The connection broke or the answer took too long.
    #[error("the supervisor does not answer: {0}")]
    Broken(std::io::Error),
    /// An answer that this build does not understand.
    #[error("the supervisor's answer makes no sense: {0}")]
    Nonsense(String),
    /// A refusal, in the supervisor's words.
    #[error("{0}")]
    Refused(String),
    /// A service did not come up again.
    #[error("{service} is {state}: {why}")]
    NotUp {
        /// The service.
        service: String,
        /// Its state.
        state: String,
        /// How its last process ended.
        why: String,
    },
}

/// How the system is.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Overview {
    /// Whether something flies.
    pub airborne: bool,
    /// running, landing or stopping.
    pub phase: String,
    /// Process id of the warden, which lands the aircraft should the supervisor die; absent while one is being started.
    pub warden: Option<u32>,
    /// In the order of start.
    pub services: Vec<ServiceRow>,
}

/// A connection to a running supervisor.
#[derive(Debug)]
pub struct Client {
    stream: BufReader<UnixStream>,
}

impl Client {
    /// Connects to the system that runs in a run directory.
    ///
    /// # Errors
    /// [`ClientError::NotRunning`], [`ClientError::Orphaned`].
    pub fn connect(run_dir: &Path) -> Result<Self, ClientError> {
        let failed = |source| match warden_at_work(run_dir) {
            Some(warden) => ClientError::Orphaned { run_dir: run_dir.to_owned(), warden },
            None => ClientError::NotRunning { run_dir: run_dir.to_owned(), source },
        };
        let stream = UnixStream::connect(control_socket(run_dir)).map_err(failed)?;
        stream.set_read_timeout(Some(PATIENCE)).map_err(ClientError::Broken)?;
        stream.set_write_timeout(Some(PATIENCE)).map_err(ClientError::Broken)?;
        Ok(Self { stream: BufReader::new(stream) })
    }

    /// Asks and waits for the answer.
    ///
    /// # Errors
    /// A refusal, a broken connection or an answer that makes no sense.
    pub fn ask(&mut self, request: &Request) -> Result<Response, ClientError> {
        let mut line = serde_json::to_string(request).map_err(|e| ClientError::Nonsense(e.to_string()))?;
        line.push('\n');
        self.stream.get_mut().write_all(line.as_bytes()).map_err(ClientError::Broken)?;
        let mut answer = String::new();
        if self.stream.read_line(&mut answer).map_err(ClientError::Broken)? == 0 {
            return Err(ClientError::Broken(std::io::ErrorKind::UnexpectedEof.into()));
        }
        match serde_json::from_str(&answer) {
            Ok(Response::Refused { reason }) => Err(ClientError::Refused(reason)),
            Ok(response) => Ok(response),
            Err(error) => Err(ClientError::Nonsense(error.to_string())),
        }
    }

    /// How the services are.
    ///
    /// # Errors
    /// As [`Client::ask`].
    pub fn ps(&mut self) -> Result<Overview, ClientError> {
        match self.ask(&Request::Ps)? {
            Response::Services { airborne, phase, warden, services } => {
                Ok(Overview { airborne, phase, warden, services })
            }
            other => Err(ClientError::Nonsense(format!("{other:?}"))),
        }
    }

    /// How one service is.
    ///
    /// # Errors
    /// As [`Client::ask`]; also when there is no such service.
    pub fn service(&mut self, name: &str) -> Result<ServiceRow, ClientError> {
        self.ps()?
            .services
            .into_iter()
            .find(|row| row.name == name)
            .ok_or_else(|| ClientError::Refused(format!("there is no service {name}")))
    }

    fn done(&mut self, request: &Request) -> Result<String, ClientError> {
        match self.ask(request)? {
            Response::Done { text } => Ok(text),
            other => Err(ClientError::Nonsense(format!("{other:?}"))),
        }
    }

    /// Restarts a service and waits until the new process is ready, at most `patience`.
    ///
    /// # Errors
    /// As [`Client::ask`]; also when the new process does not become ready.
    pub fn restart(
        &mut self,
        service: &str,
        in_flight: bool,
        patience: Duration,
    ) -> Result<ServiceRow, ClientError> {
        let before = self.service(service)?.incarnation;
        self.done(&Request::Restart { service: service.to_owned(), in_flight })?;
        self.wait_for(service, patience, |row| row.state == "running" && row.incarnation > before)
    }

    /// Starts every service anew and waits until each is ready, at most `patience` for each.
    ///
    /// # Errors
    /// As [`Client::ask`]; also when one does not become ready.
    pub fn reload(&mut self, patience: Duration) -> Result<Overview, ClientError> {
        let before = self.ps()?;
        self.done(&Request::Reload)?;
        for old in before.services.iter().filter(|row| row.state != "held") {
            self.wait_for(&old.name, patience, |row| {
                row.state == "running" && row.incarnation > old.incarnation
            })?;
        }
        self.ps()
    }

    /// Ends a service until it is released; waits until it has ended, at most `patience`.
    ///
    /// # Errors
    /// As [`Client::ask`]; also when it does not end.
    pub fn hold(
        &mut self,
        service: &str,
        in_flight: bool,
        patience: Duration,
    ) -> Result<ServiceRow, ClientError> {
        self.done(&Request::Hold { service: service.to_owned(), in_flight })?;
        self.wait_for(service, patience, |row| row.state == "held")
    }

    /// Starts a held service and waits until it is ready, at most `patience`.
    ///
    /// # Errors
    /// As [`Client::ask`]; also when it does not become ready.
    pub fn release(&mut self, service: &str, patience: Duration) -> Result<ServiceRow, ClientError> {
        self.done(&Request::Release { service: service.to_owned() })?;
        self.wait_for(service, patience, |row| row.state == "running")
    }

    /// Waits until a service is as wanted; gives up early when it fails or has ended for good.
    ///
    /// # Errors
    /// [`ClientError::NotUp`], or as [`Client::ask`].
    pub fn wait_for(
        &mut self,
        service: &str,
        patience: Duration,
        wanted: impl Fn(&ServiceRow) -> bool,
    ) -> Result<ServiceRow, ClientError> {
        let deadline = Instant::now() + patience;
        loop {
            let row = self.service(service)?;
            if wanted(&row) {
                return Ok(row);
            }
            if matches!(row.state.as_str(), "failing" | "ended") || Instant::now() >= deadline {
                let why = if row.last_end.is_empty() { row.status } else { row.last_end };
                return Err(ClientError::NotUp { service: row.name, state: row.state, why });
            }
            std::thread::sleep(GLANCE);
        }
    }

    /// The newest lines of a service's log, or of the supervisor's own (`supervisor`).
    ///
    /// # Errors
    /// As [`Client::ask`].
    pub fn logs(&mut self, service: &str, lines: usize) -> Result<Vec<String>, ClientError> {
        match self.ask(&Request::Logs { service: service.to_owned(), lines })? {
            Response::Logs { lines } => Ok(lines),
            other => Err(ClientError::Nonsense(format!("{other:?}"))),
        }
    }

    /// Lands and stops everything (`now`: without landing); waits at most `patience` until nothing is left.
    ///
    /// # Errors
    /// As [`Client::ask`]; also when it is not over in time.
    pub fn stop(mut self, now: bool, patience: Duration) -> Result<(), ClientError> {
        self.done(&Request::Stop { now })?;
        self.stream.get_mut().set_read_timeout(Some(patience)).map_err(ClientError::Broken)?;
        // The supervisor closes the connection as the last thing it does.
        let mut rest = Vec::new();
        match self.stream.read_to_end(&mut rest) {
            Ok(_) => Ok(()),
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionReset => Ok(()),
            Err(error) => Err(ClientError::Broken(error)),
        }
    }
}
