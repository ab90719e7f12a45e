//! As much of a drone as has to do with video, and a browser that watches it.
#![allow(dead_code, reason = "each test needs a part of it")]

pub(crate) mod relay;
mod server;

use relay::Relay;
use server::Server;

use ipc_types::{SignalIn, SignalOut, Video};
use manifest::Manifest;
use runtime::shm::{Holder, RunDir};
use runtime::{Input, Output, Tool};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const MANIFEST: &str = r#"
[system]
name = "filmed"
plan = "plans/demo.yaml"
vehicle = "vehicles/watchman.toml"
world = "worlds/demo.toml"
simulated = true
[service.simulator]
run = "sereno-simulator"
config = "config/simulator.toml"
criticality = "flight"
tick_hz = 200
heartbeat_ms = 10000
devices = { controller = "@run/controller" }
publishes.'sim/echo' = { hz = 16 }
publishes.'sim/truth' = { hz = 50 }
publishes.'sim/view' = { hz = 15 }
subscribes.'sim/ping' = { depth = 8 }
subscribes.'sim/shutter' = { depth = 2, wake = true }
subscribes.'flight/state' = { depth = 4 }
[service.scenery]
run = "sereno-scenery"
config = "config/simulator.toml"
criticality = "comfort"
heartbeat_ms = 10000
publishes.'camera/picture' = { hz = 15 }
subscribes.'sim/view' = { depth = 1, wake = true }
[service.camera]
run = "sereno-camera"
criticality = "comfort"
tick_hz = 120
heartbeat_ms = 2000
publishes.'camera/video' = { hz = 15 }
publishes.'camera/still' = { hz = 0 }
publishes.'sim/shutter' = { hz = 15 }
subscribes.'camera/wish' = { depth = 8, wake = true }
subscribes.'camera/picture' = { depth = 1, wake = true }
subscribes.'localization/pose' = { depth = 4 }
[service.stream]
run = "sereno-stream"
config = "config/stream.toml"
criticality = "comfort"
tick_hz = 50
heartbeat_ms = 2000
publishes.'camera/wish' = { hz = 10 }
publishes.'signal/out' = { hz = 0 }
subscribes.'signal/in' = { depth = 8, wake = true }
subscribes.'camera/video' = { depth = 8, wake = true }
subscribes.'pilot/state' = { depth = 4 }
# What is not part of this: nobody runs it.
[service.absent]
run = "absent"
criticality = "comfort"
tick_hz = 1
publishes.'sim/ping' = { hz = 0 }
publishes.'flight/state' = { hz = 0 }
publishes.'pilot/state' = { hz = 0 }
publishes.'localization/pose' = { hz = 0 }
[tool.viewer]
publishes = ["signal/in"]
"#;

/// Services that run, in the order of their start.
const RUNNING: [&str; 4] = ["simulator", "scenery", "camera", "stream"];
const PATIENCE: Duration = Duration::from_secs(120);
const ONE: &str = include_str!("../page.html");
const MANY: &str = include_str!("../many.html");

/// What a browser saw.
pub(crate) struct Watched(pub(crate) Value);

impl Watched {
    pub(crate) fn numbers(&self, key: &str) -> Vec<f64> {
        self.0[key].as_array().map(|all| all.iter().filter_map(Value::as_f64).collect()).unwrap_or_default()
    }
    pub(crate) fn errors(&self) -> Vec<String> {
        self.0["errors"].as_array().into_iter().flatten().map(ToString::to_string).collect()
    }
}

/// The value below which `share` of them lie; not a number without any.
pub(crate) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = ((sorted.len() as f64 - 1.0) * share).round().max(0.0) as usize;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

/// What the drone has done when the page marked something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    /// Frames that were encoded so far.
    pub(crate) encoded: u64,
    /// Memory of the stream's process.
    pub(crate) memory_kib: u64,
}

pub(crate) struct Drone {
    encoded: u64,
    run_dir: RunDir,
    manifest_file: PathBuf,
    running: Vec<(&'static str, Child)>,
    holder: Holder,
    tool: Tool,
    signals: Output<SignalIn>,
    replies: Input<SignalOut>,
    videos: Input<Video>,
    kill: Option<(&'static str, f64)>,
    incarnation: u32,
    /// Removed last.
    _directory: tempfile::TempDir,
}

fn programs() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from).join("release")
}

