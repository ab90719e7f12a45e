//! One service run again from its journal.

use super::bus::Bus;
use super::feed::Feed;
use crate::device::NoDevices;
use crate::ports::BusKind;
use crate::{Cache, Instance, Ports, Service, Start, StartError};
use ipc_types::{Message, Run, Trace};
use manifest::Manifest;
use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

/// A bus for one service that is run again, be it from a recording of processes or of a lockstep flight. The service
/// gets the messages that it is handed and no others; what it sends reaches those who listen, at once.
///
/// What came from a device stands in no journal: devices are there and silent.
pub struct Replay {
    bus: Rc<Bus>,
    manifest: Rc<Manifest>,
    /// Topics of which the keeper holds something.
    kept: RefCell<Vec<String>>,
}

/// All that was sent is visible at this time, however long it was on its way.
const LATE_NS: u64 = u64::MAX / 2;

impl Replay {
    /// A bus for the service called `service`; nothing runs yet.
    #[must_use]
    pub fn new(manifest: Manifest, service: &str) -> Self {
        let bus = Bus::with_feed(0, Some(Feed::new(service)));
        bus.set_now(LATE_NS);
        Self { bus, manifest: Rc::new(manifest), kept: RefCell::default() }
    }

    /// Hands over a message of a [`Run`] with the header that it has; before the start for what the start took. False
    /// when the service's input reads another topic: it is not the service that kept the journal.
    #[must_use]
    pub fn give<T: Message>(&self, run: &Run, message: &T) -> bool {
        let mut slot = bytemuck::allocation::zeroed_rc::<T>();
        // This is its only owner, so nothing is copied but the message; and that not by way of the stack.
        bytemuck::bytes_of_mut(Rc::make_mut(&mut slot)).copy_from_slice(bytemuck::bytes_of(message));
        if run.port == Run::KEEPER {
            self.bus.keep(slot);
            self.kept.borrow_mut().push(T::TOPIC.to_owned());
            return true;
        }
        self.bus.feed().is_some_and(|feed| feed.give(run.port, slot))
    }

    /// Starts the service as the journal's entry of the start says. `root` is the directory that the manifest's paths
    /// start from.
    ///
    /// # Errors
    /// As the service's own start; also when this bus is for another service, or a message that the start took belongs
    /// to no input of the service.
    pub fn start<S: Service>(
        &self,
        config: S::Config,
        root: &Path,
        cache: Cache,
        entry: &Trace,
    ) -> Result<Instance<S>, StartError> {
        let Some(feed) = self.bus.feed().filter(|feed| feed.is_of(S::NAME)) else {
            return Err(StartError::Invalid(format!("this replay is not one of {}", S::NAME)));
        };
        let incarnation = entry.header.incarnation;
        let system = self.manifest.system.clone();
        let simulated = system.simulated;
        let start = Start::new(system, root, entry.seed, incarnation, simulated, cache)?;
        let ports = self.ports(S::NAME, incarnation, entry.now_ns, self.kept.take());
        let instance = Instance::start(config, entry.config, ports, &start)?;
        if feed.is_placed() {
            Ok(instance)
        } else {
            Err(StartError::Invalid(format!("{}: its journal names inputs that it does not have", S::NAME)))
        }
    }

    /// Ports for a program that listens. To be opened before the start, so that nothing is missed.
    #[must_use]
    pub fn tool(&self, name: &str) -> Ports {
        self.ports(name, 0, LATE_NS, Vec::new())
    }

    fn ports(&self, name: &str, incarnation: u32, now: u64, kept: Vec<String>) -> Ports {
        Ports::new(
            BusKind::Lockstep(Rc::clone(&self.bus)),
            Rc::clone(&self.manifest),
            name,
            (incarnation, now),
            kept,
            Box::new(NoDevices),
        )
    }
}
