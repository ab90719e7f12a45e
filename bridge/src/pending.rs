//! Orders that wait to be given or to be answered. Pure: time is an argument, and `Q` stands for who asked.

use ipc_types::{Command, Patrol, PilotState, Verb};
use runtime::orders::{Answers, Reply, order_number};
use serde_json::{Value, json};
use std::collections::VecDeque;

/// An order is obeyed within two seconds or not at all, and is answered in the same step.
const PATIENCE_NS: u64 = 3_000_000_000;
/// For as long a route to one place is waited for; navigation works at it in slices, 20 a second.
const PLANNING_NS: u64 = 10_000_000_000;
/// Two orders are given no closer than this, nanoseconds: each service says what became of the last order that it heard,
/// and navigation hears 20 times a second. Stop and cut wait for nothing.
const APART_NS: u64 = 60_000_000;
/// Most orders that wait to be given.
const MAX_WAITING: usize = 16;
/// Most orders that wait for answers: at most one in 60 ms comes, and none waits for longer than 10 s.
const MAX_GIVEN: usize = 192;

/// Who holds the sticks, as far as the bridge has given them to him.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Holder {
    /// The lease.
    pub lease: u64,
    /// The connection.
    pub socket: u64,
    /// The certificate by which it came.
    pub certificate: String,
}

struct Given<Q> {
    answers: Answers,
    command: Command,
    given_ns: u64,
    asker: Q,
}

/// Orders on their way.
pub struct Pending<Q> {
    waiting: VecDeque<(Verb, Command, Q)>,
    given: Vec<Given<Q>>,
    last_given_ns: u64,
    last_number: u32,
    holder: Option<Holder>,
}

impl<Q> Default for Pending<Q> {
    fn default() -> Self {
        Self { waiting: VecDeque::new(), given: Vec::new(), last_given_ns: 0, last_number: 0, holder: None }
    }
}

/// The answer to an order that is not given.
#[must_use]
pub fn refusal(sentence: &str) -> Value {
    json!({ "accepted": false, "text": sentence, "answers": {} })
}

impl<Q> Pending<Q> {
    /// Takes an order in. It is given back with a sentence when there are too many.
    ///
    /// # Errors
    /// Who asked, and the sentence.
    pub fn add(&mut self, verb: Verb, command: Command, asker: Q) -> Result<(), (Q, &'static str)> {
        if self.waiting.len() >= MAX_WAITING || self.given.len() + self.waiting.len() >= MAX_GIVEN {
            return Err((asker, "too many orders at once"));
        }
        if is_urgent(verb) {
            let before = self.waiting.iter().take_while(|(verb, ..)| is_urgent(*verb)).count();
            self.waiting.insert(before, (verb, command, asker));
        } else {
            self.waiting.push_back((verb, command, asker));
        }
        Ok(())
    }

    /// The next order that is to be given now, with its number. `publish` says whether there was a place for it; who asked
    /// for one that found none comes back.
    pub fn give(&mut self, now: u64, mut publish: impl FnMut(&Command) -> bool) -> Option<(Q, Value)> {
        while let Some((verb, ..)) = self.waiting.front() {
            if !is_urgent(*verb) && now.saturating_sub(self.last_given_ns) < APART_NS {
                break;
            }
            let (verb, mut command, asker) = self.waiting.pop_front()?;
            if now >= command.expiry_ns {
                return Some((asker, refusal("the order waited too long behind others")));
            }
            command.command_sequence = self.number(now);
            if !publish(&command) {
                return Some((asker, refusal("shared memory has no place for the order")));
            }
            self.last_given_ns = now;
            let answers = Answers::new(verb, command.command_sequence);
            self.given.push(Given { answers, command, given_ns: now, asker });
        }
        None
    }

    fn number(&mut self, now: u64) -> u32 {
        // Two urgent orders may fall into one millisecond.
        let mut number = order_number(now);
        if number == self.last_number {
            number = number.wrapping_add(2);
        }
        self.last_number = number;
        number
    }

    /// Hears the pilot.
    pub fn hear_pilot(&mut self, state: &PilotState) {
        for given in &mut self.given {
            given.answers.hear_pilot(state);
            let taken = given.answers.verb() == Verb::SticksTake
                && state.command_sequence == given.answers.number()
                && state.holder_socket == given.command.socket
                && state.lease != 0;
            if taken {
                self.holder = Some(Holder {
                    lease: state.lease,
                    socket: state.holder_socket,
                    certificate: given.command.certificate.as_str().to_owned(),
                });
            }
        }
        if self.holder.as_ref().is_some_and(|holder| holder.lease != state.lease) {
            self.holder = None;
        }
    }

    /// Hears navigation.
    pub fn hear_navigation(&mut self, patrol: &Patrol) {
        for given in &mut self.given {
            given.answers.hear_navigation(patrol);
        }
    }

    /// Who holds the sticks.
    #[must_use]
    pub fn holder(&self) -> Option<&Holder> {
        self.holder.as_ref()
    }

    /// Whether orders wait to be given or answered.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.given.is_empty()
    }

    /// Takes out what is answered, or will not be answered any more.
    pub fn answered(&mut self, now: u64) -> Option<(Q, Value)> {
        let is_over = |given: &Given<Q>| {
            let patience = if given.answers.is_silent() { PATIENCE_NS } else { PLANNING_NS };
            given.answers.are_complete() || now.saturating_sub(given.given_ns) > patience
        };
        let index = self.given.iter().position(is_over)?;
        let given = self.given.swap_remove(index);
        Some((given.asker, answer(&given.answers)))
    }
}

