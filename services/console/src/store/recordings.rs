//! Recordings: what there is, whose it is, and what was erased when and by whom. Rows stay when files go.

use super::{Store, StoreError};
use rusqlite::{OptionalExtension, Row, params};
use serde::Serialize;

/// One file of pictures.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recording {
    /// Number, given by the store.
    pub id: i64,
    /// Which drone saw it.
    pub drone: String,
    /// The first picture, Unix milliseconds.
    pub started_ms: u64,
    /// The last picture, Unix milliseconds; `None` while it is being written.
    pub ended_ms: Option<u64>,
    /// Length of the file.
    pub bytes: u64,
    /// Pixels.
    pub width: u16,
    /// Pixels.
    pub height: u16,
    /// Who began it, or marked the incident.
    pub account: String,
    /// The incident that it belongs to.
    pub incident: Option<i64>,
    /// The recording that it goes on with: another size of the pictures, or a pause, begins a new file.
    pub follows: Option<i64>,
}

const LIST: &str = "SELECT id, drone, started_ms, ended_ms, bytes, width, height, account, incident, follows FROM recordings WHERE erased_ms IS NULL";
/// Recordings in one list.
const MOST: u32 = 500;

fn recording(row: &Row<'_>) -> rusqlite::Result<Recording> {
    Ok(Recording {
        id: row.get(0)?,
        drone: row.get(1)?,
        started_ms: row.get::<_, i64>(2)?.max(0) as u64,
        ended_ms: row.get::<_, Option<i64>>(3)?.map(|ms| ms.max(0) as u64),
        bytes: row.get::<_, i64>(4)?.max(0) as u64,
        width: row.get(5)?,
        height: row.get(6)?,
        account: row.get(7)?,
        incident: row.get(8)?,
        follows: row.get(9)?,
    })
}

impl Store {
    /// A recording begins; returns its number.
    ///
    /// # Errors
    /// SQLite's. So are those of all the others here.
    pub async fn begin_recording(&self, of: Recording) -> Result<i64, StoreError> {
        self.run(move |connection| {
            connection.execute(
                "INSERT INTO recordings (drone, started_ms, bytes, width, height, account, incident, follows)
                 VALUES (?1, ?2, 0, ?3, ?4, ?5, ?6, ?7)",
                params![
                    of.drone,
                    of.started_ms as i64,
                    of.width,
                    of.height,
                    of.account,
                    of.incident,
                    of.follows
                ],
            )?;
            Ok(connection.last_insert_rowid())
        })
        .await
    }

    /// A recording has ended, so many milliseconds after it began.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn end_recording(&self, id: i64, length_ms: u64, bytes: u64) -> Result<(), StoreError> {
        self.run(move |connection| {
            connection
                .execute(
                    "UPDATE recordings SET ended_ms = started_ms + ?2, bytes = ?3 WHERE id = ?1",
                    params![id, length_ms as i64, bytes as i64],
                )
                .map(|_| ())
        })
        .await
    }

    /// A recording is erased; false when there is none.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn erase_recording(&self, id: i64, by: String, now_ms: u64) -> Result<bool, StoreError> {
        self.run(move |connection| {
            connection
                .execute(
                    "UPDATE recordings SET erased_ms = ?2, erased_by = ?3 WHERE id = ?1 AND erased_ms IS NULL",
                    params![id, now_ms as i64, by],
                )
                .map(|changed| changed > 0)
        })
        .await
    }

    /// The newest recordings of a drone.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn recordings(&self, drone: String) -> Result<Vec<Recording>, StoreError> {
        self.run(move |connection| {
            connection
                .prepare(&format!("{LIST} AND drone = ?1 ORDER BY started_ms DESC, id DESC LIMIT {MOST}"))?
                .query_map([drone], recording)?
                .collect()
        })
        .await
    }

    /// One recording that has not been erased.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn recording(&self, id: i64) -> Result<Option<Recording>, StoreError> {
        self.run(move |connection| {
            connection.query_row(&format!("{LIST} AND id = ?1"), [id], recording).optional()
        })
        .await
    }

    /// All recordings of all drones, the oldest first.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn every_recording(&self) -> Result<Vec<Recording>, StoreError> {
        self.run(|connection| {
            connection
                .prepare(&format!("{LIST} ORDER BY started_ms, id"))?
                .query_map([], recording)?
                .collect()
        })
        .await
    }
}
