//! Finding the place on the plan from nothing: all places and headings against what was heard on the last metres.
//!
//! A particle filter started everywhere needs a particle near the truth; at a place and a heading for every 25 cm and
//! 36 degrees of a floor of 300 m² that is already 50 000, and most of them die in the first second by what the
//! furniture says. Here the readings of a while are kept with where they were made ([`Trail`]), and every place of a
//! lattice is asked, with every heading, how well it explains them *together* ([`Tables`]). The best are improved
//! one by one, the like ones taken together, and what is left are the competing [`Hypothesis`]es with their weights: a
//! tempered posterior (equations 3 and 4 of the thesis, over a lattice instead of a random draw).
//!
//! The work is done in slices of so many look-ups, so that it never delays a setpoint. Nothing is allocated after
//! [`Search::new`].

mod lattice;
mod modes;
mod tables;
mod trail;

pub use lattice::Lattice;
pub use trail::{MAX_HEARD, Trail, TrailPose};

use crate::SonarConfig;
use crate::map::RangeMap;
use core::cmp::{Ordering, Reverse};
use core::f32::consts::TAU;
use modes::Mode;
use std::collections::BinaryHeap;
use std::sync::Arc;
use tables::{Columns, Tables};
use trail::Heard;

/// Headings a turn.
const TURNS: usize = 72;
/// Half a step of the lattice in both directions, and half a step of the headings: what the nearest lattice point is off by.
const SLACK_M: f32 = 0.11;
const SLACK_RAD: f32 = 0.03;
/// The way between the readings is off by so much, metres, and the compass along it.
const WAY_M: f32 = 0.04;
const WAY_RAD: f32 = 0.02;
/// Readings that the lattice is asked about: half of those kept, every second one.
const COARSE: usize = 64;
/// The first of them are asked first, and where they speak against a place by so much more than against the best one,
/// the others are not asked: among clutter a third of all readings is wrong at the true place too, and each counts
/// for 4 at most.
const GLANCE: usize = 20;
const HOPELESS: f32 = 24.0;
/// Lattice points that are kept: a good place takes some thirty of them.
const CANDIDATES: usize = 2_048;
/// Places that are improved.
const MODES: usize = 48;
/// A place that is believed is off by so much at most: what the set and the way err by.
const LEASH_M: f32 = 0.25;
/// Steps in which a place is improved: metres and radians.
const FINE: [(f32, f32); 3] = [(0.1, 0.04), (0.05, 0.02), (0.02, 0.01)];
/// Rounds at most with each of them.
const ROUNDS: usize = 6;
/// A place where the drone may be: where it was in the trail's frame when the search began, on the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hypothesis {
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// Heading on the plan minus heading in the trail's frame, radians, -π..=π.
    pub turn_rad: f32,
    /// Its share of the belief; those of all hypotheses sum to one.
    pub weight: f32,
    /// Share of the readings that it explains.
    pub explained: f32,
}

/// Which headings are looked at: the frame's turn against the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turns {
    /// Middle, radians.
    pub middle_rad: f32,
    /// To either side, radians; π and more: all.
    pub half_rad: f32,
}

impl Turns {
    /// All of them.
    pub const ALL: Self = Self { middle_rad: 0.0, half_rad: core::f32::consts::PI };
}

/// A lattice point and heading that explains well.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    score: f32,
    place: u32,
    turn: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    /// By score; between equal ones the order of the lattice decides.
    fn cmp(&self, other: &Self) -> Ordering {
        self.score.total_cmp(&other.score).then(other.place.cmp(&self.place)).then(other.turn.cmp(&self.turn))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Idle,
    /// Next place of the lattice.
    Lattice(usize),
    /// Next mode.
    Improve(usize),
    Done,
}

/// The search: the lattice of a plan, and room to work in.
pub struct Search {
    sonar: SonarConfig,
    lattice: Arc<Lattice>,
    stage: Stage,
    /// The readings of the search that runs, the coarse ones first.
    heard: Vec<Heard>,
    coarse: usize,
    /// The best score of the first readings so far.
    glanced: f32,
    origin: TrailPose,
    columns: Columns,
    turned: Vec<Columns>,
    /// Angle of each entry of `turned`.
    turns: Vec<f32>,
    wide: Tables,
    fine: Tables,
    best: BinaryHeap<Reverse<Candidate>>,
    sorted: Vec<Candidate>,
    modes: Vec<Mode>,
    hypotheses: Vec<Hypothesis>,
    suspect: Option<Mode>,
    weighed: Option<Hypothesis>,
}

