//! A supervised system of tiny services for tests: real processes, shared memory only where asked for.
//!
//! The test executable plays all the parts. Run with `--ignored --exact system::supervisor_process` it is a
//! supervisor, or its warden, with `system::child_process` a service.

#![allow(dead_code, reason = "every test file uses its part")]

use rustix::process::{Pid, Signal, kill_process};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use supervisor::protocol::ServiceRow;
use supervisor::{Client, Options, Part, SharedMemory, SupervisorError};

/// Nothing here takes long: whoever waits this long waits in vain.
pub(crate) const LONG: Duration = Duration::from_secs(30);

/// Pretends to fly while `airborne` is in the directory; a landing takes one look.
struct Pretended(PathBuf);

impl SharedMemory for Pretended {
    fn keep(&mut self) {}
    fn recover(&mut self, service: &str) -> Vec<String> {
        vec![format!("{service}/state")]
    }
    fn tidy(&mut self) {}
    fn airborne(&self) -> bool {
        self.0.join("airborne").exists()
    }
    fn land(&mut self, sequence: u32) {
        let mut orders = std::fs::read_to_string(self.0.join("land")).unwrap_or_default();
        orders.push_str(&format!("{sequence}\n"));
        std::fs::write(self.0.join("land"), orders).unwrap();
        if !self.0.join("stubborn").exists() {
            std::fs::remove_file(self.0.join("airborne")).unwrap();
        }
    }
}

