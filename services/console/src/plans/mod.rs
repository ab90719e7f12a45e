//! Plans that are being made: pictures that were sent in, what is made of them, and flights in the simulator before
//! anybody flies by them.

mod drafts;
mod files;
mod picture;
mod rehearsal;
mod runner;

pub(crate) use drafts::{Drafts, Made};
pub(crate) use rehearsal::{Material, Rehearsals};

use crate::refusal::Refusal;
use axum::http::StatusCode;

impl From<floorplan::PlanError> for Refusal {
    fn from(error: floorplan::PlanError) -> Self {
        Self::bad(error.to_string())
    }
}

/// What the system says of a file that the console itself keeps.
fn disk(error: &std::io::Error) -> Refusal {
    tracing::error!("what is kept of plans: {error}");
    Refusal::new(StatusCode::INSUFFICIENT_STORAGE, format!("the console's data folder: {error}"))
}
