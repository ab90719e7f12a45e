//! Serial ports that are none: a pseudo-terminal with a link to its far end.

use runtime::{ByteDevice, DeviceError, Devices, StartError};
use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::pty::OpenptFlags;
use rustix::termios::{OptionalActions, QueueSelector};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Bytes that may wait unread at the far end. A port that nobody has open keeps nothing; without this, a
/// restarted reader would take seconds-old frames for fresh ones.
const UNREAD: u64 = 1024;
/// A far end that has said nothing for so long may have been killed. `flight` says something every 20 ms (50 Hz of
/// channels) and tries a busy port again after as long.
const SILENCE: Duration = Duration::from_millis(50);

/// Opens pseudo-terminals where the manifest wants devices.
#[derive(Clone, Copy, Debug)]
pub struct PtyDevices;

impl Devices for PtyDevices {
    fn device(&mut self, name: &str, path: &str) -> Result<Box<dyn ByteDevice>, StartError> {
        let reason =
            |reason: String| StartError::Device { name: name.to_owned(), path: path.to_owned(), reason };
        let mut device = PtyDevice { path: PathBuf::from(path), open: None };
        device.open().map_err(|error| reason(error.to_string()))?;
        Ok(Box::new(device))
    }
}

/// One pseudo-terminal.
#[derive(Debug)]
struct PtyDevice {
    path: PathBuf,
    open: Option<Pair>,
}

#[derive(Debug)]
struct Pair {
    near: OwnedFd,
    /// Held, or reading the near end fails as soon as nobody else has the far end open (FACTS 6).
    far: OwnedFd,
    far_path: PathBuf,
    /// When the far end last said something, or last had its claim lifted.
    heard: Instant,
}

impl Pair {
    /// Lifts the exclusive claim on the far end. It goes with the last close, which never comes while this process
    /// holds the far end too: without this, a killed reader's successor would find the port busy for ever (root
    /// alone may open it all the same).
    fn lift_claim(&mut self, now: Instant) {
        self.heard = now;
        // It fails only where there is no claim to lift.
        let _ = rustix::termios::ioctl_tiocnxcl(&self.far);
    }
}

fn failed(what: &str, path: &Path) -> impl FnOnce(Errno) -> DeviceError {
    let text = format!("cannot {what} {}", path.display());
    move |error| DeviceError(format!("{text}: {error}"))
}

impl PtyDevice {
    fn pair(&self) -> Result<Pair, DeviceError> {
        let path = &self.path;
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let near = rustix::pty::openpt(flags).map_err(failed("open a pseudo-terminal for", path))?;
        rustix::pty::grantpt(&near).map_err(failed("grant the pseudo-terminal of", path))?;
        rustix::pty::unlockpt(&near).map_err(failed("unlock the pseudo-terminal of", path))?;
        let nonblocking = rustix::fs::fcntl_getfl(&near).map_err(failed("look at", path))? | OFlags::NONBLOCK;
        rustix::fs::fcntl_setfl(&near, nonblocking).map_err(failed("set up", path))?;
        let name = rustix::pty::ptsname(&near, Vec::new()).map_err(failed("name", path))?;
        let far_path = PathBuf::from(name.to_string_lossy().into_owned());
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC | OFlags::NONBLOCK;
        let far = rustix::fs::open(&far_path, flags, Mode::empty()).map_err(failed("hold", &far_path))?;
        // Raw, or what is sent before the reader comes is echoed back.
        let mut line = rustix::termios::tcgetattr(&far).map_err(failed("look at", &far_path))?;
        line.make_raw();
        rustix::termios::tcsetattr(&far, OptionalActions::Now, &line).map_err(failed("set up", &far_path))?;
        Ok(Pair { near, far, far_path, heard: Instant::now() })
    }

    /// Puts the link where the manifest says; only ever over another link.
    fn link(&self, far_path: &Path) -> Result<(), DeviceError> {
        let is_link = std::fs::symlink_metadata(&self.path).map(|found| found.file_type().is_symlink());
        match is_link {
            Ok(true) => std::fs::remove_file(&self.path),
            Ok(false) => return Err(DeviceError(format!("{} is in the way", self.path.display()))),
            Err(_) => Ok(()),
        }
        .and_then(|()| std::os::unix::fs::symlink(far_path, &self.path))
        .map_err(|error| DeviceError(format!("cannot link {}: {error}", self.path.display())))
    }
}

impl ByteDevice for PtyDevice {
    fn is_open(&self) -> bool {
        self.open.is_some()
    }

    fn open(&mut self) -> Result<(), DeviceError> {
        if self.open.is_none() {
            let pair = self.pair()?;
            self.link(&pair.far_path)?;
            self.open = Some(pair);
        }
        Ok(())
    }

