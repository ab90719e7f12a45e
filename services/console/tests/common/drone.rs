//! A small drone that keeps to docs/off-board.md: it speaks and listens over real zenoh with mutual TLS.

use super::certificates::Authority;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;

#[derive(Default)]
pub struct Heard {
    pub orders: Vec<(String, Value)>,
    pub sticks: Vec<(String, Value)>,
    pub signals: Vec<(String, String)>,
    pub edits: Vec<Edit>,
    ids: BTreeSet<String>,
}

/// An edit of the building as it came.
#[derive(Clone)]
pub struct Edit {
    pub key: String,
    pub payload: Value,
    pub picture: Option<Vec<u8>>,
}

pub struct Drone {
    pub name: String,
    pub session: Session,
    pub heard: Arc<Mutex<Heard>>,
    pub png: Vec<u8>,
    /// What it says of itself, and its plan; to be changed by a test.
    pub about: Arc<Mutex<Value>>,
    pub plan: Arc<Mutex<Vec<u8>>>,
    token: Option<LivelinessToken>,
    beacons: tokio::task::JoinHandle<()>,
}

pub fn endpoint() -> String {
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    format!("tls/localhost:{}", free.local_addr().unwrap().port())
}

impl Drone {
    pub async fn start(name: &str, authority: &Authority, endpoint: &str) -> Self {
        let config = authority.zenoh(&format!("drone-{name}"), &[endpoint.to_owned()], &[]).to_string();
        let session = zenoh::open(zenoh::Config::from_json5(&config).unwrap()).await.unwrap();
        let heard = Arc::new(Mutex::new(Heard::default()));
        let now = Arc::new(Mutex::new(1_000_000_000_u64));
        let clock = now.clone();
        let to = heard.clone();
        session
            .declare_queryable(format!("sereno/{name}/command/*/*"))
            .callback(move |query| {
                let key = query.key_expr().as_str().to_owned();
                let order: Value =
                    serde_json::from_slice(&query.payload().unwrap().to_bytes()).unwrap_or_default();
                let answer = answer(&mut to.lock().unwrap(), &key, order, *clock.lock().unwrap());
                zenoh::Wait::wait(query.reply(key, answer.to_string()).encoding("application/json")).unwrap();
            })
            .background()
            .await
            .unwrap();
        let to = heard.clone();
        session
            .declare_subscriber(format!("sereno/{name}/sticks/*"))
            .callback(move |sample| {
                let frame = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
                to.lock().unwrap().sticks.push((sample.key_expr().as_str().to_owned(), frame));
            })
            .background()
            .await
            .unwrap();
        let to = heard.clone();
        session
            .declare_subscriber(format!("sereno/{name}/signal/*/*/in"))
            .callback(move |sample| {
                let text = sample.payload().try_to_string().unwrap().into_owned();
                to.lock().unwrap().signals.push((sample.key_expr().as_str().to_owned(), text));
            })
            .background()
            .await
            .unwrap();
        let about = json!({ "name": name, "simulated": true, "version": "test", "plan": { "hash": "1" } });
        let about = Arc::new(Mutex::new(about));
        let (to, clock, own) = (heard.clone(), now.clone(), about.clone());
        session
            .declare_queryable(format!("sereno/{name}/edit/*"))
            .callback(move |query| {
                let key = query.key_expr().as_str().to_owned();
                let payload = serde_json::from_slice(&query.payload().unwrap().to_bytes()).unwrap();
                let picture = query.attachment().map(|bytes| bytes.to_bytes().into_owned());
                let edit = Edit { key: key.clone(), payload, picture };
                let answer = edited(&mut to.lock().unwrap(), edit, *clock.lock().unwrap());
                if let Some(building) = answer.get("building") {
                    own.lock().unwrap()["building"] = building.clone();
                }
                zenoh::Wait::wait(query.reply(key, answer.to_string()).encoding("application/json")).unwrap();
            })
            .background()
            .await
            .unwrap();
        let own = about.clone();
        session
            .declare_queryable(format!("sereno/{name}/about"))
            .callback(move |query| {
                zenoh::Wait::wait(
                    query
                        .reply(query.key_expr(), own.lock().unwrap().to_string())
                        .encoding("application/json"),
                )
                .unwrap();
            })
            .background()
            .await
            .unwrap();
        let png = [b"\x89PNG\r\n\x1a\n", name.as_bytes()].concat();
        let plan = Arc::new(Mutex::new(png.clone()));
        let own = plan.clone();
        session
            .declare_queryable(format!("sereno/{name}/plan"))
            .callback(move |query| {
                zenoh::Wait::wait(
                    query.reply(query.key_expr(), own.lock().unwrap().clone()).encoding("image/png"),
                )
                .unwrap();
            })
            .background()
            .await
            .unwrap();
        let beacons = {
            let (session, key) = (session.clone(), format!("sereno/{name}/beacon"));
            tokio::spawn(async move {
                let mut every = tokio::time::interval(Duration::from_millis(50));
                loop {
                    every.tick().await;
                    let ns = {
                        let mut now = now.lock().unwrap();
                        *now += 50_000_000;
                        *now
                    };
                    let _ = session
                        .put(&key, format!("{{\"beacon_ns\":{ns}}}"))
                        .encoding("application/json")
                        .await;
                }
            })
        };
        let mut drone =
            Self { name: name.to_owned(), session, heard, png, about, plan, token: None, beacons };
        drone.appear().await;
        drone
    }