impl Search {
    /// A search over `lattice`.
    #[must_use]
    pub fn new(lattice: Arc<Lattice>, sonar: &SonarConfig) -> Self {
        Self {
            sonar: sonar.clone(),
            lattice,
            stage: Stage::Idle,
            heard: Vec::with_capacity(MAX_HEARD),
            coarse: 0,
            glanced: f32::NEG_INFINITY,
            origin: TrailPose::default(),
            columns: Columns::default(),
            turned: vec![Columns::default(); TURNS],
            turns: Vec::with_capacity(TURNS),
            wide: Tables::new(sonar.max_range),
            fine: Tables::new(sonar.max_range),
            best: BinaryHeap::with_capacity(CANDIDATES + 1),
            sorted: Vec::with_capacity(CANDIDATES + 1),
            modes: Vec::with_capacity(MODES + 1),
            hypotheses: Vec::with_capacity(MODES + 1),
            suspect: None,
            weighed: None,
        }
    }

    /// Whether a search runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        matches!(self.stage, Stage::Lattice(_) | Stage::Improve(_))
    }

    /// Where the drone was in the trail's frame when the last search began: what the hypotheses are about.
    #[must_use]
    pub fn origin(&self) -> TrailPose {
        self.origin
    }

    /// What the last search found, the likeliest first; empty before the first one is done.
    #[must_use]
    pub fn hypotheses(&self) -> &[Hypothesis] {
        &self.hypotheses
    }

    /// What the last search says of the place that it was given as a suspect, moved by [`LEASH_M`] at most: the readings
    /// between two places must not carry the one over to the other.
    #[must_use]
    pub fn suspect(&self) -> Option<&Hypothesis> {
        self.weighed.as_ref()
    }

    /// Begins a search: where is the drone that heard `trail` and is at `here` in its frame? `suspect`: a place and turn
    /// that is improved and weighed in any case.
    pub fn begin(&mut self, trail: &Trail, here: &TrailPose, turns: Turns, suspect: Option<(f32, f32, f32)>) {
        self.origin = *here;
        self.heard.clear();
        // Every second one first: those are what the lattice is asked about.
        let heard = trail.heard();
        self.heard.extend(heard.iter().rev().step_by(2));
        self.coarse = self.heard.len().min(COARSE);
        self.heard.extend(heard.iter().rev().skip(1).step_by(2));
        self.columns.around(&self.heard, here.x, here.y);
        self.turns.clear();
        let step = TAU / TURNS as f32;
        let half = ((turns.half_rad / step).ceil().max(0.0) as usize).min(TURNS / 2);
        let count = (2 * half + 1).min(TURNS);
        for k in 0..count {
            let angle = turns.middle_rad + (k as f32 - half as f32) * step;
            self.turns.push(angle);
            self.turned[k].turn(&self.columns, self.heard.len(), angle);
        }
        self.wide.prepare(&self.sonar, SLACK_M.hypot(WAY_M), SLACK_RAD.hypot(WAY_RAD), &self.heard);
        self.fine.prepare(&self.sonar, WAY_M, WAY_RAD, &self.heard);
        self.best.clear();
        self.glanced = f32::NEG_INFINITY;
        self.modes.clear();
        self.suspect = suspect.map(|(x, y, turn_rad)| Mode { x, y, turn_rad, score: 0.0, explained: 0.0 });
        self.modes.extend(self.suspect);
        self.stage = if self.heard.is_empty() { Stage::Idle } else { Stage::Lattice(0) };
    }

    /// Gives the search that runs up.
    pub fn cancel(&mut self) {
        self.stage = Stage::Idle;
    }

    /// Goes on for about `look_ups` questions to the map; `true` in the call that ends the search. Places for which
    /// `allowed` says no are passed over.
    pub fn step<M: RangeMap>(
        &mut self,
        map: &M,
        look_ups: usize,
        allowed: impl Fn(f32, f32) -> bool,
    ) -> bool {
        let mut left = look_ups as isize;
        while left > 0 {
            match self.stage {
                Stage::Idle | Stage::Done => return false,
                Stage::Lattice(next) => {
                    let Some((x, y)) = self.lattice.places().get(next).copied() else {
                        self.choose();
                        self.stage = Stage::Improve(0);
                        continue;
                    };
                    if allowed(x, y) {
                        left -= self.ask(map, next, x, y) as isize;
                    }
                    self.stage = Stage::Lattice(next + 1);
                }
                Stage::Improve(next) => {
                    let Some(mode) = self.modes.get(next).copied() else {
                        self.weighed =
                            modes::weigh(&mut self.modes, self.suspect.as_ref(), &mut self.hypotheses);
                        self.stage = Stage::Done;
                        return true;
                    };
                    if let Some(suspect) = self.suspect.filter(|_| next == 0) {
                        let (suspect, asked) = self.improve(map, suspect, LEASH_M);
                        self.suspect = Some(suspect);
                        left -= (asked * self.heard.len()) as isize;
                    }
                    let (improved, asked) = self.improve(map, mode, f32::INFINITY);
                    self.modes[next] = improved;
                    left -= (asked * self.heard.len()) as isize;
                    self.stage = Stage::Improve(next + 1);
                }
            }
        }
        false
    }

    /// One place of the lattice, with all turns; says how many questions that took.
    fn ask<M: RangeMap>(&mut self, map: &M, place: usize, x: f32, y: f32) -> usize {
        let glance = self.coarse.min(GLANCE);
        let mut asked = 0;
        for turn in 0..self.turns.len() {
            let turned = &self.turned[turn];
            let glanced = self.wide.score(map, (x, y), turned, 0..glance);
            asked += glance;
            self.glanced = self.glanced.max(glanced);
            if glanced < self.glanced - HOPELESS {
                continue;
            }
            let score = glanced + self.wide.score(map, (x, y), turned, glance..self.coarse);
            asked += self.coarse - glance;
            let candidate = Candidate { score, place: place as u32, turn: turn as u32 };
            if self.best.len() < CANDIDATES {
                self.best.push(Reverse(candidate));
            } else if self.best.peek().is_some_and(|worst| candidate > worst.0) {
                self.best.pop();
                self.best.push(Reverse(candidate));
            }
        }
        asked
    }

    /// The best lattice points that are apart from each other.
    fn choose(&mut self) {
        self.sorted.clear();
        self.sorted.extend(self.best.drain().map(|candidate| candidate.0));
        self.sorted.sort_unstable_by(|a, b| b.cmp(a));
        for candidate in &self.sorted {
            if self.modes.len() >= MODES {
                break;
            }
            let (x, y) = self.lattice.places()[candidate.place as usize];
            let mode = Mode {
                x,
                y,
                turn_rad: self.turns[candidate.turn as usize],
                score: candidate.score,
                explained: 0.0,
            };
            if self.modes.iter().all(|other| other.is_apart(&mode)) {
                self.modes.push(mode);
            }
        }
    }

    /// Moves a mode uphill, no farther than on a leash; says how many places were asked.
    fn improve<M: RangeMap>(&mut self, map: &M, from: Mode, leash_m: f32) -> (Mode, usize) {
        let count = self.heard.len();
        let mut asked = 0;
        let mut turned = Columns::default();
        let mut mode = from;
        let mut score = |mode: &Mode, asked: &mut usize| {
            *asked += 1;
            turned.turn(&self.columns, count, mode.turn_rad);
            self.fine.score(map, (mode.x, mode.y), &turned, 0..count)
        };
        mode.score = score(&mode, &mut asked);
        for (step_m, step_rad) in FINE {
            for _ in 0..ROUNDS {
                let before = mode.score;
                for (dx, dy, da) in [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)] {
                    for sign in [1.0, -1.0] {
                        let mut next = Mode {
                            x: mode.x + sign * dx * step_m,
                            y: mode.y + sign * dy * step_m,
                            turn_rad: mode.turn_rad + sign * da * step_rad,
                            ..mode
                        };
                        if (next.x - from.x).hypot(next.y - from.y) > leash_m {
                            continue;
                        }
                        next.score = score(&next, &mut asked);
                        if next.score > mode.score {
                            mode = next;
                            break;
                        }
                    }
                }
                if mode.score <= before {
                    break;
                }
            }
        }
        score(&mode, &mut asked);
        mode.explained = self.fine.explained(&self.sonar, &self.heard);
        (mode, asked)
    }
}
