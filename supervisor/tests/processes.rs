//! The supervisor over real processes: restarts, back-off, hangs, requests, shutdown.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod system;

use rustix::process::Signal;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::time::Duration;
use supervisor::{ClientError, Echo, NoSharedMemory, Options, SupervisorError};
use system::{LONG, System, exists, kill, wait_until};

#[test]
fn services_start_by_criticality_and_report() {
    let system = System::started(&[
        ("a", "work", "criticality = \"comfort\""),
        ("b", "work", "criticality = \"flight\"\npriority = 10"),
        ("c", "work", "criticality = \"flight\"\npriority = 20"),
    ]);
    let overview = system.client().ps().unwrap();
    let names: Vec<_> = overview.services.iter().map(|row| row.name.as_str()).collect();
    assert_eq!(names, ["c", "b", "a"]);
    let row = system.wait_for("a", |row| row.status == "at work");
    assert_eq!((row.state.as_str(), row.restarts, row.incarnation), ("running", 0, Some(0)));
    assert_eq!(std::fs::metadata(system.run_dir()).unwrap().permissions().mode() & 0o777, 0o700);
}

#[test]
fn a_killed_service_is_reaped_and_comes_back() {
    let system = System::started(&[("a", "work", "")]);
    let mut pid = system.wait_running("a");
    for round in 1..=5 {
        kill(pid, Signal::KILL);
        let row = system.wait_for("a", |row| row.state == "running" && row.incarnation == Some(round));
        assert_eq!((row.restarts, row.last_end.as_str()), (round, "killed (signal 9)"));
        assert!(!exists(pid), "no zombie");
        pid = row.pid.unwrap();
    }
    // The keeper's offer reaches the next start.
    let log = system.client().logs("a", 100).unwrap();
    assert!(log.iter().any(|line| line.ends_with("work: start 0, kept")), "{log:?}");
    assert!(log.iter().any(|line| line.ends_with("work: start 5, kept a/state")), "{log:?}");
}

#[test]
fn a_service_that_dies_at_every_start_burns_nothing() {
    let system = System::started(&[("a", "sh:echo no such sensor >&2; exit 3", ""), ("b", "work", "")]);
    system.wait_for("a", |row| row.state == "failing");
    let row = system.wait_for("a", |row| row.restarts >= 4);
    assert_eq!(row.last_end, "exit code 3: no such sensor");
    // Delays 0, 50, 100, 200, 400, 800, 1600, 2000...: a slow machine can only make it fewer.
    let before = row.restarts;
    std::thread::sleep(Duration::from_secs(3));
    let after = system.row("a").restarts;
    assert!(after - before <= 5, "{before} -> {after}");
    assert_eq!(system.wait_for("b", |row| row.state == "running").restarts, 0);
    assert!(matches!(
        system.client().restart("a", false, LONG),
        Err(ClientError::NotUp { state, why, .. }) if state == "failing" && why.contains("no such sensor")
    ));
}

#[test]
fn a_missing_executable_is_a_named_fault() {
    let system = System::of(&[("a", "work", ""), ("b", "work", "")]);
    std::fs::remove_file(system.path("a")).unwrap();
    let mut system = system;
    system.start();
    let row = system.wait_for("a", |row| row.state == "failing");
    assert!(row.last_end.starts_with("cannot start /") && row.last_end.contains("No such file"), "{row:?}");
    system.wait_running("b");
    // It is there now: the next try finds it.
    system.program("a", "work");
    system.wait_running("a");
}

#[test]
fn a_hung_service_is_killed_and_replaced() {
    let system = System::started(&[("a", "hang", "heartbeat_ms = 100")]);
    let row = system.wait_for("a", |row| row.restarts >= 1);
    assert_eq!(row.last_end, "killed: no heartbeat for 100 ms");
    // A process that is stopped is as silent as one that loops.
    system.program("a", "work");
    let pid = system.client().restart("a", false, LONG).unwrap().pid.unwrap();
    kill(pid, Signal::STOP);
    system.wait_for("a", |row| row.state == "running" && row.pid != Some(pid));
    assert!(!exists(pid));
}

#[test]
fn policies_are_kept() {
    let system = System::started(&[
        ("once", "exit", "restart = \"never\""),
        ("failing", "fail", "restart = \"on-failure\""),
        ("clean", "exit", "restart = \"on-failure\""),
        ("always", "exit", "restart = \"always\""),
    ]);
    system.wait_for("failing", |row| row.restarts >= 3);
    system.wait_for("always", |row| row.restarts >= 3);
    for name in ["once", "clean"] {
        let row = system.wait_for(name, |row| row.state == "ended");
        assert_eq!((row.restarts, row.last_end.as_str()), (0, "exit code 0"), "{name}");
    }
}

