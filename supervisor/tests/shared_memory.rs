//! The supervisor executable with its real shared memory, over services that do nothing.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod system;

use runtime::shm::RunDir;
use rustix::process::Signal;
use std::process::{Command, Stdio};
use system::{System, alive, kill, wait_until};

const TOPICS: &str =
    "publishes.'pilot/state' = { hz = 5, retained = true }\nsubscribes.'operator/command' = {}";

fn supervisor(system: &System) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sereno-supervisor"));
    command
        .args(["--quiet", "--programs"])
        .arg(system.path(""))
        .arg("--run-dir")
        .arg(system.run_dir())
        .arg(system.path("system.toml"))
        .stdin(Stdio::null());
    command
}

#[test]
fn shared_memory_is_made_held_and_given_back() {
    let mut system = System::of(&[("pilot", "work", TOPICS)]);
    let run_dir = RunDir::new(system.run_dir());
    system.start_as(supervisor(&system));
    let pid = system.wait_running("pilot");
    assert!(!run_dir.leftovers().is_empty(), "it is in use");
    assert!(!system.client().ps().unwrap().airborne, "nobody has said that anything flies");
    kill(pid, Signal::KILL);
    system.wait_for("pilot", |row| row.state == "running" && row.incarnation == Some(1));
    system.signal(Signal::TERM);
    assert!(system.ended().success());
    assert_eq!(run_dir.leftovers(), Vec::<String>::new());
    assert!(!system.run_dir().exists());
}

#[test]
fn what_a_killed_supervisor_left_is_wiped_by_its_warden() {
    let mut system = System::of(&[("pilot", "work", TOPICS)]);
    let run_dir = RunDir::new(system.run_dir());
    system.start_as(supervisor(&system));
    let pid = system.wait_running("pilot");
    system.signal(Signal::KILL);
    let _ = system.ended();
    wait_until("nothing is left", || !system.run_dir().exists());
    assert!(!alive(pid));
    assert_eq!(run_dir.leftovers(), Vec::<String>::new());
}

#[test]
fn what_both_left_is_wiped_by_the_next() {
    let mut system = System::of(&[("pilot", "work", TOPICS)]);
    let run_dir = RunDir::new(system.run_dir());
    system.start_as(supervisor(&system));
    let pid = system.wait_running("pilot");
    let warden = system.client().ps().unwrap().warden.unwrap();
    // Neither sees the other die.
    kill(warden, Signal::STOP);
    system.signal(Signal::KILL);
    let _ = system.ended();
    kill(warden, Signal::KILL);
    wait_until("the warden has died too", || !alive(warden));
    assert!(!run_dir.leftovers().is_empty(), "nobody could tidy up");
    assert!(alive(pid), "nobody ended it: the known remainder");
    system.start_as(supervisor(&system));
    assert!(!alive(pid), "the next supervisor did");
    system.wait_running("pilot");
    system.signal(Signal::TERM);
    assert!(system.ended().success());
    assert_eq!(run_dir.leftovers(), Vec::<String>::new());
}
