//! What the apps watch, and what the drone is therefore asked for: its link is narrow.

use super::channels::Channels;
use anyhow::Result;
use bridge::remote::{Following, Heard, Remote};
use foxglove::websocket::{ChannelView, Client, ServerListener};
use serde_json::json;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A wish for pictures holds for two seconds.
const WISH: Duration = Duration::from_secs(1);
/// Without these nothing can be put where it is.
const ALWAYS: [&str; 2] = ["localization/pose", "sonar/ranges"];

/// Notes which channels somebody has begun to watch.
#[derive(Debug, Default)]
pub(crate) struct Begun {
    topics: Mutex<Vec<String>>,
    count: AtomicU64,
}

impl Begun {
    /// What was begun since the last look.
    pub(crate) fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.topics.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// How often anybody has begun to watch anything.
    pub(crate) fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    fn note(&self, topic: &str) {
        self.count.fetch_add(1, Ordering::Relaxed);
        let mut topics = self.topics.lock().unwrap_or_else(PoisonError::into_inner);
        // Bounded by the number of channels, however often somebody comes and goes between two looks.
        if !topics.iter().any(|known| known == topic) {
            topics.push(topic.to_owned());
        }
    }
}

impl ServerListener for Begun {
    fn on_subscribe(&self, _: Client, channel: ChannelView) {
        self.note(channel.topic());
    }
}

/// Subscriptions to what is watched now.
pub(crate) struct Watched<'a> {
    remote: &'a Remote,
    following: BTreeMap<String, Following>,
    to: SyncSender<(String, Heard)>,
    lost: Arc<AtomicU64>,
    wished: Option<Instant>,
}

impl<'a> Watched<'a> {
    /// Messages will go into `to`; those that find it full are lost and counted.
    pub(crate) fn new(remote: &'a Remote, to: SyncSender<(String, Heard)>) -> Self {
        Self { remote, following: BTreeMap::new(), to, lost: Arc::default(), wished: None }
    }

    /// Messages that came faster than they were passed on.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Follows what `channels` has viewers for, and nothing else.
    pub(crate) fn adjust(&mut self, channels: &Channels) -> Result<()> {
        for topic in channels.topics() {
            let wanted = ALWAYS.contains(&topic) || channels.is_watched(topic);
            if !wanted {
                self.following.remove(topic);
            } else if !self.following.contains_key(topic) {
                let (to, lost, name) = (self.to.clone(), Arc::clone(&self.lost), topic.to_owned());
                let pass = move |heard| {
                    if to.try_send((name.clone(), heard)).is_err() {
                        lost.fetch_add(1, Ordering::Relaxed);
                    }
                };
                let following = self.remote.follow_with(topic, pass).map_err(anyhow::Error::msg)?;
                self.following.insert(topic.to_owned(), following);
            }
        }
        Ok(())
    }

    /// Keeps the camera awake while its pictures are watched. Another number asks for a key frame, where a decoder can begin:
    /// when somebody has begun to watch, and when a picture may have been lost.
    pub(crate) fn wish(&mut self, begun: u64) -> Result<()> {
        if self.wished.is_some_and(|wished| wished.elapsed() < WISH) {
            return Ok(());
        }
        self.wished = Some(Instant::now());
        let wish = json!({ "video": { "width": 640, "height": 480, "fps": 15 }, "still": false, "rolling": true,
            "key_requests": begun.wrapping_add(self.lost()) });
        self.remote.wish(&wish.to_string()).map_err(anyhow::Error::msg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_begun_is_named_once_and_counted_each_time() {
        let begun = Begun::default();
        for topic in ["/plan", "/video", "/plan"] {
            begun.note(topic);
        }
        assert_eq!((begun.take(), begun.count()), (vec!["/plan".to_owned(), "/video".to_owned()], 3));
        assert!(begun.take().is_empty());
    }
}
