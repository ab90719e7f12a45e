//! `kill -9` of the supervisor over the flying system: the aircraft comes down under control, then all is over.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use cli::place::Place;
use ipc_types::{PilotState, Truth};
use manifest::Manifest;
use runtime::shm::RunDir;
use runtime::{Input, Tool};
use serde_json::Value;
use sereno_tests::{lightly_cluttered, programs};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Whoever waits this long waits in vain, on a loaded machine too.
const LONG: Duration = Duration::from_secs(90);
/// Higher than this and faster than that over the ground it is on its round.
const FLYING_M: f32 = 0.8;
const FLYING_M_S: f32 = 0.15;
/// A floor touched faster counts as a contact (DESIGN 5).
const HARD_M_S: f32 = 0.7;
/// What `flight` alone may touch at, taken in the middle of a motion: it is level and drifts, and may come down on an edge.
/// A fall from the height of a round would end at 4.8. `alone.rs` is stricter with one that stood.
const ALONE_M_S: f32 = 1.0;
/// From the highest flight (1.2 m) at the usual 0.3 m/s, with the stop before it and a margin for a loaded machine.
const LANDED: Duration = Duration::from_secs(25);
/// Seven services, each of which ends within milliseconds or is killed after two seconds.
const ENDED: Duration = Duration::from_secs(20);

/// A system in the simulator, and whatever is left of it.
struct System {
    directory: tempfile::TempDir,
    deploy: PathBuf,
    up: Child,
    /// A second supervisor over the same run directory.
    second: Option<Child>,
}

impl System {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let deploy = lightly_cluttered(directory.path(), "two-rooms").unwrap();
        let up = up(&deploy, &directory.path().join("run")).spawn().unwrap();
        let system = Self { directory, deploy, up, second: None };
        system.wait_running();
        system
    }

    fn run_dir(&self) -> PathBuf {
        self.directory.path().join("run")
    }

    fn sereno(&self, words: &[&str]) -> Command {
        sereno(&self.deploy, &self.run_dir(), words)
    }

    fn ps(&self) -> Value {
        let output = self.sereno(&["ps", "--json"]).output().unwrap();
        serde_json::from_slice(&output.stdout).unwrap_or_default()
    }

    fn wait_running(&self) {
        wait_until("everything runs", || {
            let overview = self.ps();
            let services = overview["services"].as_array().cloned().unwrap_or_default();
            !services.is_empty() && services.iter().all(|service| service["state"] == "running")
        });
    }

    fn manifest(&self) -> (Manifest, RunDir) {
        let place = Place { deploy: Some(self.deploy.clone()), run_dir: Some(self.run_dir()) };
        let (manifest, _, run_dir) = place.running().unwrap();
        (manifest, run_dir)
    }

    fn pid(&self, service: &str) -> u64 {
        let overview = self.ps();
        let mut services = overview["services"].as_array().unwrap().iter();
        services.find(|row| row["name"] == service).unwrap()["pid"].as_u64().unwrap()
    }

    /// Kills the supervisor, and takes leave of it.
    fn kill_supervisor(&mut self) {
        self.up.kill().unwrap();
        self.up.wait().unwrap();
    }

    /// As a person who types `sereno up` again, at once.
    fn start_another(&mut self) {
        self.second = Some(up(&self.deploy, &self.run_dir()).spawn().unwrap());
    }

    /// What the other one said before it ended.
    fn refusal(&mut self) -> String {
        let mut status = None;
        wait_until("the second supervisor ends", || {
            status = self.second.as_mut().unwrap().try_wait().unwrap();
            status.is_some()
        });
        assert!(!status.unwrap().success());
        let output = self.second.take().unwrap().wait_with_output().unwrap();
        String::from_utf8_lossy(&output.stderr).into_owned()
    }
}

