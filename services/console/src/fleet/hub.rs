//! Who looks at which topic of one drone. A topic is subscribed while somebody looks; all viewers share one message.

use crate::mailbox::Mailbox;
use axum::body::Bytes;
use axum::extract::ws::{Message, Utf8Bytes};
use std::collections::BTreeMap;
use std::sync::{Arc, Weak};
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

/// One page's messages.
pub(crate) type Box = Arc<Mailbox<Message>>;

/// Larger messages are not relayed: a full particle set is 1.6 MB.
const LARGEST: usize = 2 * 1024 * 1024;

/// A topic that somebody looks at.
struct Topic {
    name: Arc<str>,
    newest: Option<Message>,
    viewers: Vec<Weak<Mailbox<Message>>>,
    /// Dropped, and with it undeclared, when nobody looks any more.
    subscriber: Option<Subscriber<()>>,
    /// Looked at by the console itself.
    kept: bool,
}

/// One drone's topics.
#[derive(Default)]
pub(super) struct Hub {
    topics: BTreeMap<Arc<str>, Topic>,
    /// Who wants lines.
    watchers: Vec<Weak<Mailbox<Message>>>,
}

fn same(one: &Weak<Mailbox<Message>>, other: &Box) -> bool {
    std::ptr::eq(one.as_ptr(), Arc::as_ptr(other))
}

impl Hub {
    /// A page wants these topics from now on and no others. Returns those to be subscribed, and what is to be dropped
    /// once the hub is no longer locked.
    pub(super) fn want(&mut self, page: &Box, topics: &[String]) -> (Vec<Arc<str>>, Vec<Subscriber<()>>) {
        let dropped = self.leave(page, |name| topics.iter().any(|topic| **topic == *name));
        let mut fresh = Vec::new();
        for name in topics {
            let topic = self.topic(name, &mut fresh);
            if topic.viewers.iter().any(|viewer| same(viewer, page)) {
                continue;
            }
            topic.viewers.push(Arc::downgrade(page));
            if let Some(newest) = &topic.newest {
                page.put(&topic.name, newest.clone());
            }
        }
        (fresh, dropped)
    }

    /// The console itself wants a topic.
    pub(super) fn keep(&mut self, name: &str) -> Vec<Arc<str>> {
        let mut fresh = Vec::new();
        self.topic(name, &mut fresh).kept = true;
        fresh
    }

    fn topic(&mut self, name: &str, fresh: &mut Vec<Arc<str>>) -> &mut Topic {
        let name: Arc<str> = Arc::from(name);
        self.topics.entry(name.clone()).or_insert_with(|| {
            fresh.push(name.clone());
            Topic { name, newest: None, viewers: Vec::new(), subscriber: None, kept: false }
        })
    }

    fn leave(&mut self, page: &Box, stays: impl Fn(&str) -> bool) -> Vec<Subscriber<()>> {
        let mut dropped = Vec::new();
        self.topics.retain(|name, topic| {
            if !stays(name) {
                topic.viewers.retain(|viewer| !same(viewer, page));
                page.forget(name);
            }
            topic.viewers.retain(|viewer| viewer.strong_count() > 0);
            let wanted = topic.kept || !topic.viewers.is_empty() || stays(name);
            if !wanted {
                dropped.extend(topic.subscriber.take());
            }
            wanted
        });
        dropped
    }

    /// A page is gone.
    pub(super) fn close(&mut self, page: &Box) -> Vec<Subscriber<()>> {
        self.watchers.retain(|watcher| !same(watcher, page) && watcher.strong_count() > 0);
        self.leave(page, |_| false)
    }

    /// A topic is subscribed. Given back when nobody wants it any more.
    pub(super) fn subscribed(&mut self, name: &str, subscriber: Subscriber<()>) -> Option<Subscriber<()>> {
        match self.topics.get_mut(name) {
            Some(topic) => topic.subscriber.replace(subscriber),
            None => Some(subscriber),
        }
    }

