//! A client that says what it likes: the tests' own, so that nothing is checked before it leaves.

use bridge::keys::{Keys, verb_word};
use ipc_types::Verb;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;
use zenoh::handlers::FifoChannel;
use zenoh::{Config, Session, Wait};

/// Longer than any answer that is not an order to fly somewhere, on a loaded machine too.
pub(crate) const ANSWER: Duration = Duration::from_secs(5);
/// For as long nothing must come.
pub(crate) const SILENCE: Duration = Duration::from_millis(700);

pub(crate) struct Client {
    pub(crate) session: Session,
    pub(crate) keys: Keys,
    name: String,
    beacon: Arc<AtomicU64>,
    ids: u64,
}

impl Client {
    /// Opens a session as a configuration says, changed by `change`.
    pub(crate) fn open(config: &Path, change: impl FnOnce(&mut Config)) -> zenoh::Result<Self> {
        let mut config = Config::from_json5(&std::fs::read_to_string(config).unwrap())?;
        let metadata: Value = serde_json::from_str(&config.get_json("metadata").unwrap()).unwrap();
        change(&mut config);
        let session = zenoh::open(config).wait()?;
        let keys = Keys::of("sereno-1");
        let beacon = Arc::new(AtomicU64::new(0));
        let newest = Arc::clone(&beacon);
        session
            .declare_subscriber(keys.beacon())
            .callback(move |sample| {
                let beacon: Value = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
                newest.store(beacon["beacon_ns"].as_u64().unwrap(), Ordering::Relaxed);
            })
            .background()
            .wait()?;
        let name = metadata["certificate"].as_str().unwrap().to_owned();
        Ok(Self { session, keys, name, beacon, ids: runtime::monotonic_ns() })
    }

    pub(crate) fn beacon(&self) -> u64 {
        self.beacon.load(Ordering::Relaxed)
    }

    pub(crate) fn wait_beacon(&self) {
        crate::system::wait_until("a beacon", || self.beacon() != 0);
    }

    /// A good order.
    pub(crate) fn order(&mut self, verb: Verb) -> Value {
        self.ids += 1;
        let mut order = json!({ "id": format!("{:016x}", self.ids), "beacon_ns": self.beacon() });
        if verb == Verb::GoTo {
            (order["x_m"], order["y_m"]) = (json!(1.0), json!(1.0));
        }
        if verb == Verb::SticksTake {
            order["socket"] = json!(7);
        }
        order
    }

    /// Gives an order under a name; `None` when nobody answers.
    pub(crate) fn give_as(
        &self,
        name: &str,
        verb: Verb,
        payload: Vec<u8>,
        patience: Duration,
    ) -> Option<Value> {
        let key = self.keys.command(&verb_word(verb), name);
        self.ask(&key, Some(payload), patience).map(|bytes| serde_json::from_slice(&bytes).unwrap())
    }

    /// Gives a good order.
    pub(crate) fn give(&mut self, verb: Verb) -> Option<Value> {
        let order = self.order(verb);
        self.give_order(verb, &order)
    }

    /// Gives an order that was made before.
    pub(crate) fn give_order(&self, verb: Verb, order: &Value) -> Option<Value> {
        self.give_as(&self.name, verb, order.to_string().into_bytes(), Duration::from_secs(14))
    }

    pub(crate) fn ask(&self, key: &str, payload: Option<Vec<u8>>, patience: Duration) -> Option<Vec<u8>> {
        self.ask_with(key, payload, None, patience)
    }

    /// Asks with something attached.
    pub(crate) fn ask_with(
        &self,
        key: &str,
        payload: Option<Vec<u8>>,
        attachment: Option<Vec<u8>>,
        patience: Duration,
    ) -> Option<Vec<u8>> {
        let mut question = self.session.get(key).with(FifoChannel::new(4)).timeout(patience);
        if let Some(payload) = payload {
            question = question.payload(payload);
        }
        if let Some(attachment) = attachment {
            question = question.attachment(attachment);
        }
        let replies = question.wait().ok()?;
        while let Ok(reply) = replies.recv() {
            match reply.result() {
                Ok(sample) => return Some(sample.payload().to_bytes().into_owned()),
                Err(error) => println!("{key}: {}", String::from_utf8_lossy(&error.payload().to_bytes())),
            }
        }
        None
    }

    /// Whether a message of a key comes in time.
    pub(crate) fn hears(&self, key: &str, patience: Duration) -> bool {
        let (heard, came) = mpsc::sync_channel(1);
        let subscriber = self
            .session
            .declare_subscriber(key)
            .callback(move |_| {
                let _ = heard.try_send(());
            })
            .wait()
            .unwrap();
        let came = came.recv_timeout(patience).is_ok();
        subscriber.undeclare().wait().unwrap();
        came
    }

    pub(crate) fn put(&self, key: &str, payload: impl Into<zenoh::bytes::ZBytes>) {
        self.session.put(key, payload).express(true).wait().unwrap();
    }

    /// Whether some drone's liveliness token is seen.
    pub(crate) fn sees_alive(&self, patience: Duration) -> bool {
        let replies = self
            .session
            .liveliness()
            .get(Keys::of("*").alive())
            .with(FifoChannel::new(4))
            .timeout(patience)
            .wait()
            .unwrap();
        replies.recv().is_ok_and(|reply| reply.result().is_ok())
    }
}
