//! What systemd is told (`deploy/systemd`): of programs that there are, with flags that they have, and no looser than it must be.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

use sereno_tests::{checkout, deploy_with, programs};
use std::collections::BTreeSet;
use std::os::unix::net::UnixDatagram;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

const UNITS: [&str; 2] = ["sereno.service", "sereno-console.service"];

fn unit(name: &str) -> String {
    std::fs::read_to_string(checkout().join("deploy/systemd").join(name)).unwrap()
}

fn values<'a>(unit: &'a str, key: &'a str) -> impl Iterator<Item = &'a str> {
    unit.lines().filter_map(move |line| line.strip_prefix(key)?.strip_prefix('='))
}

/// Units that name the programs where they were built.
fn built(directory: &std::path::Path) -> Vec<PathBuf> {
    let write = |name: &&str| {
        let path = directory.join(name);
        let text = unit(name).replace("/usr/bin/", &format!("{}/", programs().display()));
        std::fs::write(&path, text).unwrap();
        path
    };
    UNITS.iter().map(write).collect()
}

#[test]
fn systemd_understands_both_and_finds_them_well_locked() {
    let directory = tempfile::tempdir().unwrap();
    for path in built(directory.path()) {
        for words in [&["verify"][..], &["security", "--offline=true", "--threshold=25"]] {
            let output = Command::new("systemd-analyze").args(words).arg(&path).output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{words:?} {}: {said}", path.display());
            // What it does not know it only mentions.
            assert!(!said.contains("sereno"), "{words:?} {}: {said}", path.display());
        }
    }
}

#[test]
fn every_program_and_flag_that_a_unit_names_is_there() {
    let mut seen = BTreeSet::new();
    for text in UNITS.map(unit) {
        for line in values(&text, "ExecStart").chain(values(&text, "ExecReload")) {
            let mut words = line.split_whitespace();
            let program = words.next().unwrap().strip_prefix("/usr/bin/");
            let Some(program) = program else { continue };
            // Whoever is asked something senseless says how to ask.
            let output = Command::new(programs().join(program)).arg("--no-such-flag").output().unwrap();
            let help = match program {
                "sereno" => Command::new(programs().join(program)).arg("--help").output().unwrap().stdout,
                _ => output.stderr,
            };
            let help = String::from_utf8(help).unwrap();
            let known: BTreeSet<_> = help.split(|c: char| !(c.is_alphanumeric() || c == '-')).collect();
            for word in words.filter(|word| !word.starts_with('/')) {
                assert!(known.contains(word), "{program} knows no {word}: {help}");
            }
            seen.insert(program.to_owned());
        }
    }
    assert_eq!(seen, ["sereno", "sereno-console", "sereno-supervisor"].map(str::to_owned).into());
}

#[test]
fn the_units_the_manifest_and_the_page_on_installing_agree() {
    let drone = unit("sereno.service");
    let (manifest, _) =
        runtime::load_manifest(&checkout().join("deploy/system.toml").display().to_string()).unwrap();
    let allowed: Vec<_> = values(&drone, "DeviceAllow").collect();
    let devices: Vec<_> = manifest.services.values().flat_map(|service| service.devices.values()).collect();
    assert!(!devices.is_empty());
    for device in devices {
        let kind = device.strip_prefix("/dev/").unwrap().trim_end_matches(|c: char| c.is_ascii_digit());
        assert!(allowed.contains(&format!("char-{kind} rw").as_str()), "{device}: {allowed:?}");
    }
    // A landing, then each service in its turn, must be over before systemd loses its patience.
    let options = supervisor::Options::default();
    let longest = options.land_limit + options.stop_limit * u32::try_from(manifest.services.len()).unwrap();
    let patience: u64 = values(&drone, "TimeoutStopSec").next().unwrap().parse().unwrap();
    assert!(longest + Duration::from_secs(10) < Duration::from_secs(patience), "{longest:?}");
    // Services of a supervisor that died fly on until the warden has landed them.
    assert_eq!(values(&drone, "KillMode").collect::<Vec<_>>(), ["process"]);
    assert_eq!(values(&drone, "CapabilityBoundingSet").collect::<Vec<_>>(), [""]);

    let page = std::fs::read_to_string(checkout().join("docs/installing.md")).unwrap();
    let users = unit("sereno.sysusers");
    for text in UNITS.map(unit) {
        for line in values(&text, "ExecStart") {
            for path in
                line.split_whitespace().filter(|word| word.starts_with("/etc") || word.starts_with("/var"))
            {
                assert!(page.contains(path), "the page on installing does not name {path}");
            }
        }
        let user = values(&text, "User").next().unwrap();
        let known = users.lines().any(|line| line.split_whitespace().take(2).eq(["u", user]));
        assert!(known, "{user} is no user that is made");
        assert!(values(&text, "StateDirectory").eq([user]), "{user}");
    }
}

#[test]
fn the_supervisor_tells_systemd_that_it_is_ready_alive_and_at_its_end() {
    let directory = tempfile::tempdir().unwrap();
    let deploy = deploy_with(directory.path(), "two-rooms").unwrap();
    let place = directory.path().join("systemd.sock");
    let systemd = UnixDatagram::bind(&place).unwrap();
    systemd.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    let mut supervisor = Command::new(programs().join("sereno-supervisor"))
        .arg("--run-dir")
        .arg(directory.path().join("run"))
        .args(["--quiet".into(), deploy.join("system.toml"), deploy.join("sim.toml")])
        .env("NOTIFY_SOCKET", &place)
        .env("WATCHDOG_USEC", "200000")
        .stdin(Stdio::null())
        .spawn()
        .unwrap();
    let heard = || {
        let mut bytes = [0; 4096];
        let count = systemd.recv(&mut bytes).expect("it says something within a minute");
        String::from_utf8(bytes[..count].to_vec()).unwrap()
    };
    assert!(heard().starts_with("READY=1"));
    for _ in 0..5 {
        assert!(heard().starts_with("WATCHDOG=1"));
    }
    let pid = rustix::process::Pid::from_child(&supervisor);
    rustix::process::kill_process(pid, rustix::process::Signal::TERM).unwrap();
    while !heard().starts_with("STOPPING=1") {}
    assert!(supervisor.wait().unwrap().success());
}