    /// A message has come.
    pub(super) fn relay(&mut self, name: &str, message: Message) {
        let Some(topic) = self.topics.get_mut(name) else { return };
        topic.viewers.retain(|viewer| match viewer.upgrade() {
            Some(page) => {
                page.put(&topic.name, message.clone());
                true
            }
            None => false,
        });
        topic.newest = Some(message);
    }

    /// The answer to a question for the newest: only for those who have nothing yet.
    pub(super) fn relay_old(&mut self, name: &str, message: Message) {
        if self.topics.get(name).is_some_and(|topic| topic.newest.is_none()) {
            self.relay(name, message);
        }
    }

    /// What came before the drone was lost is not shown to who comes after.
    pub(super) fn forget(&mut self) {
        for topic in self.topics.values_mut() {
            topic.newest = None;
        }
    }

    /// A page wants lines.
    pub(super) fn watch(&mut self, page: &Box) {
        self.watchers.push(Arc::downgrade(page));
    }

    /// A line for all who want them.
    pub(super) fn line(&mut self, message: &Message) {
        self.watchers.retain(|watcher| match watcher.upgrade() {
            Some(page) => {
                page.line(message.clone());
                true
            }
            None => false,
        });
    }

    #[cfg(test)]
    pub(super) fn names(&self) -> Vec<&str> {
        self.topics.keys().map(|name| &**name).collect()
    }
}

/// Whether a page may ask for it: a plain key of at most six parts, no wildcard.
pub(crate) fn is_topic(name: &str) -> bool {
    name.len() <= 64
        && name.split('/').count() <= 6
        && name.split('/').all(|part| {
            !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-'))
        })
}

/// A sample as pages get it; `None` for what is no message.
pub(super) fn message(topic: &str, sample: &Sample) -> Option<Message> {
    if sample.payload().len() > LARGEST {
        return None;
    }
    let bytes = sample.payload().to_bytes();
    if sample.encoding().to_string().starts_with("application/json") {
        // Only what is JSON gets into a line of JSON.
        serde_json::from_slice::<serde::de::IgnoredAny>(&bytes).ok()?;
        let data = std::str::from_utf8(&bytes).ok()?;
        Some(Message::Text(Utf8Bytes::from(format!("{{\"topic\":\"{topic}\",\"data\":{data}}}"))))
    } else {
        let mut out = Vec::with_capacity(1 + topic.len() + bytes.len());
        out.push(u8::try_from(topic.len()).ok()?);
        out.extend_from_slice(topic.as_bytes());
        out.extend_from_slice(&bytes);
        Some(Message::Binary(Bytes::from(out)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(of: &str) -> Message {
        Message::Text(Utf8Bytes::from(of.to_owned()))
    }

    #[test]
    fn a_topic_lives_while_somebody_looks() {
        let mut hub = Hub::default();
        let (one, two) = (Box::default(), Box::default());
        let a = "a/b".to_owned();
        assert_eq!(hub.want(&one, std::slice::from_ref(&a)).0.len(), 1);
        assert_eq!(hub.want(&two, std::slice::from_ref(&a)).0.len(), 0, "subscribed once");
        hub.relay("a/b", text("1"));
        assert_eq!(one.take(), Some(text("1")));
        hub.want(&one, &[]);
        hub.relay("a/b", text("2"));
        assert_eq!(one.take(), None);
        assert_eq!(two.take(), Some(text("2")));
        let late = Box::default();
        hub.want(&late, std::slice::from_ref(&a));
        assert_eq!(late.take(), Some(text("2")), "a late viewer gets the newest");
        hub.close(&late);
        drop(two);
        hub.want(&one, &[]);
        assert!(hub.names().is_empty());
        hub.keep("a/b");
        hub.close(&one);
        assert_eq!(hub.names(), ["a/b"], "the console itself looks");
    }

    #[test]
    fn wildcards_are_no_topics() {
        for name in ["", "*", "a/**", "a//b", "/a", "a/", "a$", "a?b", "a/b/c/d/e/f/g", "ñ"] {
            assert!(!is_topic(name), "{name}");
        }
        assert!(is_topic("localization/pose") && is_topic("health/sonar"));
    }
}
