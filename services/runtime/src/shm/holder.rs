//! What the supervisor does with shared memory: create and hold all of it, keep what must survive.

use super::names::RunDir;
use super::node::{MAX_NODES, SharedNode, keeper_topic, layout_attribute, service_name, wake_name};
use super::payload::Payload;
use super::ports::{SharedInput, SharedLoan, SharedOutput, SharedSample};
use crate::StartError;
use crate::port::Limits;
use iceoryx2::prelude::ipc;
use iceoryx2::service::port_factory::{event, publish_subscribe};
use ipc_types::{Command, Header, Message, PilotState, TopicVisitor, visit_topic};
use manifest::Manifest;
use std::any::Any;
use std::rc::Rc;

/// What is wrong with the shared memory, in one sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ShmError(pub String);

impl From<StartError> for ShmError {
    fn from(error: StartError) -> Self {
        Self(error.to_string())
    }
}

/// Most publishers of one topic: of orders the supervisor, its warden and three programs at a time.
const PUBLISHERS: usize = 5;

/// A retained topic in the hands of the keeper.
trait Keep {
    fn topic(&self) -> &str;
    /// Takes the newest sample, and serves a restarted service that asks for it.
    fn keep(&mut self);
    /// Offers the newest sample to the service that is about to be started again. False without one.
    fn offer(&mut self) -> bool;
}

struct Kept<T: Message> {
    topic: String,
    input: SharedInput<T>,
    newest: Option<SharedSample<T>>,
    output: SharedOutput<T>,
    spare: Option<SharedLoan<T>>,
    offered: bool,
}

impl<T: Message> Keep for Kept<T> {
    fn topic(&self) -> &str {
        &self.topic
    }

    fn keep(&mut self) {
        while let Ok(Some(sample)) = self.input.receive() {
            self.newest = Some(sample);
        }
        self.output.update_connections();
    }

    fn offer(&mut self) -> bool {
        // What the publisher sent in its last moments is still to be taken.
        self.keep();
        // A service that died again before it published anything gets the same offer once more: it is still
        // in the history of the keeper's own channel.
        let Some(newest) = &self.newest else { return self.offered };
        // The sample lies in the dead publisher's memory, which clean-up is about to remove: copy it into
        // the keeper's own.
        let Some(mut loan) = self.spare.take().or_else(|| self.output.loan()) else { return false };
        bytemuck::bytes_of_mut(&mut *loan).copy_from_slice(bytemuck::bytes_of(&**newest));
        self.newest = None;
        // A reader that vanished asks again when it is back, and finds the copy in the history.
        let _ = self.output.send(loan);
        self.spare = self.output.loan();
        self.offered = true;
        true
    }
}

/// Creates every topic, event and keeper channel of the manifest and holds them for as long as it lives; or, for the
/// supervisor's warden, only looks at the pilot and gives orders ([`Holder::join`]).
pub struct Holder {
    kept: Vec<(String, Box<dyn Keep>)>,
    pilot_state: Option<SharedInput<PilotState>>,
    newest_pilot_state: Option<PilotState>,
    command: Option<SharedOutput<Command>>,
    command_sequence: u64,
    held: Vec<Box<dyn Any>>,
    services: Vec<String>,
    node: Rc<SharedNode>,
}

type Topic<T> = publish_subscribe::PortFactory<ipc::Service, Payload<T>, ()>;
type Event = event::PortFactory<ipc::Service>;

fn create_topic<T: Message>(node: &SharedNode, name: &str) -> Result<Topic<T>, ShmError> {
    let limits = Limits::of::<T>();
    node.node()
        .service_builder(&service_name(name)?)
        .publish_subscribe::<Payload<T>>()
        .subscriber_max_buffer_size(limits.depth)
        .subscriber_max_borrowed_samples(limits.held)
        .history_size(1)
        .max_subscribers(limits.readers)
        .max_publishers(PUBLISHERS)
        .max_nodes(MAX_NODES)
        .enable_safe_overflow(true)
        .create_with_attributes(&layout_attribute::<T>()?)
        .map_err(|error| ShmError(format!("cannot create {name} in shared memory: {error:?}")))
}

fn create_event(node: &SharedNode, name: &str) -> Result<Event, ShmError> {
    node.node()
        .service_builder(&service_name(name)?)
        .event()
        .max_notifiers(MAX_NODES)
        .max_listeners(4)
        .max_nodes(MAX_NODES)
        .create()
        .map_err(|error| ShmError(format!("cannot create {name} in shared memory: {error:?}")))
}

struct CreateTopic<'a> {
    node: &'a SharedNode,
    name: &'a str,
}
impl TopicVisitor for CreateTopic<'_> {
    type Output = Result<Box<dyn Any>, ShmError>;
    fn visit<T: Message>(&mut self) -> Self::Output {
        Ok(Box::new(create_topic::<T>(self.node, self.name)?))
    }
}

struct KeepTopic<'a> {
    node: &'a SharedNode,
    manifest: &'a Manifest,
    name: &'a str,
}
impl TopicVisitor for KeepTopic<'_> {
    type Output = Result<Box<dyn Keep>, ShmError>;
    fn visit<T: Message>(&mut self) -> Self::Output {
        let keeper = keeper_topic(self.name);
        let output = self.node.output::<T>(&keeper, self.manifest)?;
        let output = Rc::into_inner(output).ok_or_else(|| ShmError("keeper output is shared".to_owned()))?;
        // The place to copy into is taken now, so that a full /dev/shm shows at start and not at a crash.
        let spare = output.loan();
        let input = self.node.input::<T>(self.name, 1)?;
        Ok(Box::new(Kept { topic: self.name.to_owned(), input, newest: None, output, spare, offered: false }))
    }
}