#[test]
#[ignore = "the supervisor of the other tests"]
fn supervisor_process() {
    let Some(dir) = std::env::var_os("TEST_DIR").map(PathBuf::from) else { return };
    let options = Options {
        manifests: vec![dir.join("system.toml")],
        run_dir: Some(dir.join("run")),
        programs: Some(dir.clone()),
        stop_limit: Duration::from_millis(500),
        logs: std::env::var_os("TEST_LOGS").map(PathBuf::from),
        ..Options::default()
    };
    let open = |part, _: &_, _: &_| {
        if part == Part::Warden && dir.join("no-warden").exists() {
            return Err(SupervisorError::SharedMemory("the test wants no warden".to_owned()));
        }
        Ok(Pretended(dir.clone()))
    };
    if let Err(error) = supervisor::run_with(&options, open) {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

fn notify(text: &str) {
    if let Some(path) = std::env::var_os("NOTIFY_SOCKET") {
        let _ = UnixDatagram::unbound().and_then(|socket| socket.send_to(text.as_bytes(), path));
    }
}

#[test]
#[ignore = "a service of the other tests"]
fn child_process() {
    let Ok(part) = std::env::var("TEST_PART") else { return };
    let stop = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGTERM, Arc::clone(&stop)).unwrap();
    let start = std::env::var("SERENO_INCARNATION").unwrap();
    println!("{part}: start {start}, kept {}", std::env::var("SERENO_RETAINED").unwrap());
    notify("READY=1");
    match part.as_str() {
        "exit" => return,
        "fail" => std::process::exit(3),
        "hang" => std::thread::sleep(LONG * 2),
        _ => {}
    }
    while part == "deaf" || !stop.load(Ordering::Relaxed) {
        notify("WATCHDOG=1\nSTATUS=at work");
        std::thread::sleep(Duration::from_millis(20));
    }
    notify("STOPPING=1");
}

/// A directory with a manifest, services and perhaps a supervisor.
pub(crate) struct System {
    dir: tempfile::TempDir,
    supervisor: Option<std::process::Child>,
}

impl System {
    /// A system of services (name, part, further manifest lines), not yet started.
    pub(crate) fn of(services: &[(&str, &str, &str)]) -> Self {
        let system = Self { dir: tempfile::tempdir().unwrap(), supervisor: None };
        let mut manifest = "[system]\nname = \"test\"\nplan = \"p.yaml\"\nvehicle = \"v.toml\"\n".to_owned();
        for (name, part, more) in services {
            system.program(name, part);
            manifest.push_str(&format!("[service.{name}]\nrun = \"{name}\"\ntick_hz = 1\n{more}\n"));
        }
        std::fs::write(system.path("system.toml"), manifest).unwrap();
        system
    }

    /// [`System::of`], supervised.
    pub(crate) fn started(services: &[(&str, &str, &str)]) -> Self {
        let mut system = Self::of(services);
        system.start();
        system
    }

    /// Makes the executable of a service: a part of [`child_process`], or a shell script (`sh: ...`).
    pub(crate) fn program(&self, name: &str, part: &str) {
        let test = std::env::current_exe().unwrap();
        let text = match part.strip_prefix("sh:") {
            Some(script) => format!("#!/bin/sh\n{script}\n"),
            None => format!(
                "#!/bin/sh\nTEST_PART={part} exec {} --ignored --exact system::child_process --nocapture\n",
                test.display()
            ),
        };
        // A new file, so that no running shell reads the new text through the old one.
        let fresh = self.path("fresh");
        let mut file = std::fs::File::create(&fresh).unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file.set_permissions(std::fs::Permissions::from_mode(0o755)).unwrap();
        drop(file);
        std::fs::rename(fresh, self.path(name)).unwrap();
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn run_dir(&self) -> PathBuf {
        self.path("run")
    }

    pub(crate) fn supervisor_command(&self) -> Command {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command
            .args(["--ignored", "--exact", "system::supervisor_process", "--nocapture"])
            .env("TEST_DIR", self.dir.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        command
    }

    /// Starts a supervisor and waits until it answers.
    pub(crate) fn start(&mut self) {
        self.start_as(self.supervisor_command());
    }

    /// Starts a supervisor by a command of the test's own; its process id.
    pub(crate) fn start_as(&mut self, mut command: Command) -> u32 {
        let supervisor = command.spawn().unwrap();
        let pid = supervisor.id();
        self.supervisor = Some(supervisor);
        let run_dir = self.run_dir();
        wait_until("the supervisor answers", || Client::connect(&run_dir).is_ok());
        pid
    }

    /// Runs one more supervisor to its end; what it says is a few lines.
    pub(crate) fn second(&self) -> Output {
        let mut second = self.supervisor_command().stderr(Stdio::piped()).spawn().unwrap();
        let deadline = Instant::now() + LONG;
        while second.try_wait().unwrap().is_none() {
            if Instant::now() >= deadline {
                second.kill().unwrap();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        second.wait_with_output().unwrap()
    }

    pub(crate) fn client(&self) -> Client {
        Client::connect(&self.run_dir()).unwrap()
    }

    pub(crate) fn row(&self, service: &str) -> ServiceRow {
        self.client().service(service).unwrap()
    }

    /// Waits until a service is as wanted.
    pub(crate) fn wait_for(&self, service: &str, wanted: impl Fn(&ServiceRow) -> bool) -> ServiceRow {
        let deadline = Instant::now() + LONG;
        loop {
            let row = self.row(service);
            if wanted(&row) {
                return row;
            }
            assert!(Instant::now() < deadline, "in vain: {row:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    pub(crate) fn wait_running(&self, service: &str) -> u32 {
        self.wait_for(service, |row| row.state == "running").pid.unwrap()
    }

    /// Sends a signal to the supervisor.
    pub(crate) fn signal(&self, signal: Signal) {
        let supervisor = self.supervisor.as_ref().unwrap();
        kill_process(Pid::from_child(supervisor), signal).unwrap();
    }

    /// Waits for the supervisor's end.
    pub(crate) fn ended(&mut self) -> ExitStatus {
        let mut status = None;
        let supervisor = self.supervisor.as_mut().unwrap();
        wait_until("the supervisor ends", || {
            status = supervisor.try_wait().unwrap();
            status.is_some()
        });
        self.supervisor = None;
        status.unwrap()
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if let Some(mut supervisor) = self.supervisor.take() {
            let _ = supervisor.kill();
            let _ = supervisor.wait();
        }
        // Neither a warden nor services outlive a test, however it ended.
        let deadline = Instant::now() + LONG;
        while Instant::now() < deadline {
            let left = processes(&self.run_dir());
            if left.is_empty() {
                break;
            }
            for pid in left {
                let _ = kill_process(Pid::from_raw(pid.cast_signed()).unwrap(), Signal::KILL);
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        runtime::shm::RunDir::new(self.run_dir()).wipe();
    }
}

/// Services and wardens of a run directory, and what they started, by their environment; whoever has ended has none.
pub(crate) fn processes(run_dir: &Path) -> Vec<u32> {
    let mark = format!("{}={}", runtime::env::RUN_DIR, run_dir.display());
    let entries = std::fs::read_dir("/proc").unwrap().flatten();
    entries
        .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
        .filter(|pid: &u32| {
            std::fs::read(format!("/proc/{pid}/environ"))
                .is_ok_and(|all| all.split(|b| *b == 0).any(|variable| variable == mark.as_bytes()))
        })
        .collect()
}

pub(crate) fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + LONG;
    while !done() {
        assert!(Instant::now() < deadline, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

pub(crate) fn kill(pid: u32, signal: Signal) {
    kill_process(Pid::from_raw(pid.cast_signed()).unwrap(), signal).unwrap();
}

/// Whether there is such a process, zombies included.
pub(crate) fn exists(pid: u32) -> bool {
    Path::new(&format!("/proc/{pid}")).exists()
}

/// Whether a process runs; one that has ended and that nobody has reaped yet does not.
pub(crate) fn alive(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    stat.rsplit_once(") ").is_some_and(|(_, rest)| !rest.starts_with(['Z', 'X']))
}
