//! A listener on the serial line between `flight` and the simulated controller: bytes pass through a second pseudo-terminal,
//! and every SET_RAW_RC is noted with the time at which its last byte was there.

use msp::Decoder;
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// MSP_SET_RAW_RC (Betaflight `msp_protocol.h`).
const SET_RAW_RC: u16 = 200;

/// Milliseconds since 1970, as browsers count them.
pub(crate) fn now_ms() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64() * 1e3
}

/// One frame of channels.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    /// When its last byte came, milliseconds since 1970.
    pub(crate) at_ms: f64,
    /// Microseconds.
    pub(crate) channels: Vec<u16>,
}

/// What was heard.
#[derive(Clone, Default)]
pub(crate) struct Tap(Arc<Mutex<Vec<Frame>>>);

impl Tap {
    /// Listens between `controller`, which the simulator makes, and `tapped`, which `flight` opens.
    pub(crate) fn between(controller: PathBuf, tapped: PathBuf) -> Self {
        let tap = Self::default();
        let heard = tap.clone();
        std::thread::spawn(move || {
            if let Err(error) = heard.carry(&controller, &tapped) {
                eprintln!("the tap ended: {error}");
            }
        });
        tap
    }

    /// What has come since `since_ms`.
    pub(crate) fn since(&self, since_ms: f64) -> Vec<Frame> {
        let frames = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        frames.iter().filter(|frame| frame.at_ms >= since_ms).cloned().collect()
    }

    fn carry(&self, controller: &Path, tapped: &Path) -> std::io::Result<()> {
        let (near, _far, name) = pair()?;
        let began = Instant::now();
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK;
        let line = loop {
            match rustix::fs::open(controller, flags, Mode::empty()) {
                Ok(line) => break line,
                Err(error) if began.elapsed() > Duration::from_secs(60) => return Err(error.into()),
                Err(_) => std::thread::sleep(Duration::from_millis(10)),
            }
        };
        std::os::unix::fs::symlink(name, tapped)?;
        let mut raw = rustix::termios::tcgetattr(&line)?;
        raw.make_raw();
        rustix::termios::tcsetattr(&line, OptionalActions::Now, &raw)?;
        let mut decoder = Decoder::<512>::new();
        let mut buffer = [0_u8; 1024];
        loop {
            wait(&near, &line)?;
            let count = rustix::io::read(&near, &mut buffer).unwrap_or(0);
            let bytes = buffer.get(..count).unwrap_or_default();
            pass(&line, bytes);
            let at_ms = now_ms();
            decoder.feed(bytes, |frame| {
                if frame.code == SET_RAW_RC {
                    let pairs = frame.payload.chunks_exact(2);
                    let channels = pairs.map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
                    self.0.lock().unwrap_or_else(PoisonError::into_inner).push(Frame { at_ms, channels });
                }
            });
            let count = rustix::io::read(&line, &mut buffer).unwrap_or(0);
            pass(&near, buffer.get(..count).unwrap_or_default());
        }
    }
}

fn pair() -> std::io::Result<(OwnedFd, OwnedFd, String)> {
    let near = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::pty::grantpt(&near)?;
    rustix::pty::unlockpt(&near)?;
    let nonblocking = rustix::fs::fcntl_getfl(&near)? | OFlags::NONBLOCK;
    rustix::fs::fcntl_setfl(&near, nonblocking)?;
    let name = rustix::pty::ptsname(&near, Vec::new())?.to_string_lossy().into_owned();
    let far = rustix::fs::open(name.as_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
    let mut raw = rustix::termios::tcgetattr(&far)?;
    raw.make_raw();
    rustix::termios::tcsetattr(&far, OptionalActions::Now, &raw)?;
    Ok((near, far, name))
}

fn wait(a: &OwnedFd, b: &OwnedFd) -> std::io::Result<()> {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    let mut fds = [PollFd::new(a, PollFlags::IN), PollFd::new(b, PollFlags::IN)];
    poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 100_000_000 }))?;
    Ok(())
}

fn pass(to: &OwnedFd, mut bytes: &[u8]) {
    let began = Instant::now();
    while !bytes.is_empty() && began.elapsed() < Duration::from_millis(100) {
        match rustix::io::write(to, bytes) {
            Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
            Err(_) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
}
