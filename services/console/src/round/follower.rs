//! From messages to events and reports.

use super::report::{Event, Report, Room, Span};
use super::views::{PatrolView, PilotView, Place, PoseView, RoomView};
use crate::store::Incident;
use ipc_types::{FailsafeAction, FailsafeCause, PatrolState, Phase, RoomState};

/// On the pad: the pad's own width and what a landing strays.
const ON_PAD_M: f64 = 0.5;
/// After the landing the route's last word is waited for, milliseconds: it comes twice a second.
const LAST_WORD_MS: u64 = 3_000;
/// A drone that has been silent for so long in the middle of a round is written off, milliseconds.
const GIVEN_UP_MS: u64 = 600_000;
/// Entries of each list in a report.
const MOST: usize = 256;

/// What came of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// A line for the event log.
    Event(Event),
    /// A round is over.
    Report(Box<Report>),
}

#[derive(Clone, Debug)]
struct Round {
    report: Report,
    flew: bool,
    landed_ms: Option<u64>,
    silent_since_ms: Option<u64>,
    pad: Option<(f64, f64)>,
}

/// Follows one drone.
#[derive(Clone, Debug)]
pub struct Follower {
    drone: String,
    phase: Option<Phase>,
    cause: FailsafeCause,
    place: Option<Place>,
    holder: String,
    /// Of the round that was reported last: it is not reported again.
    reported_ns: u64,
    round: Option<Round>,
}

fn push<T>(list: &mut Vec<T>, item: T) {
    if list.len() < MOST {
        list.push(item);
    }
}

fn end_last(list: &mut [Span], now_ms: u64) {
    if let Some(last) = list.last_mut() {
        last.ended_ms.get_or_insert(now_ms);
    }
}

impl Follower {
    /// Of a drone of which nothing is known.
    #[must_use]
    pub fn new(drone: &str) -> Self {
        Self {
            drone: drone.to_owned(),
            phase: None,
            cause: FailsafeCause::None,
            place: None,
            holder: String::new(),
            reported_ns: 0,
            round: None,
        }
    }

    /// Where the drone says that it is; `None` while it does not know.
    #[must_use]
    pub fn place(&self) -> Option<Place> {
        self.place
    }

    /// Whether the drone is off the ground, as far as it has said.
    #[must_use]
    pub fn flies(&self) -> bool {
        self.phase.is_some_and(|phase| !matches!(phase, Phase::Grounded | Phase::Arming))
    }

    /// Who holds the sticks; empty for nobody.
    #[must_use]
    pub fn holder(&self) -> &str {
        &self.holder
    }

    /// A `localization/pose`.
    pub fn pose(&mut self, view: PoseView) {
        self.place = match (view.x_m, view.y_m, view.heading_rad, view.searching) {
            (Some(x_m), Some(y_m), Some(heading_rad), 0) => Some(Place { x_m, y_m, heading_rad }),
            _ => None,
        };
    }

    /// A `pilot/state`.
    pub fn pilot(&mut self, view: &PilotView, now_ms: u64) -> Vec<News> {
        let mut news = Vec::new();
        if let Some(cause) = FailsafeCause::from_code(view.cause).filter(|cause| *cause != self.cause) {
            self.failsafe(cause, FailsafeAction::from_code(view.action), now_ms, &mut news);
        }
        if view.holder != self.holder {
            self.holder.clone_from(&view.holder);
            if let Some(round) = &mut self.round {
                end_last(&mut round.report.flown_by, now_ms);
                if !view.holder.is_empty() {
                    let text = view.holder.clone();
                    push(
                        &mut round.report.flown_by,
                        Span { time_ms: now_ms, ended_ms: None, text, action: "" },
                    );
                }
            }
        }
        let before = self.phase;
        if let Some(phase) = Phase::from_code(view.phase).filter(|phase| Some(*phase) != before) {
            // The first that is heard is no change.
            if before.is_some() {
                news.push(News::Event(Event::new(now_ms, "phase", phase.word())));
            }
            self.phase = Some(phase);
            self.landed(before, phase, now_ms);
        }
        news
    }

    fn failsafe(
        &mut self,
        cause: FailsafeCause,
        action: Option<FailsafeAction>,
        now_ms: u64,
        news: &mut Vec<News>,
    ) {
        let action = action.unwrap_or(FailsafeAction::None).word();
        self.cause = cause;
        let mut event = Event::new(now_ms, "failsafe", cause.word());
        event.verb = action.to_owned();
        news.push(News::Event(event));
        if let Some(round) = &mut self.round {
            end_last(&mut round.report.failsafes, now_ms);
            if cause != FailsafeCause::None {
                let span = Span { time_ms: now_ms, ended_ms: None, text: cause.word().to_owned(), action };
                push(&mut round.report.failsafes, span);
            }
        }
    }

    fn landed(&mut self, before: Option<Phase>, phase: Phase, now_ms: u64) {
        let place = self.place;
        let Some(round) = &mut self.round else { return };
        if phase != Phase::Grounded {
            round.landed_ms = None;
            round.flew |= phase != Phase::Arming;
            if matches!(phase, Phase::EmergencyLanding) {
                round.report.outcome = "emergency_landing";
            } else if matches!(phase, Phase::Cut) {
                round.report.outcome = "cut";
            }
        } else if round.flew {
            round.landed_ms = Some(now_ms);
            if !matches!(before, Some(Phase::EmergencyLanding | Phase::Cut)) {
                let near = place
                    .zip(round.pad)
                    .is_some_and(|(place, (x_m, y_m))| (place.x_m - x_m).hypot(place.y_m - y_m) <= ON_PAD_M);
                round.report.outcome = if near { "landed_on_pad" } else { "landed_elsewhere" };
            }
        }
    }

