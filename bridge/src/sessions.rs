//! The sessions of zenoh and who keeps them: opened when the papers are in order, opened anew when the list of clients or a
//! certificate changes, closed when a certificate ends. Never open without papers.

use crate::config::BridgeConfig;
use crate::identity::{self, Papers};
use crate::keys::{Direction, Keys};
use crate::network::spawn;
use crate::roles::Clients;
use crate::zenoh_config::{connecting, listening};
use runtime::StartError;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use zenoh::query::Query;
use zenoh::sample::Sample;
use zenoh::{Config, Session, Wait};

/// After this the papers are read again, and what failed is tried again.
const LOOK: Duration = Duration::from_secs(2);

/// What is done with what comes in; called on zenoh's threads, so it waits for nothing.
pub(crate) trait Hearing: Send + Sync {
    /// Keys of this drone.
    fn keys(&self) -> &Keys;
    /// The list of clients is this from now on.
    fn known(&self, clients: Clients);
    /// An order.
    fn order(&self, query: Query);
    /// A change of the building.
    fn edit(&self, query: Query);
    /// An input of the sticks.
    fn sticks(&self, sample: &Sample);
    /// A message of a video session.
    fn signal(&self, sample: &Sample);
    /// A wish for pictures.
    fn wish(&self, sample: &Sample);
    /// A question for the newest message of a topic.
    fn newest(&self, query: Query);
    /// A question for what the drone is.
    fn about(&self, query: Query);
    /// A question for the plan.
    fn plan(&self, query: Query);
}

/// The sessions that are open now.
#[derive(Clone, Default)]
pub(crate) struct Sessions(Arc<Mutex<Arc<Vec<Session>>>>);

impl Sessions {
    pub(crate) fn get(&self) -> Arc<Vec<Session>> {
        Arc::clone(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn set(&self, sessions: Vec<Session>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Arc::new(sessions);
    }
}

/// Keeps the sessions, on a thread of its own.
pub(crate) struct Keeper {
    sessions: Sessions,
    standing: Arc<Mutex<String>>,
}

struct Work {
    drone: String,
    config: BridgeConfig,
    certificates: PathBuf,
    hearing: Arc<dyn Hearing>,
    sessions: Sessions,
    standing: Arc<Mutex<String>>,
    /// What the open sessions were opened with.
    papers: Option<Papers>,
    /// The routers, and the session with each that is reached.
    links: Vec<(String, Option<Session>)>,
    listener: Option<Session>,
    /// Which port listens, when it was left to the system.
    listening: String,
}

fn now_s() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    since.as_secs().cast_signed()
}

impl Keeper {
    pub(crate) fn start(
        drone: &str,
        config: &BridgeConfig,
        certificates: PathBuf,
        hearing: Arc<dyn Hearing>,
    ) -> Result<Self, StartError> {
        let sessions = Sessions::default();
        let standing = Arc::new(Mutex::new("opening".to_owned()));
        let mut work = Work {
            drone: drone.to_owned(),
            config: config.clone(),
            certificates,
            hearing,
            sessions: sessions.clone(),
            standing: Arc::clone(&standing),
            papers: None,
            links: Vec::new(),
            listener: None,
            listening: String::new(),
        };
        spawn("keep sessions", move || {
            loop {
                work.look();
                std::thread::sleep(LOOK);
            }
        })?;
        Ok(Self { sessions, standing })
    }

    pub(crate) fn sessions(&self) -> Sessions {
        self.sessions.clone()
    }