impl Drone {
    /// Starts everything; `stream` is written into the stream's configuration.
    pub(crate) fn start(stream: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
        for folder in ["plans", "vehicles", "worlds"] {
            std::os::unix::fs::symlink(
                deploy.join(folder).canonicalize().unwrap(),
                directory.path().join(folder),
            )
            .unwrap();
        }
        std::fs::create_dir(directory.path().join("config")).unwrap();
        let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
        write("config/simulator.toml", "camera = { bar_code = true }\n");
        write("config/stream.toml", stream);
        write("filmed.toml", MANIFEST);
        let run_dir = RunDir::new(directory.path().join("run"));
        std::fs::create_dir_all(run_dir.path()).unwrap();
        let manifest = Manifest::parse("filmed.toml", MANIFEST).unwrap();
        let holder = Holder::create(&manifest, &run_dir).unwrap();
        let mut tool = Tool::join("viewer", manifest, &run_dir).unwrap();
        let (signals, replies, videos) =
            (tool.ports.output().unwrap(), tool.ports.input().unwrap(), tool.ports.input().unwrap());
        let manifest_file = directory.path().join("filmed.toml");
        let mut drone = Self {
            _directory: directory,
            run_dir,
            manifest_file,
            running: Vec::new(),
            holder,
            tool,
            signals,
            replies,
            videos,
            kill: None,
            incarnation: 0,
            encoded: 0,
        };
        for service in RUNNING {
            drone.spawn(service);
        }
        drone
    }

    fn spawn(&mut self, service: &'static str) {
        let program = programs().join(format!("sereno-{service}"));
        let child = Command::new(&program)
            .env("SERENO_MANIFEST", &self.manifest_file)
            .env("SERENO_RUN_DIR", self.run_dir.path())
            .env("SERENO_SEED", "3")
            .env("SERENO_INCARNATION", self.incarnation.to_string())
            .spawn()
            .unwrap_or_else(|error| panic!("{}: {error}; build the programs first", program.display()));
        self.running.push((service, child));
    }

    /// Kills a service so many seconds after the first picture of the next [`Drone::watch`], and starts it again.
    pub(crate) fn kill_during(&mut self, service: &'static str, after_s: f64) {
        self.kill = Some((service, after_s));
    }

    /// Has a browser watch with these options of the page.
    pub(crate) fn watch(&mut self, options: &str) -> Watched {
        self.watch_through(ONE, options, PATIENCE, &[], |_, _| {})
    }

    /// The same with a relay between browser and drone.
    pub(crate) fn watch_behind(&mut self, relay: &Relay, options: &str) -> Watched {
        self.watch_through(ONE, options, PATIENCE, &[(0, relay)], |_, _| {})
    }

    /// Has a browser watch many times at once for so many seconds, each viewer that has a number among `relays` behind that
    /// one. `mark` hears how far the page is.
    pub(crate) fn watch_many(
        &mut self,
        viewers: usize,
        seconds: u64,
        relays: &[(usize, &Relay)],
        mark: impl FnMut(&str, State),
    ) -> Watched {
        let options = format!("viewers={viewers}&seconds={seconds}");
        self.watch_through(MANY, &options, PATIENCE + Duration::from_secs(seconds), relays, mark)
    }

