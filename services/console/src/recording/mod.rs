//! Recording what drones see: on this console, never on a drone that was not told to.
//!
//! Pictures come from zenoh's threads into one bounded queue; one thread of its own keeps the last seconds of each drone in
//! memory ([`ring`]), writes files ([`film`]) and erases what must go ([`retention`]). Nobody waits for its disk.

mod files;
mod film;
mod retention;
mod ring;
mod settings;
mod take;
mod thread;
mod unit;

pub use settings::RecordingConfig;

use crate::Store;
use crate::app::Clock;
use files::Files;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::runtime::Handle;
use tokio::sync::{Notify, oneshot};
use unit::Unit;

/// Pictures and requests that wait for the thread: some seconds of one drone.
const WAITING: usize = 128;
/// How long a console that stops waits for the last files.
const LAST_WORDS: Duration = Duration::from_secs(3);

/// What a page is told of a drone's recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Now {
    /// Since when, Unix milliseconds; `None` when nobody records.
    pub(crate) since_ms: Option<u64>,
    /// Who began it.
    pub(crate) account: String,
    /// Why the last one ended by itself, or could not begin; empty when all is well.
    pub(crate) trouble: String,
}

/// What the camera is to be asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Wants {
    /// Somebody records, or an incident is being kept.
    pub(crate) records: bool,
    /// Key frames that were asked for.
    pub(crate) key_requests: u32,
}

enum Work {
    Picture {
        drone: Arc<str>,
        unit: Box<Unit>,
    },
    /// Whether the last seconds of a drone are to be kept.
    Roll {
        drone: Arc<str>,
        on: bool,
    },
    Start {
        drone: Arc<str>,
        account: String,
        answer: oneshot::Sender<Result<(), String>>,
    },
    Stop {
        drone: Arc<str>,
        answer: oneshot::Sender<bool>,
    },
    Mark {
        drone: Arc<str>,
        account: String,
        incident: i64,
        answer: oneshot::Sender<Result<(), String>>,
    },
    Erase {
        id: i64,
        by: String,
        answer: oneshot::Sender<Result<bool, String>>,
    },
    End {
        done: std::sync::mpsc::Sender<()>,
    },
}

/// What others may know of the thread's work.
#[derive(Debug, Default)]
struct Shared {
    now: BTreeMap<Arc<str>, Now>,
    wants: BTreeMap<Arc<str>, Wants>,
    /// Files that are being written, and how much of each is whole.
    open: BTreeMap<i64, u64>,
    /// Drones of which the page is to be told anew.
    news: BTreeSet<Arc<str>>,
}

/// The recorder of a console that keeps pictures.
pub(crate) struct Recorder {
    pub(crate) settings: RecordingConfig,
    files: Files,
    work: SyncSender<Work>,
    shared: Arc<Mutex<Shared>>,
    changed: Arc<Notify>,
    refused: AtomicU64,
    lost: AtomicU64,
}

