//! The run directory: private, locked by one supervisor and its warden, empty again in the end.

use crate::error::{SupervisorError, while_doing};
use manifest::Manifest;
use runtime::shm::RunDir;
use rustix::fs::{FlockOperation, flock};
use rustix::process::{Pid, Signal, kill_process};
use std::fs::{File, OpenOptions};
use std::io::Read;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest path of a Unix socket (108 bytes with its NUL).
const SOCKET_PATH: usize = 107;
/// A killed process is gone within milliseconds unless it hangs in the kernel.
const ORPHAN_PATIENCE: Duration = Duration::from_secs(3);

/// What a warden at work is called among processes.
pub(crate) const WARDEN_NAME: &str = "sereno-warden";
/// How what it writes in the lock begins.
const WARDEN_HOLDS: &str = "process ";

/// Socket for requests inside a run directory.
pub(crate) fn control_socket(run_dir: &Path) -> PathBuf {
    run_dir.join("control.sock")
}

/// A run directory held by this process.
#[derive(Debug)]
pub(crate) struct Place {
    pub(crate) run: RunDir,
    logs: PathBuf,
    logs_stay: bool,
    /// Holds the lock for as long as it is open, here or in another process that was given it.
    lock: File,
}

impl Place {
    /// Makes the directory, takes its lock, ends what an earlier supervisor left alive and wipes what it left
    /// in shared memory.
    pub(crate) fn take(path: &Path, logs: Option<&Path>) -> Result<Self, SupervisorError> {
        let path = std::path::absolute(path).map_err(while_doing("run directory"))?;
        let run = RunDir::new(path.clone());
        let wrong = |reason: String| SupervisorError::RunDir { run_dir: path.clone(), reason };
        if control_socket(&path).as_os_str().len() > SOCKET_PATH {
            return Err(wrong(format!(
                "too long for a socket inside it ({SOCKET_PATH} bytes): use --run-dir"
            )));
        }
        run.create().map_err(|e| wrong(e.to_string()))?;
        let metadata = std::fs::metadata(&path).map_err(while_doing(path.display().to_string()))?;
        let user = rustix::process::geteuid().as_raw();
        if metadata.uid() != user {
            return Err(wrong(format!(
                "belongs to user {}, not to user {user}: use --run-dir",
                metadata.uid()
            )));
        }
        if metadata.mode() & 0o077 != 0 {
            return Err(wrong(format!(
                "is open to others (mode {:o}): chmod 700 it",
                metadata.mode() & 0o777
            )));
        }
        let lock = take_lock(&path)?;
        end_orphans(&path)?;
        run.wipe();
        for socket in [control_socket(&path), path.join("notify.sock")] {
            remove(&socket);
        }
        let place = Self::inherit(run, logs, lock);
        std::fs::create_dir_all(&place.logs).map_err(while_doing(place.logs.display().to_string()))?;
        Ok(place)
    }

    /// The run directory of another process that gave this one its lock.
    pub(crate) fn inherit(run: RunDir, logs: Option<&Path>, lock: File) -> Self {
        let logs_stay = logs.is_some();
        let logs = logs.map_or_else(|| run.path().join("logs"), Path::to_owned);
        Self { run, logs, logs_stay, lock }
    }

    /// The lock, to be given to another process.
    pub(crate) fn lock(&self) -> BorrowedFd<'_> {
        self.lock.as_fd()
    }

    /// Lets whoever wants the directory know what its supervisor's warden, this process, does.
    pub(crate) fn held_by_warden(&self, doing: &str) {
        let own = std::process::id();
        // The lock counts, not what is written in it.
        let _ = write_holder(
            &self.lock,
            &format!("{WARDEN_HOLDS}{own}, the warden, which is {doing} after its supervisor died"),
        );
    }

    pub(crate) fn path(&self) -> &Path {
        self.run.path()
    }

    pub(crate) fn control(&self) -> PathBuf {
        control_socket(self.path())
    }

    pub(crate) fn notify(&self) -> PathBuf {
        self.path().join("notify.sock")
    }

    pub(crate) fn changes(&self) -> PathBuf {
        self.path().join("changes.toml")
    }

    pub(crate) fn log(&self, service: &str) -> PathBuf {
        self.logs.join(format!("{service}.log"))
    }

    /// Removes everything that this system made; only its own names, since the directory may be a user's.
    pub(crate) fn leave(self, manifest: &Manifest) {
        self.run.wipe();
        for file in [self.control(), self.notify(), self.changes()] {
            remove(&file);
        }
        for path in manifest.services.values().flat_map(|s| s.devices.values()) {
            if path.starts_with("@run/") {
                remove(&self.run.resolve(path));
            }
        }
        if !self.logs_stay {
            let _ = std::fs::remove_dir_all(&self.logs);
        }
        remove(&self.path().join("lock"));
        // Stays when somebody else's files are in it.
        let _ = std::fs::remove_dir(self.path());
    }
}

