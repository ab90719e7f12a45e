//! Orders to the supervised simulated system: every service its own process on real shared memory, and the
//! `sereno` command as people type it.
//!
//! The test executable plays all the parts: it is started again with [`PART`] set, as the supervisor, its warden or one
//! of the services, which are the real ones.
#![allow(clippy::unwrap_used, reason = "tests")]

use cli::orders::{Orders, next_order_number};
use ipc_types::{Command as Order, Phase, PilotState, Verb};
use runtime::{Input, NoDevices, Tool};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Which part the executable is to play.
const PART: &str = "SERENO_TEST_PART";
const DIRECTORY: &str = "SERENO_TEST_DIRECTORY";
/// Whoever waits this long waits in vain, on a loaded machine too.
const LONG: Duration = Duration::from_secs(60);

fn deploy() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy")
}

#[test]
fn a_part_of_the_other_tests() {
    let Ok(part) = std::env::var(PART) else { return };
    let code = match part.as_str() {
        "supervisor" => {
            let directory = PathBuf::from(std::env::var_os(DIRECTORY).unwrap());
            let options = supervisor::Options {
                manifests: vec![deploy().join("system.toml"), deploy().join("sim.toml")],
                run_dir: Some(directory.join("run")),
                programs: Some(directory),
                seed: 3,
                ..supervisor::Options::default()
            };
            supervisor::run(&options).unwrap();
            return;
        }
        "flight" => runtime::main::<flight::Flight>(flight::SerialPorts),
        "flow" => runtime::main::<flow::Flow>(flow::SerialPorts),
        "localization" => runtime::main::<localization::Localization>(NoDevices),
        "navigation" => runtime::main::<navigation::Navigation>(NoDevices),
        "pilot" => runtime::main::<pilot::Pilot>(NoDevices),
        "simulator" => runtime::main::<simulator::Simulator>(simulator::PtyDevices),
        "sonar" => runtime::main::<sonar::Sonar>(NoDevices),
        other => unreachable!("{other}"),
    };
    assert_eq!(format!("{code:?}"), format!("{:?}", std::process::ExitCode::SUCCESS));
}

/// A running system, ended with the test.
struct System {
    directory: tempfile::TempDir,
    supervisor: Child,
}

impl System {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let test = std::env::current_exe().unwrap();
        for part in ["flight", "flow", "localization", "navigation", "pilot", "simulator", "sonar"] {
            let program = directory.path().join(format!("sereno-{part}"));
            let text = format!(
                "#!/bin/sh\n{PART}={part} exec {} --exact a_part_of_the_other_tests --nocapture\n",
                test.display()
            );
            std::fs::write(&program, text).unwrap();
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        }
        let supervisor = Command::new(test)
            .args(["--exact", "a_part_of_the_other_tests", "--nocapture"])
            .env(PART, "supervisor")
            .env(DIRECTORY, directory.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .process_group(0)
            .spawn()
            .unwrap();
        let system = Self { directory, supervisor };
        for service in ["flight", "flow", "localization", "navigation", "pilot", "simulator", "sonar"] {
            system.wait_running(service);
        }
        system
    }

    fn run_dir(&self) -> PathBuf {
        self.directory.path().join("run")
    }

    fn wait_running(&self, service: &str) -> u32 {
        wait_for(&format!("{service} runs"), || {
            let row = supervisor::Client::connect(&self.run_dir()).ok()?.service(service).ok()?;
            row.pid.filter(|_| row.state == "running")
        })
    }

