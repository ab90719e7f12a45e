//! What is kept: SQLite, one file, touched by one thread. Everybody else sends it work and waits for the answer.

mod accounts;
mod log;
mod recordings;
mod reports;
mod schema;

pub use accounts::NewAccount;
pub use log::{Entry, Kind};
pub use recordings::Recording;
pub use reports::{Incident, ReportLine};

use rusqlite::Connection;
use std::path::{Path, PathBuf};
use tokio::sync::{mpsc, oneshot};

/// What is wrong with the store.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// SQLite's own reason: a full disk, a folder that may not be written, a damaged file.
    #[error("the console's database {}: {reason}", .path.display())]
    Database {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        reason: rusqlite::Error,
    },
    /// The data folder.
    #[error("the console's data folder {}: {reason}", .path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        reason: std::io::Error,
    },
    /// A file that a newer version has written.
    #[error(
        "the console's database {} is of version {found}, this program knows up to {known}: use the newer program",
        .path.display()
    )]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: i64,
        /// The newest that this program knows.
        known: i64,
    },
    /// Another account has this e-mail address.
    #[error("another account has the e-mail address {0}")]
    EmailTaken(String),
    /// The console has an account already.
    #[error("this console has been claimed already")]
    Claimed,
    /// The thread has ended: the console is stopping.
    #[error("the console is stopping")]
    Gone,
}

type Work = Box<dyn FnOnce(&mut Connection) + Send>;

/// Work that may wait for the thread; more than this and those who ask wait.
const WAITING: usize = 256;
/// For how long SQLite waits for another process (`--claim`) to finish writing, milliseconds.
const BUSY_MS: u64 = 3000;

/// The way to the thread that has the file.
#[derive(Clone, Debug)]
pub struct Store {
    work: mpsc::Sender<Work>,
    path: PathBuf,
}

impl Store {
    /// Opens the database in `folder`, makes both when they are missing, brings it to this version.
    ///
    /// # Errors
    /// One sentence about what cannot be read or written.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        make_folder(folder)?;
        let path = folder.join("console.sqlite");
        let mut connection = open(&path)?;
        let (work, mut waiting) = mpsc::channel::<Work>(WAITING);
        std::thread::Builder::new()
            .name("store".to_owned())
            .spawn(move || {
                while let Some(work) = waiting.blocking_recv() {
                    work(&mut connection);
                }
            })
            .map_err(|reason| StoreError::Folder { path: folder.to_owned(), reason })?;
        Ok(Self { work, path })
    }

    /// Does `work` on the thread.
    ///
    /// # Errors
    /// SQLite's, naming the file.
    pub(crate) async fn run<T, F>(&self, work: F) -> Result<T, StoreError>
    where
        T: Send + 'static,
        F: FnOnce(&mut Connection) -> rusqlite::Result<T> + Send + 'static,
    {
        let (answer, answered) = oneshot::channel();
        let work: Work = Box::new(move |connection| {
            // Who asked may have gone; then nobody wants the answer.
            let _ = answer.send(work(connection));
        });
        self.work.send(work).await.map_err(|_| StoreError::Gone)?;
        answered.await.map_err(|_| StoreError::Gone)?.map_err(|reason| self.error(reason))
    }

    pub(crate) fn error(&self, reason: rusqlite::Error) -> StoreError {
        StoreError::Database { path: self.path.clone(), reason }
    }
}

fn make_folder(folder: &Path) -> Result<(), StoreError> {
    use std::os::unix::fs::DirBuilderExt;
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .map_err(|reason| StoreError::Folder { path: folder.to_owned(), reason })
}

fn open(path: &Path) -> Result<Connection, StoreError> {
    use std::os::unix::fs::OpenOptionsExt;
    // SQLite gives its side files the mode of the database: password hashes are in all of them.
    std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .mode(0o600)
        .open(path)
        .map_err(|reason| StoreError::Folder { path: path.to_owned(), reason })?;
    let failed = |reason| StoreError::Database { path: path.to_owned(), reason };
    let mut connection = Connection::open(path).map_err(failed)?;
    connection.busy_timeout(std::time::Duration::from_millis(BUSY_MS)).map_err(failed)?;
    connection.pragma_update(None, "journal_mode", "WAL").map_err(failed)?;
    // With WAL a power cut may cost the last moments, never the file.
    connection.pragma_update(None, "synchronous", "NORMAL").map_err(failed)?;
    connection.pragma_update(None, "foreign_keys", true).map_err(failed)?;
    schema::migrate(&mut connection, path)?;
    // Whether it can be written is known now, not at the first log-in.
    connection.execute("INSERT INTO starts (time_ms) VALUES (unixepoch() * 1000)", []).map_err(failed)?;
    Ok(connection)
}
