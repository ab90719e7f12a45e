//! What happens when the supervisor is killed, or its warden.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod system;

use rustix::process::{Pid, Signal, kill_process_group};
use std::os::unix::process::CommandExt;
use std::process::Stdio;
use std::time::Duration;
use supervisor::Client;
use system::{System, alive, exists, kill, processes, wait_until};

fn warden(system: &System) -> u32 {
    let mut found = None;
    wait_until("a warden is there", || {
        found = system.client().ps().unwrap().warden;
        found.is_some()
    });
    found.unwrap()
}

fn orders(system: &System) -> Vec<String> {
    let text = std::fs::read_to_string(system.path("land")).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

fn stays_in_the_air(system: &System) {
    std::fs::write(system.path("airborne"), "").unwrap();
    std::fs::write(system.path("stubborn"), "").unwrap();
}

fn all_is_over(system: &System) {
    wait_until("nothing is left", || !system.run_dir().exists());
    // The directory is the last that the warden takes away before it leaves itself.
    wait_until("nobody is left", || processes(&system.run_dir()).is_empty());
}

#[test]
fn a_killed_supervisor_leaves_nothing_behind_and_another_may_start() {
    // One that ends when asked to, one that does not, and one that starts others.
    let mut system = System::started(&[
        ("a", "work", "criticality = \"flight\""),
        ("deaf", "deaf", ""),
        ("shell", "sh:trap '' TERM; sleep 60 & sleep 60; sleep 60", "criticality = \"comfort\""),
    ]);
    let pids = [system.wait_running("a"), system.wait_running("deaf"), system.row("shell").pid.unwrap()];
    system.signal(Signal::KILL);
    let _ = system.ended();
    all_is_over(&system);
    assert!(!pids.into_iter().any(alive));
    assert_eq!(orders(&system), Vec::<String>::new(), "nothing flew");
    system.start();
    system.wait_running("a");
    system.signal(Signal::TERM);
    assert!(system.ended().success());
}

#[test]
fn a_killed_supervisor_lands_first_and_nobody_may_take_its_place_meanwhile() {
    let mut system = System::of(&[("a", "work", "criticality = \"flight\""), ("b", "work", "")]);
    let mut command = system.supervisor_command();
    command.stderr(Stdio::piped());
    system.start_as(command);
    let pids = [system.wait_running("a"), system.wait_running("b")];
    stays_in_the_air(&system);
    system.signal(Signal::KILL);
    wait_until("the order is repeated", || orders(&system).len() >= 3);
    let given = orders(&system);
    assert!(given.iter().all(|order| Some(order) == given.first()), "one order, repeated: {given:?}");
    assert!(pids.into_iter().all(alive), "nothing ends while it flies");

    let second = system.second();
    let said = String::from_utf8_lossy(&second.stderr).into_owned();
    assert!(!second.status.success());
    assert!(said.contains("already in use by process "), "{said}");
    assert!(said.contains(", the warden, which is landing after its supervisor died"), "{said}");
    assert!(pids.into_iter().all(alive), "it is not disturbed");
    let said = Client::connect(&system.run_dir()).unwrap_err().to_string();
    assert!(said.contains("in the hands of process ") && said.contains("which is landing"), "{said}");

    std::fs::remove_file(system.path("airborne")).unwrap();
    all_is_over(&system);
    assert!(!pids.into_iter().any(alive));
}

#[test]
fn each_step_is_logged_and_services_end_in_reverse_order() {
    let mut system = System::of(&[("a", "work", "criticality = \"flight\""), ("b", "deaf", "")]);
    let logs = system.path("logs");
    let mut command = system.supervisor_command();
    command.env("TEST_LOGS", &logs);
    system.start_as(command);
    let (a, b) = (system.wait_running("a"), system.wait_running("b"));
    std::fs::write(system.path("airborne"), "").unwrap();
    system.signal(Signal::KILL);
    wait_until("the last started has ended", || {
        let first = alive(a);
        let last = alive(b);
        assert!(first || !last, "the first started ended before the last");
        !last
    });
    let _ = system.ended();
    all_is_over(&system);
    let said = std::fs::read_to_string(logs.join("warden.log")).unwrap();
    let said: Vec<&str> = said.lines().filter_map(|line| line.get(11..)).collect();
    assert_eq!(
        said,
        [
            "the supervisor has died without a good-bye",
            "it flies: landing; a signal to this process stops at once",
            "landed; stopping",
            "b: did not end when asked to; killed",
            "stopped"
        ]
    );
    assert_eq!(orders(&system).len(), 1);
}

#[test]
fn who_does_not_want_to_wait_for_the_landing_tells_the_warden() {
    let mut system = System::started(&[("a", "work", "")]);
    system.wait_running("a");
    let warden = warden(&system);
    // While the supervisor lives a signal means nothing to the warden, nor is it kept for later.
    kill(warden, Signal::TERM);
    kill(warden, Signal::INT);
    stays_in_the_air(&system);
    system.signal(Signal::KILL);
    let _ = system.ended();
    wait_until("the order is repeated", || orders(&system).len() >= 2);
    kill(warden, Signal::TERM);
    all_is_over(&system);
    assert!(system.path("airborne").exists());
}

#[test]
fn a_killed_warden_is_replaced_and_nobody_else_notices() {
    let mut system = System::started(&[("a", "work", "")]);
    let service = system.wait_running("a");
    let mut known = warden(&system);
    for _ in 0..3 {
        kill(known, Signal::KILL);
        wait_until("another one", || {
            let found = system.client().ps().unwrap().warden;
            found.is_some_and(|found| found != known)
        });
        assert!(!exists(known), "no zombie");
        known = warden(&system);
    }
    let own = system.client().logs("supervisor", 100).unwrap();
    assert!(
        own.iter().any(|line| line.ends_with("warden: killed (signal 9); another one follows")),
        "{own:?}"
    );
    assert_eq!((system.row("a").pid, system.row("a").restarts), (Some(service), 0));

    // And it does what the first would have done, as soon as it is ready: it catches signals then.
    wait_until("it is at its post", || {
        let status = std::fs::read_to_string(format!("/proc/{known}/status")).unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:\t")).unwrap();
        u64::from_str_radix(caught, 16).unwrap() & (1 << 14) != 0
    });
    std::fs::write(system.path("airborne"), "").unwrap();
    system.signal(Signal::KILL);
    let _ = system.ended();
    all_is_over(&system);
    assert_eq!(orders(&system).len(), 1);
}

#[test]
fn a_warden_that_cannot_start_is_a_named_fault_and_nothing_starts() {
    let system = System::of(&[("a", "work", "")]);
    std::fs::write(system.path("no-warden"), "").unwrap();
    let output = system.second();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success());
    assert!(
        said.contains("cannot start the warden, which is to land the aircraft should the supervisor die: ")
            && said.contains("the test wants no warden"),
        "{said}"
    );
    assert!(!system.run_dir().exists());
    assert_eq!(processes(&system.run_dir()), Vec::<u32>::new());
}