fn is_urgent(verb: Verb) -> bool {
    matches!(verb, Verb::Stop | Verb::Cut)
}

/// The answer to an order, as all have answered it so far.
fn answer(answers: &Answers) -> Value {
    let mut trouble = Vec::new();
    let mut said = Vec::new();
    let mut each = serde_json::Map::new();
    for (who, reply) in answers.iter() {
        match reply {
            Reply::Accepted(text) => said.push(format!("{who} {text}")),
            Reply::Refused(text) => trouble.push(format!("{who} {text}")),
            Reply::Working(_) => trouble.push(format!(
                "{who} has not worked out a route within {} s and is still at it",
                PLANNING_NS / 1_000_000_000
            )),
            Reply::Silent => {
                trouble.push(format!("{who} did not answer within {} s", PATIENCE_NS / 1_000_000_000));
            }
        }
        each.insert(who.to_owned(), json!({ "answer": reply.word(), "text": reply.sentence() }));
    }
    let accepted = trouble.is_empty();
    let text = if accepted { said.join("; ") } else { trouble.join("; ") };
    json!({ "accepted": accepted, "text": text, "answers": each })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use ipc_types::{Answer, Text};

    const MS: u64 = 1_000_000;
    const START: u64 = 1_000_000 * MS;

    fn command() -> Command {
        Command { expiry_ns: START + 2000 * MS, ..Command::default() }
    }

    fn state(number: u32, answer: Answer) -> PilotState {
        PilotState {
            command_sequence: number,
            answer: u32::from(answer.code()),
            answer_text: Text::new("says so"),
            ..PilotState::default()
        }
    }

    #[test]
    fn orders_are_given_apart_and_stop_waits_for_nothing() {
        let mut pending = Pending::default();
        let mut given = Vec::new();
        for (name, verb) in [("a", Verb::TakeOff), ("b", Verb::Land), ("c", Verb::Hold), ("d", Verb::Stop)] {
            let command = Command { verb: u32::from(verb.code()), ..command() };
            pending.add(verb, command, name).unwrap();
        }
        for step in 0..8 {
            let now = START + step * 20 * MS;
            assert!(
                pending
                    .give(now, |order| {
                        given.push((step, order.verb));
                        true
                    })
                    .is_none()
            );
        }
        let code = |verb: Verb| u32::from(verb.code());
        let expected = [(0, Verb::Stop), (3, Verb::TakeOff), (6, Verb::Land)];
        assert_eq!(given, expected.map(|(step, verb)| (step, code(verb))));
    }

    #[test]
    fn numbers_differ_even_within_a_millisecond() {
        let mut pending = Pending::default();
        let mut numbers = Vec::new();
        for asker in 0..5 {
            pending.add(Verb::Stop, command(), asker).unwrap();
            pending.give(START, |order| {
                numbers.push(order.command_sequence);
                true
            });
        }
        numbers.dedup();
        assert_eq!(numbers.len(), 5);
    }

    #[test]
    fn answers_come_when_all_have_spoken_or_patience_ends() {
        let mut pending = Pending::default();
        pending.add(Verb::TakeOff, command(), "desk").unwrap();
        let mut number = 0;
        pending.give(START, |order| {
            number = order.command_sequence;
            true
        });
        assert!(pending.answered(START + 100 * MS).is_none());
        pending.hear_pilot(&state(number, Answer::Accepted));
        let (asker, said) = pending.answered(START + 100 * MS).unwrap();
        assert_eq!(
            (asker, &said["accepted"], &said["text"]),
            ("desk", &json!(true), &json!("pilot says so"))
        );
        pending.add(Verb::Land, command(), "desk").unwrap();
        pending.give(START + 200 * MS, |order| {
            number = order.command_sequence;
            true
        });
        pending.hear_pilot(&state(number, Answer::Accepted));
        assert!(pending.answered(START + 3200 * MS).is_none());
        let (_, said) = pending.answered(START + 3201 * MS).unwrap();
        assert_eq!(said["accepted"], json!(false));
        assert_eq!(said["text"], json!("navigation did not answer within 3 s"));
        assert!(pending.is_empty());
    }

    #[test]
    fn full_is_refused() {
        let mut pending = Pending::default();
        for asker in 0..MAX_WAITING {
            pending.add(Verb::Land, command(), asker).unwrap();
        }
        assert_eq!(pending.add(Verb::Stop, command(), 99), Err((99, "too many orders at once")));
        assert!(pending.give(START, |_| false).is_some(), "no place in shared memory is an answer");
    }

    #[test]
    fn the_lease_belongs_to_the_certificate_that_took_it() {
        let mut pending = Pending::default();
        let take = Command { socket: 17, certificate: Text::new("desk"), ..command() };
        pending.add(Verb::SticksTake, take, ()).unwrap();
        let mut number = 0;
        pending.give(START, |order| {
            number = order.command_sequence;
            true
        });
        let granted = PilotState { lease: 3, holder_socket: 17, ..state(number, Answer::Accepted) };
        pending.hear_pilot(&PilotState { holder_socket: 18, ..granted });
        assert_eq!(pending.holder(), None, "somebody else got it");
        pending.hear_pilot(&granted);
        let holder = Holder { lease: 3, socket: 17, certificate: "desk".to_owned() };
        assert_eq!(pending.holder(), Some(&holder));
        pending.hear_pilot(&PilotState { lease: 3, command_sequence: 0, ..granted });
        assert_eq!(pending.holder(), Some(&holder), "a later order of somebody else unsays nothing");
        pending.hear_pilot(&PilotState { lease: 0, ..granted });
        assert_eq!(pending.holder(), None);
    }
}
