//! What is done at once with what comes in: whoever is not known, too quick or too loud goes no further.

use crate::about::About;
use crate::edit::{MAX_EDIT, MAX_PICTURE};
use crate::gate::{Class, Limits};
use crate::keys::{Keys, part, verb_from_word};
use crate::network::{Answer, Asker, Heard, HeardSticks, Losses};
use crate::pending::refusal;
use crate::roles::Clients;
use crate::sessions::Hearing;
use crate::wishes::MAX_WISH;
use crate::zenoh_config::{MAX_ORDER, MAX_SIGNAL};
use ipc_types::Verb;
use runtime::Waker;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::bytes::Encoding;
use zenoh::query::Query;
use zenoh::sample::Sample;

/// What callbacks of all sessions share.
pub(crate) struct Ear {
    pub(crate) keys: Keys,
    pub(crate) about: Arc<About>,
    pub(crate) clients: Arc<Mutex<Arc<Clients>>>,
    pub(crate) limits: Mutex<Limits>,
    pub(crate) orders: SyncSender<Heard>,
    pub(crate) urgent: SyncSender<Heard>,
    pub(crate) others: SyncSender<Heard>,
    pub(crate) sticks: SyncSender<HeardSticks>,
    pub(crate) answers: SyncSender<Answer>,
    pub(crate) losses: Arc<Losses>,
    pub(crate) waker: Waker,
}

impl Ear {
    fn lose(&self) {
        self.losses.refused.fetch_add(1, Ordering::Relaxed);
    }

    fn may(&self, certificate: &str, class: Class) -> bool {
        let now = runtime::monotonic_ns();
        self.limits.lock().unwrap_or_else(PoisonError::into_inner).take(now, certificate, class)
    }

    fn knows(&self, certificate: &str) -> bool {
        let clients = Arc::clone(&self.clients.lock().unwrap_or_else(PoisonError::into_inner));
        clients.role(certificate).is_some()
    }

    fn say(&self, asker: Asker, payload: Option<(Encoding, Vec<u8>)>) {
        if self.answers.try_send(Answer { asker, payload }).is_err() {
            self.lose();
        }
    }

    fn refuse(&self, asker: Asker, sentence: &str) {
        self.lose();
        self.say(asker, Some((Encoding::APPLICATION_JSON, refusal(sentence).to_string().into_bytes())));
    }

    fn hand_over(&self, queue: &SyncSender<Heard>, heard: Heard) {
        match queue.try_send(heard) {
            Ok(()) => self.waker.wake(),
            Err(error) => {
                let (TrySendError::Full(heard) | TrySendError::Disconnected(heard)) = error;
                match heard {
                    Heard::Order { asker, .. } | Heard::Edit { asker, .. } => {
                        self.refuse(asker, "too many orders at once");
                    }
                    _ => self.lose(),
                }
            }
        }
    }
}

impl Hearing for Ear {
    fn keys(&self) -> &Keys {
        &self.keys
    }

    fn known(&self, clients: Clients) {
        *self.clients.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(clients);
    }

    fn order(&self, query: Query) {
        let key = query.key_expr().as_str().to_owned();
        let asker = Asker { query, key: key.clone() };
        let (Some(word), Some(certificate)) = (part(&key, 3), part(&key, 4)) else {
            return self.refuse(asker, "this key is no order: sereno/DRONE/command/VERB/CERTIFICATE is");
        };
        let Some(verb) = verb_from_word(word) else {
            let words: Vec<String> = Verb::ALL.iter().map(|verb| crate::keys::verb_word(*verb)).collect();
            let word = manifest::plain(&word.chars().take(40).collect::<String>());
            return self.refuse(asker, &format!("{word} is no order: there are {}", words.join(", ")));
        };
        if !self.knows(certificate) {
            return self.refuse(asker, "this certificate is not on the drone's list of clients");
        }
        if !self.may(certificate, Class::of(verb)) {
            return self.refuse(asker, "too many orders: not so fast");
        }
        let json = asker.query.payload().map(|payload| payload.to_bytes().into_owned()).unwrap_or_default();
        if json.len() > MAX_ORDER {
            return self.refuse(
                asker,
                &format!("an order of {} bytes: allowed are at most {MAX_ORDER}", json.len()),
            );
        }
        let queue = if Class::of(verb) == Class::Urgent { &self.urgent } else { &self.orders };
        self.hand_over(queue, Heard::Order { certificate: certificate.to_owned(), verb, json, asker });
    }

