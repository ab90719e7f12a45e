//! The shell over zenoh. Threads of its own open sessions, send and answer; a step hands over and takes from bounded
//! queues and waits for nobody. What comes in wakes the service at once.

use crate::about::About;
use crate::config::BridgeConfig;
use crate::ear::Ear;
use crate::gate::Limits;
use crate::keys::Keys;
use crate::roles::Clients;
use crate::sessions::{Hearing, Keeper};
use ipc_types::Verb;
use runtime::{StartError, Waker};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;

/// Orders that wait for the next step. The limits of each certificate are kept before this queue.
const ORDERS: usize = 64;
/// Sticks that wait for the next step, which takes the newest.
const STICKS: usize = 32;
/// Questions and messages of video sessions that wait for the next step.
const OTHERS: usize = 64;
/// Messages on their way out: a step sends some twenty at most, and the thread is done with each in microseconds.
const PUTS: usize = 64;
/// Answers on their way out.
const ANSWERS: usize = 256;

/// Who asked, to be answered once, and by which key: a question with wildcards is answered by the drone's own.
pub struct Asker {
    pub(crate) query: Query,
    pub(crate) key: String,
}

/// Something that came in and passed the limits of its certificate.
pub enum Heard {
    /// An order.
    Order {
        /// By which certificate.
        certificate: String,
        /// What is wanted.
        verb: Verb,
        /// The rest of it.
        json: Vec<u8>,
        /// Who is to be answered.
        asker: Asker,
    },
    /// A change of the building.
    Edit {
        /// By which certificate.
        certificate: String,
        /// What is wanted.
        json: Vec<u8>,
        /// The picture of a new plan.
        picture: Option<Vec<u8>>,
        /// Who is to be answered.
        asker: Asker,
    },
    /// A message of a video session.
    Signal {
        /// By which certificate.
        certificate: String,
        /// Which session of it.
        session: String,
        /// What it says.
        json: Vec<u8>,
    },
    /// A wish for pictures.
    Wish {
        /// By which certificate.
        certificate: String,
        /// What it says.
        json: Vec<u8>,
    },
    /// Somebody wants the newest message of a topic.
    Newest {
        /// Which.
        topic: String,
        /// Who is to be answered.
        asker: Asker,
    },
}

/// An input of the sticks.
pub struct HeardSticks {
    /// By which certificate.
    pub certificate: String,
    /// What it says.
    pub json: Vec<u8>,
}

/// How urgent a message is, and how it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// By itself and before all others: the beacon.
    Express,
    /// Small and fresh.
    Small,
    /// Large: particles, pictures.
    Large,
    /// Not to be lost while the link lives: messages of video sessions.
    Reliable,
}

/// A message on its way out.
pub(crate) struct Put {
    pub key: Arc<str>,
    pub encoding: Encoding,
    pub payload: Vec<u8>,
    pub pace: Pace,
}

pub(crate) struct Answer {
    pub asker: Asker,
    /// `None` ends the question without an answer.
    pub payload: Option<(Encoding, Vec<u8>)>,
}

/// What was lost on the way, since the start.
#[derive(Debug, Default)]
pub struct Losses {
    /// Messages that came faster than allowed, were too large, or found their queue full.
    pub refused: AtomicU64,
    /// Messages and answers that found their queue full on the way out.
    pub unsent: AtomicU64,
}

/// The drone on the network, or on its way there.
pub struct Network {
    orders: Receiver<Heard>,
    urgent: Receiver<Heard>,
    others: Receiver<Heard>,
    sticks: Receiver<HeardSticks>,
    puts: SyncSender<Put>,
    answers: SyncSender<Answer>,
    keeper: Keeper,
    clients: Arc<Mutex<Arc<Clients>>>,
    losses: Arc<Losses>,
}

