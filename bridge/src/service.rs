//! The bridge as a service: a step drains topics and network, and waits for neither.

use crate::about::About;
use crate::config::BridgeConfig;
use crate::editor::Editor;
use crate::gate::Gate;
use crate::keys::Keys;
use crate::network::{Asker, Heard, Network, Pace};
use crate::order::{Input as StickInput, parse_sticks};
use crate::pending::{Pending, refusal};
use crate::signals::Signals;
use crate::taps::{self, AnyTap, Pacer, Tap};
use crate::wishes::Wishes;
use ipc_types::{Command, Message, Patrol, PilotState, Sticks, Text, Wish};
use runtime::{Output, Ports, Service, Start, StartError};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use zenoh::bytes::Encoding;

/// Topics that do not leave as they are: what goes to one session only, and raw pictures, which are too large.
const KEPT: [&str; 2] = ["signal/out", "camera/picture"];

/// How often a wish is repeated while it stands.
const WISH_EVERY_NS: u64 = 100_000_000;
/// For how long each of them is good: a lost one is no interruption.
const WISH_GOOD_NS: u64 = 500_000_000;

/// The drone on zenoh.
pub struct Bridge {
    network: Network,
    gate: Gate,
    pending: Pending<Asker>,
    command: Output<Command>,
    sticks: Output<Sticks>,
    pilot: Tap<PilotState>,
    navigation: Tap<Patrol>,
    taps: BTreeMap<String, Box<dyn AnyTap>>,
    /// Video sessions, where the system has video.
    signals: Option<Signals>,
    editor: Editor,
    wishes: Wishes,
    /// To the camera, where the system has one, and when the next wish is due.
    camera: Option<Output<Wish>>,
    wish_pacer: Pacer,
    beacon: Pacer,
    beacon_key: Arc<str>,
    /// Set at the first step.
    begun: bool,
    /// Orders and sticks that were refused here.
    refused: u64,
}

impl Service for Bridge {
    const NAME: &'static str = "bridge";
    type Config = BridgeConfig;

    fn start(config: BridgeConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let drone = &start.system.name;
        if !crate::roles::is_name(drone) {
            return Err(StartError::Invalid(format!(
                "[system] name = \"{}\": the name of a drone on the network has 1 to 32 letters, digits, - _ and .",
                manifest::plain(drone)
            )));
        }
        let keys = Keys::of(drone);
        let leaving: Vec<String> =
            ports.readable().into_iter().filter(|topic| !KEPT.contains(&topic.as_str())).collect();
        let about = About::new(start, &config, &leaving)?;
        let mut taps = BTreeMap::new();
        for topic in
            leaving.iter().filter(|topic| ![PilotState::TOPIC, Patrol::TOPIC].contains(&topic.as_str()))
        {
            let period = config.period_ns(topic);
            taps.insert(topic.clone(), taps::open(ports, topic, &keys.telemetry(topic), period)?);
        }
        let own = |topic: &str| (keys.telemetry(topic), config.period_ns(topic));
        let (pilot_key, pilot_period) = own(PilotState::TOPIC);
        let (patrol_key, patrol_period) = own(Patrol::TOPIC);
        let waker = ports.waker()?;
        Ok(Self {
            pilot: Tap::open(ports, PilotState::TOPIC, &pilot_key, pilot_period)?,
            navigation: Tap::open(ports, Patrol::TOPIC, &patrol_key, patrol_period)?,
            command: ports.output()?,
            sticks: ports.output()?,
            signals: Signals::open(ports, keys.clone())?,
            camera: ports.may_publish(Wish::TOPIC).then(|| ports.output()).transpose()?,
            editor: Editor::start(start)?,
            wishes: Wishes::default(),
            wish_pacer: Pacer::new(Some(WISH_EVERY_NS)),
            taps,
            gate: Gate::new(Arc::default(), 0),
            pending: Pending::default(),
            beacon: Pacer::new(Some((1e9 / config.beacon_hz) as u64)),
            beacon_key: keys.beacon().into(),
            begun: false,
            refused: 0,
            network: Network::start(drone, &config, start.root.join(&config.certificates), about, waker)?,
        })
    }

    fn step(&mut self, now: u64) {
        if !self.begun {
            self.begun = true;
            self.gate = Gate::new(self.network.clients(), now);
        }
        self.gate.set_clients(self.network.clients());
        self.hear_sticks(now);
        self.hear(now);
        self.give(now);
        self.wish(now);
        self.pass(now);
        self.settle(now);
    }

    fn status(&self, text: &mut Text<96>) {
        // What does not fit is cut.
        let _ = text.write_str(&self.network.standing());
    }

    fn refused(&self) -> u64 {
        self.refused + self.network.losses().refused.load(Ordering::Relaxed)
    }
}

