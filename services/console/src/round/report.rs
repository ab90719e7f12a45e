//! What is written: lines of the event log, and the report of a round.

use crate::store::Incident;
use serde::Serialize;

/// A line for the event log of the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Event {
    /// When, Unix milliseconds.
    pub time_ms: u64,
    /// `phase`, `failsafe`, `order`, `link`, `round` or `incident`.
    pub kind: &'static str,
    /// What, in the words of the messages.
    pub text: String,
    /// Whose deed it was; empty for nobody's.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub account: String,
    /// The order's verb, or what the failsafe does; empty otherwise.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub verb: String,
    /// Whether an order was accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accepted: Option<bool>,
    /// Number of the report that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub report: Option<i64>,
}

impl Event {
    /// A line without a person.
    #[must_use]
    pub fn new(time_ms: u64, kind: &'static str, text: impl Into<String>) -> Self {
        Self {
            time_ms,
            kind,
            text: text.into(),
            account: String::new(),
            verb: String::new(),
            accepted: None,
            report: None,
        }
    }
}

/// A room in a report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Room {
    /// As the plan names it.
    pub name: String,
    /// `waiting`, `entered`, `seen`, `skipped` or `partly seen`.
    pub state: &'static str,
    /// Share that was seen, 0..1.
    pub seen: f64,
    /// Why it was skipped or seen in part.
    pub reason: String,
    /// When it was entered, Unix milliseconds.
    pub entered_ms: Option<u64>,
    /// When it was done with.
    pub left_ms: Option<u64>,
}

/// Something with a beginning and an end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Span {
    /// Beginning, Unix milliseconds.
    pub time_ms: u64,
    /// End; absent: it lasted to the end of the round.
    pub ended_ms: Option<u64>,
    /// The failsafe's cause, or who flew.
    pub text: String,
    /// What the failsafe did; empty of a person.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub action: &'static str,
}

/// The report of a round.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Drone.
    pub drone: String,
    /// When the round began, Unix milliseconds.
    pub started_ms: u64,
    /// When it had landed.
    pub landed_ms: u64,
    /// `landed_on_pad`, `landed_elsewhere`, `emergency_landing`, `cut` or `lost_contact`.
    pub outcome: &'static str,
    /// Share of what was to be seen, 0..1.
    pub coverage: f64,
    /// The route's last sentence.
    pub text: String,
    /// The rooms, in the order of the round.
    pub rooms: Vec<Room>,
    /// Failsafes that acted.
    pub failsafes: Vec<Span>,
    /// Who held the sticks and when.
    pub flown_by: Vec<Span>,
    /// When the console did not hear the drone.
    pub silences: Vec<Span>,
    /// Orders that were accepted or refused.
    pub orders: Vec<Event>,
    /// What guards marked.
    pub incidents: Vec<Incident>,
}