#[test]
fn requests_hold_release_restart_and_show_logs() {
    let system = System::started(&[("a", "work", "restart = \"never\"")]);
    let first = system.wait_running("a");
    let mut client = system.client();
    let held = client.hold("a", false, LONG).unwrap();
    assert_eq!((held.pid, held.last_end.as_str()), (None, "exit code 0"));
    assert!(!exists(first));
    let said = client.restart("a", false, LONG).unwrap_err().to_string();
    assert_eq!(said, "a: it is held; release it instead");
    let released = client.release("a", LONG).unwrap();
    assert_eq!(released.incarnation, Some(1));
    assert_eq!(client.release("a", LONG).unwrap_err().to_string(), "a: it is not held");
    // A new executable is what a restart runs.
    system.program("a", "renewed");
    assert_eq!(client.restart("a", false, LONG).unwrap().incarnation, Some(2));
    let log = client.logs("a", 100).unwrap();
    assert!(log.iter().any(|line| line.contains("renewed: start 2")), "{log:?}");
    assert_eq!(client.logs("a", 1).unwrap().len(), 1);
    let own = client.logs("supervisor", 100).unwrap();
    assert!(own.iter().any(|line| line.ends_with("a: hold by request")), "{own:?}");
    let said = client.logs("b", 1).unwrap_err().to_string();
    assert_eq!(said, "there is no service b; there are a");
}

#[test]
fn a_reload_starts_everything_anew_and_keeps_nothing() {
    let system =
        System::started(&[("a", "work", ""), ("b", "work", "criticality = \"flight\""), ("c", "work", "")]);
    let old = ["a", "b"].map(|name| system.wait_running(name));
    let mut client = system.client();
    client.hold("c", false, LONG).unwrap();
    // What a kill keeps, a reload forgets.
    kill(old[0], Signal::KILL);
    let before = system.wait_for("a", |row| row.state == "running" && row.incarnation == Some(1));
    let overview = client.reload(LONG).unwrap();
    let state = |name: &str| overview.services.iter().find(|row| row.name == name).unwrap().clone();
    assert_eq!((state("a").incarnation, state("b").incarnation), (Some(2), Some(1)));
    assert!(!exists(old[1]) && !exists(before.pid.unwrap()));
    assert_eq!(state("c").state, "held", "who is held stays so");
    let log = client.logs("a", 100).unwrap();
    assert!(log.iter().any(|line| line.ends_with("work: start 1, kept a/state")), "{log:?}");
    assert!(log.iter().any(|line| line.ends_with("work: start 2, kept")), "{log:?}");
    // The start after that is offered what was kept of the new one.
    client.restart("a", false, LONG).unwrap();
    let log = client.logs("a", 100).unwrap();
    assert!(log.iter().any(|line| line.ends_with("work: start 3, kept a/state")), "{log:?}");
}

#[test]
fn what_keeps_the_aircraft_in_the_air_is_not_restarted_by_mistake() {
    let system = System::started(&[("a", "work", "criticality = \"flight\""), ("b", "work", "")]);
    system.wait_running("a");
    system.wait_running("b");
    std::fs::write(system.path("airborne"), "").unwrap();
    let mut client = system.client();
    assert!(client.ps().unwrap().airborne);
    for refused in [client.restart("a", false, LONG), client.hold("a", false, LONG)] {
        let said = refused.unwrap_err().to_string();
        assert!(said.starts_with("a keeps the aircraft in the air: land first, or "), "{said}");
    }
    assert_eq!(client.reload(LONG).unwrap_err().to_string(), "the drone flies: land first");
    assert_eq!((system.row("a").restarts, system.row("b").restarts), (0, 0));
    assert_eq!(client.restart("b", false, LONG).unwrap().restarts, 1);
    assert_eq!(client.restart("a", true, LONG).unwrap().restarts, 1);
}

#[test]
fn nonsense_on_the_control_socket_is_refused_and_harms_nobody() {
    let system = System::started(&[("a", "work", "")]);
    let pid = system.wait_running("a");
    let socket = system.run_dir().join("control.sock");
    for (line, says) in [
        ("hello\n", "not understood"),
        ("{\"ask\":\"dance\"}\n", "unknown variant `dance`"),
        ("{\"ask\":\"restart\",\"service\":\"a\",\"speed\":1}\n", "unknown field `speed`"),
        ("\u{0}\n", "not understood"),
    ] {
        let mut stream = UnixStream::connect(&socket).unwrap();
        stream.write_all(line.as_bytes()).unwrap();
        let mut answer = String::new();
        BufReader::new(stream).read_line(&mut answer).unwrap();
        assert!(answer.contains("\"answer\":\"refused\"") && answer.contains(says), "{line}: {answer}");
    }
    // A line that never ends is cut off.
    let mut endless = UnixStream::connect(&socket).unwrap();
    wait_until("cut off", || endless.write_all(&[b'x'; 1024]).is_err());
    // More connections than anybody needs.
    let many: Vec<_> = (0..100).filter_map(|_| UnixStream::connect(&socket).ok()).collect();
    drop(many);
    wait_until("it still answers", || {
        supervisor::Client::connect(&system.run_dir()).is_ok_and(|mut c| c.ps().is_ok())
    });
    assert_eq!(system.row("a").pid, Some(pid));
}

