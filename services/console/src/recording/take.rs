//! One thing that is being recorded: file after file of it.

use super::files::Files;
use super::film::Film;
use super::unit::Unit;
use crate::Store;
use crate::app::Clock;
use crate::store::Recording;
use std::io;
use std::sync::Arc;
use tokio::runtime::Handle;

/// A file is no longer, nanoseconds: a key frame after it begins the next.
const LONGEST_NS: u64 = 3_600_000_000_000;
/// Nor does it hold a pause that is longer, nanoseconds.
pub(super) const LONGEST_GAP_NS: u64 = 10_000_000_000;

/// Where recordings are kept.
pub(super) struct Desk {
    pub(super) files: Files,
    pub(super) store: Store,
    pub(super) clock: Arc<dyn Clock>,
    /// To wait for the store on the recorder's own thread.
    pub(super) runtime: Handle,
}

/// Why something could not be kept: one sentence.
pub(super) type Trouble = String;

fn of_disk(error: &io::Error) -> Trouble {
    format!("the recording cannot be written: {error}")
}

/// What is being recorded.
pub(super) struct Take {
    drone: Arc<str>,
    account: String,
    incident: Option<i64>,
    film: Option<(i64, Film)>,
    follows: Option<i64>,
}

impl Take {
    pub(super) fn new(drone: &Arc<str>, account: String, incident: Option<i64>) -> Self {
        Self { drone: drone.clone(), account, incident, film: None, follows: None }
    }

    pub(super) fn account(&self) -> &str {
        &self.account
    }

    /// The file that is open: its number, and how much of it is on the disk.
    pub(super) fn open(&self) -> Option<(i64, u64)> {
        self.film.as_ref().map(|(id, film)| (*id, film.bytes()))
    }

    /// Adds a picture that was there at `time_ms` (Unix). Nothing is kept before the first key frame.
    pub(super) fn push(&mut self, desk: &Desk, unit: &Arc<Unit>, time_ms: u64) -> Result<(), Trouble> {
        let full = |film: &Film| unit.is_key() && film.length_ns() >= LONGEST_NS;
        if let Some((_, film)) = &mut self.film
            && film.takes(unit, LONGEST_GAP_NS)
            && !full(film)
        {
            return film.push(unit).map_err(|error| of_disk(&error));
        }
        if !unit.is_key() {
            return Ok(());
        }
        self.end(desk)?;
        let row = Recording {
            drone: self.drone.to_string(),
            started_ms: time_ms,
            width: unit.width,
            height: unit.height,
            account: self.account.clone(),
            incident: self.incident,
            follows: self.follows,
            ..Recording::default()
        };
        let id = desk.runtime.block_on(desk.store.begin_recording(row)).map_err(|error| error.to_string())?;
        self.follows.get_or_insert(id);
        let film = desk.files.create(id).and_then(|file| Film::begin(file, unit));
        match film {
            Ok(film) => {
                self.film = Some((id, film));
                Ok(())
            }
            Err(error) => {
                desk.nothing(id)?;
                Err(of_disk(&error))
            }
        }
    }

    /// Ends the file that is open.
    pub(super) fn end(&mut self, desk: &Desk) -> Result<(), Trouble> {
        let Some((id, film)) = self.film.take() else { return Ok(()) };
        match film.finish() {
            Ok(done) => {
                let ended = desk.store.end_recording(id, done.length_ms, done.bytes);
                desk.runtime.block_on(ended).map_err(|error| error.to_string())
            }
            Err(error) => {
                // What is whole of it is kept.
                desk.finish(id)?;
                Err(of_disk(&error))
            }
        }
    }
}

impl Desk {
    /// Finishes a file that its writer did not.
    pub(super) fn finish(&self, id: i64) -> Result<(), Trouble> {
        match self.files.edit(id).and_then(super::film::repair) {
            Ok(Some(done)) => {
                let ended = self.store.end_recording(id, done.length_ms, done.bytes);
                self.runtime.block_on(ended).map_err(|error| error.to_string())
            }
            Ok(None) => self.nothing(id),
            Err(error) if error.kind() == io::ErrorKind::NotFound => self.nothing(id),
            Err(error) => Err(of_disk(&error)),
        }
    }

    /// Nothing of it can be shown.
    fn nothing(&self, id: i64) -> Result<(), Trouble> {
        let erased = self.store.erase_recording(id, "nothing was written".to_owned(), self.clock.now_ms());
        self.runtime.block_on(erased).map_err(|error| error.to_string())?;
        self.files.remove(id).map_err(|error| of_disk(&error))
    }

    /// Finishes what an earlier start left behind, and erases files that no row speaks of any more.
    pub(super) fn tidy(&self) -> Result<(), Trouble> {
        let rows = self.runtime.block_on(self.store.every_recording()).map_err(|error| error.to_string())?;
        for row in rows.iter().filter(|row| row.ended_ms.is_none()) {
            self.finish(row.id)?;
        }
        for id in self.files.numbers().map_err(|error| of_disk(&error))? {
            if !rows.iter().any(|row| row.id == id) {
                self.files.remove(id).map_err(|error| of_disk(&error))?;
            }
        }
        Ok(())
    }
}
