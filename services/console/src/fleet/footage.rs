//! Pictures for the recorder: subscribed and wished for while somebody records, and while the last seconds are kept.
//!
//! The last seconds of a drone are kept while it flies and while a page of this console has its video open, and for half a minute
//! after. A flight alone asks the camera for a small picture, as who looks does, so that it decides over nobody's choice;
//! whoever only watches has asked already. A recording asks as a recorder.

use super::camera::VideoWish;
use super::{Drone, Fleet};
use crate::recording::{Now, Recorder};
use axum::extract::ws::{Message, Utf8Bytes};
use ipc_types::{Message as _, Video};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;
use tokio::time::{Instant, interval};
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

/// How often it is looked whether pictures are wanted.
const LOOK: Duration = Duration::from_secs(1);
/// The last seconds are kept for so long after the reason for it is gone.
const AFTER: Duration = Duration::from_secs(30);
/// What a recording asks for: the thesis's picture.
const RECORDING: VideoWish = VideoWish { width: 1280, height: 720, fps: 15, rolling: false, key_requests: 0 };
/// What the last seconds of a flight ask for.
const ROLLING: VideoWish = VideoWish { width: 640, height: 480, fps: 15, rolling: true, key_requests: 0 };

/// A drone's pictures on their way to the recorder.
#[derive(Default)]
pub(super) struct Footage {
    subscriber: Mutex<Option<Subscriber<()>>>,
    viewers: AtomicUsize,
    until: Mutex<Option<Instant>>,
    /// What pages were told last, when, and for how long it had been recorded then.
    told: Mutex<Option<(Now, Instant, Duration)>>,
}

/// A page that has the video open.
pub(super) struct Viewer(Arc<Drone>);

impl Viewer {
    pub(super) fn of(drone: &Arc<Drone>) -> Self {
        drone.footage.viewers.fetch_add(1, Ordering::Relaxed);
        Self(drone.clone())
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.footage.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Footage {
    /// What a page that comes is told: for how long, since its own clock may be wrong.
    pub(super) fn line(&self) -> Option<Message> {
        let told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let (now, at, lasted) = told.as_ref()?;
        let mut line = serde_json::json!({ "recording": now });
        if let Some(fields) = line.get_mut("recording").and_then(serde_json::Value::as_object_mut) {
            let lasts_ms = u64::try_from((*lasted + at.elapsed()).as_millis()).unwrap_or(u64::MAX);
            fields.insert("lasts_ms".to_owned(), now.since_ms.map(|_| lasts_ms).into());
        }
        Some(Message::Text(Utf8Bytes::from(line.to_string())))
    }

    /// Whether the last seconds are to be kept, while there is (or is not) a reason for it.
    fn rolls(&self, reason: bool, now: Instant) -> bool {
        let mut until = self.until.lock().unwrap_or_else(PoisonError::into_inner);
        if reason {
            *until = Some(now + AFTER);
        }
        until.is_some_and(|until| now < until)
    }
}

/// Supplies the recorder for as long as there is a fleet.
pub(super) async fn supply(fleet: Weak<Fleet>, recorder: Arc<Recorder>) {
    let mut turn = interval(LOOK);
    loop {
        let news = tokio::select! {
            _ = turn.tick() => BTreeSet::new(),
            news = recorder.news() => news,
        };
        let Some(fleet) = fleet.upgrade() else { return };
        for drone in fleet.all() {
            if news.contains(&drone.name) {
                let now = recorder.now(&drone.name);
                let lasted_ms =
                    now.since_ms.map_or(0, |since_ms| fleet.clock.now_ms().saturating_sub(since_ms));
                drone.tell_recording(now, Duration::from_millis(lasted_ms));
            }
            fleet.supply(&drone, &recorder).await;
        }
    }
}

impl Drone {
    fn tell_recording(&self, now: Now, lasted: Duration) {
        *self.footage.told.lock().unwrap_or_else(PoisonError::into_inner) =
            Some((now, Instant::now(), lasted));
        if let Some(line) = self.footage.line() {
            self.hub().line(&line);
        }
    }
}

impl Fleet {
    async fn supply(self: &Arc<Self>, drone: &Arc<Drone>, recorder: &Arc<Recorder>) {
        let flies = drone.is_alive() && drone.memory().follower.flies();
        let watched = drone.is_alive() && drone.footage.viewers.load(Ordering::Relaxed) > 0;
        let rolls = recorder.settings.rolling_s > 0 && drone.footage.rolls(flies || watched, Instant::now());
        recorder.roll(&drone.name, rolls);
        let wants = recorder.wants(&drone.name);
        let wish = match (wants.records, flies && rolls) {
            _ if !drone.is_alive() => None,
            (true, _) => Some(RECORDING),
            (false, true) => Some(ROLLING),
            (false, false) => None,
        };
        self.want_video(drone, wish.map(|wish| VideoWish { key_requests: wants.key_requests, ..wish }));
        let wanted = rolls || wants.records;
        let has = drone.footage.subscriber.lock().unwrap_or_else(PoisonError::into_inner).is_some();
        if wanted && !has {
            self.begin_video(drone, recorder).await;
        } else if !wanted && has {
            let gone = drone.footage.subscriber.lock().unwrap_or_else(PoisonError::into_inner).take();
            drop(gone);
        }
    }

    async fn begin_video(&self, drone: &Drone, recorder: &Arc<Recorder>) {
        let expected = format!(
            "application/octet-stream;schema=sereno/Video/{:016x}",
            <Video as ipc_types::Field>::LAYOUT
        );
        let (to, name) = (Arc::downgrade(recorder), drone.name.clone());
        let heard = move |sample: Sample| {
            let Some(recorder) = to.upgrade() else { return };
            // A drone of another version may lay it out in another way: nothing of it is read.
            let known = sample.encoding().to_string() == expected;
            recorder.hear(
                &name,
                if known { sample.payload().to_bytes() } else { std::borrow::Cow::Borrowed(&[][..]) }
                    .as_ref(),
            );
        };
        let key = format!("sereno/{}/telemetry/{}", drone.name, Video::TOPIC);
        match self.session.declare_subscriber(key).callback(heard).await {
            Ok(subscriber) => {
                let mut place = drone.footage.subscriber.lock().unwrap_or_else(PoisonError::into_inner);
                *place = Some(subscriber);
            }
            Err(error) => tracing::warn!("no video of {} for recordings: {error}", drone.name),
        }
    }
}
