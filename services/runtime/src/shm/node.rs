//! One process's view of the shared memory: it opens, it never creates.

use super::names::RunDir;
use super::payload::Payload;
use super::ports::{SharedInput, SharedOutput};
use crate::port::Limits;
use crate::{StartError, access};
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::prelude::{
    AttributeSpecifier, AttributeVerifier, EventId, NodeName, ServiceName, SignalHandlingMode, ipc,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use ipc_types::Message;
use manifest::Manifest;
use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// The event that wakes a service.
pub(crate) const WAKE: EventId = EventId::new(1);
/// How long an open is retried: the supervisor may still be creating what is to be opened.
const OPEN_PATIENCE: Duration = Duration::from_secs(5);
/// How long a restarted service waits for the keeper, which answers within one turn of its loop.
const KEEPER_PATIENCE: Duration = Duration::from_millis(500);
const RETRY_PAUSE: Duration = Duration::from_millis(2);
/// Most processes of one system.
pub(crate) const MAX_NODES: usize = 48;

pub(crate) fn keeper_topic(topic: &str) -> String {
    format!("keeper/{topic}")
}

pub(crate) fn wake_name(service: &str) -> String {
    format!("wake/{service}")
}

/// One process in the shared memory of a system.
pub(crate) struct SharedNode {
    node: Node<ipc::Service>,
    run_dir: RunDir,
    simulated: bool,
    /// Outputs, to be told of late joiners between their own sends.
    refresh: RefCell<Vec<Box<dyn Fn()>>>,
}

pub(crate) fn service_name(name: &str) -> Result<ServiceName, StartError> {
    ServiceName::new(name).map_err(|_| StartError::SharedMemory(format!("{name} is no service name")))
}

fn layout_text<T: Message>() -> String {
    format!("{:016x}", T::LAYOUT)
}

fn attribute<T>(made: Result<T, impl std::fmt::Debug>) -> Result<T, StartError> {
    made.map_err(|error| StartError::SharedMemory(format!("layout attribute: {error:?}")))
}

/// The layout hash as an attribute that a service is created with.
pub(crate) fn layout_attribute<T: Message>() -> Result<AttributeSpecifier, StartError> {
    let key = attribute("layout".try_into())?;
    let value = attribute(layout_text::<T>().as_str().try_into())?;
    attribute(AttributeSpecifier::new().define(&key, &value))
}

/// The layout hash as an attribute that an existing service must have.
fn layout_requirement<T: Message>() -> Result<AttributeVerifier, StartError> {
    let key = attribute("layout".try_into())?;
    let value = attribute(layout_text::<T>().as_str().try_into())?;
    attribute(AttributeVerifier::new().require(&key, &value))
}

/// Tries until it works or patience ends.
fn patiently<T, E: std::fmt::Debug>(
    what: &str,
    mut attempt: impl FnMut() -> Result<T, E>,
    is_final: impl Fn(&E) -> bool,
) -> Result<T, StartError> {
    let began = Instant::now();
    loop {
        match attempt() {
            Ok(value) => return Ok(value),
            Err(error) if is_final(&error) || began.elapsed() > OPEN_PATIENCE => {
                return Err(StartError::SharedMemory(format!(
                    "cannot open {what} in shared memory: {error:?}"
                )));
            }
            Err(_) => std::thread::sleep(RETRY_PAUSE),
        }
    }
}

impl SharedNode {
    pub(crate) fn open(name: &str, run_dir: &RunDir, simulated: bool) -> Result<Rc<Self>, StartError> {
        let config = run_dir.iceoryx_config().map_err(|error| StartError::SharedMemory(error.to_string()))?;
        let node_name =
            NodeName::new(name).map_err(|_| StartError::SharedMemory(format!("{name} is no name")))?;
        let node = patiently(
            "a node",
            || {
                NodeBuilder::new()
                    .name(&node_name)
                    .config(&config)
                    .signal_handling_mode(SignalHandlingMode::Disabled)
                    .create::<ipc::Service>()
            },
            |_| false,
        )?;
        Ok(Rc::new(Self { node, run_dir: run_dir.clone(), simulated, refresh: RefCell::default() }))
    }

    pub(crate) fn node(&self) -> &Node<ipc::Service> {
        &self.node
    }

    fn topic<T: Message>(&self, name: &str) -> Result<PortFactory<ipc::Service, Payload<T>, ()>, StartError> {
        use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError as Error;
        let service = service_name(name)?;
        let layout = layout_requirement::<T>()?;
        patiently(
            name,
            || {
                self.node
                    .service_builder(&service)
                    .publish_subscribe::<Payload<T>>()
                    .open_with_attributes(&layout)
            },
            |error| matches!(error, Error::IncompatibleAttributes | Error::IncompatibleTypes),
        )
        .map_err(|error| match error {
            StartError::SharedMemory(text) if text.contains("Incompatible") => StartError::SharedMemory(format!(
                "{name} in shared memory has another layout than this binary ({}): it was built from another \
                 version of ipc-types; rebuild and restart the whole system",
                layout_text::<T>()
            )),
            other => other,
        })
    }

    pub(crate) fn input<T: Message>(&self, name: &str, depth: usize) -> Result<SharedInput<T>, StartError> {
        let factory = self.topic::<T>(name)?;
        let subscriber = patiently(
            name,
            || factory.subscriber_builder().buffer_size(depth).history_request(1).create(),
            |_| false,
        )?;
        Ok(SharedInput::new(subscriber))
    }

    pub(crate) fn output<T: Message>(
        &self,
        name: &str,
        manifest: &Manifest,
    ) -> Result<Rc<SharedOutput<T>>, StartError> {
        let factory = self.topic::<T>(name)?;
        let publisher =
            patiently(name, || factory.publisher_builder().max_loaned_samples(2).create(), |_| false)?;
        let mut notifiers = Vec::new();
        for service in access::woken_by(manifest, name) {
            notifiers.push(self.notifier(service)?);
        }
        let output = Rc::new(SharedOutput::new(publisher, notifiers));
        let weak = Rc::downgrade(&output);
        self.refresh.borrow_mut().push(Box::new(move || {
            if let Some(output) = weak.upgrade() {
                output.update_connections();
            }
        }));
        Ok(output)
    }

    /// Hands the newest message of every output to readers that joined since the last call.
    pub(crate) fn serve_late_joiners(&self) {
        for refresh in self.refresh.borrow().iter() {
            refresh();
        }
    }

    fn notifier(&self, service: &str) -> Result<Notifier<ipc::Service>, StartError> {
        let name = wake_name(service);
        let event = service_name(&name)?;
        let factory = patiently(&name, || self.node.service_builder(&event).event().open(), |_| false)?;
        patiently(&name, || factory.notifier_builder().default_event_id(WAKE).create(), |_| false)
    }

    pub(crate) fn listener(&self, service: &str) -> Result<Listener<ipc::Service>, StartError> {
        let name = wake_name(service);
        let event = service_name(&name)?;
        let factory = patiently(&name, || self.node.service_builder(&event).event().open(), |_| false)?;
        patiently(&name, || factory.listener_builder().create(), |_| false)
    }

    pub(crate) fn device_path(&self, path: &str) -> Result<String, StartError> {
        if self.simulated && !path.starts_with("@run/") {
            return Err(StartError::Device {
                name: "real device".to_owned(),
                path: path.to_owned(),
                reason: "a simulated system may only open devices in its run directory (@run/...)".to_owned(),
            });
        }
        Ok(self.run_dir.resolve(path).to_string_lossy().into_owned())
    }

    /// What the keeper holds of the topic of `T`.
    pub(crate) fn retained<T: Message>(&self) -> Result<Option<Box<T>>, StartError> {
        debug_assert!(Limits::of::<T>().held > 0);
        let mut input = self.input::<T>(&keeper_topic(T::TOPIC), 1)?;
        let began = Instant::now();
        loop {
            if let Ok(Some(sample)) = input.receive() {
                let mut copy = bytemuck::allocation::zeroed_box::<T>();
                bytemuck::bytes_of_mut(&mut *copy).copy_from_slice(bytemuck::bytes_of(&*sample));
                return Ok(Some(copy));
            }
            if began.elapsed() > KEEPER_PATIENCE {
                return Ok(None);
            }
            std::thread::sleep(RETRY_PAUSE);
        }
    }
}