    /// The command line, about this system.
    fn sereno(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sereno"));
        command.arg("--deploy").arg(deploy()).arg("--run-dir").arg(self.run_dir());
        command.args(words).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn run(&self, words: &[&str]) -> Output {
        self.sereno(words).output().unwrap()
    }

    /// Gives an order that both pilot and navigation must have heard when the command ends.
    fn heard(&self, words: &[&str]) {
        let error = text(&self.run(words).stderr);
        assert!(!error.contains("did not answer"), "{words:?}: {error}");
        let last = |topic: &str| self.newest(topic)["command_sequence"].clone();
        assert_eq!(last("pilot/state"), last("navigation/patrol"), "{words:?}: {error}");
    }

    /// Runs an order that is to be refused; the one sentence of why.
    fn refused(&self, words: &[&str]) -> String {
        let output = self.run(words);
        assert_eq!(output.status.code(), Some(1), "{words:?}: {}", text(&output.stdout));
        let error = text(&output.stderr);
        assert_eq!(error.lines().count(), 1, "{words:?}: {error}");
        error
    }

    /// What is published now on a topic.
    fn newest(&self, topic: &str) -> serde_json::Value {
        let output = self.run(&["topic", "echo", topic, "-n", "1"]);
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn tool(&self) -> Tool {
        let files = format!("{0}/system.toml:{0}/sim.toml", deploy().display());
        let (manifest, _) = runtime::load_manifest(&files).unwrap();
        Tool::join("cli", manifest, &runtime::shm::RunDir::new(self.run_dir())).unwrap()
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if !self.run(&["down", "--now"]).status.success() {
            // Its warden ends what it leaves.
            let _ = self.supervisor.kill();
        }
        let _ = self.supervisor.wait();
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn wait_for<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + LONG;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < deadline, "in vain: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn signal(pid: u32, name: &str) {
    assert!(Command::new("kill").args([format!("-{name}"), pid.to_string()]).status().unwrap().success());
}

fn phase_of(state: &mut Input<PilotState>) -> Option<Phase> {
    state.latest().and_then(|state| Phase::from_code(state.phase))
}

/// One system for everything, as its start takes the flight controller's boot grace (5 s, FACTS 1).
#[test]
fn orders_reach_everybody_who_must_obey_or_say_why_not() {
    let system = System::start();

    // A refusal is a failure, for people and for programs.
    let said = system.refused(&["patrol", "stop"]);
    assert!(said.contains("patrol stop: pilot refused: not flying"), "{said}");
    let output = system.run(&["--json", "hold"]);
    assert_eq!(output.status.code(), Some(1));
    let answer: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(answer["accepted"], false, "{answer}");
    assert_eq!(answer["answers"]["pilot"]["text"], "refused: on the ground", "{answer}");

    two_operators_and_a_restart(&system);

    // A round: accepted as soon as the controller arms, and then known to navigation too, each time.
    wait_for("a take-off is accepted", || {
        let output = system.run(&["patrol", "start"]);
        let accepted = output.status.success();
        assert!(accepted || text(&output.stderr).contains("refused: "), "{}", text(&output.stderr));
        accepted.then_some(())
    });
    // On a machine too busy to fly on, a failsafe may refuse what follows; heard it must be all the same.
    for order in ["pause", "start"].into_iter().cycle().take(20) {
        system.heard(&["patrol", order]);
    }

    // What navigation cannot plan is navigation's refusal.
    let said = system.refused(&["goto", "500", "500"]);
    assert!(said.contains("navigation refused: "), "{said}");

    dead_tools_are_forgotten(&system);
    watching_ends_in_order(&system);
}

/// One orders a take-off, another calls it off, both programs live on, and the pilot is killed: it hears both again.
fn two_operators_and_a_restart(system: &System) {
    let (mut first, mut second) = (system.tool(), system.tool());
    let mut state = first.ports.input::<PilotState>().unwrap();
    let (mut one, mut other) =
        (Orders::open(&mut first.ports).unwrap(), Orders::open(&mut second.ports).unwrap());
    wait_for("the first order is obeyed", || {
        first.tick();
        one.give(Verb::TakeOff, f32::NAN, f32::NAN, next_order_number());
        std::thread::sleep(Duration::from_millis(50));
        phase_of(&mut state).filter(|phase| *phase == Phase::Arming)
    });
    second.tick();
    other.give(Verb::Land, f32::NAN, f32::NAN, next_order_number());
    wait_for("it is called off", || phase_of(&mut state).filter(|phase| *phase == Phase::Grounded));
    let pid = system.wait_running("pilot");
    signal(pid, "KILL");
    let heard = Instant::now();
    wait_for("another pilot", || Some(system.wait_running("pilot")).filter(|new| *new != pid));
    // Both senders serve it as a late joiner for as long as an order could count, and longer.
    while heard.elapsed() < Duration::from_nanos(ipc_types::COMMAND_LIFE_NS) + Duration::from_secs(1) {
        first.tick();
        second.tick();
        let phase = phase_of(&mut state);
        assert!(phase.is_none_or(|phase| phase == Phase::Grounded), "it obeyed an old order: {phase:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Seven programs die while they wait for an answer; a topic has places for five publishers.
fn dead_tools_are_forgotten(system: &System) {
    assert!(system.run(&["hold", "navigation"]).status.success());
    let mut tool = system.tool();
    let mut orders = tool.ports.input::<Order>().unwrap();
    for round in 0..7 {
        let mut child = system.sereno(&["patrol", "pause"]).spawn().unwrap();
        wait_for(&format!("order {round} is given"), || {
            let waits = child.try_wait().unwrap().is_none();
            assert!(waits, "order {round} could not be given");
            orders.latest()
        });
        signal(child.id(), "KILL");
        child.wait().unwrap();
    }
    let said = system.refused(&["patrol", "pause"]);
    assert!(said.contains("navigation did not answer within 3 s"), "{said}");
    assert!(system.run(&["release", "navigation"]).status.success());
    system.wait_running("navigation");
    system.heard(&["home"]);
}

fn watching_ends_in_order(system: &System) {
    // As `| head -1` does.
    let mut echo = system.sereno(&["topic", "echo", "pilot/channels"]).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(echo.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.starts_with('{'), "{line}");
    let output = echo.wait_with_output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    // And as Ctrl-C does.
    let mut echo = system.sereno(&["topic", "echo", "pilot/channels"]).spawn().unwrap();
    let mut line = String::new();
    let mut reader = BufReader::new(echo.stdout.take().unwrap());
    reader.read_line(&mut line).unwrap();
    signal(echo.id(), "INT");
    std::io::copy(&mut reader, &mut std::io::sink()).unwrap();
    assert!(echo.wait().unwrap().success());
}