    fn edit(&self, query: Query) {
        let key = query.key_expr().as_str().to_owned();
        let asker = Asker { query, key: key.clone() };
        let Some(certificate) = part(&key, 3) else {
            return self.refuse(asker, "this key is no change: sereno/DRONE/edit/CERTIFICATE is");
        };
        if !self.knows(certificate) {
            return self.refuse(asker, "this certificate is not on the drone's list of clients");
        }
        if !self.may(certificate, Class::Edit) {
            return self.refuse(asker, "too many changes: not so fast");
        }
        let json = asker.query.payload().map(|payload| payload.to_bytes().into_owned()).unwrap_or_default();
        let picture = asker.query.attachment().map(|picture| picture.to_bytes().into_owned());
        let size = picture.as_ref().map_or(0, Vec::len);
        if json.len() > MAX_EDIT || size > MAX_PICTURE {
            let sentence = format!(
                "a change of {} bytes and a picture of {size}: allowed are at most {MAX_EDIT} and {MAX_PICTURE}",
                json.len()
            );
            return self.refuse(asker, &sentence);
        }
        self.hand_over(
            &self.others,
            Heard::Edit { certificate: certificate.to_owned(), json, picture, asker },
        );
    }

    fn sticks(&self, sample: &Sample) {
        let Some(certificate) = part(sample.key_expr().as_str(), 3) else { return self.lose() };
        let fits = sample.payload().len() <= MAX_ORDER;
        if !(fits && self.knows(certificate) && self.may(certificate, Class::Sticks)) {
            return self.lose();
        }
        let heard = HeardSticks {
            certificate: certificate.to_owned(),
            json: sample.payload().to_bytes().into_owned(),
        };
        match self.sticks.try_send(heard) {
            Ok(()) => self.waker.wake(),
            Err(_) => self.lose(),
        }
    }

    fn signal(&self, sample: &Sample) {
        let key = sample.key_expr().as_str();
        let (Some(certificate), Some(session)) = (part(key, 3), part(key, 4)) else { return self.lose() };
        let fits = sample.payload().len() <= MAX_SIGNAL && session.len() <= crate::roles::MAX_NAME;
        if !(fits && self.knows(certificate) && self.may(certificate, Class::Other)) {
            return self.lose();
        }
        let json = sample.payload().to_bytes().into_owned();
        let heard = Heard::Signal { certificate: certificate.to_owned(), session: session.to_owned(), json };
        self.hand_over(&self.others, heard);
    }

    fn wish(&self, sample: &Sample) {
        let Some(certificate) = part(sample.key_expr().as_str(), 3) else { return self.lose() };
        let fits = sample.payload().len() <= MAX_WISH;
        if !(fits && self.knows(certificate) && self.may(certificate, Class::Other)) {
            return self.lose();
        }
        let json = sample.payload().to_bytes().into_owned();
        self.hand_over(&self.others, Heard::Wish { certificate: certificate.to_owned(), json });
    }

    fn newest(&self, query: Query) {
        // Behind `sereno/<drone>/telemetry/`; the drone may be a wildcard, the topic may not.
        let topic = query.key_expr().as_str().splitn(4, '/').nth(3).map(str::to_owned);
        let key = self.keys.telemetry(topic.as_deref().unwrap_or_default());
        let asker = Asker { query, key };
        // A question that names no single topic is answered by nobody.
        match topic.filter(|topic| !topic.contains('*')) {
            Some(topic) if self.may("", Class::Other) => {
                self.hand_over(&self.others, Heard::Newest { topic, asker });
            }
            _ => self.lose(),
        }
    }

    fn about(&self, query: Query) {
        let json = self.about.json.clone().into_bytes();
        self.say(Asker { query, key: self.keys.about() }, Some((Encoding::APPLICATION_JSON, json)));
    }

    fn plan(&self, query: Query) {
        let asker = Asker { query, key: self.keys.plan() };
        self.say(asker, Some((Encoding::IMAGE_PNG, self.about.plan.clone())));
    }
}
