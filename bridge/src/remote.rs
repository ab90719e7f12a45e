//! A client of drones: what `sereno --remote` and any other program does.

use crate::form::{Form, decode_particles};
use crate::keys::{Keys, verb_word};
use crate::order::OrderText;
use ipc_types::{Field, Message, Particles, TopicVisitor, Verb, visit_topic};
use serde_json::Value;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;
use zenoh::handlers::FifoChannel;
use zenoh::{Config, Session, Wait};

/// For so long the drone may be silent before it is said to be away.
const PATIENCE: Duration = Duration::from_secs(3);
/// A route is worked out within ten seconds, and said to be too late after that.
const ORDER_PATIENCE: Duration = Duration::from_secs(14);
/// Messages that wait to be looked at; more are dropped.
const WAITING: usize = 64;

/// A program's way to one drone.
pub struct Remote {
    session: Session,
    keys: Keys,
    drone: String,
    certificate: String,
}

/// A message of a topic as it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heard {
    /// JSON, or bytes as its encoding says.
    pub payload: Vec<u8>,
    /// Whether it is JSON.
    pub is_json: bool,
}

fn said(error: &zenoh::Error) -> String {
    let text = error.to_string();
    manifest::one_line(text.split(" at ").next().unwrap_or(&text))
}

impl Remote {
    /// Connects as a configuration says that `sereno certs client` wrote; to the drone of this name, or to the only one.
    ///
    /// # Errors
    /// One sentence on what is wrong with the file, the network or the drone.
    pub fn connect(file: &Path, drone: Option<&str>) -> Result<Self, String> {
        crate::files::check_private(file)?;
        let text = crate::files::read_text(file)?;
        let name = file.display();
        let config = Config::from_json5(&text).map_err(|error| format!("{name}: {}", said(&error)))?;
        let metadata: Value = config
            .get_json("metadata")
            .ok()
            .and_then(|json| serde_json::from_str(&json).ok())
            .unwrap_or_default();
        let certificate = metadata["certificate"]
            .as_str()
            .ok_or_else(|| {
                format!("{name}: metadata.certificate is missing: `sereno certs client` writes it")
            })?
            .to_owned();
        let session = zenoh::open(config).wait().map_err(|error| {
            format!("cannot connect as {certificate}: {} (is the drone on, and does its certificate name this address?)", said(&error))
        })?;
        let known: Vec<&str> =
            metadata["drones"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let alive = alive(&session)?;
        let drone = match (drone, alive.as_slice(), known.as_slice()) {
            (Some(drone), ..) => drone.to_owned(),
            (None, [drone], _) => drone.clone(),
            (None, [], [drone]) => (*drone).to_owned(),
            (None, [], _) => return Err("no drone is there".to_owned()),
            (None, several, _) => {
                return Err(format!(
                    "there are several drones, choose one with --drone: {}",
                    several.join(", ")
                ));
            }
        };
        if !alive.contains(&drone) {
            return Err(format!(
                "{drone} is not there, or does not know the certificate {certificate}: {}",
                if alive.is_empty() {
                    "no drone answers".to_owned()
                } else {
                    format!("there are {}", alive.join(", "))
                }
            ));
        }
        Ok(Self { keys: Keys::of(&drone), session, drone, certificate })
    }

    /// The drone's name.
    #[must_use]
    pub fn drone(&self) -> &str {
        &self.drone
    }

    /// What the drone says of itself.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn about(&self) -> Result<Value, String> {
        let bytes = self.ask(&self.keys.about(), None, PATIENCE)?;
        serde_json::from_slice(&bytes)
            .map_err(|error| format!("{} says no JSON of itself: {error}", self.drone))
    }

    /// The plan as PNG, pixel for pixel of the map file.
    ///
    /// # Errors
    /// When the drone does not answer.
    pub fn plan(&self) -> Result<Vec<u8>, String> {
        self.ask(&self.keys.plan(), None, PATIENCE)
    }

    /// Says which pictures are wanted, for two seconds (`docs/off-board.md`, *Video*).
    ///
    /// # Errors
    /// When zenoh refuses.
    pub fn wish(&self, json: &str) -> Result<(), String> {
        self.session.put(self.keys.wish(&self.certificate), json).wait().map_err(|error| said(&error))
    }

    /// The first answer to a question.
    fn ask(&self, key: &str, payload: Option<String>, patience: Duration) -> Result<Vec<u8>, String> {
        let mut question = self.session.get(key).with(FifoChannel::new(1)).timeout(patience);
        if let Some(payload) = payload {
            question = question.payload(payload);
        }
        let replies = question.wait().map_err(|error| said(&error))?;
        while let Ok(reply) = replies.recv() {
            if let Ok(sample) = reply.result() {
                return Ok(sample.payload().to_bytes().into_owned());
            }
        }
        Err(format!("{} does not answer the certificate {}", self.drone, self.certificate))
    }