impl Drop for System {
    fn drop(&mut self) {
        for supervisor in [Some(&mut self.up), self.second.as_mut()].into_iter().flatten() {
            let _ = supervisor.kill();
            let _ = supervisor.wait();
        }
        // Services and wardens of a test that failed.
        let deadline = Instant::now() + LONG;
        while !processes(&self.run_dir()).is_empty() && Instant::now() < deadline {
            for pid in processes(&self.run_dir()) {
                // It may have ended a moment ago.
                let _ = signal(pid.into(), "KILL");
            }
        }
        RunDir::new(self.run_dir()).wipe();
    }
}

fn sereno(deploy: &Path, run_dir: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(programs().join("sereno"));
    command.arg("--deploy").arg(deploy).arg("--run-dir").arg(run_dir).args(words);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn up(deploy: &Path, run_dir: &Path) -> Command {
    let mut command = sereno(deploy, run_dir, &["up", "--sim", "--quiet", "--seed", "2"]);
    command.stdout(Stdio::null());
    command
}

fn signal(pid: u64, name: &str) -> bool {
    Command::new("kill").args([format!("-{name}"), pid.to_string()]).status().unwrap().success()
}

fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + LONG;
    while !done() {
        assert!(Instant::now() < deadline, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Services and wardens of a run directory, by their environment; whoever has ended has none.
fn processes(run_dir: &Path) -> Vec<u32> {
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

/// What the simulator says of itself, and how the flight came down.
struct Witness {
    tool: Tool,
    truth: Input<Truth>,
    newest: Option<Truth>,
    /// Vertical speed just before the floor was touched.
    touched_m_s: Option<f32>,
}

impl Witness {
    fn join(system: &System) -> Self {
        let (manifest, run_dir) = system.manifest();
        let mut tool = Tool::join("cli", manifest, &run_dir).unwrap();
        let truth = tool.ports.input().unwrap();
        Self { tool, truth, newest: None, touched_m_s: None }
    }

    fn look(&mut self) {
        self.tool.tick();
        while let Some(truth) = self.truth.receive() {
            if let Some(before) = self.newest.filter(|before| before.on_ground == 0)
                && truth.on_ground != 0
            {
                self.touched_m_s = Some(before.velocity_z_m_s);
            }
            self.newest = Some(*truth);
        }
    }

    fn on_its_round(&self) -> bool {
        self.newest.is_some_and(|truth| {
            truth.z_m > FLYING_M && truth.velocity_x_m_s.hypot(truth.velocity_y_m_s) > FLYING_M_S
        })
    }

    fn stands(&self) -> bool {
        self.newest.is_some_and(|truth| truth.on_ground != 0 && truth.armed == 0)
    }
}

fn take_off(system: &System, witness: &mut Witness) {
    wait_until("a round is accepted", || {
        system.sereno(&["patrol", "start"]).output().unwrap().status.success()
    });
    wait_until("it is on its round", || {
        witness.look();
        witness.on_its_round()
    });
}

fn nothing_is_left(system: &System, limit: Duration) {
    let deadline = Instant::now() + limit;
    while !processes(&system.run_dir()).is_empty() || system.run_dir().exists() {
        let left = processes(&system.run_dir());
        assert!(Instant::now() < deadline, "left: processes {left:?}, in {}", system.run_dir().display());
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(RunDir::new(system.run_dir()).leftovers(), Vec::<String>::new(), "in shared memory");
}

#[test]
fn the_aircraft_of_a_killed_supervisor_lands_and_then_all_is_over() {
    let mut system = System::start();
    let mut witness = Witness::join(&system);
    take_off(&system, &mut witness);
    let (manifest, run_dir) = system.manifest();

    system.kill_supervisor();
    let killed = Instant::now();
    let mut newcomer = None;
    while !witness.stands() {
        witness.look();
        let truth = witness.newest.unwrap();
        let at = format!(
            "{:.1} s after the kill at {:.2} m: {truth:?}",
            killed.elapsed().as_secs_f64(),
            truth.z_m
        );
        assert!(killed.elapsed() < LANDED, "{at}");
        assert_eq!(truth.contacts, 0, "{at}");
        // Meanwhile, in the air: the memory that the dead supervisor made may still be joined, and its place is taken.
        if killed.elapsed() > Duration::from_secs(1) && newcomer.is_none() {
            assert!(truth.z_m > 0.2, "{at}");
            system.start_another();
            let mut tool = Tool::join("cli", manifest.clone(), &run_dir).unwrap();
            let state = tool.ports.input::<PilotState>().unwrap();
            newcomer = Some((tool, state));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let landed = killed.elapsed();
    let speed = witness.touched_m_s.unwrap();
    assert!(speed > -HARD_M_S, "touched at {speed} m/s");
    let (_, mut state) = newcomer.unwrap();
    assert!(state.latest().is_some(), "whoever joins after the death hears the pilot");
    let said = system.refusal();
    assert!(said.contains("already in use by process "), "{said}");
    assert!(said.contains("which is landing after its supervisor died"), "{said}");

    drop((state, witness));
    nothing_is_left(&system, ENDED);
    println!(
        "landed {:.1} s after the kill, touched at {speed:.2} m/s, all over after {:.1} s",
        landed.as_secs_f64(),
        killed.elapsed().as_secs_f64()
    );
}

#[test]
fn on_the_ground_a_killed_supervisor_is_over_at_once_and_another_may_start() {
    let mut system = System::start();
    system.kill_supervisor();
    let killed = Instant::now();
    nothing_is_left(&system, ENDED);
    println!("all over {:.1} s after the kill", killed.elapsed().as_secs_f64());

    system.up = up(&system.deploy, &system.run_dir()).spawn().unwrap();
    system.wait_running();
    // A warden that dies is replaced, and nobody else notices.
    let before = system.ps();
    let warden = before["warden"].as_u64().unwrap();
    assert!(signal(warden, "KILL"));
    wait_until("another warden", || {
        let now = system.ps()["warden"].as_u64();
        now.is_some_and(|now| now != warden)
    });
    let after = system.ps();
    for (was, is) in before["services"].as_array().unwrap().iter().zip(after["services"].as_array().unwrap())
    {
        assert_eq!((&was["pid"], &is["state"]), (&is["pid"], &Value::from("running")), "{is}");
    }
    assert!(system.sereno(&["down"]).output().unwrap().status.success());
    assert!(system.up.wait().unwrap().success());
    nothing_is_left(&system, Duration::ZERO);
}

/// Nobody restarts anybody then: `flight` levels and comes down by itself, blind to walls.
#[test]
fn without_supervisor_and_pilot_flight_is_the_last_line() {
    let mut system = System::start();
    let mut witness = Witness::join(&system);
    take_off(&system, &mut witness);
    let warden = system.ps()["warden"].as_u64().unwrap();
    let pilot = system.pid("pilot");
    system.kill_supervisor();
    assert!(signal(pilot, "KILL"));
    let killed = Instant::now();
    while !witness.stands() {
        witness.look();
        assert!(killed.elapsed() < LANDED, "{:?}", witness.newest);
        std::thread::sleep(Duration::from_millis(5));
    }
    let speed = witness.touched_m_s.unwrap();
    assert!(speed > -ALONE_M_S, "touched at {speed} m/s");
    drop(witness);
    println!("landed {:.1} s after the kill, touched at {speed:.2} m/s", killed.elapsed().as_secs_f64());
    // The pilot can no longer say that it has landed, and the warden would wait out the time that a landing may take.
    assert!(!processes(&system.run_dir()).is_empty());
    assert!(signal(warden, "TERM"));
    nothing_is_left(&system, ENDED);
}

/// As all of them are when the supervisor, who reads what they print, is killed.
#[test]
fn a_service_whose_log_nobody_reads_does_not_die_of_it() {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    // What it logs first is that it does not know its manifest; a panic would end it with 101.
    let status = Command::new(programs().join("sereno-sonar"))
        .env_remove(runtime::env::MANIFEST)
        .stderr(writer)
        .status()
        .unwrap();
    assert_eq!(status.code(), Some(1));
}
