//! A serial port as a device: 115200 baud, locked against other programs, never blocking, opened again when
//! it vanishes and returns.

use runtime::{ByteDevice, DeviceError, Devices, StartError};
use serialport::{SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::os::fd::{AsRawFd, BorrowedFd};
use std::time::Duration;

/// What flight controllers and flow sensors use for MSP.
const BAUD: u32 = 115_200;

/// Opens the serial ports that the manifest names.
#[derive(Debug, Clone, Copy)]
pub struct SerialPorts;

impl Devices for SerialPorts {
    fn device(&mut self, _name: &str, path: &str) -> Result<Box<dyn ByteDevice>, StartError> {
        Ok(Box::new(SerialDevice::new(path)))
    }
}

/// One serial port.
#[derive(Debug)]
pub struct SerialDevice {
    path: String,
    port: Option<TTYPort>,
}

impl SerialDevice {
    /// The port at `path`, not opened yet.
    #[must_use]
    pub fn new(path: &str) -> Self {
        Self { path: path.to_owned(), port: None }
    }

    fn lost(&mut self, reason: &dyn std::fmt::Display) -> DeviceError {
        self.port = None;
        DeviceError(format!("{}: {reason}", self.path))
    }

    /// What came of an attempt to read or write.
    fn outcome(&mut self, result: std::io::Result<usize>) -> Result<usize, DeviceError> {
        match result {
            Ok(count) => Ok(count),
            Err(error) => match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(0),
                _ => Err(self.lost(&error)),
            },
        }
    }
}

impl ByteDevice for SerialDevice {
    fn is_open(&self) -> bool {
        self.port.is_some()
    }

    fn open(&mut self) -> Result<(), DeviceError> {
        if self.port.is_some() {
            return Ok(());
        }
        let builder = serialport::new(&self.path, BAUD).timeout(Duration::ZERO);
        let port = match TTYPort::open(&builder) {
            Ok(port) => port,
            Err(error) => {
                let reason = match error.kind() {
                    serialport::ErrorKind::NoDevice => "busy: another program holds it".to_owned(),
                    serialport::ErrorKind::Io(ErrorKind::NotFound) => "no such port".to_owned(),
                    _ => error.to_string(),
                };
                return Err(self.lost(&reason));
            }
        };
        never_block(&port).map_err(|error| self.lost(&error))?;
        // What lay in the buffers is from before.
        let _ = port.clear(serialport::ClearBuffer::All);
        self.port = Some(port);
        Ok(())
    }

    fn close(&mut self) {
        self.port = None;
    }

    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, DeviceError> {
        match &mut self.port {
            Some(port) => {
                let result = port.read(buffer);
                self.outcome(result)
            }
            None => Ok(0),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, DeviceError> {
        match &mut self.port {
            Some(port) => {
                let result = port.write(bytes);
                self.outcome(result)
            }
            None => Ok(0),
        }
    }
}

/// A timeout of zero bounds only the wait before a write: the write itself would wait for room, for ever when
/// the other end of a pseudo-terminal is stopped.
#[expect(unsafe_code, reason = "serialport lends its descriptor only as a number")]
fn never_block(port: &TTYPort) -> std::io::Result<()> {
    // SAFETY: `port` owns the descriptor and outlives the borrow, which ends with this function.
    let descriptor = unsafe { BorrowedFd::borrow_raw(port.as_raw_fd()) };
    let flags = rustix::fs::fcntl_getfl(descriptor)?;
    rustix::fs::fcntl_setfl(descriptor, flags | rustix::fs::OFlags::NONBLOCK)?;
    Ok(())
}
