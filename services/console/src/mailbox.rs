//! What waits for one viewer: of each topic the newest message and nothing older, and a short queue of lines (answers,
//! events). A viewer that reads slowly loses messages, never their order, and costs no more memory than this.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::Notify;

/// Lines that wait at most; the oldest goes.
pub(crate) const LINES: usize = 128;
/// Topics with a slot at most; what is on others is lost.
pub(crate) const SLOTS: usize = 64;

#[derive(Debug)]
struct Slot<T> {
    topic: Arc<str>,
    waiting: Option<(u64, T)>,
}

#[derive(Debug)]
struct Inner<T> {
    slots: Vec<Slot<T>>,
    lines: VecDeque<(u64, T)>,
    turn: u64,
}

/// One viewer's messages.
#[derive(Debug)]
pub struct Mailbox<T> {
    inner: Mutex<Inner<T>>,
    wake: Notify,
    dropped: AtomicU64,
}

impl<T> Default for Mailbox<T> {
    fn default() -> Self {
        Self {
            inner: Mutex::new(Inner { slots: Vec::new(), lines: VecDeque::new(), turn: 0 }),
            wake: Notify::new(),
            dropped: AtomicU64::new(0),
        }
    }
}

impl<T> Mailbox<T> {
    fn with<R>(&self, work: impl FnOnce(&mut Inner<T>) -> R) -> R {
        // Whoever panicked with the lock held left a state that is whole after each statement.
        work(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The newest of a topic, in place of one that still waits. It keeps that one's turn, so that a fast topic does not
    /// hold up a slow one.
    pub fn put(&self, topic: &Arc<str>, message: T) {
        let dropped = self.with(|inner| {
            inner.turn += 1;
            let turn = inner.turn;
            if let Some(slot) = inner.slots.iter_mut().find(|slot| slot.topic == *topic) {
                let old = slot.waiting.as_ref().map(|(turn, _)| *turn);
                slot.waiting = Some((old.unwrap_or(turn), message));
                old.is_some()
            } else if inner.slots.len() < SLOTS {
                inner.slots.push(Slot { topic: topic.clone(), waiting: Some((turn, message)) });
                false
            } else {
                true
            }
        });
        self.note(dropped);
    }

    /// A line, after all lines before it.
    pub fn line(&self, message: T) {
        let dropped = self.with(|inner| {
            inner.turn += 1;
            let full = inner.lines.len() >= LINES;
            if full {
                inner.lines.pop_front();
            }
            inner.lines.push_back((inner.turn, message));
            full
        });
        self.note(dropped);
    }

    fn note(&self, dropped: bool) {
        if dropped {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        self.wake.notify_one();
    }

    /// A topic is no longer wanted.
    pub fn forget(&self, topic: &str) {
        self.with(|inner| inner.slots.retain(|slot| &*slot.topic != topic));
    }

    /// Messages that were never read.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// What has waited for longest, lines before topics.
    pub fn take(&self) -> Option<T> {
        self.with(|inner| {
            if let Some((_, line)) = inner.lines.pop_front() {
                return Some(line);
            }
            let next = inner
                .slots
                .iter_mut()
                .filter(|slot| slot.waiting.is_some())
                .min_by_key(|slot| slot.waiting.as_ref().map(|(turn, _)| *turn))?;
            next.waiting.take().map(|(_, message)| message)
        })
    }

    /// The same, waiting for one to come. One task at a time.
    pub async fn next(&self) -> T {
        loop {
            if let Some(message) = self.take() {
                return message;
            }
            self.wake.notified().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(name: &str) -> Arc<str> {
        Arc::from(name)
    }

    #[test]
    fn the_newest_wins_and_nothing_comes_out_of_order() {
        let mailbox = Mailbox::default();
        for k in 0..1000 {
            mailbox.put(&topic("a"), k);
        }
        mailbox.put(&topic("b"), -1);
        mailbox.put(&topic("a"), 1000);
        assert_eq!([mailbox.take(), mailbox.take(), mailbox.take()], [Some(1000), Some(-1), None]);
        assert_eq!(mailbox.dropped(), 1000);
    }

    #[test]
    fn a_fast_topic_does_not_starve_a_slow_one() {
        let mailbox = Mailbox::default();
        mailbox.put(&topic("slow"), 0);
        let mut taken = Vec::new();
        for k in 1..5 {
            mailbox.put(&topic("fast"), k);
            taken.extend(mailbox.take());
        }
        assert_eq!(taken, [0, 2, 3, 4]);
    }

    #[test]
    fn lines_are_bounded_and_the_oldest_goes() {
        let mailbox = Mailbox::default();
        for k in 0..LINES + 10 {
            mailbox.line(k);
        }
        let taken: Vec<usize> = std::iter::from_fn(|| mailbox.take()).collect();
        assert_eq!(taken, (10..LINES + 10).collect::<Vec<_>>());
        assert_eq!(mailbox.dropped(), 10);
    }

    #[test]
    fn no_more_topics_than_slots() {
        let mailbox = Mailbox::default();
        for k in 0..2 * SLOTS {
            mailbox.put(&topic(&k.to_string()), k);
        }
        assert_eq!(std::iter::from_fn(|| mailbox.take()).count(), SLOTS);
    }
}
