//! All viewers, on a runtime of their own beside the service's loop.

use crate::line::for_all;
use crate::session::{Ends, QUEUE, Told, Unit, run};
use crate::viewer::LineState;
use crate::{Call, Choice, FromViewer, Party, StreamConfig, ToViewer};
use ipc_types::Format;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{mpsc, watch};

/// Messages that wait for the service or for one session.
const SAID: usize = 256;
const INBOX: usize = 80;

/// Who a session is with.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Who {
    pub certificate: String,
    pub session: String,
}

/// Something for a viewer, and whether the session ends with it.
pub(crate) struct Said {
    pub who: Who,
    pub message: ToViewer,
    /// Number of the session that has ended.
    pub ended: Option<u64>,
}

struct Session {
    who: Who,
    party: Party,
    inbox: mpsc::Sender<FromViewer>,
    frames: mpsc::Sender<Arc<Unit>>,
    dropped: Arc<AtomicU64>,
    line: Arc<LineState>,
}

/// The sessions. Dropped, it ends them all.
pub(crate) struct Hub {
    runtime: Runtime,
    config: Arc<StreamConfig>,
    sessions: Vec<Session>,
    said: mpsc::Receiver<Said>,
    say: mpsc::Sender<Said>,
    told: watch::Sender<Told>,
    key_requests: Arc<AtomicU64>,
    number: u64,
    seed: u64,
    wake: runtime::Waker,
}

impl Hub {
    pub(crate) fn new(config: StreamConfig, seed: u64, wake: runtime::Waker) -> std::io::Result<Self> {
        let runtime =
            Builder::new_multi_thread().worker_threads(2).thread_name("viewers").enable_all().build()?;
        let (say, said) = mpsc::channel(SAID);
        Ok(Self {
            runtime,
            config: Arc::new(config),
            sessions: Vec::new(),
            said,
            say,
            told: watch::channel(Told::default()).0,
            key_requests: Arc::default(),
            number: 0,
            seed,
            wake,
        })
    }

    /// Takes a message of a viewer; the sentence says why it was refused.
    pub(crate) fn hear(&mut self, who: Who, account: &str, message: FromViewer) -> Result<(), String> {
        let known = self.sessions.iter_mut().find(|session| session.who == who);
        match (known, message) {
            (None, FromViewer::Call(call)) => self.begin(who, account, call),
            (None, FromViewer::HangUp(_)) => Ok(()),
            (None, _) => Err("there is no such session: call first".to_owned()),
            (Some(session), message) => {
                if let FromViewer::Call(call) = &message {
                    session.party.format = call.format();
                }
                session.inbox.try_send(message).map_err(|_| "too many messages at once".to_owned())
            }
        }
    }

    fn begin(&mut self, who: Who, account: &str, call: Call) -> Result<(), String> {
        if self.sessions.len() >= self.config.viewers as usize {
            return Err(format!("{} viewers are watching already: no more are allowed", self.sessions.len()));
        }
        self.number += 1;
        let (inbox, messages) = mpsc::channel(INBOX);
        let (frames, queue) = mpsc::channel(QUEUE);
        let (say, mut replies) = mpsc::channel::<ToViewer>(INBOX);
        let dropped = Arc::new(AtomicU64::new(0));
        let line = Arc::new(LineState::default());
        let ends = Ends {
            config: Arc::clone(&self.config),
            number: runtime::mix_seed(self.seed, self.number),
            since: self.number,
            inbox: messages,
            say,
            frames: queue,
            told: self.told.subscribe(),
            key_requests: Arc::clone(&self.key_requests),
            dropped: Arc::clone(&dropped),
            line: Arc::clone(&line),
        };
        let account = if call.account.is_empty() { account } else { &call.account };
        let party = Party {
            account: account.to_owned(),
            certificate: who.certificate.clone(),
            format: call.format(),
            since: self.number,
        };
        let (out, wake, number, to) = (self.say.clone(), self.wake.clone(), self.number, who.clone());
        let session = self.runtime.spawn(run(call, ends));
        self.runtime.spawn(async move {
            while let Some(message) = replies.recv().await {
                if out.send(Said { who: to.clone(), message, ended: None }).await.is_err() {
                    return;
                }
                wake.wake();
            }
            // A description that makes the library panic ends its own session and no other.
            let why = session.await.unwrap_or_else(|_| "the session failed".to_owned());
            let end = Said { who: to, message: ToViewer::hang_up(why), ended: Some(number) };
            if out.send(end).await.is_ok() {
                wake.wake();
            }
        });
        self.sessions.push(Session { who, party, inbox, frames, dropped, line });
        Ok(())
    }

    /// The next thing to say, if there is one.
    pub(crate) fn next_said(&mut self) -> Option<(Who, ToViewer)> {
        let said = self.said.try_recv().ok()?;
        if let Some(number) = said.ended {
            self.sessions.retain(|session| session.party.since != number);
        }
        Some((said.who, said.message))
    }

    /// Gives a frame to all; whoever has no room loses it.
    pub(crate) fn show(&self, unit: Unit) {
        let unit = Arc::new(unit);
        for session in &self.sessions {
            if session.frames.try_send(Arc::clone(&unit)).is_err() {
                session.dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// What is wished of the camera and whether its chooser flies; `holder` is the account that holds the sticks.
    pub(crate) fn choose(&self, holder: &str) -> Option<(Format, bool)> {
        let choice = Choice::of(self.sessions.iter().map(|session| &session.party), holder)?;
        self.told.send_if_modified(|told| {
            let pilot = if choice.flies { choice.since } else { 0 };
            let differs = told.chosen_by != choice.account || told.pilot != pilot;
            told.chosen_by.clone_from(&choice.account);
            told.pilot = pilot;
            differs
        });
        let flying = |session: &&Session| choice.flies && session.party.since == choice.since;
        let pilot = self.sessions.iter().find(flying).and_then(|session| session.line.bits());
        let lines = self.sessions.iter().filter_map(|session| {
            session.line.bits().map(|bits| (bits, session.line.left_out.load(Ordering::Relaxed)))
        });
        let wished = choice.format.bitrate.min(self.config.bitrate_most);
        let bitrate = for_all(wished, self.config.bitrate_least, pilot, lines);
        Some((Format { bitrate, ..choice.format }, choice.flies))
    }

    pub(crate) fn viewers(&self) -> usize {
        self.sessions.len()
    }

    pub(crate) fn key_requests(&self) -> u32 {
        self.key_requests.load(Ordering::Relaxed) as u32
    }
}
