//! The drones, as a zenoh client sees them: which are there, what they say, and what is said to them.

mod camera;
mod drone;
mod edit;
mod footage;
mod hub;
mod link;
mod order;
mod signal;

pub use drone::Drone;
pub use link::LinkError;

pub(crate) use edit::{Change, PlanPlace};
pub(crate) use hub::{Box, is_topic};
pub(crate) use order::{Answer, Asking, Giver};
pub(crate) use signal::Signal;

use crate::app::Clock;
use crate::config::ZenohConfig;
use crate::recording::Recorder;
use crate::role::{EVERY_DRONE, is_drone_name};
use crate::round::{Event, Report};
use crate::store::{Incident, ReportLine};
use crate::{Account, Store};
use axum::body::Bytes;
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError, RwLock, Weak};
use std::time::Duration;
use tokio::runtime::Handle;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Sample, SampleKind};

/// Drones that are followed at most.
const MOST_DRONES: usize = 256;
/// Topics that the console follows itself, for reports and events.
const FOLLOWED: [&str; 3] = ["pilot/state", "navigation/patrol", "localization/pose"];
/// What `about`, plan and newest messages may take to come.
const QUESTION: Duration = Duration::from_millis(2500);
/// The largest `about` and plan.
const LARGEST_ABOUT: usize = 1024 * 1024;
const LARGEST_PLAN: usize = 32 * 1024 * 1024;

/// Who looks at the same recording again within this time is not written down again, milliseconds; nor are more remembered.
const SHOWN_MS: u64 = 600_000;
const MOST_SHOWN: usize = 256;

/// All drones.
pub struct Fleet {
    session: zenoh::Session,
    certificate: String,
    drones: RwLock<BTreeMap<String, Arc<Drone>>>,
    store: Store,
    clock: Arc<dyn Clock>,
    runtime: Handle,
    /// Where this console keeps pictures.
    recorder: Option<Arc<Recorder>>,
    shown: Mutex<VecDeque<(String, i64, u64)>>,
}

impl Fleet {
    /// Connects to whoever is there now or later; `known` were there before.
    ///
    /// # Errors
    /// When the client's file is wrong. A drone that is not there is no error.
    pub(crate) async fn open(
        config: &ZenohConfig,
        store: Store,
        clock: Arc<dyn Clock>,
        known: &[String],
        recorder: Option<Arc<Recorder>>,
    ) -> Result<Arc<Self>, LinkError> {
        let link::Link { session, certificate } = link::open(config).await?;
        let fleet = Arc::new(Self {
            session,
            certificate,
            drones: RwLock::new(BTreeMap::new()),
            store,
            clock,
            runtime: Handle::current(),
            recorder: recorder.clone(),
            shown: Mutex::default(),
        });
        for name in known {
            fleet.meet(name);
        }
        // Unbounded: only who has a certificate comes and goes, and losing one would lose a drone.
        let (tokens, mut come) = tokio::sync::mpsc::unbounded_channel::<(String, bool)>();
        let failed =
            |error: zenoh::Error| LinkError::Open { path: config.client.clone(), reason: error.to_string() };
        fleet
            .session
            .liveliness()
            .declare_subscriber("sereno/*/alive")
            .history(true)
            .callback(move |sample| {
                let name = sample.key_expr().as_str().split('/').nth(1).unwrap_or("").to_owned();
                // The fleet has gone when nobody receives.
                let _ = tokens.send((name, sample.kind() == SampleKind::Put));
            })
            .background()
            .await
            .map_err(failed)?;
        let weak = Arc::downgrade(&fleet);
        tokio::spawn(async move {
            while let Some((name, alive)) = come.recv().await {
                let Some(fleet) = weak.upgrade() else { return };
                fleet.token(&name, alive).await;
            }
        });
        let weak = Arc::downgrade(&fleet);
        tokio::spawn(async move {
            let mut second = tokio::time::interval(Duration::from_secs(1));
            loop {
                second.tick().await;
                let Some(fleet) = weak.upgrade() else { return };
                for drone in fleet.all() {
                    let news = drone.memory().follower.tick(fleet.clock.now_ms());
                    fleet.keep(drone.publish(news));
                }
            }
        });
        if let Some(recorder) = recorder {
            tokio::spawn(footage::supply(Arc::downgrade(&fleet), recorder));
        }
        Ok(fleet)
    }

