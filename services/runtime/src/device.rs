//! Devices are ports too: bytes in, bytes out, never blocking.

use crate::StartError;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

/// A device failed; it is closed and may be opened again.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DeviceError(pub String);

/// A stream of bytes to and from a device.
pub trait ByteDevice {
    /// Whether bytes can flow.
    fn is_open(&self) -> bool;
    /// Tries to open it (again).
    ///
    /// # Errors
    /// Says why not: missing, busy, no permission.
    fn open(&mut self) -> Result<(), DeviceError>;
    /// Closes it.
    fn close(&mut self);
    /// Takes what has arrived; `Ok(0)` when nothing has. Never blocks.
    ///
    /// # Errors
    /// The device is gone; it is closed now.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, DeviceError>;
    /// Sends as much as the device takes now. Never blocks.
    ///
    /// # Errors
    /// The device is gone; it is closed now.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, DeviceError>;
}

/// Opens the devices that a process may touch; given to [`crate::main`].
pub trait Devices {
    /// The device called `name` in the manifest, at `path`.
    ///
    /// # Errors
    /// [`StartError::Device`] when there can be no such device; a device that is merely absent now is
    /// returned closed.
    fn device(&mut self, name: &str, path: &str) -> Result<Box<dyn ByteDevice>, StartError>;
}

/// For services that touch no device.
#[derive(Debug, Clone, Copy)]
pub struct NoDevices;

impl Devices for NoDevices {
    fn device(&mut self, name: &str, path: &str) -> Result<Box<dyn ByteDevice>, StartError> {
        Err(StartError::Device {
            name: name.to_owned(),
            path: path.to_owned(),
            reason: "this service uses no devices".to_owned(),
        })
    }
}

/// Most bytes that wait in one direction of a [`MemoryDevice`]; more are lost, as in a serial driver.
const MEMORY_CAPACITY: usize = 4096;

/// One end of a wire between two services in lockstep.
#[derive(Debug)]
pub struct MemoryDevice {
    incoming: Rc<RefCell<VecDeque<u8>>>,
    outgoing: Rc<RefCell<VecDeque<u8>>>,
}

impl MemoryDevice {
    /// Both ends of a new wire.
    #[must_use]
    pub fn pair() -> (Self, Self) {
        let a = Rc::new(RefCell::new(VecDeque::with_capacity(MEMORY_CAPACITY)));
        let b = Rc::new(RefCell::new(VecDeque::with_capacity(MEMORY_CAPACITY)));
        (Self { incoming: Rc::clone(&a), outgoing: Rc::clone(&b) }, Self { incoming: b, outgoing: a })
    }
}

impl ByteDevice for MemoryDevice {
    fn is_open(&self) -> bool {
        true
    }
    fn open(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn close(&mut self) {}
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, DeviceError> {
        let mut incoming = self.incoming.borrow_mut();
        let count = buffer.len().min(incoming.len());
        for (slot, byte) in buffer.iter_mut().zip(incoming.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
    fn write(&mut self, bytes: &[u8]) -> Result<usize, DeviceError> {
        let mut outgoing = self.outgoing.borrow_mut();
        let count = bytes.len().min(MEMORY_CAPACITY - outgoing.len());
        outgoing.extend(&bytes[..count]);
        Ok(count)
    }
}
