//! A simulated system with certificates, and clients of every kind.

use bridge::Authority;
use bridge::roles::{Role, Standing};
use cli::place::Place;
use runtime::Tool;
use runtime::shm::RunDir;
use serde_json::Value;
use sereno_tests::{lightly_cluttered, programs};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Whoever waits this long waits in vain, on a loaded machine too.
const LONG: Duration = Duration::from_secs(90);

/// One system at a time: two cores fly one.
static TURN: Mutex<()> = Mutex::new(());

pub(crate) struct System {
    pub(crate) directory: tempfile::TempDir,
    deploy: PathBuf,
    up: Child,
    pub(crate) authority: Authority,
    _turn: MutexGuard<'static, ()>,
}

/// How a system is connected.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Way {
    /// Clients connect to the bridge.
    Direct,
    /// Bridge and clients connect to a router.
    Router,
}

pub(crate) fn now_s() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs().cast_signed()
}

/// An endpoint that nobody uses at the moment.
pub(crate) fn free_endpoint() -> String {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    format!("tls/127.0.0.1:{port}")
}

pub(crate) fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + LONG;
    while !done() {
        assert!(Instant::now() < deadline, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

impl System {
    /// Starts a system whose bridge is on the network, or on its way to a router at `endpoint`. Clients: a `guard`, a
    /// `viewer`, an `installer`, another guard (`other`), and one whose certificate is on no list (`revoked`).
    pub(crate) fn start(way: Way, endpoint: &str) -> Self {
        Self::start_with(way, endpoint, "")
    }

    /// As [`Self::start`], with more lines in the bridge's configuration.
    pub(crate) fn start_with(way: Way, endpoint: &str, more: &str) -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let directory = tempfile::tempdir().unwrap();
        let deploy = lightly_cluttered(directory.path(), "two-rooms").unwrap();
        let authority = Authority::at(deploy.join("certs"));
        let endpoints = [endpoint.to_owned()];
        authority.init(&["sereno-1".into()], &[], &endpoints, now_s()).unwrap();
        for (name, role) in [
            ("guard", Role::Guard),
            ("viewer", Role::Viewer),
            ("installer", Role::Installer),
            ("other", Role::Guard),
            ("revoked", Role::Guard),
        ] {
            authority.client(name, Standing::Client(role), &endpoints, now_s()).unwrap();
        }
        authority.revoke("revoked").unwrap();
        if way == Way::Router {
            authority.client("hub", Standing::Router, &endpoints, now_s()).unwrap();
        }
        let config = match way {
            Way::Direct => format!("listen = [\"{endpoint}\"]\n{more}"),
            Way::Router => format!("listen = []\nconnect = [\"{endpoint}\"]\n{more}"),
        };
        std::fs::write(deploy.join("config/bridge.toml"), config).unwrap();
        let up = sereno(&deploy, &directory.path().join("run"), &["up", "--sim", "--quiet", "--seed", "2"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let system = Self { directory, deploy, up, authority, _turn: turn };
        system.wait_running();
        system
    }

    pub(crate) fn deploy(&self) -> &Path {
        &self.deploy
    }

    pub(crate) fn run_dir(&self) -> PathBuf {
        self.directory.path().join("run")
    }

    /// Runs `sereno` on board.
    pub(crate) fn sereno(&self, words: &[&str]) -> Output {
        sereno(&self.deploy, &self.run_dir(), words).output().unwrap()
    }

    /// Runs `sereno` as a client somewhere else: with its configuration alone.
    pub(crate) fn remote(&self, client: &str, words: &[&str]) -> Output {
        let mut command = Command::new(programs().join("sereno"));
        command.arg("--remote").arg(self.authority.client_config(client)).args(words);
        command.current_dir(self.directory.path()).stdin(Stdio::null()).output().unwrap()
    }

    pub(crate) fn ps(&self, service: &str) -> Value {
        let overview: Value =
            serde_json::from_slice(&self.sereno(&["ps", "--json"]).stdout).unwrap_or_default();
        let rows = overview["services"].as_array().cloned().unwrap_or_default();
        rows.into_iter().find(|row| row["name"] == service).unwrap_or_default()
    }

    fn wait_running(&self) {
        wait_until("everything runs", || {
            let overview: Value =
                serde_json::from_slice(&self.sereno(&["ps", "--json"]).stdout).unwrap_or_default();
            let rows = overview["services"].as_array().cloned().unwrap_or_default();
            !rows.is_empty() && rows.iter().all(|row| row["state"] == "running")
        });
    }

    /// Waits until the bridge says something of itself.
    pub(crate) fn wait_bridge(&self, says: &str) {
        wait_until(says, || self.ps("bridge")["status"].as_str().is_some_and(|status| status.contains(says)));
    }

    /// Ports of a program on board.
    pub(crate) fn tool(&self) -> Tool {
        let place = Place { deploy: Some(self.deploy.clone()), run_dir: Some(self.run_dir()) };
        let (manifest, _, run_dir) = place.running().unwrap();
        Tool::join("cli", manifest, &run_dir).unwrap()
    }
}

impl Drop for System {
    fn drop(&mut self) {
        let _ = self.sereno(&["down", "--now"]);
        let deadline = Instant::now() + LONG;
        while self.up.try_wait().is_ok_and(|ended| ended.is_none()) && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.up.kill();
        let _ = self.up.wait();
        RunDir::new(self.run_dir()).wipe();
    }
}

fn sereno(deploy: &Path, run_dir: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(programs().join("sereno"));
    command.arg("--deploy").arg(deploy).arg("--run-dir").arg(run_dir).args(words);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}