    /// What keeps pictures; `None` on a console that keeps none.
    pub(crate) fn recorder(&self) -> Option<&Arc<Recorder>> {
        self.recorder.as_ref()
    }

    /// Whether somebody begins to look at a recording: a browser asks for it in many pieces.
    pub(crate) fn shows_anew(&self, account: &str, recording: i64, now_ms: u64) -> bool {
        let mut shown = self.shown.lock().unwrap_or_else(PoisonError::into_inner);
        shown.retain(|(_, _, at_ms)| now_ms.saturating_sub(*at_ms) < SHOWN_MS);
        let known = shown.iter().any(|(by, of, _)| by == account && *of == recording);
        if !known {
            if shown.len() >= MOST_SHOWN {
                shown.pop_front();
            }
            shown.push_back((account.to_owned(), recording, now_ms));
        }
        !known
    }

    fn all(&self) -> Vec<Arc<Drone>> {
        self.drones.read().unwrap_or_else(PoisonError::into_inner).values().cloned().collect()
    }

    /// A drone that was heard of.
    #[must_use]
    pub fn drone(&self, name: &str) -> Option<Arc<Drone>> {
        self.drones.read().unwrap_or_else(PoisonError::into_inner).get(name).cloned()
    }

    /// Names of the drones that an account may see; those it is assigned to also before they are heard of.
    #[must_use]
    pub fn names_for(&self, account: &Account) -> Vec<String> {
        if account.drones.contains(EVERY_DRONE) {
            return self.drones.read().unwrap_or_else(PoisonError::into_inner).keys().cloned().collect();
        }
        account.drones.iter().cloned().collect()
    }

    fn meet(&self, name: &str) -> Option<Arc<Drone>> {
        if !is_drone_name(name) {
            return None;
        }
        let mut drones = self.drones.write().unwrap_or_else(PoisonError::into_inner);
        if drones.len() >= MOST_DRONES && !drones.contains_key(name) {
            return None;
        }
        Some(drones.entry(name.to_owned()).or_insert_with(|| Arc::new(Drone::new(name))).clone())
    }

    /// A drone has come or gone.
    async fn token(self: &Arc<Self>, name: &str, alive: bool) {
        let Some(drone) = self.meet(name) else { return };
        if drone.alive.swap(alive, Ordering::AcqRel) == alive {
            return;
        }
        let now_ms = self.clock.now_ms();
        if alive {
            drone.memory().plan_is_old = true;
            self.follow(&drone).await;
            if let Err(error) = self.store.drone_seen(name.to_owned(), now_ms).await {
                tracing::warn!("{error}");
            }
            let (fleet, of) = (self.clone(), drone.clone());
            tokio::spawn(async move { fleet.about(&of).await });
        } else {
            drone.beacon_ns.send_replace(0);
            drone.hub().forget();
        }
        let line = drone.alive_line();
        drone.hub().line(&line);
        let news = drone.memory().follower.link(alive, now_ms);
        self.keep(drone.publish(news));
    }

    /// Subscribes what the console itself needs of a drone, once.
    async fn follow(self: &Arc<Self>, drone: &Arc<Drone>) {
        let _turn = drone.turn.lock().await;
        for topic in FOLLOWED {
            let fresh = drone.hub().keep(topic);
            self.subscribe(drone, fresh).await;
        }
        let fresh = drone.hub().keep("beacon");
        for topic in fresh {
            let (to, name) = (Arc::downgrade(drone), topic.clone());
            let heard = move |sample: Sample| {
                #[derive(serde::Deserialize)]
                struct Beacon {
                    beacon_ns: u64,
                }
                if let (Some(drone), Ok(beacon)) =
                    (to.upgrade(), serde_json::from_slice::<Beacon>(&sample.payload().to_bytes()))
                {
                    drone.beacon(&name, beacon.beacon_ns);
                }
            };
            self.declare(drone, &topic, format!("sereno/{}/beacon", drone.name), heard).await;
        }
    }