    pub(crate) fn standing(&self) -> String {
        self.standing.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Work {
    fn say(&self, sentence: &str, trouble: bool) {
        let mut standing = self.standing.lock().unwrap_or_else(PoisonError::into_inner);
        if *standing != sentence {
            if trouble {
                tracing::warn!("bridge: {sentence}");
            } else {
                tracing::info!("bridge: {sentence}");
            }
            sentence.clone_into(&mut standing);
        }
    }

    /// Looks whether everything is as it should be, and does what is needed.
    fn look(&mut self) {
        match identity::read(&self.certificates, &self.drone, now_s()) {
            Err(sentence) => {
                self.close();
                self.say(&format!("closed: {sentence}"), true);
            }
            Ok(papers) => {
                if self.papers.as_ref() != Some(&papers) {
                    self.close();
                    self.hearing.known(papers.clients.clone());
                    self.papers = Some(papers);
                }
                self.open();
            }
        }
    }

    fn close(&mut self) {
        self.sessions.set(Vec::new());
        self.hearing.known(Clients::default());
        self.papers = None;
        let open = self.listener.take().into_iter().chain(self.links.drain(..).filter_map(|(_, link)| link));
        for session in open.collect::<Vec<_>>() {
            // One that does not end by itself ends with the process.
            let _ = session.close().wait();
        }
    }

    /// Opens what is not open.
    fn open(&mut self) {
        let Some(papers) = self.papers.clone() else { return };
        let mut troubles = Vec::new();
        if self.listener.is_none() && !self.config.listen.is_empty() {
            let config = listening(
                &self.drone,
                &papers.clients,
                &papers.identity,
                &self.config.listen,
                self.config.lease_ms,
                self.config.max_connections,
            );
            match session(&config, &self.hearing) {
                Ok(session) => {
                    let locators = session.info().locators().wait();
                    self.listening = locators.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
                    self.listener = Some(session);
                }
                Err(error) => {
                    troubles.push(format!("cannot listen on {}: {error}", self.config.listen.join(", ")));
                }
            }
        }
        if self.links.is_empty() {
            self.links = self.config.connect.iter().map(|endpoint| (endpoint.clone(), None)).collect();
        }
        for (endpoint, link) in &mut self.links {
            if link.is_none() {
                let config = connecting(
                    &self.drone,
                    &papers.clients,
                    &papers.identity,
                    endpoint,
                    self.config.lease_ms,
                );
                match session(&config, &self.hearing) {
                    Ok(session) => *link = Some(session),
                    Err(error) => troubles.push(format!("cannot reach the router {endpoint}: {error}")),
                }
            }
        }
        let links = self.links.iter().filter_map(|(_, link)| link.as_ref());
        let all: Vec<Session> = self.listener.iter().chain(links).cloned().collect();
        let reached = self.links.iter().filter(|(_, link)| link.is_some()).count();
        self.sessions.set(all);
        let clients = papers.clients.iter().count();
        let mut sentence = match (&self.listener, self.links.len()) {
            (Some(_), 0) => format!("on {}, {clients} certificates known", self.listening),
            (Some(_), links) => format!("on {} and {reached} of {links} routers", self.listening),
            (None, 0) if self.config.listen.is_empty() => {
                "closed: bridge.toml: listen and connect are empty".to_owned()
            }
            (None, links) => format!("on {reached} of {links} routers"),
        };
        for trouble in &troubles {
            sentence = format!("{trouble}; {sentence}");
        }
        self.say(&sentence, !troubles.is_empty());
    }
}

/// Opens a session and declares what the drone offers on it.
fn session(config: &str, hearing: &Arc<dyn Hearing>) -> Result<Session, String> {
    let said = |error: zenoh::Error| {
        // Zenoh's errors carry the places in its source where they passed.
        let text = error.to_string();
        manifest::one_line(text.split(" at ").next().unwrap_or(&text))
    };
    let config = Config::from_json5(config).map_err(said)?;
    let session = zenoh::open(config).wait().map_err(said)?;
    let keys = hearing.keys().clone();
    macro_rules! queryable {
        ($key:expr, $method:ident) => {{
            let ear = Arc::clone(hearing);
            session
                .declare_queryable($key)
                .callback(move |query| ear.$method(query))
                .background()
                .wait()
                .map_err(said)?;
        }};
    }
    macro_rules! subscriber {
        ($key:expr, $method:ident) => {{
            let ear = Arc::clone(hearing);
            session
                .declare_subscriber($key)
                .callback(move |sample| ear.$method(&sample))
                .background()
                .wait()
                .map_err(said)?;
        }};
    }
    queryable!(keys.command("*", "*"), order);
    queryable!(keys.edit("*"), edit);
    queryable!(keys.telemetry("**"), newest);
    queryable!(keys.about(), about);
    queryable!(keys.plan(), plan);
    subscriber!(keys.sticks("*"), sticks);
    subscriber!(keys.signal("*", "*", Direction::In), signal);
    subscriber!(keys.wish("*"), wish);
    // Last: who sees the token finds everything else.
    let token = session.liveliness().declare_token(keys.alive()).wait().map_err(said)?;
    // It lives as long as its session.
    std::mem::forget(token);
    Ok(session)
}