    pub async fn appear(&mut self) {
        self.token = Some(
            self.session.liveliness().declare_token(format!("sereno/{}/alive", self.name)).await.unwrap(),
        );
    }

    pub async fn disappear(&mut self) {
        self.token.take().unwrap().undeclare().await.unwrap();
    }

    pub async fn say(&self, topic: &str, value: &Value) {
        self.session
            .put(format!("sereno/{}/telemetry/{topic}", self.name), value.to_string())
            .encoding("application/json;schema=sereno/Test/0")
            .await
            .unwrap();
    }

    pub async fn say_bytes(&self, topic: &str, bytes: Vec<u8>) {
        self.session
            .put(format!("sereno/{}/telemetry/{topic}", self.name), bytes)
            .encoding("application/octet-stream;schema=sereno/Test/0")
            .await
            .unwrap();
    }

    pub fn orders(&self) -> Vec<(String, Value)> {
        self.heard.lock().unwrap().orders.clone()
    }
}

impl Drop for Drone {
    fn drop(&mut self) {
        self.beacons.abort();
    }
}

fn answer(heard: &mut Heard, key: &str, order: Value, now_ns: u64) -> Value {
    let refused = |text: &str| json!({ "accepted": false, "text": text, "answers": {} });
    let id = order["id"].as_str().unwrap_or("").to_owned();
    let well_formed = id.len() == 16 && id.bytes().all(|b| b.is_ascii_hexdigit());
    if !well_formed {
        return refused("the id is no id");
    }
    if !heard.ids.insert(id) {
        return refused("the same order came before");
    }
    let beacon = order["beacon_ns"].as_u64().unwrap_or(0);
    if beacon > now_ns || now_ns - beacon > 2_000_000_000 {
        return refused("the order is too old");
    }
    let verb = key.split('/').nth(3).unwrap_or("").to_owned();
    heard.orders.push((key.to_owned(), order));
    json!({ "accepted": verb != "land", "text": format!("{verb}: heard"), "answers": {} })
}

/// As docs/off-board.md says: whoever is no installer, comes twice or too late is refused; this one also in the air.
fn edited(heard: &mut Heard, edit: Edit, now_ns: u64) -> Value {
    let refused = |text: &str| json!({ "accepted": false, "text": text });
    let payload = edit.payload.clone();
    let id = payload["id"].as_str().unwrap_or("").to_owned();
    let beacon = payload["beacon_ns"].as_u64().unwrap_or(0);
    heard.edits.push(edit);
    if id.len() != 16 || !heard.ids.insert(id) {
        return refused("the same order came before");
    }
    if beacon > now_ns || now_ns - beacon > 2_000_000_000 {
        return refused("the order is too old");
    }
    if !matches!(payload["role"].as_str(), Some("installer" | "administrator")) {
        return refused("this needs the role installer");
    }
    if payload["building"]["pad"].is_null() {
        return refused("not in the air");
    }
    json!({ "accepted": true, "text": "written; starting anew with it", "building": payload["building"] })
}