    /// A page wants these topics of a drone from now on and no others.
    pub(crate) async fn want(self: &Arc<Self>, drone: &Arc<Drone>, page: &Box, topics: &[String]) {
        let _turn = drone.turn.lock().await;
        let (fresh, dropped) = drone.hub().want(page, topics);
        drop(dropped);
        self.subscribe(drone, fresh).await;
    }

    /// A page no longer looks.
    pub(crate) fn close(&self, drone: &Drone, page: &Box) {
        let dropped = drone.hub().close(page);
        drop(dropped);
    }

    async fn subscribe(self: &Arc<Self>, drone: &Arc<Drone>, topics: Vec<Arc<str>>) {
        for topic in topics {
            let key = format!("sereno/{}/telemetry/{topic}", drone.name);
            let (fleet, to, name) = (Arc::downgrade(self), Arc::downgrade(drone), topic.clone());
            self.declare(drone, &topic, key.clone(), move |sample| heard(&fleet, &to, &name, &sample)).await;
            let (fleet, to, name) = (Arc::downgrade(self), Arc::downgrade(drone), topic.clone());
            // What was said before anybody listened, for topics that are said seldom.
            let asked = self
                .session
                .get(key)
                .timeout(QUESTION)
                .callback(move |reply| {
                    if let (Ok(sample), Some(drone)) = (reply.result(), to.upgrade()) {
                        if let Some(fleet) = fleet.upgrade() {
                            fleet.note(&drone, &name, sample);
                        }
                        if let Some(message) = hub::message(&name, sample) {
                            drone.hub().relay_old(&name, message);
                        }
                    }
                })
                .await;
            if let Err(error) = asked {
                tracing::warn!("cannot ask {} for {topic}: {error}", drone.name);
            }
        }
    }

    async fn declare(
        &self,
        drone: &Drone,
        topic: &str,
        key: String,
        heard: impl Fn(Sample) + Send + Sync + 'static,
    ) {
        match self.session.declare_subscriber(key).callback(heard).await {
            Ok(subscriber) => {
                let unwanted = drone.hub().subscribed(topic, subscriber);
                drop(unwanted);
            }
            Err(error) => tracing::warn!("cannot subscribe {topic} of {}: {error}", drone.name),
        }
    }

    /// Reads what the console itself follows.
    fn note(&self, drone: &Drone, topic: &str, sample: &Sample) {
        if !FOLLOWED.contains(&topic) {
            return;
        }
        let bytes = sample.payload().to_bytes();
        let now_ms = self.clock.now_ms();
        let mut memory = drone.memory();
        let news = match topic {
            "pilot/state" => serde_json::from_slice(&bytes).map(|view| memory.follower.pilot(&view, now_ms)),
            "navigation/patrol" => {
                serde_json::from_slice(&bytes).map(|view| memory.follower.patrol(&view, now_ms))
            }
            _ => serde_json::from_slice(&bytes).map(|view| {
                memory.follower.pose(view);
                Vec::new()
            }),
        };
        drop(memory);
        if let Ok(news) = news
            && !news.is_empty()
        {
            self.keep(drone.publish(news));
        }
    }

    /// Writes reports down and tells the pages.
    fn keep(&self, reports: Vec<Report>) {
        for report in reports {
            let Some(drone) = self.drone(&report.drone) else { continue };
            let (store, now_ms) = (self.store.clone(), self.clock.now_ms());
            self.runtime.spawn(async move {
                let line = ReportLine {
                    id: 0,
                    drone: report.drone.clone(),
                    started_ms: report.started_ms,
                    landed_ms: report.landed_ms,
                    outcome: report.outcome.to_owned(),
                    coverage: report.coverage,
                };
                let text = serde_json::to_string(&report).unwrap_or_default();
                match store.keep_report(line, text).await {
                    Ok(id) => {
                        let mut event = Event::new(now_ms, "round", report.outcome);
                        event.report = Some(id);
                        drone.event(&event);
                    }
                    Err(error) => {
                        tracing::error!("{error}");
                        drone.event(&Event::new(now_ms, "round", format!("no report: {error}")));
                    }
                }
            });
        }
    }