    fn close(&mut self) {
        let Some(pair) = self.open.take() else { return };
        if std::fs::read_link(&self.path).is_ok_and(|target| target == pair.far_path) {
            // It may be gone already with the whole run directory.
            let _ = std::fs::remove_file(&self.path);
        }
    }

    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, DeviceError> {
        let Some(pair) = &mut self.open else {
            return Err(DeviceError(format!("{} is closed", self.path.display())));
        };
        match rustix::io::read(&pair.near, buffer) {
            Ok(count) => {
                pair.heard = Instant::now();
                Ok(count)
            }
            Err(Errno::AGAIN | Errno::INTR) => {
                let now = Instant::now();
                if now.duration_since(pair.heard) >= SILENCE {
                    pair.lift_claim(now);
                }
                Ok(0)
            }
            Err(error) => {
                let error = failed("read", &self.path)(error);
                self.close();
                Err(error)
            }
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, DeviceError> {
        let Some(pair) = &self.open else {
            return Err(DeviceError(format!("{} is closed", self.path.display())));
        };
        if rustix::io::ioctl_fionread(&pair.far).is_ok_and(|unread| unread > UNREAD) {
            let _ = rustix::termios::tcflush(&pair.far, QueueSelector::IFlush);
        }
        match rustix::io::write(&pair.near, bytes) {
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(error) => {
                let error = failed("write", &self.path)(error);
                self.close();
                Err(error)
            }
        }
    }
}

impl Drop for PtyDevice {
    fn drop(&mut self) {
        self.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};
    use std::os::unix::fs::OpenOptionsExt;

    fn place(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("sereno-pty-{}-{name}", std::process::id()))
    }

    fn far_end(path: &Path) -> std::fs::File {
        std::fs::OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(OFlags::NONBLOCK.bits().cast_signed())
            .open(path)
            .unwrap()
    }

    #[test]
    fn bytes_pass_unchanged_both_ways_and_the_link_goes_at_the_end() {
        let path = place("both");
        let mut device = PtyDevices.device("controller", path.to_str().unwrap()).unwrap();
        let every: Vec<u8> = (0..=255).collect();
        // Nobody has the far end open yet: nothing comes back.
        assert_eq!(device.write(b"\r\n\x03$").unwrap(), 4);
        let mut buffer = [0; 512];
        assert_eq!(device.read(&mut buffer).unwrap(), 0);
        let mut far = far_end(&path);
        let count = far.read(&mut buffer).unwrap();
        assert_eq!(&buffer[..count], b"\r\n\x03$");
        far.write_all(&every).unwrap();
        assert_eq!(device.read(&mut buffer).unwrap(), 256);
        assert_eq!(buffer[..256], every[..]);
        device.write(&every).unwrap();
        assert_eq!(far.read(&mut buffer).unwrap(), 256);
        assert_eq!(buffer[..256], every[..]);
        // The reader goes and comes back; this end survives.
        drop(far);
        assert_eq!(device.read(&mut buffer).unwrap(), 0);
        let mut far = far_end(&path);
        far.write_all(b"x").unwrap();
        assert_eq!(device.read(&mut buffer).unwrap(), 1);
        drop(device);
        assert!(!path.exists() && std::fs::symlink_metadata(&path).is_err());
    }

    #[test]
    fn an_unread_port_keeps_little() {
        let path = place("unread");
        let mut device = PtyDevices.device("flow", path.to_str().unwrap()).unwrap();
        for _ in 0..300 {
            device.write(&[7; 32]).unwrap();
            // The kernel hands bytes from one end to the other in a thread of its own.
            std::thread::sleep(Duration::from_millis(1));
        }
        let mut kept = Vec::new();
        let _ = far_end(&path).read_to_end(&mut kept);
        assert!(kept.len() < 4000, "{} of 9600", kept.len());
    }

    /// Somebody who is not root, for whom alone an exclusive claim counts.
    const NOBODY: u32 = 65_534;

    /// Whether a process without privileges can open the far end; `None` where none can be started.
    fn opens_for_others(path: &Path) -> Option<bool> {
        use std::os::unix::process::CommandExt;
        let mut shell = std::process::Command::new("/bin/sh");
        shell.args(["-c", ": <>\"$0\""]).arg(path).stdin(std::process::Stdio::null());
        if rustix::process::geteuid().is_root() {
            std::os::unix::fs::chown(std::fs::canonicalize(path).unwrap(), Some(NOBODY), None).unwrap();
            shell.uid(NOBODY);
        }
        let output = shell.output().ok()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success() || said.contains("busy"), "{said}");
        Some(output.status.success())
    }

    #[test]
    fn the_claim_of_a_killed_reader_is_lifted_and_that_of_a_talking_one_is_not() {
        let path = place("claim");
        let mut device = PtyDevices.device("controller", path.to_str().unwrap()).unwrap();
        let mut far = far_end(&path);
        rustix::termios::ioctl_tiocexcl(&far).unwrap();
        let mut buffer = [0; 64];
        for _ in 0..12 {
            far.write_all(b"x").unwrap();
            std::thread::sleep(SILENCE / 5);
            device.read(&mut buffer).unwrap();
        }
        match opens_for_others(&path) {
            None => return println!("skipped: this process may not start one under another user"),
            Some(opens) => assert!(!opens, "the claim of a reader that talks holds"),
        }
        // A kill closes its end, but the claim stays; nothing waits unread on a line of questions and answers.
        drop(far);
        assert_eq!(opens_for_others(&path), Some(false), "the claim outlives its owner");
        std::thread::sleep(SILENCE);
        assert_eq!(device.read(&mut buffer).unwrap(), 0);
        assert_eq!(opens_for_others(&path), Some(true));
    }

    #[test]
    fn a_real_file_in_the_way_is_left_alone() {
        let path = place("file");
        std::fs::write(&path, "precious").unwrap();
        let error = PtyDevices.device("flow", path.to_str().unwrap()).err().unwrap().to_string();
        assert!(error.contains("in the way"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
        std::fs::remove_file(&path).unwrap();
    }
}