impl Network {
    /// Begins to open sessions, and goes on trying until the process ends.
    ///
    /// # Errors
    /// When the system gives no threads.
    pub fn start(
        drone: &str,
        config: &BridgeConfig,
        certificates: PathBuf,
        about: About,
        waker: Waker,
    ) -> Result<Self, StartError> {
        let (orders_in, orders) = sync_channel(ORDERS);
        let (urgent_in, urgent) = sync_channel(ORDERS);
        let (others_in, others) = sync_channel(OTHERS);
        let (sticks_in, sticks) = sync_channel(STICKS);
        let (puts, puts_out) = sync_channel::<Put>(PUTS);
        let (answers, answers_out) = sync_channel::<Answer>(ANSWERS);
        let clients = Arc::new(Mutex::new(Arc::new(Clients::default())));
        let losses = Arc::new(Losses::default());
        let ear = Arc::new(Ear {
            keys: Keys::of(drone),
            about: Arc::new(about),
            clients: Arc::clone(&clients),
            limits: Mutex::new(Limits::new(config.orders_hz, config.sticks_hz)),
            orders: orders_in,
            urgent: urgent_in,
            others: others_in,
            sticks: sticks_in,
            answers: answers.clone(),
            losses: Arc::clone(&losses),
            waker,
        });
        let hearing: Arc<dyn Hearing> = ear;
        let keeper = Keeper::start(drone, config, certificates, hearing)?;
        let sessions = keeper.sessions();
        spawn("send", move || {
            for put in puts_out {
                for session in sessions.get().iter() {
                    send(session, &put);
                }
            }
        })?;
        spawn("answer", move || answers_out.into_iter().for_each(reply))?;
        Ok(Self { orders, urgent, others, sticks, puts, answers, keeper, clients, losses })
    }

    /// The next order or question, stops and cuts first.
    pub fn hear(&self) -> Option<Heard> {
        let first = self.urgent.try_recv().or_else(|_| self.orders.try_recv());
        first.or_else(|_| self.others.try_recv()).ok()
    }

    /// The next input of the sticks.
    pub fn hear_sticks(&self) -> Option<HeardSticks> {
        self.sticks.try_recv().ok()
    }

    /// Sends a message to everybody who wants it, or drops it.
    pub fn put(&self, key: &Arc<str>, encoding: &Encoding, payload: Vec<u8>, pace: Pace) {
        let put = Put { key: Arc::clone(key), encoding: encoding.clone(), payload, pace };
        if self.puts.try_send(put).is_err() {
            self.losses.unsent.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Answers a question; `None` ends it without an answer.
    pub fn answer(&self, asker: Asker, payload: Option<(Encoding, Vec<u8>)>) {
        if self.answers.try_send(Answer { asker, payload }).is_err() {
            self.losses.unsent.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The list of clients as it is now.
    #[must_use]
    pub fn clients(&self) -> Arc<Clients> {
        Arc::clone(&self.clients.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// One sentence on whether the drone is on the network.
    #[must_use]
    pub fn standing(&self) -> String {
        self.keeper.standing()
    }

    /// What was lost.
    #[must_use]
    pub fn losses(&self) -> &Losses {
        &self.losses
    }
}

pub(crate) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), StartError> {
    thread::Builder::new()
        .name(name.to_owned())
        .spawn(work)
        .map(drop)
        .map_err(|error| StartError::invalid(format!("no thread: {error}")))
}

fn send(session: &zenoh::Session, put: &Put) {
    let priority = match put.pace {
        Pace::Express => Priority::RealTime,
        Pace::Small => Priority::Data,
        Pace::Large => Priority::DataLow,
        Pace::Reliable => Priority::InteractiveHigh,
    };
    // Waiting for room ends within half a second: then the connection of who does not read is closed.
    let congestion =
        if put.pace == Pace::Reliable { CongestionControl::Block } else { CongestionControl::Drop };
    // A session that has ended is replaced by its keeper.
    let _ = session
        .put(&*put.key, put.payload.as_slice())
        .encoding(put.encoding.clone())
        .congestion_control(congestion)
        .priority(priority)
        .express(matches!(put.pace, Pace::Express | Pace::Reliable))
        .wait();
}

/// Answers before it returns, for who has a thread to wait on.
pub(crate) fn reply_now(asker: Asker, answer: &serde_json::Value) {
    reply(Answer { asker, payload: Some((Encoding::APPLICATION_JSON, answer.to_string().into_bytes())) });
}

fn reply(answer: Answer) {
    let Asker { query, key } = answer.asker;
    if let Some((encoding, payload)) = answer.payload {
        // Who asked may have gone.
        let _ = query.reply(key, payload).encoding(encoding).express(true).wait();
    }
}