impl Recorder {
    /// Finishes what was left behind and begins; `None` when this console keeps nothing.
    ///
    /// # Errors
    /// One sentence when the folder cannot be used.
    pub(crate) async fn open(
        settings: RecordingConfig,
        data: &Path,
        store: Store,
        clock: Arc<dyn Clock>,
    ) -> Result<Option<Arc<Self>>, String> {
        if !settings.enabled {
            return Ok(None);
        }
        let files = Files::open(data)
            .map_err(|error| format!("the folder of recordings in {}: {error}", data.display()))?;
        let (work, waiting) = sync_channel(WAITING);
        let shared = Arc::new(Mutex::new(Shared::default()));
        let changed = Arc::new(Notify::new());
        let recorder = Arc::new(Self {
            settings,
            files: files.clone(),
            work,
            shared: shared.clone(),
            changed: changed.clone(),
            refused: AtomicU64::new(0),
            lost: AtomicU64::new(0),
        });
        let desk = take::Desk { files, store, clock, runtime: Handle::current() };
        let (ready, is_ready) = oneshot::channel();
        let run = move |waiting: Receiver<Work>| {
            // Who waits for it may have given up.
            let _ = ready.send(desk.tidy());
            thread::Thread::new(settings, desk, shared, changed).run(&waiting);
        };
        std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || run(waiting))
            .map_err(|error| format!("no thread for recordings: {error}"))?;
        is_ready.await.map_err(|_| "the recorder does not begin".to_owned())??;
        Ok(Some(recorder))
    }

    fn shared(&self) -> MutexGuard<'_, Shared> {
        lock(&self.shared)
    }

    /// A message of `camera/video` has come.
    pub(crate) fn hear(&self, drone: &Arc<str>, message: &[u8]) {
        match Unit::read(message) {
            Ok(unit) => {
                let picture = Work::Picture { drone: drone.clone(), unit: Box::new(unit) };
                if self.work.try_send(picture).is_err() {
                    self.lost.fetch_add(1, Ordering::Relaxed);
                }
            }
            Err(why) => {
                if self.refused.fetch_add(1, Ordering::Relaxed) == 0 {
                    tracing::warn!("{drone} sends {why}: it is not recorded");
                }
            }
        }
    }

    /// Messages that were no video, since the start.
    pub(crate) fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }

    /// Pictures that came faster than the disk takes them, since the start.
    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    async fn ask<T>(&self, work: impl FnOnce(oneshot::Sender<T>) -> Work) -> Result<T, String> {
        let (answer, answered) = oneshot::channel();
        let (queue, work) = (self.work.clone(), work(answer));
        // The queue is full for as long as a disk hangs: that is waited for elsewhere.
        let sent = tokio::task::spawn_blocking(move || queue.send(work).is_ok());
        if !sent.await.unwrap_or(false) {
            return Err("the recorder has ended".to_owned());
        }
        answered.await.map_err(|_| "the recorder has ended".to_owned())
    }

    /// Begins to record a drone.
    pub(crate) async fn start(&self, drone: &Arc<str>, account: &str) -> Result<(), String> {
        let (drone, account) = (drone.clone(), account.to_owned());
        self.ask(|answer| Work::Start { drone, account, answer }).await?
    }

    /// Ends it; false when nobody was recording.
    pub(crate) async fn stop(&self, drone: &Arc<str>) -> Result<bool, String> {
        let drone = drone.clone();
        self.ask(|answer| Work::Stop { drone, answer }).await
    }

    /// Keeps the last seconds of a drone and what follows, for an incident.
    pub(crate) async fn mark(&self, drone: &Arc<str>, account: &str, incident: i64) -> Result<(), String> {
        let (drone, account) = (drone.clone(), account.to_owned());
        self.ask(|answer| Work::Mark { drone, account, incident, answer }).await?
    }

    /// Erases a recording; false when there is none.
    pub(crate) async fn erase(&self, id: i64, by: &str) -> Result<bool, String> {
        let by = by.to_owned();
        self.ask(|answer| Work::Erase { id, by, answer }).await?
    }

    /// Whether the last seconds of a drone are to be kept from now on.
    pub(crate) fn roll(&self, drone: &Arc<str>, on: bool) {
        // Said again each second.
        let _ = self.work.try_send(Work::Roll { drone: drone.clone(), on });
    }

    /// What pages are to know of a drone.
    pub(crate) fn now(&self, drone: &str) -> Now {
        self.shared().now.get(drone).cloned().unwrap_or_default()
    }

    /// What is wanted of its camera.
    pub(crate) fn wants(&self, drone: &str) -> Wants {
        self.shared().wants.get(drone).copied().unwrap_or_default()
    }

    /// Where a recording's file is, and how much of it is whole when it is still being written.
    pub(crate) fn file(&self, id: i64) -> (PathBuf, Option<u64>) {
        (self.files.path(id), self.shared().open.get(&id).copied())
    }

    /// Waits until something has changed, and takes of which drones.
    pub(crate) async fn news(&self) -> BTreeSet<Arc<str>> {
        loop {
            let changed = self.changed.notified();
            let news = std::mem::take(&mut self.shared().news);
            if !news.is_empty() {
                return news;
            }
            changed.await;
        }
    }

    /// Finishes all files.
    pub(crate) fn end(&self) {
        let (done, is_done) = std::sync::mpsc::channel();
        if self.work.try_send(Work::End { done }).is_ok() {
            // Should it take longer, the next start finishes them.
            let _ = is_done.recv_timeout(LAST_WORDS);
        }
    }
}

/// Whoever panicked with the lock held left it whole: each change is one statement.
fn lock(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
