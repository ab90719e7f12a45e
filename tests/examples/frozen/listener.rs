//! Hears every state of the pilot, and notes when the sticks changed hands.

use crate::rig::Rig;
use ipc_types::{PilotState, SticksState};
use runtime::{Tool, monotonic_ns};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Most changes that are kept: each trial makes some ten.
const MOST_NOTES: usize = 100_000;

/// Milliseconds since 1970, as browsers count them.
pub(crate) fn clock_ms() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64() * 1e3
}

/// What one state said, on the clock of browsers.
#[derive(Clone, Copy)]
struct Note {
    at_ms: f64,
    sticks: SticksState,
    /// When the holder's newest input was made; NaN without a holder.
    input_ms: f64,
}

/// One time at which a holder fell silent, milliseconds since 1970.
pub(crate) struct Silence {
    /// When the newest input that was taken was made.
    pub(crate) last_input_ms: f64,
    /// When the pilot first said that the sticks are not followed.
    pub(crate) hovers_ms: f64,
    /// When it first said that nobody holds them.
    pub(crate) free_ms: f64,
}

/// Listens on a thread of its own for as long as the program runs.
#[derive(Clone, Default)]
pub(crate) struct Listener(Arc<Mutex<Vec<Note>>>);

impl Listener {
    /// Begins to listen to a running system.
    pub(crate) fn begin(rig: &Rig) -> Self {
        let (manifest, run_dir) = rig.manifest();
        let listener = Self::default();
        let heard = listener.clone();
        std::thread::spawn(move || {
            let mut tool = Tool::join("cli", manifest, &run_dir).unwrap();
            let mut states = tool.ports.input::<PilotState>().unwrap();
            loop {
                tool.tick();
                let ahead_ms = clock_ms() - monotonic_ns() as f64 * 1e-6;
                while let Some(state) = states.receive() {
                    heard.note(&state, ahead_ms);
                }
                std::thread::sleep(Duration::from_millis(5));
            }
        });
        listener
    }

    fn note(&self, state: &PilotState, ahead_ms: f64) {
        let Some(sticks) = SticksState::from_code(state.sticks) else { return };
        let at_ms = state.header.stamp_ns as f64 * 1e-6 + ahead_ms;
        let mut notes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if notes.len() < MOST_NOTES {
            notes.push(Note { at_ms, sticks, input_ms: at_ms - f64::from(state.sticks_age_ms) });
        }
    }

    /// The silence that began after `since_ms`, once it has ended the lease.
    pub(crate) fn silence(&self, since_ms: f64) -> Option<Silence> {
        let notes = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut since = notes.iter().filter(|note| note.at_ms >= since_ms);
        let hovers = since.find(|note| note.sticks != SticksState::Following)?;
        let free =
            notes.iter().find(|note| note.at_ms >= hovers.at_ms && note.sticks == SticksState::Free)?;
        // A state that says who is silent says how old his newest input is; one that says nobody's cannot.
        let last = notes.iter().rev().find(|note| note.at_ms < free.at_ms && note.input_ms.is_finite())?;
        Some(Silence { last_input_ms: last.input_ms, hovers_ms: hovers.at_ms, free_ms: free.at_ms })
    }
}
