//! The control socket: who asks, what is asked, what is still to be sent. Never blocks.

use crate::error::{SupervisorError, while_doing};
use crate::protocol::{Request, Response};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;

/// More at once is a mistake of somebody's script.
const CONNECTIONS: usize = 16;
/// Longest request: names and numbers.
const REQUEST: usize = 4096;
/// A reader that lets so much wait is not reading.
const WAITING: usize = 4 << 20;

#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) stream: UnixStream,
    input: Vec<u8>,
    output: Vec<u8>,
    open: bool,
}

impl Connection {
    pub(crate) fn has_output(&self) -> bool {
        !self.output.is_empty()
    }
}

/// The listening socket and its connections.
#[derive(Debug)]
pub(crate) struct Control {
    pub(crate) listener: UnixListener,
    pub(crate) connections: Vec<Connection>,
}

impl Control {
    pub(crate) fn bind(path: &Path) -> Result<Self, SupervisorError> {
        let doing = || format!("control socket {}", path.display());
        let listener = UnixListener::bind(path).map_err(while_doing(doing()))?;
        listener.set_nonblocking(true).map_err(while_doing(doing()))?;
        let private = std::fs::Permissions::from_mode(0o600);
        std::fs::set_permissions(path, private).map_err(while_doing(doing()))?;
        Ok(Self { listener, connections: Vec::new() })
    }

    /// Takes everybody who waits at the door.
    pub(crate) fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            if self.connections.len() < CONNECTIONS && stream.set_nonblocking(true).is_ok() {
                self.connections.push(Connection {
                    stream,
                    input: Vec::new(),
                    output: Vec::new(),
                    open: true,
                });
            }
        }
    }

    /// The next whole request of a connection, if there is one.
    pub(crate) fn next_request(&mut self, index: usize) -> Option<Result<Request, String>> {
        let connection = self.connections.get_mut(index)?;
        loop {
            if let Some(end) = connection.input.iter().position(|b| *b == b'\n') {
                let line: Vec<u8> = connection.input.drain(..=end).collect();
                return Some(serde_json::from_slice(&line).map_err(|e| format!("not understood: {e}")));
            }
            if connection.input.len() > REQUEST {
                connection.open = false;
                return None;
            }
            let mut buffer = [0_u8; REQUEST];
            match connection.stream.read(&mut buffer) {
                Ok(0) => connection.open = false,
                Ok(count) => {
                    connection.input.extend_from_slice(&buffer[..count]);
                    continue;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(_) => connection.open = false,
            }
            return None;
        }
    }

    pub(crate) fn answer(&mut self, index: usize, response: &Response) {
        if let Some(connection) = self.connections.get_mut(index)
            && let Ok(line) = serde_json::to_vec(response)
        {
            connection.output.extend_from_slice(&line);
            connection.output.push(b'\n');
            connection.open &= connection.output.len() <= WAITING;
        }
    }

    /// Sends what can be sent now and forgets who has left.
    pub(crate) fn flush(&mut self) {
        for connection in &mut self.connections {
            while !connection.output.is_empty() {
                match connection.stream.write(&connection.output) {
                    Ok(count) if count > 0 => drop(connection.output.drain(..count)),
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                    _ => {
                        connection.open = false;
                        break;
                    }
                }
            }
        }
        self.connections.retain(|connection| connection.open);
    }
}
