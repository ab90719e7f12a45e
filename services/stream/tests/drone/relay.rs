//! What lies between a browser and the drone: a relay that loses packets, or stops.

use serde_json::Value;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const TURN: Duration = Duration::from_millis(20);

/// Which of the drone's candidates the browser hears of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum By {
    Udp,
    Tcp,
}

/// Stands between one browser and the drone. Dropped, it ends.
pub(crate) struct Relay {
    by: By,
    shared: Arc<Shared>,
}

struct Shared {
    /// Of a thousand packets.
    lost: u64,
    random: Mutex<u64>,
    stalled: AtomicBool,
    ended: AtomicBool,
    carried: AtomicU64,
    dropped: AtomicU64,
}

impl Shared {
    /// Whether the next packet is lost; drawn from the seed (SplitMix64).
    fn loses(&self) -> bool {
        let mut state = self.random.lock().unwrap();
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = *state;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let lost = self.stalled.load(Ordering::Relaxed) || (mixed ^ (mixed >> 31)) % 1000 < self.lost;
        let count = if lost { &self.dropped } else { &self.carried };
        count.fetch_add(1, Ordering::Relaxed);
        lost
    }

    fn ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }
}

impl Relay {
    pub(crate) fn new(by: By, lost_of_thousand: u64, seed: u64) -> Self {
        let shared = Shared {
            lost: lost_of_thousand,
            random: Mutex::new(seed),
            stalled: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            carried: AtomicU64::new(0),
            dropped: AtomicU64::new(0),
        };
        Self { by, shared: Arc::new(shared) }
    }

    /// From now on nothing comes through; over TCP nothing is read any more, and the connections stay.
    pub(crate) fn stall(&self) {
        self.shared.stalled.store(true, Ordering::Relaxed);
    }

    /// Packets carried and lost.
    pub(crate) fn counts(&self) -> (u64, u64) {
        (self.shared.carried.load(Ordering::Relaxed), self.shared.dropped.load(Ordering::Relaxed))
    }

    /// What the browser is told in place of what the drone says: of all candidates those that lead here. `None`: nothing.
    pub(crate) fn to_browser(&self, message: &str) -> Option<String> {
        let mut value: Value = serde_json::from_str(message).unwrap();
        let Some(line) = value["candidate"]["candidate"].as_str() else { return Some(message.to_owned()) };
        let mut words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let protocol = words.get(2)?.to_lowercase();
        if protocol != (if self.by == By::Udp { "udp" } else { "tcp" }) {
            return None;
        }
        let drone: SocketAddr = format!("{}:{}", words.get(4)?, words.get(5)?).parse().ok()?;
        let here = match self.by {
            By::Udp => udp(drone, &self.shared),
            By::Tcp => tcp(drone, &self.shared),
        };
        words[4] = here.ip().to_string();
        words[5] = here.port().to_string();
        value["candidate"]["candidate"] = words.join(" ").into();
        Some(value.to_string())
    }

    /// The drone hears of no way around the relay.
    pub(crate) fn to_drone(message: &str) -> bool {
        let value: Value = serde_json::from_str(message).unwrap();
        value["candidate"].is_null()
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Relaxed);
    }
}

fn udp(drone: SocketAddr, shared: &Arc<Shared>) -> SocketAddr {
    let socket = || {
        let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        socket.set_read_timeout(Some(TURN)).unwrap();
        Arc::new(socket)
    };
    let (near, far) = (socket(), socket());
    let here = near.local_addr().unwrap();
    let browser: Arc<Mutex<Option<SocketAddr>>> = Arc::default();
    {
        let (near, far, browser, shared) = (near.clone(), far.clone(), browser.clone(), shared.clone());
        std::thread::spawn(move || {
            let mut packet = [0; 2048];
            while !shared.ended() {
                let Ok((length, from)) = near.recv_from(&mut packet) else { continue };
                *browser.lock().unwrap() = Some(from);
                if !shared.loses() {
                    let _ = far.send_to(&packet[..length], drone);
                }
            }
        });
    }
    let shared = shared.clone();
    std::thread::spawn(move || {
        let mut packet = [0; 2048];
        while !shared.ended() {
            let Ok((length, _)) = far.recv_from(&mut packet) else { continue };
            let to = *browser.lock().unwrap();
            if let (Some(to), false) = (to, shared.loses()) {
                let _ = near.send_to(&packet[..length], to);
            }
        }
    });
    here
}

fn tcp(drone: SocketAddr, shared: &Arc<Shared>) -> SocketAddr {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let here = listener.local_addr().unwrap();
    listener.set_nonblocking(true).unwrap();
    let shared = shared.clone();
    std::thread::spawn(move || {
        while !shared.ended() {
            let Ok((near, _)) = listener.accept() else {
                std::thread::sleep(TURN);
                continue;
            };
            let Ok(far) = TcpStream::connect(drone) else { continue };
            for (from, to) in [(&near, &far), (&far, &near)] {
                let (from, to, shared) = (from.try_clone().unwrap(), to.try_clone().unwrap(), shared.clone());
                from.set_nonblocking(false).unwrap();
                from.set_read_timeout(Some(TURN)).unwrap();
                std::thread::spawn(move || copy(from, to, &shared));
            }
        }
    });
    here
}

fn copy(mut from: TcpStream, mut to: TcpStream, shared: &Shared) {
    let mut bytes = [0; 4096];
    while !shared.ended() {
        if shared.stalled.load(Ordering::Relaxed) {
            std::thread::sleep(TURN);
            continue;
        }
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(length) if to.write_all(&bytes[..length]).is_ok() => {
                shared.carried.fetch_add(1, Ordering::Relaxed);
            }
            Ok(_) => break,
            Err(error)
                if matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
            Err(_) => break,
        }
    }
    let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
}
