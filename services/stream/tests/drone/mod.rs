//! As much of a drone as has to do with video, and a browser that watches it.

use ipc_types::{SignalIn, SignalOut, Video};
use manifest::Manifest;
use runtime::shm::{Holder, RunDir};
use runtime::{Input, Output, Tool};
use serde_json::Value;
use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, mpsc};
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
publishes.'sim/shutter' = { hz = 15 }
subscribes.'camera/wish' = { depth = 8, wake = true }
subscribes.'camera/picture' = { depth = 1, wake = true }
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
[tool.viewer]
publishes = ["signal/in"]
"#;

/// Services that run, in the order of their start.
const RUNNING: [&str; 4] = ["simulator", "scenery", "camera", "stream"];
const PATIENCE: Duration = Duration::from_secs(120);

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

pub(crate) struct Drone {
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
        let server = Server::start();
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
            assert!(began.elapsed() < PATIENCE, "the browser did not report");
            self.turn(&server, &session, &mut first_video);
            if let Ok(result) = server.results.try_recv() {
                break result;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        for _ in 0..100 {
            self.turn(&server, &session, &mut first_video);
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = browser.kill();
        let _ = browser.wait();
        Watched(serde_json::from_str(&result).unwrap())
    }

    fn turn(&mut self, server: &Server, session: &str, first_video: &mut Option<Instant>) {
        self.tool.tick();
        self.holder.keep();
        while let Ok(said) = server.said.try_recv() {
            let mut loan = self.signals.loan().unwrap();
            loan.session.set(session);
            loan.certificate.set("desk");
            loan.account.set("ana");
            loan.role.set("viewer");
            loan.body.set(&said);
            loan.send();
        }
        while let Some(reply) = self.replies.receive() {
            if reply.session.as_str() == session {
                server.outbox.lock().unwrap().push_back(reply.body.as_str().to_owned());
            }
        }
        while self.videos.receive().is_some() {
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

/// Serves the page and carries its messages.
struct Server {
    address: std::net::SocketAddr,
    said: mpsc::Receiver<String>,
    results: mpsc::Receiver<String>,
    outbox: Arc<Mutex<VecDeque<String>>>,
}

impl Server {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let (say, said) = mpsc::channel();
        let (done, results) = mpsc::channel();
        let outbox = Arc::new(Mutex::new(VecDeque::new()));
        let shared = Arc::clone(&outbox);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (say, done, outbox) = (say.clone(), done.clone(), Arc::clone(&shared));
                std::thread::spawn(move || serve(stream, &say, &done, &outbox));
            }
        });
        Self { address, said, results, outbox }
    }
}

fn serve(
    stream: TcpStream,
    say: &mpsc::Sender<String>,
    done: &mpsc::Sender<String>,
    outbox: &Mutex<VecDeque<String>>,
) {
    let _ = stream.set_nodelay(true);
    let mut writer = stream.try_clone().unwrap();
    let mut reader = BufReader::new(stream);
    loop {
        let mut request = String::new();
        if reader.read_line(&mut request).unwrap_or(0) == 0 {
            return;
        }
        let mut length = 0;
        loop {
            let mut line = String::new();
            if reader.read_line(&mut line).unwrap_or(0) == 0 {
                return;
            }
            if line.trim().is_empty() {
                break;
            }
            if let Some(value) = line.to_lowercase().strip_prefix("content-length:") {
                length = value.trim().parse().unwrap();
            }
        }
        let mut body = vec![0; length];
        if reader.read_exact(&mut body).is_err() {
            return;
        }
        let body = String::from_utf8(body).unwrap();
        let path = request.split(' ').nth(1).unwrap_or("/").to_owned();
        let (kind, text) = match path.split('?').next().unwrap_or("/") {
            "/clock" => ("text/plain", (runtime::monotonic_ns() / 1000).to_string()),
            "/say" => {
                let _ = say.send(body);
                ("text/plain", String::new())
            }
            "/result" => {
                let _ = done.send(body);
                ("text/plain", String::new())
            }
            "/poll" => {
                std::thread::sleep(Duration::from_millis(10));
                let all: Vec<String> = outbox.lock().unwrap().drain(..).collect();
                ("application/json", format!("[{}]", all.join(",")))
            }
            _ => ("text/html", include_str!("../page.html").to_owned()),
        };
        let head =
            format!("HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {}\r\n\r\n", text.len());
        if writer.write_all((head + &text).as_bytes()).is_err() {
            return;
        }
    }
}