#[test]
fn a_stopped_supervisor_is_not_dead() {
    let system = System::started(&[("a", "work", "heartbeat_ms = 300")]);
    let service = system.wait_running("a");
    std::fs::write(system.path("airborne"), "").unwrap();
    system.signal(Signal::STOP);
    std::thread::sleep(Duration::from_secs(2));
    assert_eq!(orders(&system), Vec::<String>::new());
    assert!(alive(service));
    system.signal(Signal::CONT);
    assert_eq!(system.row("a").pid, Some(service));
    assert_eq!(orders(&system), Vec::<String>::new());
}

#[test]
fn ctrl_c_is_the_supervisors_and_a_normal_stop_leaves_no_warden() {
    let mut system = System::of(&[("a", "work", "")]);
    let mut command = system.supervisor_command();
    let logs = system.path("logs");
    command.process_group(0).env("TEST_LOGS", &logs);
    let group = system.start_as(command);
    system.wait_running("a");
    let warden = warden(&system);
    stays_in_the_air(&system);
    // As the terminal does.
    let interrupt = || kill_process_group(Pid::from_raw(group.cast_signed()).unwrap(), Signal::INT).unwrap();
    interrupt();
    wait_until("it is being landed", || !orders(&system).is_empty());
    assert!(alive(warden));
    assert_eq!(system.client().ps().unwrap().warden, Some(warden));
    std::fs::remove_file(system.path("airborne")).unwrap();
    assert!(system.ended().success());
    assert!(!exists(warden), "it was waited for");
    assert_eq!(processes(&system.run_dir()), Vec::<u32>::new());
    assert!(!system.run_dir().exists());
    assert!(logs.join("supervisor.log").exists());
    assert!(!logs.join("warden.log").exists(), "it had nothing to say");
}