    /// A `navigation/patrol`.
    pub fn patrol(&mut self, view: &PatrolView, now_ms: u64) -> Vec<News> {
        let mut news = Vec::new();
        let flying = PatrolState::from_code(view.state) == Some(PatrolState::Flying);
        if flying && self.round.is_none() && view.started_ns != self.reported_ns {
            self.reported_ns = view.started_ns;
            self.begin(now_ms);
            news.push(News::Event(Event::new(now_ms, "round", "started")));
        }
        let Some(round) = &mut self.round else { return news };
        // Another round than this one's, once this one has landed, is no word on it.
        if view.started_ns == self.reported_ns {
            round.pad = view.pad_x_m.zip(view.pad_y_m).or(round.pad);
            round.report.coverage = view.coverage.unwrap_or(0.0).clamp(0.0, 1.0);
            round.report.text.clone_from(&view.text);
            rooms(&mut round.report.rooms, &view.rooms, now_ms);
        }
        if round.landed_ms.is_some() {
            news.extend(self.finish(now_ms));
        }
        news
    }

    fn begin(&mut self, now_ms: u64) {
        let airborne = self.flies();
        let mut report = Report {
            drone: self.drone.clone(),
            started_ms: now_ms,
            landed_ms: now_ms,
            outcome: "lost_contact",
            coverage: 0.0,
            text: String::new(),
            rooms: Vec::new(),
            failsafes: Vec::new(),
            flown_by: Vec::new(),
            silences: Vec::new(),
            orders: Vec::new(),
            incidents: Vec::new(),
        };
        if !self.holder.is_empty() {
            let text = self.holder.clone();
            report.flown_by.push(Span { time_ms: now_ms, ended_ms: None, text, action: "" });
        }
        self.round =
            Some(Round { report, flew: airborne, landed_ms: None, silent_since_ms: None, pad: None });
    }

    fn finish(&mut self, now_ms: u64) -> Option<News> {
        let round = self.round.take()?;
        let mut report = round.report;
        report.landed_ms = round.landed_ms.unwrap_or(now_ms);
        for list in [&mut report.failsafes, &mut report.flown_by, &mut report.silences] {
            end_last(list, report.landed_ms);
        }
        Some(News::Report(Box::new(report)))
    }

    /// The drone has been found or lost.
    pub fn link(&mut self, alive: bool, now_ms: u64) -> Vec<News> {
        if let Some(round) = &mut self.round {
            if alive {
                round.silent_since_ms = None;
                end_last(&mut round.report.silences, now_ms);
            } else if round.silent_since_ms.is_none() {
                round.silent_since_ms = Some(now_ms);
                let text = "connection lost".to_owned();
                push(&mut round.report.silences, Span { time_ms: now_ms, ended_ms: None, text, action: "" });
            }
        }
        vec![News::Event(Event::new(
            now_ms,
            "link",
            if alive { "connection found" } else { "connection lost" },
        ))]
    }

    /// Time passes.
    pub fn tick(&mut self, now_ms: u64) -> Vec<News> {
        let Some(round) = &mut self.round else { return Vec::new() };
        let landed = round.landed_ms.is_some_and(|landed| now_ms >= landed.saturating_add(LAST_WORD_MS));
        let given_up = round.silent_since_ms.is_some_and(|since| now_ms >= since.saturating_add(GIVEN_UP_MS));
        if given_up && round.landed_ms.is_none() {
            round.report.outcome = "lost_contact";
            round.landed_ms = round.silent_since_ms;
        }
        if landed || given_up { self.finish(now_ms).into_iter().collect() } else { Vec::new() }
    }

    /// An order was answered.
    pub fn order(&mut self, event: &Event) {
        if let Some(round) = &mut self.round {
            push(&mut round.report.orders, event.clone());
        }
    }

    /// An incident was marked.
    pub fn incident(&mut self, incident: &Incident) {
        if let Some(round) = &mut self.round {
            push(&mut round.report.incidents, incident.clone());
        }
    }
}

fn rooms(known: &mut Vec<Room>, views: &[RoomView], now_ms: u64) {
    for (at, view) in views.iter().take(ipc_types::MAX_ROOMS).enumerate() {
        let Some(state) = RoomState::from_code(view.state) else { continue };
        if known.len() <= at {
            known.push(Room {
                name: String::new(),
                state: RoomState::Waiting.word(),
                seen: 0.0,
                reason: String::new(),
                entered_ms: None,
                left_ms: None,
            });
        }
        let Some(room) = known.get_mut(at) else { continue };
        room.name.clone_from(&view.name);
        room.reason.clone_from(&view.reason);
        room.seen = view.seen.unwrap_or(0.0).clamp(0.0, 1.0);
        room.state = state.word();
        if matches!(state, RoomState::Entered | RoomState::Seen | RoomState::PartlySeen) {
            room.entered_ms.get_or_insert(now_ms);
        }
        if matches!(state, RoomState::Seen | RoomState::PartlySeen | RoomState::Skipped) {
            room.left_ms.get_or_insert(now_ms);
        } else {
            room.left_ms = None;
        }
    }
    known.truncate(views.len());
}
