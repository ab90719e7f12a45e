//! Lines that are poor: UDP blocked, packets lost, a viewer that has stopped. A real TURN server and a real browser.
//!
//! Needs the programs of a release build, `chromium` and `turnserver` (Debian: coturn). `SERENO_VIEWERS_S=300` has the eight
//! viewers watch for five minutes in place of half of one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod drone;

use drone::relay::{By, Relay};
use drone::{Drone, State};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A TURN server on the loopback that listens by TCP alone, as where UDP is blocked.
struct TurnServer {
    process: Child,
    port: u16,
    _directory: tempfile::TempDir,
}

impl TurnServer {
    fn start() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let free = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = free.local_addr().unwrap().port();
        drop(free);
        let process = Command::new("turnserver")
            .current_dir(directory.path())
            .args(["-n", "--no-cli", "--no-tls", "--no-dtls", "--no-udp", "--lt-cred-mech", "--fingerprint"])
            .args(["--listening-ip", "127.0.0.1", "--relay-ip", "127.0.0.1", "--allow-loopback-peers"])
            .args(["--realm", "sereno", "--user", "drone:hush", "--log-file", "stdout", "--no-stdout-log"])
            .args(["--listening-port", &port.to_string(), "--pidfile"])
            .arg(directory.path().join("pid"))
            .args(["--userdb"])
            .arg(directory.path().join("users"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("turnserver is installed (Debian: coturn)");
        let mut server = Self { process, port, _directory: directory };
        let began = Instant::now();
        while TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err() {
            assert!(server.process.try_wait().unwrap().is_none(), "turnserver has ended");
            assert!(began.elapsed() < Duration::from_secs(20), "turnserver does not listen");
            std::thread::sleep(Duration::from_millis(20));
        }
        server
    }
}

impl Drop for TurnServer {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

#[test]
fn where_udp_and_direct_ways_are_blocked_the_picture_comes_through_a_turn_server() {
    let server = TurnServer::start();
    // The viewer's side is behind the firewall: it reaches nothing but the server, by TCP.
    let config = format!(
        "tcp = false\nservers = [{{ urls = [\"turn:127.0.0.1:{}?transport=tcp\"], username = \"drone\", credential = \"hush\" }}]\n",
        server.port
    );
    let mut drone = Drone::start(&config);
    let watched = drone.watch("mode=watch&frames=90&relay=1");
    let status = watched.0["statuses"].as_array().unwrap().last().unwrap().clone();
    println!("turn: {} frames, {}, {status}", watched.0["frames"], watched.0["inbound"]);
    assert_eq!(status["path"].as_str(), Some("turn"), "{status}");
    assert_eq!(watched.0["frames"].as_u64(), Some(90));
    assert!(watched.errors().is_empty(), "{:?}", watched.0["errors"]);
    // The server knows the drone's name: without the right word nothing comes through.
    let mut drone = Drone::start(&config.replace("hush", "guess"));
    let watched = drone.watch("mode=watch&frames=90&relay=1&patience_s=10");
    assert_eq!(watched.0["frames"].as_u64(), Some(0));
}

/// Every packet counts: what was lost is asked for and sent again, so that every frame is whole and none but the first is a key frame
/// by request.
#[test]
fn with_five_per_cent_lost_every_frame_comes_in_watch_mode() {
    let mut drone = Drone::start("tcp = false\n");
    let relay = Relay::new(By::Udp, 50, 7);
    let watched = drone.watch_behind(&relay, "mode=watch&buffer=100&frames=600");
    let inbound = &watched.0["inbound"];
    let (carried, lost) = relay.counts();
    let longest = watched.numbers("gaps").into_iter().fold(0.0, f64::max);
    println!("5 % lost: {carried} packets carried, {lost} lost, longest gap {longest:.0} ms, {inbound}");
    assert!(lost * 100 > carried * 3, "{lost} of {carried}: the relay is on the way");
    assert_eq!(watched.0["frames"].as_u64(), Some(600));
    let number = |name: &str| inbound[name].as_u64().unwrap();
    assert!(number("nacks") > 0, "{inbound}");
    assert_eq!(number("freezes"), 0, "{inbound}");
    assert!(longest < 1000.0, "{longest} ms without a picture");
    let status = watched.0["statuses"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(status["dropped"].as_u64(), Some(0), "{status}");
}

/// What eight viewers may have waiting to be sent again, and what an allocator keeps besides.
const MEMORY_KIB: u64 = 8 * 1024 * 1200 / 1024 + 8 * 1024;

fn eight_viewers_one_stalled(by: By) {
    let seconds = std::env::var("SERENO_VIEWERS_S").map_or(30, |text| text.parse().expect("seconds"));
    let mut drone = Drone::start("");
    let relay = Relay::new(by, 0, 1);
    let mut marks: Vec<(String, State)> = Vec::new();
    let watched = drone.watch_many(8, seconds, &[(7, &relay)], |how_far, state| {
        if how_far == "stall" {
            relay.stall();
        }
        marks.push((how_far.to_owned(), state));
    });
    assert!(watched.errors().is_empty(), "{:?}", watched.errors());
    let at = |name: &str| marks.iter().find(|(how_far, _)| how_far == name).unwrap().1;
    let (begin, end) = (at("begin"), at("end"));
    let encoded = end.encoded - begin.encoded;
    let counts = |name: &str| watched.numbers(name);
    let decoded: Vec<f64> = counts("after").iter().zip(counts("before")).map(|(a, b)| a - b).collect();
    println!(
        "stalled by {by:?}: {encoded} frames encoded in {seconds} s, decoded {decoded:?}, memory {} to {} KiB, {}",
        begin.memory_kib, end.memory_kib, watched.0["hungUp"]
    );
    assert!(encoded as f64 >= 10.0 * seconds as f64, "{encoded} frames in {seconds} s");
    for (viewer, frames) in decoded.iter().enumerate().take(7) {
        assert!(*frames >= 0.95 * encoded as f64 - 5.0, "viewer {viewer}: {frames} of {encoded}");
    }
    assert!(decoded[7] <= 2.0, "the stalled one: {}", decoded[7]);
    // Nobody's picture became worse for it.
    let bitrate = watched.0["statuses"][0]["bitrate"].as_u64();
    assert_eq!(bitrate, Some(300_000), "{}", watched.0["statuses"][0]);
    let grown = end.memory_kib.saturating_sub(begin.memory_kib);
    assert!(grown <= MEMORY_KIB, "grown by {grown} KiB");
}

#[test]
fn of_eight_viewers_one_that_is_cut_off_slows_nobody() {
    eight_viewers_one_stalled(By::Udp);
}

#[test]
fn of_eight_viewers_one_that_stops_reading_slows_nobody() {
    eight_viewers_one_stalled(By::Tcp);
}
