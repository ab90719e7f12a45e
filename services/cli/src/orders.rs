//! Orders to the drone, and what those who must obey them answer.

use ipc_types::{Answer, COMMAND_LIFE_NS, Command, Patrol, PilotState, Text, Verb};
use runtime::{Input, Output, Ports, StartError};

/// A number for an order that no earlier order of anybody had: obeyed once, whoever hears it again.
#[must_use]
pub fn next_order_number() -> u32 {
    // Milliseconds of the monotonic clock differ between any two orders of people; never zero.
    (runtime::monotonic_ns() / 1_000_000) as u32 | 1
}

/// Where orders are given.
pub struct Orders {
    command: Output<Command>,
}

impl Orders {
    /// Opens the port of an operator.
    ///
    /// # Errors
    /// When the manifest does not allow it.
    pub fn open(ports: &mut Ports) -> Result<Self, StartError> {
        Ok(Self { command: ports.output()? })
    }

    /// Gives an order as the local operator. False when shared memory has no place for it.
    pub fn give(&mut self, verb: Verb, x_m: f32, y_m: f32, number: u32) -> bool {
        let expiry_ns = self.command.now_ns().saturating_add(COMMAND_LIFE_NS);
        self.command.publish(&Command {
            expiry_ns,
            x_m,
            y_m,
            verb: u32::from(verb.code()),
            command_sequence: number,
            account: Text::new("local"),
            role: Text::new("administrator"),
            ..Command::default()
        })
    }
}

/// What a service says of an order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// Nothing yet.
    Silent,
    /// It has it, and works out whether it can be done.
    Working(String),
    /// It obeys.
    Accepted(String),
    /// It does not.
    Refused(String),
}

impl Reply {
    fn of(number: u32, sequence: u32, answer: u32, text: &str) -> Self {
        if sequence != number {
            return Self::Silent;
        }
        match u8::try_from(answer).ok().and_then(Answer::from_code) {
            Some(Answer::Working) => Self::Working(text.to_owned()),
            Some(Answer::Accepted) => Self::Accepted(text.to_owned()),
            Some(Answer::Refused) => Self::Refused(text.to_owned()),
            Some(Answer::None) | None => Self::Silent,
        }
    }

    /// One word for programs.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Silent => "silent",
            Self::Working(_) => "working",
            Self::Accepted(_) => "accepted",
            Self::Refused(_) => "refused",
        }
    }

    /// The sentence; empty from one who is silent.
    #[must_use]
    pub fn sentence(&self) -> &str {
        match self {
            Self::Silent => "",
            Self::Working(text) | Self::Accepted(text) | Self::Refused(text) => text,
        }
    }

    fn is_final(&self) -> bool {
        matches!(self, Self::Accepted(_) | Self::Refused(_))
    }
}

/// The services that must obey an order, by name. Navigation keeps the route and hears less often (20 Hz) than the
/// pilot (50 Hz): an answer of the pilot alone does not mean that navigation has heard.
#[must_use]
pub fn obeyed_by(verb: Verb) -> &'static [&'static str] {
    match verb {
        Verb::TakeOff | Verb::Cut | Verb::SticksRelease | Verb::AutomaticOn => &["pilot"],
        Verb::Land
        | Verb::Hold
        | Verb::GoTo
        | Verb::PatrolStart
        | Verb::PatrolPause
        | Verb::PatrolStop
        | Verb::Home
        | Verb::Stop
        | Verb::SticksTake
        | Verb::AutomaticOff => &["pilot", "navigation"],
    }
}

/// What everybody who must obey one order says of it.
pub struct Replies {
    pilot: Input<PilotState>,
    navigation: Input<Patrol>,
    number: u32,
    awaited: &'static [&'static str],
    heard: [Reply; 2],
}

impl Replies {
    /// To be opened before the order is given.
    ///
    /// # Errors
    /// When the manifest does not allow it.
    pub fn open(ports: &mut Ports, verb: Verb, number: u32) -> Result<Self, StartError> {
        Ok(Self {
            pilot: ports.input()?,
            navigation: ports.input()?,
            number,
            awaited: obeyed_by(verb),
            heard: [Reply::Silent, Reply::Silent],
        })
    }

    /// Hears what has come. True when all has been said that is to be waited for.
    pub fn look(&mut self) -> bool {
        let [pilot, navigation] = &mut self.heard;
        while let Some(state) = self.pilot.receive() {
            let text = state.answer_text;
            note(pilot, Reply::of(self.number, state.command_sequence, state.answer, text.as_str()));
        }
        while let Some(patrol) = self.navigation.receive() {
            let text = patrol.answer_text;
            note(navigation, Reply::of(self.number, patrol.command_sequence, patrol.answer, text.as_str()));
        }
        self.iter().all(|(_, reply)| reply.is_final())
    }

    /// Who must obey, and what he said so far.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Reply)> {
        self.awaited.iter().copied().zip(&self.heard)
    }
}

/// A later order of somebody else does not unsay what was said of this one.
fn note(known: &mut Reply, new: Reply) {
    if new != Reply::Silent {
        *known = new;
    }
}
