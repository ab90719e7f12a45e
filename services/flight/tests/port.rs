//! The real serial device on a pseudo-terminal: opened, locked, vanished, opened again, never blocking.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{Controller, MS, Pilot, T0};
use flight::{Config, Core, SerialDevice};
use ipc_types::LinkState;
use runtime::ByteDevice;
use rustix::fs::OFlags;
use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use std::os::fd::OwnedFd;

/// The controller's end. It holds its own slave, or the master would report an error while nobody listens.
struct Pty {
    master: OwnedFd,
    _slave: OwnedFd,
    path: String,
}

fn pty() -> Pty {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let slave = ioctl_tiocgptpeer(&master, OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    let path = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    let flags = rustix::fs::fcntl_getfl(&master).unwrap();
    rustix::fs::fcntl_setfl(&master, flags | OFlags::NONBLOCK).unwrap();
    Pty { master, _slave: slave, path }
}

fn read(fd: &OwnedFd) -> Vec<u8> {
    let mut buffer = [0; 512];
    rustix::io::read(fd, &mut buffer).map_or(Vec::new(), |count| buffer[..count].to_vec())
}

/// Runs `flight` against the controller over the terminal, on simulated time.
fn talk(
    core: &mut Core,
    device: &mut SerialDevice,
    pty: &Pty,
    controller: &mut Controller,
    now: &mut u64,
    ms: u64,
) {
    for _ in 0..ms / 5 {
        *now += 5 * MS;
        if (*now / MS).is_multiple_of(10) {
            controller.pass(*now);
        }
        if (*now / MS).is_multiple_of(20) {
            core.pilot(*now, &Pilot { arm: true, ..Pilot::IDLE }.message(*now));
        }
        controller.receive(*now, &read(&pty.master));
        let answers = controller.transmit(*now);
        if !answers.is_empty() {
            rustix::io::write(&pty.master, &answers).unwrap();
        }
        let mut buffer = [0; 512];
        let count = device.read(&mut buffer).unwrap();
        core.receive(*now, &buffer[..count]);
        core.step(*now);
        let count = device.write(core.waiting()).unwrap();
        core.taken(count);
    }
}

#[test]
fn a_conversation_over_a_terminal_that_vanishes_and_returns() {
    let first = pty();
    let mut device = SerialDevice::new(&first.path);
    assert!(!device.is_open());
    device.open().unwrap();
    let mut core = Core::new(&Config::default(), 4);
    let mut now = T0;
    core.opened(now);
    let mut controller = Controller::new();
    talk(&mut core, &mut device, &first, &mut controller, &mut now, 3_000);
    assert_eq!(core.link_state(now), LinkState::Up);
    assert!(controller.armed, "{}", core.state(now).reason);

    // Another program cannot have it at the same time.
    let refused = SerialDevice::new(&first.path).open().unwrap_err().0;
    assert!(refused.contains("busy"), "{refused}");

    // The other end goes away: reading says so, the device is closed and asks to be opened again.
    let path = first.path.clone();
    drop(first);
    let mut buffer = [0; 16];
    let lost = device.read(&mut buffer).unwrap_err().0;
    assert!(lost.starts_with(&path) && !device.is_open(), "{lost}");
    core.closed(&lost);
    assert_eq!(core.link_state(now), LinkState::Closed);

    let second = pty();
    let mut device = SerialDevice::new(&second.path);
    device.open().unwrap();
    core.opened(now);
    talk(&mut core, &mut device, &second, &mut controller, &mut now, 1_000);
    assert_eq!(core.link_state(now), LinkState::Up);
}

#[test]
fn a_missing_port_is_one_clear_sentence() {
    let error = SerialDevice::new("/nowhere/ttyX").open().unwrap_err().0;
    assert_eq!(error, "/nowhere/ttyX: no such port");
    let not_a_port = SerialDevice::new("/dev/null").open().unwrap_err().0;
    assert!(not_a_port.starts_with("/dev/null: "), "{not_a_port}");
}

#[test]
fn a_stopped_peer_never_blocks() {
    let pty = pty();
    let mut device = SerialDevice::new(&pty.path);
    device.open().unwrap();
    // Nobody reads the master: the terminal's buffer fills, and then nothing more is taken.
    let mut written = 0;
    for _ in 0..10_000 {
        written += device.write(&[0x55; 64]).unwrap();
    }
    assert!(written < 640_000 && device.is_open());
    assert_eq!(device.write(&[0x55; 64]).unwrap(), 0);
}
