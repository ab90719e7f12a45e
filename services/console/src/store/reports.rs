//! Reports of rounds, incidents, and the drones that were ever seen.

use super::{Store, StoreError};
use rusqlite::{OptionalExtension, Row, params};
use serde::{Deserialize, Serialize};

/// Something that a guard marked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Incident {
    /// Number, given by the store.
    pub id: i64,
    /// When, Unix milliseconds.
    pub time_ms: u64,
    /// Which drone saw it.
    pub drone: String,
    /// Who marked it.
    pub account: String,
    /// What it is.
    pub text: String,
    /// Where the drone was, plan frame; `None` when nobody knew.
    pub x_m: Option<f64>,
    /// See `x_m`.
    pub y_m: Option<f64>,
    /// Where it looked, plan frame.
    pub heading_rad: Option<f64>,
    /// Who held the sticks; empty for nobody.
    pub holder: String,
}

/// A report in a list.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReportLine {
    /// Number.
    pub id: i64,
    /// Drone.
    pub drone: String,
    /// Take-off, Unix milliseconds.
    pub started_ms: u64,
    /// Landing, Unix milliseconds.
    pub landed_ms: u64,
    /// How it ended.
    pub outcome: String,
    /// Share of what was to be seen, 0..1.
    pub coverage: f64,
}

const LIST: &str = "SELECT id, drone, started_ms, landed_ms, outcome, coverage FROM reports";
/// Reports in one list.
const MOST: u32 = 500;

fn line(row: &Row<'_>) -> rusqlite::Result<ReportLine> {
    Ok(ReportLine {
        id: row.get(0)?,
        drone: row.get(1)?,
        started_ms: row.get::<_, i64>(2)?.max(0) as u64,
        landed_ms: row.get::<_, i64>(3)?.max(0) as u64,
        outcome: row.get(4)?,
        coverage: row.get(5)?,
    })
}

impl Store {
    /// Keeps a report, `report` being its JSON; returns its number.
    ///
    /// # Errors
    /// SQLite's. So are those of all the others here.
    pub async fn keep_report(&self, about: ReportLine, report: String) -> Result<i64, StoreError> {
        self.run(move |connection| {
            connection.execute(
                "INSERT INTO reports (drone, started_ms, landed_ms, outcome, coverage, report)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                params![
                    about.drone,
                    about.started_ms as i64,
                    about.landed_ms as i64,
                    about.outcome,
                    about.coverage,
                    report
                ],
            )?;
            Ok(connection.last_insert_rowid())
        })
        .await
    }

    /// The newest reports, of one drone or of all.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn reports(&self, drone: Option<String>) -> Result<Vec<ReportLine>, StoreError> {
        self.run(move |connection| {
            connection
                .prepare(&format!(
                    "{LIST} WHERE ?1 IS NULL OR drone = ?1 ORDER BY landed_ms DESC, id DESC LIMIT {MOST}"
                ))?
                .query_map([drone], line)?
                .collect()
        })
        .await
    }

    /// One report: its line and its JSON.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn report(&self, id: i64) -> Result<Option<(ReportLine, String)>, StoreError> {
        self.run(move |connection| {
            connection
                .query_row(
                    "SELECT id, drone, started_ms, landed_ms, outcome, coverage, report FROM reports WHERE id = ?1",
                    [id],
                    |row| Ok((line(row)?, row.get(6)?)),
                )
                .optional()
        })
        .await
    }

    /// Keeps an incident; returns its number.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn keep_incident(&self, incident: Incident) -> Result<i64, StoreError> {
        self.run(move |connection| {
            connection.execute(
                "INSERT INTO incidents (time_ms, drone, account, text, x_m, y_m, heading_rad, holder)
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                params![
                    incident.time_ms as i64,
                    incident.drone,
                    incident.account,
                    incident.text,
                    incident.x_m,
                    incident.y_m,
                    incident.heading_rad,
                    incident.holder
                ],
            )?;
            Ok(connection.last_insert_rowid())
        })
        .await
    }

    /// The newest incidents of a drone.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn incidents(&self, drone: String) -> Result<Vec<Incident>, StoreError> {
        self.run(move |connection| {
            connection
                .prepare(&format!(
                    "SELECT id, time_ms, drone, account, text, x_m, y_m, heading_rad, holder
                     FROM incidents WHERE drone = ?1 ORDER BY time_ms DESC, id DESC LIMIT {MOST}"
                ))?
                .query_map([drone], |row| {
                    Ok(Incident {
                        id: row.get(0)?,
                        time_ms: row.get::<_, i64>(1)?.max(0) as u64,
                        drone: row.get(2)?,
                        account: row.get(3)?,
                        text: row.get(4)?,
                        x_m: row.get(5)?,
                        y_m: row.get(6)?,
                        heading_rad: row.get(7)?,
                        holder: row.get(8)?,
                    })
                })?
                .collect()
        })
        .await
    }

    /// Remembers that a drone was there.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn drone_seen(&self, name: String, now_ms: u64) -> Result<(), StoreError> {
        self.run(move |connection| {
            connection
                .execute("INSERT OR REPLACE INTO drones VALUES (?1, ?2)", params![name, now_ms as i64])
                .map(|_| ())
        })
        .await
    }

    /// Drones that were ever there.
    ///
    /// # Errors
    /// SQLite's.
    pub async fn drones_seen(&self) -> Result<Vec<String>, StoreError> {
        self.run(|connection| {
            connection
                .prepare("SELECT name FROM drones ORDER BY name")?
                .query_map([], |row| row.get(0))?
                .collect()
        })
        .await
    }
}
