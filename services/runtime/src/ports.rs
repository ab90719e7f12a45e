//! All ports of one service, checked against the manifest as they are opened.

use crate::counters::{InputStats, OutputStats};
use crate::device::{ByteDevice, Devices};
use crate::journal::{Cursor, Taken};
use crate::lockstep::bus::Bus;
use crate::port::{InputKind, OutputKind, StepContext};
use crate::shm::SharedNode;
use crate::{Input, Limits, Output, StartError, Waker, access, name_hash};
use ipc_types::{Message, Run};
use manifest::{Manifest, Subscription};
use std::cell::Cell;
use std::rc::Rc;

pub(crate) enum BusKind {
    Shared(Rc<SharedNode>),
    Lockstep(Rc<Bus>),
}

/// The ports of one service, checked against the manifest as they are opened.
pub struct Ports {
    pub(crate) bus: BusKind,
    pub(crate) service: String,
    pub(crate) manifest: Rc<Manifest>,
    pub(crate) context: Rc<StepContext>,
    /// What the present step has taken.
    pub(crate) taken: Rc<Taken>,
    pub(crate) inputs: Vec<Rc<InputStats>>,
    pub(crate) outputs: Vec<Rc<OutputStats>>,
    /// Topics that were opened, to read or to publish.
    pub(crate) opened: Vec<String>,
    pub(crate) devices: Box<dyn Devices>,
    /// Topics for which the keeper holds something for this start of the service.
    pub(crate) retained: Vec<String>,
    /// Topics of `retained` that the keeper did not hand over in time.
    pub(crate) forgotten: Vec<&'static str>,
    /// What wakes the service from outside the bus, if it wants to be.
    pub(crate) waker: Option<Waker>,
}

