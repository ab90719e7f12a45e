//! The folder of the recordings. Names are made from numbers, never from what somebody said.

use std::fs::{DirBuilder, File};
use std::io;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// One folder, for its owner alone.
#[derive(Clone, Debug)]
pub(super) struct Files {
    folder: PathBuf,
}

impl Files {
    /// Makes it when it is missing.
    pub(super) fn open(data: &Path) -> io::Result<Self> {
        let folder = data.join("recordings");
        DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
        Ok(Self { folder })
    }

    /// Of the recording of this number.
    pub(super) fn path(&self, id: i64) -> PathBuf {
        self.folder.join(format!("{id:010}.mp4"))
    }

    /// A new file.
    pub(super) fn create(&self, id: i64) -> io::Result<File> {
        File::options().read(true).write(true).create_new(true).mode(0o600).open(self.path(id))
    }

    /// One that is there, to be finished.
    pub(super) fn edit(&self, id: i64) -> io::Result<File> {
        File::options().read(true).write(true).open(self.path(id))
    }

    /// Erases one; one that is not there is erased already.
    pub(super) fn remove(&self, id: i64) -> io::Result<()> {
        match std::fs::remove_file(self.path(id)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }

    /// Numbers of all that are there.
    pub(super) fn numbers(&self) -> io::Result<Vec<i64>> {
        let number =
            |name: &str| name.strip_suffix(".mp4").filter(|digits| digits.len() == 10)?.parse::<i64>().ok();
        let mut found = Vec::new();
        for entry in std::fs::read_dir(&self.folder)? {
            found.extend(number(&entry?.file_name().to_string_lossy()));
        }
        Ok(found)
    }

    /// Bytes that are free on the disk for who is not root.
    pub(super) fn free(&self) -> io::Result<u64> {
        let disk = rustix::fs::statvfs(&self.folder)?;
        Ok(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
}
