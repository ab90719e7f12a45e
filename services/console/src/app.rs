//! What every request shares.

use crate::authority::Authority;
use crate::backoff::Backoff;
use crate::fleet::Fleet;
use crate::page::Page;
use crate::plans::{Drafts, Rehearsals};
use crate::secret::Digest;
use crate::store::{Entry, Kind};
use crate::{Account, Directory, Store};
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use tokio::sync::{Semaphore, watch};

/// Tells the time; another one in tests.
pub trait Clock: Send + Sync {
    /// Unix milliseconds.
    fn now_ms(&self) -> u64;
}

/// The system's clock.
#[derive(Clone, Copy, Debug)]
pub struct SystemClock;

impl Clock for SystemClock {
    fn now_ms(&self) -> u64 {
        std::time::SystemTime::now()
            .duration_since(std::time::UNIX_EPOCH)
            .map_or(0, |since| u64::try_from(since.as_millis()).unwrap_or(u64::MAX))
    }
}

/// Random bytes of the operating system.
///
/// # Errors
/// When it has none.
pub(crate) fn random<const N: usize>() -> Result<[u8; N], getrandom::Error> {
    let mut bytes = [0; N];
    getrandom::fill(&mut bytes)?;
    Ok(bytes)
}

/// Passwords hashed at the same time: each takes 19 MiB and a core.
const HASHES: usize = 2;

/// Everything that the handlers need.
pub struct App {
    pub(crate) store: Store,
    pub(crate) fleet: Arc<Fleet>,
    pub(crate) page: Page,
    /// What devices are to trust, if anything.
    pub(crate) authority: Option<Authority>,
    pub(crate) drafts: Drafts,
    pub(crate) rehearsals: Rehearsals,
    pub(crate) clock: Arc<dyn Clock>,
    pub(crate) hashes: Semaphore,
    pub(crate) decoy: String,
    directory: RwLock<Directory>,
    backoff: Mutex<Backoff>,
    /// Counts changes of who may do what: open sockets look again.
    changed: watch::Sender<u64>,
}

impl App {
    pub(crate) fn new(
        store: Store,
        fleet: Arc<Fleet>,
        (page, authority): (Page, Option<Authority>),
        (drafts, rehearsals): (Drafts, Rehearsals),
        clock: Arc<dyn Clock>,
        directory: Directory,
        decoy: String,
    ) -> Self {
        Self {
            store,
            fleet,
            page,
            authority,
            drafts,
            rehearsals,
            clock,
            hashes: Semaphore::new(HASHES),
            decoy,
            directory: RwLock::new(directory),
            backoff: Mutex::new(Backoff::default()),
            changed: watch::Sender::new(0),
        }
    }

    /// Whoever panicked with one of these locks held left it whole: each change is one call of a pure structure.
    pub(crate) fn directory(&self) -> RwLockReadGuard<'_, Directory> {
        self.directory.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// For changes; whoever takes something away calls [`Self::announce`] afterwards.
    pub(crate) fn directory_mut(&self) -> RwLockWriteGuard<'_, Directory> {
        self.directory.write().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn backoff(&self) -> MutexGuard<'_, Backoff> {
        self.backoff.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Open sockets are to look again whether they are still allowed.
    pub(crate) fn announce(&self) {
        self.changed.send_modify(|count| *count += 1);
    }

    pub(crate) fn watch(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }

    pub(crate) fn who(&self, session: &Digest) -> Option<Account> {
        self.directory().who(session, self.clock.now_ms()).cloned()
    }

    /// A human did something in this session.
    pub(crate) fn seen(&self, session: &Digest) {
        let now_ms = self.clock.now_ms();
        let due = self.directory_mut().seen(session, now_ms);
        if due {
            let (store, session) = (self.store.clone(), *session);
            tokio::spawn(async move {
                // Should it fail, a restart of the console takes the session for idle a minute too early.
                if let Err(error) = store.session_seen(session, now_ms).await {
                    tracing::warn!("{error}");
                }
            });
        }
    }

    /// A line for the log about an account.
    pub(crate) fn entry(&self, kind: Kind, account: &Account, address: IpAddr) -> Entry {
        Entry {
            time_ms: self.clock.now_ms(),
            kind,
            account: account.email.clone(),
            role: account.role.word(),
            address: address.to_string(),
            drone: String::new(),
            verb: String::new(),
            answer: String::new(),
        }
    }
}
