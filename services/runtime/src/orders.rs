//! Orders to the drone, and what those who must obey them answer: for every program that gives orders.

use crate::{Input, Output, Ports, StartError};
use ipc_types::{Answer, COMMAND_LIFE_NS, Command, Patrol, PilotState, Text, Verb};

/// A number for an order that no earlier order of anybody had: obeyed once, whoever hears it again.
#[must_use]
pub fn next_order_number() -> u32 {
    order_number(crate::monotonic_ns())
}

/// The number of an order given at `now`, nanoseconds of the system's clock.
#[must_use]
pub fn order_number(now: u64) -> u32 {
    // Milliseconds of the monotonic clock differ between any two orders of people; never zero.
    (now / 1_000_000) as u32 | 1
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

/// What everybody who must obey one order has said of it so far.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answers {
    verb: Verb,
    number: u32,
    awaited: &'static [&'static str],
    heard: [Reply; 2],
}

impl Answers {
    /// Nobody has said anything of the order of this number.
    #[must_use]
    pub fn new(verb: Verb, number: u32) -> Self {
        Self { verb, number, awaited: obeyed_by(verb), heard: [Reply::Silent, Reply::Silent] }
    }

    /// The order.
    #[must_use]
    pub fn verb(&self) -> Verb {
        self.verb
    }

    /// Its number.
    #[must_use]
    pub fn number(&self) -> u32 {
        self.number
    }

    /// Hears the pilot.
    pub fn hear_pilot(&mut self, state: &PilotState) {
        let [pilot, _] = &mut self.heard;
        note(pilot, Reply::of(self.number, state.command_sequence, state.answer, state.answer_text.as_str()));
    }

    /// Hears navigation.
    pub fn hear_navigation(&mut self, patrol: &Patrol) {
        let [_, navigation] = &mut self.heard;
        note(
            navigation,
            Reply::of(self.number, patrol.command_sequence, patrol.answer, patrol.answer_text.as_str()),
        );
    }

    /// Whether all has been said that is to be waited for.
    #[must_use]
    pub fn are_complete(&self) -> bool {
        self.iter().all(|(_, reply)| reply.is_final())
    }

    /// Whether somebody who must obey has not said anything.
    #[must_use]
    pub fn is_silent(&self) -> bool {
        self.iter().any(|(_, reply)| *reply == Reply::Silent)
    }

    /// Who must obey, and what he said so far.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Reply)> {
        self.awaited.iter().copied().zip(&self.heard)
    }
}

/// What everybody who must obey one order says of it, from the ports of a program.
pub struct Replies {
    pilot: Input<PilotState>,
    navigation: Input<Patrol>,
    answers: Answers,
}

impl Replies {
    /// To be opened before the order is given.
    ///
    /// # Errors
    /// When the manifest does not allow it.
    pub fn open(ports: &mut Ports, verb: Verb, number: u32) -> Result<Self, StartError> {
        Ok(Self { pilot: ports.input()?, navigation: ports.input()?, answers: Answers::new(verb, number) })
    }

    /// Hears what has come. True when all has been said that is to be waited for.
    pub fn look(&mut self) -> bool {
        while let Some(state) = self.pilot.receive() {
            self.answers.hear_pilot(&state);
        }
        while let Some(patrol) = self.navigation.receive() {
            self.answers.hear_navigation(&patrol);
        }
        self.answers.are_complete()
    }

    /// Who must obey, and what he said so far.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Reply)> {
        self.answers.iter()
    }
}

/// A later order of somebody else does not unsay what was said of this one.
fn note(known: &mut Reply, new: Reply) {
    if new != Reply::Silent {
        *known = new;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_answered_when_everybody_has_and_a_later_one_unsays_nothing() {
        let mut answers = Answers::new(Verb::GoTo, 7);
        let said = |number, answer: Answer| PilotState {
            command_sequence: number,
            answer: u32::from(answer.code()),
            answer_text: Text::new("yes"),
            ..PilotState::default()
        };
        answers.hear_pilot(&said(6, Answer::Accepted));
        assert!(answers.is_silent());
        answers.hear_pilot(&said(7, Answer::Accepted));
        answers.hear_pilot(&said(9, Answer::Refused));
        assert_eq!(answers.iter().next(), Some(("pilot", &Reply::Accepted("yes".to_owned()))));
        assert!(!answers.are_complete(), "navigation has not said anything");
        let mut patrol = bytemuck::allocation::zeroed_box::<Patrol>();
        (patrol.command_sequence, patrol.answer) = (7, u32::from(Answer::Working.code()));
        answers.hear_navigation(&patrol);
        assert!(!answers.are_complete() && !answers.is_silent());
        patrol.answer = u32::from(Answer::Refused.code());
        answers.hear_navigation(&patrol);
        assert!(answers.are_complete());
    }
}