    /// The newest beacon of the drone.
    fn beacon(&self) -> Result<u64, String> {
        let beacons = self.messages(&self.keys.beacon())?;
        let away = || format!("{} does not tell its clock", self.drone);
        let heard = beacons.recv_timeout(PATIENCE).map_err(|_| away())?;
        let beacon: Value = serde_json::from_slice(&heard.payload).map_err(|_| away())?;
        beacon["beacon_ns"].as_u64().ok_or_else(away)
    }

    /// Gives an order and waits for its answer (`docs/off-board.md`, *An order*).
    ///
    /// # Errors
    /// When there is no answer.
    pub fn order(&self, verb: Verb, place: Option<(f32, f32)>) -> Result<Value, String> {
        let id = getrandom::u64().map_err(|error| format!("no random number: {error}"))?;
        let order = OrderText {
            id: format!("{id:016x}"),
            beacon_ns: self.beacon()?,
            account: String::new(),
            role: String::new(),
            socket: 0,
            lease: 0,
            x_m: place.map(|place| place.0),
            y_m: place.map(|place| place.1),
        };
        let json = serde_json::to_string(&order).map_err(|error| error.to_string())?;
        let key = self.keys.command(&verb_word(verb), &self.certificate);
        let answer = self.ask(&key, Some(json), ORDER_PATIENCE)?;
        serde_json::from_slice(&answer).map_err(|error| format!("{} answers no JSON: {error}", self.drone))
    }

    /// Messages of a topic as they come, until the receiver is dropped.
    ///
    /// # Errors
    /// When zenoh refuses.
    pub fn follow(&self, topic: &str) -> Result<Followed, String> {
        self.messages(&self.keys.telemetry(topic))
    }

    /// Messages of a topic as they come, until what this returns is dropped. `hear` is called by zenoh and must not wait.
    ///
    /// # Errors
    /// When zenoh refuses.
    pub fn follow_with(
        &self,
        topic: &str,
        hear: impl Fn(Heard) + Send + Sync + 'static,
    ) -> Result<Following, String> {
        Ok(Following { _subscriber: self.subscribe(&self.keys.telemetry(topic), hear)? })
    }

    fn messages(&self, key: &str) -> Result<Followed, String> {
        let (heard, messages) = sync_channel(WAITING);
        // Who does not look loses messages, as on board.
        let subscriber = self.subscribe(key, move |message| drop(heard.try_send(message)))?;
        Ok(Followed { messages, _subscriber: subscriber })
    }

    fn subscribe(
        &self,
        key: &str,
        hear: impl Fn(Heard) + Send + Sync + 'static,
    ) -> Result<zenoh::pubsub::Subscriber<()>, String> {
        self.session
            .declare_subscriber(key)
            .callback(move |sample| {
                let is_json = sample.encoding().to_string().starts_with("application/json");
                hear(Heard { payload: sample.payload().to_bytes().into_owned(), is_json });
            })
            .wait()
            .map_err(|error| said(&error))
    }
}

/// A topic that is followed for as long as this is there.
pub struct Following {
    _subscriber: zenoh::pubsub::Subscriber<()>,
}

/// Messages that come.
pub struct Followed {
    messages: Receiver<Heard>,
    _subscriber: zenoh::pubsub::Subscriber<()>,
}

impl Followed {
    /// The next message.
    ///
    /// # Errors
    /// When none comes in time, or the session has ended.
    pub fn recv_timeout(&self, patience: Duration) -> Result<Heard, RecvTimeoutError> {
        self.messages.recv_timeout(patience)
    }
}

fn alive(session: &Session) -> Result<Vec<String>, String> {
    let replies = session
        .liveliness()
        .get(Keys::of("*").alive())
        .with(FifoChannel::new(64))
        .timeout(PATIENCE)
        .wait()
        .map_err(|error| said(&error))?;
    let mut drones = Vec::new();
    while let Ok(reply) = replies.recv() {
        if let Ok(sample) = reply.result()
            && let Some(drone) = crate::keys::part(sample.key_expr().as_str(), 1)
        {
            drones.push(drone.to_owned());
        }
    }
    drones.sort();
    drones.dedup();
    Ok(drones)
}

/// A message as JSON, whatever its form; `None` when the bytes are no message of the topic.
#[must_use]
pub fn to_json(topic: &str, heard: &Heard) -> Option<String> {
    if heard.is_json {
        return String::from_utf8(heard.payload.clone()).ok();
    }
    visit_topic(topic, &mut Decode(&heard.payload)).flatten()
}

struct Decode<'a>(&'a [u8]);

impl TopicVisitor for Decode<'_> {
    type Output = Option<String>;
    fn visit<T: Message>(&mut self) -> Option<String> {
        let mut text = String::new();
        if T::TOPIC == Particles::TOPIC {
            decode_particles(self.0)?.write_json(&mut text).ok()?;
            return Some(text);
        }
        let mut message = bytemuck::allocation::zeroed_box::<T>();
        let cut = Form::of::<T>() == Form::BytesCut && self.0.len() <= size_of::<T>();
        if !(cut || self.0.len() == size_of::<T>()) {
            return None;
        }
        bytemuck::bytes_of_mut(&mut *message).get_mut(..self.0.len())?.copy_from_slice(self.0);
        message.write_json(&mut text).ok()?;
        Some(text)
    }
}