impl Bridge {
    /// Of all inputs that wait, the newest that counts is flown.
    fn hear_sticks(&mut self, now: u64) {
        let mut newest: Option<StickInput> = None;
        while let Some(heard) = self.network.hear_sticks() {
            match self.input(now, &heard.certificate, &heard.json) {
                Some(input) => newest = Some(input),
                None => self.refused += 1,
            }
        }
        if let Some(input) = newest {
            self.sticks.publish(&input.sticks);
        }
    }

    fn input(&self, now: u64, certificate: &str, json: &[u8]) -> Option<StickInput> {
        let input = parse_sticks(json, now, self.gate.first_beacon_ns()).ok()?;
        let holder = self.pending.holder()?;
        let holds = holder.lease == input.sticks.lease
            && holder.socket == input.socket
            && holder.certificate == certificate;
        (holds && self.gate.may_fly(certificate)).then_some(input)
    }

    fn hear(&mut self, now: u64) {
        while let Some(heard) = self.network.hear() {
            match heard {
                Heard::Order { certificate, verb, json, asker } => {
                    let taken = self.gate.decide(now, &certificate, verb, &json);
                    let refused = match taken {
                        Err(sentence) => Some((asker, sentence)),
                        Ok(command) => match self.pending.add(verb, command, asker) {
                            Ok(()) => None,
                            Err((asker, sentence)) => Some((asker, sentence.to_owned())),
                        },
                    };
                    if let Some((asker, sentence)) = refused {
                        self.refused += 1;
                        self.answer(asker, &refusal(&sentence));
                    }
                }
                Heard::Edit { certificate, json, picture, asker } => {
                    let decided = self.gate.decide_edit(now, &certificate, &json, picture.as_deref());
                    let refused = match decided {
                        Err(sentence) => Some((asker, sentence)),
                        Ok(edit) => {
                            self.editor.take(edit, asker).map(|(asker, said)| (asker, said.to_owned()))
                        }
                    };
                    if let Some((asker, sentence)) = refused {
                        self.refused += 1;
                        self.answer(asker, &refusal(&sentence));
                    }
                }
                Heard::Newest { topic, asker } => {
                    let newest = match topic.as_str() {
                        PilotState::TOPIC => self.pilot.newest(),
                        Patrol::TOPIC => self.navigation.newest(),
                        topic => self.taps.get(topic).and_then(|tap| tap.newest()),
                    };
                    self.network.answer(asker, newest);
                }
                Heard::Wish { certificate, json } => {
                    let known = self.camera.is_some() && self.gate.role(&certificate, None).is_some();
                    let taken = known && self.wishes.take(now, &certificate, &json).is_ok();
                    self.refused += u64::from(!taken);
                }
                Heard::Signal { certificate, session, json } => {
                    let role = self.gate.role(&certificate, None);
                    let taken = match (&mut self.signals, role) {
                        (Some(signals), Some(role)) => signals.hear(&certificate, &session, role, &json),
                        _ => false,
                    };
                    self.refused += u64::from(!taken);
                }
            }
        }
    }

    /// Tells the camera what is wished for over the network, while it is.
    fn wish(&mut self, now: u64) {
        let Some(camera) = &mut self.camera else { return };
        if let Some(wish) = self.wishes.wanted(now)
            && self.wish_pacer.pass(now)
        {
            camera.publish(&Wish { expiry_ns: now + WISH_GOOD_NS, ..wish });
        }
    }

    /// What the topics say goes out.
    fn pass(&mut self, now: u64) {
        if self.beacon.pass(now) {
            let beacon = format!("{{\"beacon_ns\":{now}}}").into_bytes();
            self.network.put(&self.beacon_key, &Encoding::APPLICATION_JSON, beacon, Pace::Express);
        }
        let pending = &mut self.pending;
        self.pilot.pass(now, &self.network, |state| pending.hear_pilot(state));
        self.navigation.pass(now, &self.network, |patrol| pending.hear_navigation(patrol));
        if let Some(signals) = &mut self.signals {
            signals.pass(&self.network);
        }
        for tap in self.taps.values_mut() {
            tap.pass(now, &self.network);
        }
    }

    /// Gives orders whose time has come.
    fn give(&mut self, now: u64) {
        let command = &mut self.command;
        while let Some((asker, failed)) = self.pending.give(now, |order| command.publish(order)) {
            self.network.answer(asker, Some((Encoding::APPLICATION_JSON, failed.to_string().into_bytes())));
        }
    }

    /// Answers orders that are settled.
    fn settle(&mut self, now: u64) {
        while let Some((asker, answer)) = self.pending.answered(now) {
            self.answer(asker, &answer);
        }
    }

    fn answer(&self, asker: Asker, answer: &Value) {
        self.network.answer(asker, Some((Encoding::APPLICATION_JSON, answer.to_string().into_bytes())));
    }
}