    /// An order was answered: the pages see it, and the report has it.
    pub(crate) fn ordered(&self, drone: &Drone, event: &Event) {
        drone.memory().follower.order(event);
        drone.event(event);
    }

    /// An incident was marked.
    pub(crate) fn incident(&self, drone: &Drone, incident: &Incident) {
        drone.memory().follower.incident(incident);
        let mut event = Event::new(incident.time_ms, "incident", incident.text.clone());
        event.account.clone_from(&incident.account);
        drone.event(&event);
    }

    /// Asks a drone something; `None` when it does not answer.
    async fn ask(&self, key: String, largest: usize) -> Option<Bytes> {
        let replies = self.session.get(key).timeout(QUESTION).await.ok()?;
        let reply = tokio::time::timeout(QUESTION, replies.recv_async()).await.ok()?.ok()?;
        let sample = reply.into_result().ok()?;
        (sample.payload().len() <= largest).then(|| Bytes::copy_from_slice(&sample.payload().to_bytes()))
    }

    /// What a drone says of itself, or what it last said.
    pub(crate) async fn about(&self, drone: &Drone) -> Option<Arc<str>> {
        if drone.is_alive()
            && let Some(bytes) = self.ask(format!("sereno/{}/about", drone.name), LARGEST_ABOUT).await
            && let Ok(value) = serde_json::from_slice::<serde_json::Value>(&bytes)
        {
            let mut memory = drone.memory();
            let plan_of = |about: &str| {
                serde_json::from_str::<serde_json::Value>(about).ok().map(|v| v["plan"].clone())
            };
            if memory.about.as_deref().and_then(plan_of) != Some(value["plan"].clone()) {
                memory.plan_is_old = true;
            }
            memory.simulated = value["simulated"].as_bool();
            memory.about = Some(Arc::from(value.to_string()));
        }
        drone.memory().about.clone()
    }

    /// Its plan as PNG: asked for again after the drone was away or speaks of another plan.
    pub(crate) async fn plan(&self, drone: &Drone) -> Option<Bytes> {
        let (known, old) = {
            let memory = drone.memory();
            (memory.plan.clone(), memory.plan_is_old)
        };
        if known.is_some() && (!old || !drone.is_alive()) {
            return known;
        }
        let fresh = self.ask(format!("sereno/{}/plan", drone.name), LARGEST_PLAN).await;
        if let Some(plan) = &fresh {
            let mut memory = drone.memory();
            memory.plan = Some(plan.clone());
            memory.plan_is_old = false;
        }
        fresh.or(known)
    }

    /// One frame of sticks, as it is: newest wins, nothing is sent twice.
    pub(crate) async fn sticks(&self, drone: &Drone, frame: Vec<u8>) {
        let sent = self
            .session
            .put(format!("sereno/{}/sticks/{}", drone.name, self.certificate), frame)
            .encoding("application/json")
            .priority(Priority::RealTime)
            .congestion_control(CongestionControl::Drop)
            .express(true)
            .await;
        if let Err(error) = sent {
            tracing::debug!("a frame of sticks was not sent: {error}");
        }
    }
}

fn heard(fleet: &Weak<Fleet>, drone: &Weak<Drone>, topic: &str, sample: &Sample) {
    let (Some(fleet), Some(drone)) = (fleet.upgrade(), drone.upgrade()) else { return };
    fleet.note(&drone, topic, sample);
    if let Some(message) = hub::message(topic, sample) {
        drone.hub().relay(topic, message);
    }
}
