//! A simulated system, a console and a browser before it.

use cli::place::Place;
use manifest::Manifest;
use runtime::shm::RunDir;
use sereno_tests::{lightly_cluttered, programs};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Whoever waits this long waits in vain, on a loaded machine too.
pub(crate) const LONG: Duration = Duration::from_secs(90);

/// Waits for a condition; says what for when it does not come.
pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let began = Instant::now();
    while !holds() {
        assert!(began.elapsed() < LONG, "{what}: not within {} s", LONG.as_secs());
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// One system and one browser at a time: two cores fly one.
static TURN: Mutex<()> = Mutex::new(());

/// A supervised system in the simulator with a console on it.
pub(crate) struct Rig {
    directory: tempfile::TempDir,
    deploy: PathBuf,
    up: Child,
    console: Option<Child>,
    /// Where the page is.
    pub(crate) address: String,
    /// What claims it.
    pub(crate) claim: String,
    _turn: MutexGuard<'static, ()>,
}

impl Rig {
    /// Everything but a browser.
    pub(crate) fn start() -> Self {
        let mut rig = Self::start_with(|_, _| {});
        rig.wait_running();
        rig.open();
        rig
    }

    /// The system alone, with files changed that are in its deploy directory, and its run directory. Nothing is waited for.
    pub(crate) fn start_with(change: impl FnOnce(&Path, &Path)) -> Self {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        let directory = tempfile::tempdir().unwrap();
        let deploy = lightly_cluttered(directory.path(), "two-rooms").unwrap();
        let run_dir = directory.path().join("run");
        change(&deploy, &run_dir);
        let up = sereno(&deploy, &run_dir, &["up", "--sim", "--quiet"]).stdin(Stdio::null()).spawn().unwrap();
        Self {
            directory,
            deploy,
            up,
            console: None,
            address: String::new(),
            claim: String::new(),
            _turn: turn,
        }
    }

    /// Waits until every service runs.
    pub(crate) fn wait_running(&self) {
        wait_until("everything runs", || {
            let rows = supervisor::Client::connect(&self.run_dir()).and_then(|mut client| client.ps());
            rows.is_ok_and(|all| {
                !all.services.is_empty() && all.services.iter().all(|row| row.state == "running")
            })
        });
    }

    /// Starts the console.
    pub(crate) fn open(&mut self) {
        let config = self.deploy.join("config/console.toml");
        let text = std::fs::read_to_string(&config).unwrap().replace("127.0.0.1:8443", "127.0.0.1:0");
        std::fs::write(&config, text).unwrap();
        let mut console = Command::new(programs().join("sereno-console"))
            .arg("--config")
            .arg(&config)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(console.stdout.take().unwrap()).lines();
        self.console = Some(console);
        while self.address.is_empty() || self.claim.is_empty() {
            let line = lines.next().expect("the console ended before it said where it is").unwrap();
            if let Some(at) = line.find("https://") {
                line[at..].clone_into(&mut self.address);
            }
            if let Some((_, code)) = line.split_once("claim code: ") {
                code.trim().clone_into(&mut self.claim);
            }
        }
    }

    /// Where the supervisor keeps its things.
    pub(crate) fn run_dir(&self) -> PathBuf {
        self.directory.path().join("run")
    }

    /// The running system, for who reads its topics.
    pub(crate) fn manifest(&self) -> (Manifest, RunDir) {
        let place = Place { deploy: Some(self.deploy.clone()), run_dir: Some(self.run_dir()) };
        let (manifest, _, run_dir) = place.running().unwrap();
        (manifest, run_dir)
    }
}

fn sereno(deploy: &Path, run_dir: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(programs().join("sereno"));
    command.arg("--deploy").arg(deploy).arg("--run-dir").arg(run_dir).args(words);
    command
}

impl Drop for Rig {
    fn drop(&mut self) {
        if let Some(console) = &mut self.console {
            let _ = console.kill();
            let _ = console.wait();
        }
        let _ = sereno(&self.deploy, &self.run_dir(), &["down", "--now"]).output();
        let _ = self.up.kill();
        let _ = self.up.wait();
    }
}