/// Who brings a system to its end whose supervisor has died, as it writes it in the lock; nobody when none does.
pub(crate) fn warden_at_work(run_dir: &Path) -> Option<String> {
    let text = std::fs::read_to_string(run_dir.join("lock")).ok()?;
    let pid: u32 = text.strip_prefix(WARDEN_HOLDS)?.split(',').next()?.parse().ok()?;
    // The file stays if it dies.
    let name = std::fs::read_to_string(format!("/proc/{pid}/comm")).ok()?;
    (name.trim_end() == WARDEN_NAME).then(|| text.trim_end().to_owned())
}

/// What is not there need not be removed; what cannot be removed is met again at the next start.
fn remove(path: &Path) {
    let _ = std::fs::remove_file(path);
}

fn take_lock(run_dir: &Path) -> Result<File, SupervisorError> {
    let path = run_dir.join("lock");
    let doing = || format!("lock {}", path.display());
    loop {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(&path)
            .map_err(while_doing(doing()))?;
        match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => {}
            Err(rustix::io::Errno::WOULDBLOCK) => {
                let mut holder = String::new();
                let _ = file.read_to_string(&mut holder);
                let holder = holder.trim();
                return Err(SupervisorError::AlreadyRunning {
                    run_dir: run_dir.to_owned(),
                    holder: if holder.is_empty() { "a supervisor" } else { holder }.to_owned(),
                });
            }
            Err(error) => return Err(while_doing(doing())(error)),
        }
        // A supervisor that just left may have removed the file between our open and our lock.
        let same = std::fs::metadata(&path).and_then(|there| {
            file.metadata().map(|here| here.ino() == there.ino() && here.dev() == there.dev())
        });
        if !same.unwrap_or(false) {
            continue;
        }
        let holder = format!("the supervisor with process id {}", std::process::id());
        write_holder(&file, &holder).map_err(while_doing(doing()))?;
        return Ok(file);
    }
}

fn write_holder(lock: &File, holder: &str) -> std::io::Result<()> {
    let line = format!("{holder}\n");
    lock.write_all_at(line.as_bytes(), 0)?;
    lock.set_len(line.len() as u64)
}

/// Services that outlived their supervisor hold shared memory that is about to be wiped.
fn end_orphans(run_dir: &Path) -> Result<(), SupervisorError> {
    let deadline = Instant::now() + ORPHAN_PATIENCE;
    loop {
        let orphans = orphans(run_dir);
        if orphans.is_empty() {
            return Ok(());
        }
        if Instant::now() >= deadline {
            let pids: Vec<String> = orphans.iter().map(|(pid, _)| pid.as_raw_pid().to_string()).collect();
            return Err(SupervisorError::Orphans { run_dir: run_dir.to_owned(), pids: pids.join(", ") });
        }
        for (pid, _) in orphans {
            // Gone already is as good.
            let _ = kill_process(pid, Signal::KILL);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Processes that some supervisor of this run directory started, with the services they belong to, by their environment.
/// A zombie has none.
pub(crate) fn orphans(run_dir: &Path) -> Vec<(Pid, String)> {
    let mark = [runtime::env::SUPERVISED.as_bytes(), b"=", run_dir.as_os_str().as_encoded_bytes()].concat();
    let name = [runtime::env::SERVICE.as_bytes(), b"="].concat();
    let own = std::process::id().cast_signed();
    let service = |pid: i32| {
        let environment = std::fs::read(format!("/proc/{pid}/environ")).ok()?;
        let variables = || environment.split(|b| *b == 0);
        if !variables().any(|variable| variable == mark) {
            return None;
        }
        let name =
            variables().find_map(|variable| variable.strip_prefix(name.as_slice())).unwrap_or_default();
        Some(String::from_utf8_lossy(name).into_owned())
    };
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    entries
        .filter_map(|entry| entry.file_name().to_str()?.parse::<i32>().ok())
        .filter(|pid| *pid != own)
        .filter_map(|pid| Some((Pid::from_raw(pid)?, service(pid)?)))
        .collect()
}
