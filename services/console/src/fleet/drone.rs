//! One drone as the console knows it.

use super::camera::Camera;
use super::footage::Footage;
use super::hub::{Box, Hub};
use crate::round::{Event, Follower, News, Place};
use axum::body::Bytes;
use axum::extract::ws::{Message, Utf8Bytes};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;

/// Lines that a page gets when it comes.
const REMEMBERED: usize = 100;

/// What changes rarely.
pub(super) struct Memory {
    pub(super) follower: Follower,
    pub(super) events: VecDeque<Message>,
    pub(super) about: Option<Arc<str>>,
    pub(super) simulated: Option<bool>,
    /// The plan, and whether it may be another one by now.
    pub(super) plan: Option<Bytes>,
    pub(super) plan_is_old: bool,
}

/// A drone that was heard of.
pub struct Drone {
    pub(crate) name: Arc<str>,
    pub(super) alive: AtomicBool,
    /// The newest beacon; 0 before any.
    pub(super) beacon_ns: tokio::sync::watch::Sender<u64>,
    pub(super) camera: Camera,
    pub(super) footage: Footage,
    hub: Mutex<Hub>,
    memory: Mutex<Memory>,
    /// Sockets of sticks, which get each beacon at once, with their numbers.
    sticks: Mutex<Vec<(u64, Weak<crate::mailbox::Mailbox<Message>>)>>,
    /// Whoever subscribes or unsubscribes does it alone.
    pub(super) turn: tokio::sync::Mutex<()>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Each change under these locks is whole after each statement.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drone {
    pub(super) fn new(name: &str) -> Self {
        Self {
            name: Arc::from(name),
            alive: AtomicBool::new(false),
            beacon_ns: tokio::sync::watch::Sender::new(0),
            camera: Camera::default(),
            footage: Footage::default(),
            hub: Mutex::new(Hub::default()),
            memory: Mutex::new(Memory {
                follower: Follower::new(name),
                events: VecDeque::new(),
                about: None,
                simulated: None,
                plan: None,
                plan_is_old: true,
            }),
            sticks: Mutex::new(Vec::new()),
            turn: tokio::sync::Mutex::new(()),
        }
    }

    /// Whether it is reached.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.alive.load(Ordering::Acquire)
    }

    /// Whether it flies in a simulator; `None` while it has not said so.
    #[must_use]
    pub fn simulated(&self) -> Option<bool> {
        self.memory().simulated
    }

    /// Where it is.
    #[must_use]
    pub fn place(&self) -> Option<Place> {
        self.memory().follower.place()
    }

    /// How old something is that was there at `then_ns` of the drone's clock; `None` while its clock is not known.
    pub(crate) fn age(&self, then_ns: u64) -> Option<Duration> {
        let now_ns = *self.beacon_ns.borrow();
        (now_ns > 0).then(|| Duration::from_nanos(now_ns.saturating_sub(then_ns)))
    }

    /// Who holds its sticks.
    #[must_use]
    pub fn holder(&self) -> String {
        self.memory().follower.holder().to_owned()
    }

    /// Never locked together with [`Self::memory`].
    pub(super) fn hub(&self) -> MutexGuard<'_, Hub> {
        lock(&self.hub)
    }

    pub(super) fn memory(&self) -> MutexGuard<'_, Memory> {
        lock(&self.memory)
    }

    /// A page begins to look: whether the drone is there, and what happened of late.
    pub(crate) fn watch(&self, page: &Box) {
        page.line(self.alive_line());
        if let Some(line) = self.footage.line() {
            page.line(line);
        }
        for event in &self.memory().events {
            page.line(event.clone());
        }
        self.hub().watch(page);
    }

    pub(super) fn alive_line(&self) -> Message {
        Message::Text(Utf8Bytes::from(serde_json::json!({ "alive": self.is_alive() }).to_string()))
    }

    /// A socket of sticks begins.
    pub(crate) fn add_sticks(&self, socket: u64, page: &Box) {
        lock(&self.sticks).push((socket, Arc::downgrade(page)));
    }

    /// A beacon has come: on to every socket of sticks, with its number.
    pub(super) fn beacon(&self, topic: &Arc<str>, beacon_ns: u64) {
        self.beacon_ns.send_replace(beacon_ns);
        lock(&self.sticks).retain(|(socket, page)| match page.upgrade() {
            Some(page) => {
                let text = format!("{{\"beacon_ns\":{beacon_ns},\"socket\":{socket}}}");
                page.put(topic, Message::Text(Utf8Bytes::from(text)));
                true
            }
            None => false,
        });
    }

    /// Shows events to the pages; returns the reports.
    pub(super) fn publish(&self, news: Vec<News>) -> Vec<crate::round::Report> {
        let mut reports = Vec::new();
        for one in news {
            match one {
                News::Event(event) => self.event(&event),
                News::Report(report) => reports.push(*report),
            }
        }
        reports
    }

    /// A line for the event log.
    pub(super) fn event(&self, event: &Event) {
        let line = Message::Text(Utf8Bytes::from(serde_json::json!({ "event": event }).to_string()));
        {
            let mut memory = self.memory();
            if memory.events.len() >= REMEMBERED {
                memory.events.pop_front();
            }
            memory.events.push_back(line.clone());
        }
        self.hub().line(&line);
    }
}