    fn watch_through(
        &mut self,
        page: &'static str,
        options: &str,
        patience: Duration,
        relays: &[(usize, &Relay)],
        mut mark: impl FnMut(&str, State),
    ) -> Watched {
        let server = Server::start(page);
        let profile = tempfile::tempdir().unwrap();
        let mut browser = Command::new("chromium")
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--disable-sync",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
                "--autoplay-policy=no-user-gesture-required",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("http://{}/?{options}", server.address))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromium is installed");
        let session = format!("s{}", server.address.port());
        let began = Instant::now();
        let mut first_video = None;
        let result = loop {
            assert!(began.elapsed() < patience, "the browser did not report");
            self.turn(&server, &session, relays, &mut first_video);
            while let Ok(how_far) = server.marks.try_recv() {
                mark(&how_far, State { encoded: self.encoded, memory_kib: self.memory_kib() });
            }
            if let Ok(result) = server.results.try_recv() {
                break result;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        for _ in 0..100 {
            self.turn(&server, &session, relays, &mut first_video);
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = browser.kill();
        let _ = browser.wait();
        Watched(serde_json::from_str(&result).unwrap())
    }

    fn turn(
        &mut self,
        server: &Server,
        session: &str,
        relays: &[(usize, &Relay)],
        first_video: &mut Option<Instant>,
    ) {
        self.tool.tick();
        self.holder.keep();
        let relay_of =
            |viewer: usize| relays.iter().find(|(number, _)| *number == viewer).map(|(_, relay)| *relay);
        while let Ok((viewer, said)) = server.said.try_recv() {
            if relay_of(viewer).is_none() || Relay::to_drone(&said) {
                self.say(&format!("{session}-{viewer}"), &said);
            }
        }
        while let Some(reply) = self.replies.receive() {
            let number = reply.session.as_str().strip_prefix(session).and_then(|rest| rest.strip_prefix('-'));
            let Some(viewer) = number.and_then(|number| number.parse().ok()) else { continue };
            let text = match relay_of(viewer) {
                Some(relay) => relay.to_browser(reply.body.as_str()),
                None => Some(reply.body.as_str().to_owned()),
            };
            server.outbox.lock().unwrap().extend(text.map(|text| (viewer, text)));
        }
        while self.videos.receive().is_some() {
            self.encoded += 1;
            first_video.get_or_insert_with(Instant::now);
        }
        if let (Some((service, after_s)), Some(first)) = (self.kill, *first_video)
            && first.elapsed().as_secs_f64() > after_s
        {
            self.kill = None;
            let index = self.running.iter().position(|(name, _)| *name == service).unwrap();
            let (_, mut child) = self.running.remove(index);
            child.kill().unwrap();
            child.wait().unwrap();
            self.holder.cleanup_dead_nodes();
            self.incarnation += 1;
            self.spawn(service);
        }
    }

    /// Says something in a session.
    pub(crate) fn say(&mut self, session: &str, body: &str) {
        let mut loan = self.signals.loan().unwrap();
        loan.session.set(session);
        loan.certificate.set("desk");
        loan.account.set("ana");
        loan.role.set("viewer");
        loan.body.set(body);
        loan.send();
    }

    /// The next thing that is said in a session, within a while.
    pub(crate) fn hear(&mut self, session: &str) -> Option<Value> {
        let until = Instant::now() + Duration::from_secs(10);
        while Instant::now() < until {
            self.tool.tick();
            self.holder.keep();
            while let Some(reply) = self.replies.receive() {
                if reply.session.as_str() == session {
                    return Some(serde_json::from_str(reply.body.as_str()).unwrap());
                }
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        None
    }

    /// Whether a service is the process that was started.
    pub(crate) fn lives(&mut self, service: &str) -> bool {
        let (_, child) = self.running.iter_mut().find(|(name, _)| *name == service).unwrap();
        child.try_wait().unwrap().is_none()
    }

    /// Memory of the stream's process that is in use.
    fn memory_kib(&self) -> u64 {
        let (_, child) = self.running.iter().find(|(name, _)| *name == "stream").unwrap();
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
        line.trim().trim_end_matches(" kB").parse().unwrap()
    }

    /// Asserts that within two seconds nothing is encoded any more, as nobody watches.
    pub(crate) fn stays_quiet(&mut self) {
        let wait = |drone: &mut Self, seconds: u64| {
            let until = Instant::now() + Duration::from_secs(seconds);
            let mut videos = 0;
            while Instant::now() < until {
                drone.tool.tick();
                while drone.videos.receive().is_some() {
                    videos += 1;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            videos
        };
        wait(self, 2);
        assert_eq!(wait(self, 1), 0, "the camera sleeps while nobody watches");
    }
}

impl Drop for Drone {
    fn drop(&mut self) {
        for (_, child) in self.running.iter_mut().rev() {
            let _ = child.kill();
            let _ = child.wait();
        }
        self.holder.cleanup_dead_nodes();
    }
}
