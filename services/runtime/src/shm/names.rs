//! Where a system lives: its run directory, and the names that it uses in shared memory.

use super::ShmError;
use crate::fnv;
use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IoxPath, SemanticString};
use std::path::{Path, PathBuf};

/// The private directory of one running system: sockets, links to pseudo-terminals, logs, and what
/// iceoryx2 keeps on disk. Everything in shared memory carries a prefix derived from its path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunDir(PathBuf);

impl RunDir {
    /// The run directory at `path`; nothing is created yet. `x`, `x/` and `./x` are the same.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        let path = path.into();
        // Without a working directory the path stays as it is.
        let absolute = std::path::absolute(&path).unwrap_or(path);
        // `absolute` keeps a slash at the end; the sequence of components has none.
        Self(absolute.components().collect())
    }

    /// The directory.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Prefix of everything that this system has in shared memory.
    #[must_use]
    pub fn prefix(&self) -> String {
        format!("sereno_{:016x}_", fnv(self.0.as_os_str().as_encoded_bytes()))
    }

    fn shared_root(&self) -> PathBuf {
        self.0.join("shm")
    }

    /// A path of the manifest: `@run/x` lies in this directory.
    #[must_use]
    pub fn resolve(&self, path: &str) -> PathBuf {
        path.strip_prefix("@run/").map_or_else(|| PathBuf::from(path), |rest| self.0.join(rest))
    }

    /// Creates the directory, readable by its owner alone.
    ///
    /// # Errors
    /// [`ShmError`] naming the directory.
    pub fn create(&self) -> Result<(), ShmError> {
        use std::os::unix::fs::DirBuilderExt;
        let failed = |error: std::io::Error| ShmError(format!("cannot create {}: {error}", self.0.display()));
        std::fs::DirBuilder::new().recursive(true).mode(0o700).create(&self.0).map_err(failed)
    }

    /// The iceoryx2 configuration of this system. Dead nodes are cleaned up by the supervisor alone, at a
    /// moment when it has saved what the keeper needs.
    pub(crate) fn iceoryx_config(&self) -> Result<Config, ShmError> {
        let root = self.shared_root();
        let root_name = IoxPath::new(root.as_os_str().as_encoded_bytes()).map_err(|_| {
            ShmError(format!("the run directory {} is too long or no path", self.0.display()))
        })?;
        let prefix = FileName::new(self.prefix().as_bytes())
            .map_err(|_| ShmError("the shared-memory prefix is no file name".to_owned()))?;
        let mut config = Config::default();
        config.global.set_root_path(&root_name);
        config.global.prefix = prefix;
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        Ok(config)
    }

    /// Removes everything of this system in shared memory. Only to be called while no process of it lives.
    pub fn wipe(&self) {
        let prefix = self.prefix();
        if let Ok(entries) = std::fs::read_dir("/dev/shm") {
            for entry in entries.flatten() {
                if entry.file_name().as_encoded_bytes().starts_with(prefix.as_bytes()) {
                    // What cannot be removed now is tried again at the next start.
                    let _ = std::fs::remove_file(entry.path());
                }
            }
        }
        let _ = std::fs::remove_dir_all(self.shared_root());
    }

    /// Names of this system that are in shared memory now.
    #[must_use]
    pub fn leftovers(&self) -> Vec<String> {
        let prefix = self.prefix();
        let entries = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
        entries
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(|name| name.starts_with(&prefix))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_directory_is_one_system_however_it_is_written() {
        let here = std::env::current_dir().unwrap();
        let plain = RunDir::new(here.join("run"));
        for spelling in ["run", "run/", "./run", "run/.", ".//run//"] {
            assert_eq!(RunDir::new(spelling).prefix(), plain.prefix(), "{spelling}");
        }
        assert_ne!(RunDir::new("run2").prefix(), plain.prefix());
    }
}
