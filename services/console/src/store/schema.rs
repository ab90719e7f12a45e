//! The tables, version by version.

use super::StoreError;
use rusqlite::Connection;
use std::path::Path;

/// One step a version; a step that has been released is never changed.
const STEPS: &[&str] = &[
    "
CREATE TABLE starts (id INTEGER PRIMARY KEY, time_ms INTEGER NOT NULL) STRICT;

CREATE TABLE accounts (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    name TEXT NOT NULL,
    surname TEXT NOT NULL,
    email TEXT NOT NULL,
    email_folded TEXT NOT NULL UNIQUE,
    password TEXT NOT NULL,
    role TEXT NOT NULL CHECK (role IN ('viewer', 'guard', 'installer', 'administrator')),
    language TEXT NOT NULL,
    disabled INTEGER NOT NULL DEFAULT 0,
    made_ms INTEGER NOT NULL
) STRICT;

CREATE TABLE account_drones (
    account INTEGER NOT NULL REFERENCES accounts (id),
    drone TEXT NOT NULL,
    PRIMARY KEY (account, drone)
) STRICT, WITHOUT ROWID;

CREATE TABLE sessions (
    digest BLOB PRIMARY KEY,
    account INTEGER NOT NULL REFERENCES accounts (id),
    began_ms INTEGER NOT NULL,
    seen_ms INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

CREATE TABLE claim (id INTEGER PRIMARY KEY CHECK (id = 1), digest BLOB NOT NULL) STRICT;

CREATE TABLE drones (name TEXT PRIMARY KEY, seen_ms INTEGER NOT NULL) STRICT, WITHOUT ROWID;

CREATE TABLE log (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    time_ms INTEGER NOT NULL,
    kind TEXT NOT NULL,
    account TEXT NOT NULL,
    role TEXT NOT NULL,
    address TEXT NOT NULL,
    drone TEXT NOT NULL,
    verb TEXT NOT NULL,
    answer TEXT NOT NULL
) STRICT;
CREATE TRIGGER log_is_not_changed BEFORE UPDATE ON log
    BEGIN SELECT RAISE(ABORT, 'the log is only added to'); END;
CREATE TRIGGER log_is_not_erased BEFORE DELETE ON log
    BEGIN SELECT RAISE(ABORT, 'the log is only added to'); END;

CREATE TABLE incidents (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    time_ms INTEGER NOT NULL,
    drone TEXT NOT NULL,
    account TEXT NOT NULL,
    text TEXT NOT NULL,
    x_m REAL,
    y_m REAL,
    heading_rad REAL,
    holder TEXT NOT NULL
) STRICT;
CREATE INDEX incidents_by_drone ON incidents (drone, time_ms);

CREATE TABLE reports (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    drone TEXT NOT NULL,
    started_ms INTEGER NOT NULL,
    landed_ms INTEGER NOT NULL,
    outcome TEXT NOT NULL,
    coverage REAL NOT NULL,
    report TEXT NOT NULL
) STRICT;
CREATE INDEX reports_by_drone ON reports (drone, landed_ms);
",
    "
CREATE TABLE recordings (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    drone TEXT NOT NULL,
    started_ms INTEGER NOT NULL,
    ended_ms INTEGER,
    bytes INTEGER NOT NULL,
    width INTEGER NOT NULL,
    height INTEGER NOT NULL,
    account TEXT NOT NULL,
    incident INTEGER REFERENCES incidents (id),
    follows INTEGER REFERENCES recordings (id),
    erased_ms INTEGER,
    erased_by TEXT
) STRICT;
CREATE INDEX recordings_by_drone ON recordings (drone, started_ms);
",
];

/// Brings the file to this version: all or nothing.
pub(super) fn migrate(connection: &mut Connection, path: &Path) -> Result<(), StoreError> {
    let failed = |reason| StoreError::Database { path: path.to_owned(), reason };
    // Immediate: a second process that opens the same new file waits.
    let transaction =
        connection.transaction_with_behavior(rusqlite::TransactionBehavior::Immediate).map_err(failed)?;
    let found: i64 = transaction.query_row("PRAGMA user_version", [], |row| row.get(0)).map_err(failed)?;
    let known = STEPS.len() as i64;
    if !(0..=known).contains(&found) {
        return Err(StoreError::Newer { path: path.to_owned(), found, known });
    }
    for step in STEPS.iter().skip(found as usize) {
        transaction.execute_batch(step).map_err(failed)?;
    }
    transaction.pragma_update(None, "user_version", known).map_err(failed)?;
    transaction.commit().map_err(failed)
}