impl Holder {
    /// Creates everything. The run directory must be wiped first.
    ///
    /// # Errors
    /// A topic that no message type is known for, or shared memory that refuses.
    pub fn create(manifest: &Manifest, run_dir: &RunDir) -> Result<Self, ShmError> {
        let node = SharedNode::open("supervisor", run_dir, true)?;
        let mut held: Vec<Box<dyn Any>> = Vec::new();
        let mut kept = Vec::new();
        for topic in manifest.topics() {
            let unknown =
                || ShmError(format!("{}: no message type is known for topic {}", manifest.file, topic.name));
            held.push(
                visit_topic(&topic.name, &mut CreateTopic { node: &node, name: &topic.name })
                    .ok_or_else(unknown)??,
            );
        }
        for service in manifest.services.keys() {
            held.push(Box::new(create_event(&node, &wake_name(service))?));
        }
        for (service, entry) in &manifest.services {
            for topic in entry.retained() {
                let keeper = keeper_topic(topic);
                let unknown =
                    || ShmError(format!("{}: no message type is known for topic {topic}", manifest.file));
                held.push(
                    visit_topic(topic, &mut CreateTopic { node: &node, name: &keeper })
                        .ok_or_else(unknown)??,
                );
                let keep = visit_topic(topic, &mut KeepTopic { node: &node, manifest, name: topic })
                    .ok_or_else(unknown)??;
                kept.push((service.clone(), keep));
            }
        }
        Ok(Self { kept, held, ..Self::over(node, manifest)? })
    }

    /// Opens what it takes to see whether something flies and to land it, and holds nothing: what its creator leaves
    /// behind stays until it is wiped.
    ///
    /// # Errors
    /// Shared memory that refuses.
    pub fn join(name: &str, manifest: &Manifest, run_dir: &RunDir) -> Result<Self, ShmError> {
        Self::over(SharedNode::open(name, run_dir, true)?, manifest)
    }

    fn over(node: Rc<SharedNode>, manifest: &Manifest) -> Result<Self, ShmError> {
        let topics = manifest.topics();
        let has = |name: &str| topics.iter().any(|topic| topic.name == name);
        let pilot_state = if has(PilotState::TOPIC) { Some(node.input(PilotState::TOPIC, 4)?) } else { None };
        let command = if has(Command::TOPIC) {
            Rc::into_inner(node.output::<Command>(Command::TOPIC, manifest)?)
        } else {
            None
        };
        Ok(Self {
            kept: Vec::new(),
            pilot_state,
            newest_pilot_state: None,
            command,
            command_sequence: 0,
            held: Vec::new(),
            services: manifest.services.keys().cloned().collect(),
            node,
        })
    }

    /// Takes the newest sample of every retained topic and serves late joiners. To be called at every turn
    /// of the supervisor's loop, every few milliseconds.
    pub fn keep(&mut self) {
        for (_, keep) in &mut self.kept {
            keep.keep();
        }
        if let Some(input) = &mut self.pilot_state {
            while let Ok(Some(state)) = input.receive() {
                self.newest_pilot_state = Some(*state);
            }
        }
        self.node.serve_late_joiners();
    }

    /// To be called after a service was reaped and before dead nodes are cleaned up: puts aside what it
    /// published last on its retained topics. Returns those topics, for the environment of its next start.
    pub fn restore(&mut self, service: &str) -> Vec<String> {
        let mut topics = Vec::new();
        for (owner, keep) in &mut self.kept {
            if owner == service && keep.offer() {
                topics.push(keep.topic().to_owned());
            }
        }
        topics
    }

    /// Removes what dead processes left behind. To be called after they were reaped: a zombie looks alive.
    pub fn cleanup_dead_nodes(&self) {
        let _ = self.node.node().try_cleanup_dead_nodes();
    }

    /// Removes what dead programs beside the services left behind: each would hold one of the few places among
    /// publishers and nodes for ever. Services are left to [`Holder::cleanup_dead_nodes`], after their last words
    /// were taken. To be called about once a second; it reads one directory when nobody died.
    pub fn cleanup_dead_tools(&self) {
        use iceoryx2::node::{Node, NodeState, NodeView};
        use iceoryx2::prelude::CallbackProgression;
        let node = self.node.node();
        // What cannot be listed or removed now is tried again the next time.
        let _ = Node::<ipc::Service>::list(node.config(), |state| {
            if let NodeState::Dead(dead) = state
                && dead.details().as_ref().is_some_and(|details| !self.is_service(details.name().as_str()))
            {
                let _ = dead.try_remove_stale_resources();
            }
            CallbackProgression::Continue
        });
    }

    fn is_service(&self, name: &str) -> bool {
        self.services.iter().any(|service| service == name)
    }

    /// The newest state of the pilot, if there ever was one.
    #[must_use]
    pub fn pilot_state(&self) -> Option<&PilotState> {
        self.newest_pilot_state.as_ref()
    }

    /// Gives a command as the supervisor. False when nobody can take it.
    pub fn publish_command(&mut self, command: &Command, now: u64) -> bool {
        let Some(output) = &self.command else { return false };
        let Some(mut loan) = output.loan() else { return false };
        self.command_sequence += 1;
        *loan = *command;
        loan.header = Header { stamp_ns: now, sequence: self.command_sequence, publisher: 0, incarnation: 0 };
        output.send(loan).is_ok()
    }

    /// How many things are held.
    #[must_use]
    pub fn held(&self) -> usize {
        self.held.len()
    }
}
