//! A console on real TLS, SQLite and zenoh, with drones that stand in, and a client for it.
#![allow(dead_code, unreachable_pub, reason = "each test uses what it needs of it")]

pub mod certificates;
pub mod client;
pub mod drawing;
pub mod drone;
pub mod video;

use certificates::Authority;
use client::Client;
use console::{
    Clock, Console, ConsoleConfig, HttpsConfig, Page, RehearsalConfig, Role, SessionConfig, ZenohConfig,
};
use drone::Drone;
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

pub const PASSWORD: &str = "a long enough password";
/// How long anything may take on a loaded machine before a test gives up.
pub const DEADLINE: Duration = Duration::from_secs(30);

pub struct TestClock(pub AtomicU64);

impl Clock for TestClock {
    fn now_ms(&self) -> u64 {
        self.0.load(Ordering::SeqCst)
    }
}

pub struct Bench {
    pub folder: tempfile::TempDir,
    pub authority: Authority,
    pub config: ConsoleConfig,
    pub clock: Arc<TestClock>,
    pub console: Option<Console>,
    pub endpoints: Vec<String>,
}

/// Waits until `ready` holds; fails with `what` when it never does.
pub async fn until(what: &str, mut ready: impl AsyncFnMut() -> bool) {
    let began = Instant::now();
    while !ready().await {
        assert!(began.elapsed() < DEADLINE, "never: {what}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

impl Bench {
    /// A console for so many drones, of which none is there yet.
    pub async fn new(drones: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let authority = Authority::new(folder.path());
        let endpoints: Vec<String> = (0..drones).map(|_| drone::endpoint()).collect();
        let client = folder.path().join("console.json5");
        std::fs::write(&client, format!("// of a test\n{}", authority.zenoh("console", &[], &endpoints)))
            .unwrap();
        let https = authority.identity("https");
        let config = ConsoleConfig {
            data: folder.path().join("data"),
            https: HttpsConfig {
                listen: "127.0.0.1:0".parse().unwrap(),
                redirect: None,
                certificate: https.certificate,
                key: https.key,
                authority: None,
                connections: 256,
                connections_an_address: 200,
            },
            zenoh: ZenohConfig { client, endpoints: Vec::new() },
            session: SessionConfig { idle_min: 60, absolute_h: 12 },
            rehearsal: RehearsalConfig::default(),
            recording: console::RecordingConfig::default(),
        };
        let clock = Arc::new(TestClock(AtomicU64::new(1_800_000_000_000)));
        let mut bench = Self { folder, authority, config, clock, console: None, endpoints };
        bench.restart().await;
        bench
    }

    pub async fn restart(&mut self) {
        self.console = None;
        self.console = Some(Console::start(&self.config, Page::Embedded, self.clock.clone()).await.unwrap());
    }

    pub fn console(&self) -> &Console {
        self.console.as_ref().unwrap()
    }

    pub fn pass(&self, time: Duration) {
        self.clock.0.fetch_add(time.as_millis() as u64, Ordering::SeqCst);
    }

    /// A client without a session.
    pub fn client(&self) -> Client {
        Client::new(self.console().address, &self.authority.pem)
    }

    pub async fn drone(&self, at: usize, name: &str) -> Drone {
        Drone::start(name, &self.authority, &self.endpoints[at]).await
    }

    /// The administrator that has claimed it, logged in.
    pub async fn claim(&self) -> Client {
        let mut client = self.client();
        let claim = json!({ "code": self.console().claim.as_ref().unwrap(), "name": "Eva", "surname": "Sanz",
            "email": "eva@example.org", "password": PASSWORD });
        let answer = client.post("/api/claim", &claim).await;
        assert_eq!(answer.status, 200, "{}", answer.text);
        client.take_cookie(&answer);
        client
    }

    /// Makes an account and logs it in.
    pub async fn account(
        &self,
        administrator: &Client,
        role: Role,
        drones: &[&str],
    ) -> (Client, i64, String) {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let email = format!("{}{}@example.org", role.word(), NUMBER.fetch_add(1, Ordering::SeqCst));
        let new = json!({ "name": "Ana", "surname": "Prieto", "email": email, "password": PASSWORD,
            "role": role, "drones": drones });
        let made = administrator.post("/api/accounts", &new).await;
        assert_eq!(made.status, 201, "{}", made.text);
        let id = made.json()["id"].as_i64().unwrap();
        (self.log_in(&email).await, id, email)
    }

    pub async fn log_in(&self, email: &str) -> Client {
        let mut client = self.client();
        let answer = client.post("/api/login", &json!({ "email": email, "password": PASSWORD })).await;
        assert_eq!(answer.status, 200, "{}", answer.text);
        client.take_cookie(&answer);
        client
    }

    /// Waits until the console knows the drone as alive (or not).
    pub async fn sees(&self, client: &Client, drone: &str, alive: bool) {
        until(&format!("{drone} alive: {alive}"), async || {
            let drones = client.get("/api/drones").await.json();
            drones.as_array().unwrap().iter().any(|one| one["name"] == drone && one["alive"] == alive)
        })
        .await;
    }

    pub async fn log(&self, administrator: &Client) -> Vec<Value> {
        let log = administrator.get("/api/log?limit=500").await;
        assert_eq!(log.status, 200, "{}", log.text);
        log.json().as_array().unwrap().clone()
    }
}