impl Ports {
    /// Ports of `service`, none of them open yet. `retained` are the topics for which the keeper holds something.
    pub(crate) fn new(
        bus: BusKind,
        manifest: Rc<Manifest>,
        service: &str,
        (incarnation, now): (u32, u64),
        retained: Vec<String>,
        devices: Box<dyn Devices>,
    ) -> Self {
        Self {
            bus,
            service: service.to_owned(),
            manifest,
            context: StepContext::new(service, incarnation, now),
            taken: Rc::default(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            opened: Vec::new(),
            devices,
            retained,
            forgotten: Vec::new(),
            waker: None,
        }
    }

    /// What is published from now on bears this incarnation: for programs that play a service which was started again.
    pub fn set_incarnation(&self, incarnation: u32) {
        self.context.incarnation.set(incarnation);
    }

    fn refuse(&self, action: &'static str, topic: &str) -> StartError {
        StartError::Port { service: self.service.clone(), action, topic: topic.to_owned() }
    }

    /// An input of the topic of `T`, as deep as the manifest says.
    ///
    /// # Errors
    /// When the manifest does not list the topic for this service or wants it deeper than [`Limits::of`], or shared
    /// memory refuses.
    pub fn input<T: Message>(&mut self) -> Result<Input<T>, StartError> {
        self.input_of(T::TOPIC)
    }

    /// An input of one topic of a family, such as `health/sonar`.
    ///
    /// # Errors
    /// As [`Ports::input`].
    pub fn input_of<T: Message>(&mut self, topic: &str) -> Result<Input<T>, StartError> {
        let most = Limits::of::<T>().depth;
        let subscription = access::subscription(&self.manifest, &self.service, topic, most);
        let Some(Subscription { depth, wake }) = subscription else {
            return Err(self.refuse("subscribe", topic));
        };
        if !(1..=most).contains(&depth) {
            return Err(StartError::Manifest(format!(
                "{}: service.{}.subscribes.\"{topic}\".depth = {depth}: allowed is 1 to {most} for messages of this size",
                self.manifest.file, self.service
            )));
        }
        let kind = match &self.bus {
            BusKind::Shared(node) => InputKind::Shared(node.input(topic, depth)?),
            BusKind::Lockstep(bus) => InputKind::Lockstep(bus.input(topic, depth, &self.service, wake)),
        };
        self.opened.push(topic.to_owned());
        let port = u16::try_from(self.inputs.len()).unwrap_or(Run::KEEPER);
        let stats = Rc::new(InputStats::new(port, name_hash(topic), Rc::clone(&self.taken)));
        self.inputs.push(Rc::clone(&stats));
        Ok(Input { kind, stats })
    }

    /// The output of the topic of `T`.
    ///
    /// # Errors
    /// When the manifest does not list the topic for this service, or shared memory refuses.
    pub fn output<T: Message>(&mut self) -> Result<Output<T>, StartError> {
        self.output_of(T::TOPIC)
    }

    /// The output of one topic of a family, such as `health/sonar`.
    ///
    /// # Errors
    /// As [`Ports::output`].
    pub fn output_of<T: Message>(&mut self, topic: &str) -> Result<Output<T>, StartError> {
        if !access::may_publish(&self.manifest, &self.service, topic) {
            return Err(self.refuse("publish", topic));
        }
        let kind = match &self.bus {
            BusKind::Shared(node) => OutputKind::Shared(node.output(topic, &self.manifest)?),
            BusKind::Lockstep(bus) => OutputKind::Lockstep(bus.output(topic)),
        };
        let stats =
            Rc::new(OutputStats::with_deadline(access::deadline_ns(&self.manifest, &self.service, topic)));
        self.opened.push(topic.to_owned());
        self.outputs.push(Rc::clone(&stats));
        Ok(Output { kind, context: Rc::clone(&self.context), sequence: Rc::new(Cell::new(0)), stats })
    }

    /// Checks that the service has opened every topic that the manifest lists for it: the picture of the wiring is
    /// only worth something if it shows what is, no more and no less. Devices are left out, as a vehicle may lack one.
    ///
    /// # Errors
    /// Names the first that was not opened.
    pub(crate) fn check_all_opened(&self) -> Result<(), StartError> {
        let Some(entry) = self.manifest.services.get(&self.service) else { return Ok(()) };
        let read = entry.subscribes.keys().map(|topic| ("subscribes", topic));
        let published = entry.publishes.keys().map(|topic| ("publishes", topic));
        match read.chain(published).find(|(_, topic)| !self.opened.contains(topic)) {
            None => Ok(()),
            Some((how, topic)) => Err(StartError::Manifest(format!(
                "{}: service.{}.{how}.\"{topic}\": the service does not open it; the manifest must not list it",
                self.manifest.file, self.service
            ))),
        }
    }

    /// Whether the manifest gives this service the device.
    #[must_use]
    pub fn has_device(&self, name: &str) -> bool {
        access::device(&self.manifest, &self.service, name).is_some()
    }

    /// The device that the manifest calls `name` for this service.
    ///
    /// # Errors
    /// When the manifest does not list it, or there can be no such device.
    pub fn device(&mut self, name: &str) -> Result<Box<dyn ByteDevice>, StartError> {
        let Some(path) = access::device(&self.manifest, &self.service, name) else {
            return Err(self.refuse("use device", name));
        };
        match &self.bus {
            BusKind::Lockstep(bus) => Ok(bus.device(name)),
            BusKind::Shared(node) => {
                let path = node.device_path(path)?;
                self.devices.device(name, &path)
            }
        }
    }

    /// What another thread of this service wakes it by, when something comes that is on no topic.
    ///
    /// # Errors
    /// When the system has no descriptor left.
    pub fn waker(&mut self) -> Result<Waker, StartError> {
        if let Some(waker) = &self.waker {
            return Ok(waker.clone());
        }
        let waker = Waker::new()?;
        self.waker = Some(waker.clone());
        Ok(waker)
    }

    /// The topics that the manifest lets this service read; none for a tool, which may read almost all.
    #[must_use]
    pub fn readable(&self) -> Vec<String> {
        let entry = self.manifest.services.get(&self.service);
        entry.map(|service| service.subscribes.keys().cloned().collect()).unwrap_or_default()
    }

    /// Whether the manifest lets this service publish a topic.
    #[must_use]
    pub fn may_publish(&self, topic: &str) -> bool {
        access::may_publish(&self.manifest, &self.service, topic)
    }

    /// After a restart: the last valid sample of a retained topic, from the keeper. `None` at the first
    /// start, and when nothing was ever published.
    ///
    /// # Errors
    /// When shared memory refuses.
    pub fn retained<T: Message>(&mut self) -> Result<Option<Box<T>>, StartError> {
        if !self.retained.iter().any(|topic| topic == T::TOPIC) {
            return Ok(None);
        }
        let kept: Option<Box<T>> = match &self.bus {
            BusKind::Shared(node) => node.retained()?,
            BusKind::Lockstep(bus) => bus.retained(),
        };
        match &kept {
            Some(sample) => {
                self.taken.note(&Cursor::default(), Run::KEEPER, name_hash(T::TOPIC), sample.header());
            }
            None => self.forgotten.push(T::TOPIC),
        }
        Ok(kept)
    }
}
