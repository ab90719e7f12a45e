//! The log: who came, who failed, who did what. It is only added to; triggers in the file refuse the rest.

use super::{Store, StoreError};
use rusqlite::params;
use serde::Serialize;

/// What a line is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The console was claimed.
    Claimed,
    /// Somebody logged in.
    LogIn,
    /// Somebody logged out.
    LogOut,
    /// A log-in, claim or change of password failed.
    Failed,
    /// Accounts were changed.
    Accounts,
    /// An order to a drone, with its answer.
    Order,
    /// An incident was marked.
    Incident,
    /// A recording was begun, ended, shown, taken away or erased.
    Recording,
    /// A building's plan, round or zones were changed, or a flight over them rehearsed.
    Plan,
}

impl Kind {
    const fn word(self) -> &'static str {
        match self {
            Self::Claimed => "claimed",
            Self::LogIn => "log-in",
            Self::LogOut => "log-out",
            Self::Failed => "failed",
            Self::Accounts => "accounts",
            Self::Order => "order",
            Self::Incident => "incident",
            Self::Recording => "recording",
            Self::Plan => "plan",
        }
    }
}

/// A line to be added.
#[derive(Clone, Debug)]
pub struct Entry {
    /// When, Unix milliseconds.
    pub time_ms: u64,
    /// About what.
    pub kind: Kind,
    /// E-mail address of the account, or what was given as one.
    pub account: String,
    /// Its role; empty without an account.
    pub role: &'static str,
    /// From where.
    pub address: String,
    /// To which drone; empty for none.
    pub drone: String,
    /// What was asked for.
    pub verb: String,
    /// What came of it.
    pub answer: String,
}

/// A line as it is read.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Line {
    id: i64,
    time_ms: i64,
    kind: String,
    account: String,
    role: String,
    address: String,
    drone: String,
    verb: String,
    answer: String,
}

impl Store {
    /// Adds a line.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn log(&self, entry: Entry) -> Result<(), StoreError> {
        self.run(move |connection| {
            connection
                .prepare(
                    "INSERT INTO log (time_ms, kind, account, role, address, drone, verb, answer)
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                )?
                .execute(params![
                    entry.time_ms as i64,
                    entry.kind.word(),
                    entry.account,
                    entry.role,
                    entry.address,
                    entry.drone,
                    entry.verb,
                    entry.answer
                ])
                .map(|_| ())
        })
        .await
    }

    /// Lines before number `before`, the newest first.
    pub(crate) async fn read_log(&self, before: i64, limit: u32) -> Result<Vec<Line>, StoreError> {
        self.run(move |connection| {
            connection
                .prepare(
                    "SELECT id, time_ms, kind, account, role, address, drone, verb, answer
                     FROM log WHERE id < ?1 ORDER BY id DESC LIMIT ?2",
                )?
                .query_map(params![before, limit], |row| {
                    Ok(Line {
                        id: row.get(0)?,
                        time_ms: row.get(1)?,
                        kind: row.get(2)?,
                        account: row.get(3)?,
                        role: row.get(4)?,
                        address: row.get(5)?,
                        drone: row.get(6)?,
                        verb: row.get(7)?,
                        answer: row.get(8)?,
                    })
                })?
                .collect()
        })
        .await
    }
}