#[test]
fn one_supervisor_only() {
    let mut system = System::started(&[("a", "work", "")]);
    let pid = system.wait_running("a");
    let second = system.second();
    assert!(!second.status.success());
    let said = String::from_utf8_lossy(&second.stderr).into_owned();
    assert!(said.contains("already in use by the supervisor with process id "), "{said}");
    assert_eq!(system.row("a").pid, Some(pid), "the first one is not disturbed");
    system.signal(Signal::TERM);
    assert!(system.ended().success());
    // Now there is room again.
    system.start();
    system.wait_running("a");
}

#[test]
fn a_signal_ends_everything_and_leaves_nothing() {
    let mut system = System::started(&[
        ("a", "work", "criticality = \"flight\""),
        ("deaf", "deaf", ""),
        ("shell", "sh:trap '' TERM; sleep 60 & sleep 60; sleep 60", "criticality = \"comfort\""),
        ("crash", "fail", ""),
    ]);
    let pids = [system.wait_running("a"), system.wait_running("deaf"), system.row("shell").pid.unwrap()];
    system.signal(Signal::TERM);
    assert!(system.ended().success());
    assert!(pids.iter().all(|pid| !exists(*pid)));
    assert!(!system.run_dir().exists());
}

#[test]
fn a_client_that_stops_the_system_sees_the_end() {
    let mut system = System::started(&[("a", "work", "")]);
    let pid = system.wait_running("a");
    system.client().stop(false, LONG).unwrap();
    assert!(!exists(pid) && !system.run_dir().exists());
    assert!(system.ended().success());
}

#[test]
fn the_first_signal_lands_and_the_second_does_not_wait() {
    let mut system = System::started(&[("a", "work", "")]);
    system.wait_running("a");
    std::fs::write(system.path("airborne"), "").unwrap();
    system.signal(Signal::INT);
    assert!(system.ended().success());
    assert_eq!(std::fs::read_to_string(system.path("land")).unwrap().lines().count(), 1);

    std::fs::remove_file(system.path("land")).unwrap();
    system.start();
    system.wait_running("a");
    std::fs::write(system.path("airborne"), "").unwrap();
    std::fs::write(system.path("stubborn"), "").unwrap();
    system.signal(Signal::INT);
    let orders = || std::fs::read_to_string(system.path("land")).unwrap_or_default();
    wait_until("the order is repeated", || orders().lines().count() >= 2);
    let orders = orders();
    assert!(
        orders.lines().all(|order| Some(order) == orders.lines().next()),
        "one order, repeated: {orders}"
    );
    assert_eq!(system.client().ps().unwrap().phase, "landing");
    assert_eq!(system.row("a").state, "running", "nothing stops while it flies");
    system.signal(Signal::INT);
    assert!(system.ended().success());
    assert!(!system.run_dir().exists());
}

#[test]
fn what_cannot_run_is_said_in_one_sentence() {
    let system = System::of(&[("a", "work", "")]);
    let good = Options {
        manifests: vec![system.path("system.toml")],
        run_dir: Some(system.run_dir()),
        ..Options::default()
    };
    let refusal = |options: &Options| {
        let error: SupervisorError = supervisor::run_with(options, |_, _, _| Ok(NoSharedMemory)).unwrap_err();
        let text = error.to_string();
        assert!(!text.contains('\n'), "{text}");
        text
    };
    let missing = Options { manifests: vec![system.path("none.toml")], ..good.clone() };
    assert!(refusal(&missing).contains("none.toml"));
    let text = refusal(&Options { changes: "[service.a]\npriority = 1000".to_owned(), ..good.clone() });
    assert!(text.contains("service.a.priority = 1000: allowed is 0 to 99"), "{text}");
    let text =
        refusal(&Options { changes: "[service.a.publishes.'sonar/rangs']".to_owned(), ..good.clone() });
    assert!(text.contains("did you mean sonar/ranges?"), "{text}");
    let text = refusal(&Options { run_dir: Some(system.path(&"x".repeat(120))), ..good.clone() });
    assert!(text.contains("too long for a socket"), "{text}");
    assert!(!system.run_dir().exists(), "a refusal leaves nothing behind");
    let open = system.path("open");
    std::fs::create_dir(&open).unwrap();
    std::fs::set_permissions(&open, std::fs::Permissions::from_mode(0o755)).unwrap();
    let text = refusal(&Options { run_dir: Some(open.clone()), ..good });
    assert!(text.ends_with("is open to others (mode 755): chmod 700 it"), "{text}");
    let said = supervisor::Client::connect(&open).unwrap_err().to_string();
    assert!(said.starts_with("no system runs in "), "{said}");
}

#[test]
fn arguments_are_read_strictly() {
    let parse = |line: &str| supervisor::parse_arguments(line.split_whitespace().map(str::to_owned));
    let options = parse("--seed 7 --run-dir /r system.toml sim.toml --quiet").unwrap();
    assert_eq!((options.seed, options.manifests.len(), options.echo), (7, 2, Echo::Silent));
    for (line, says) in [
        ("", "no manifest given"),
        ("--seed x m", "--seed x is not a whole number"),
        ("m --seed", "--seed needs a value"),
        ("--fast m", "unknown option --fast"),
    ] {
        let said = parse(line).unwrap_err().to_string();
        assert!(said.starts_with(says) && said.contains("usage: "), "{said}");
    }
}
