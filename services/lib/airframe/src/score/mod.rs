//! Scoring a flight by the truth alone: never by what the drone believes (DESIGN 5).

mod calibration;
mod coverage;
mod honesty;
mod report;
mod sight;
#[cfg(test)]
mod tests;

pub use calibration::calibration_svg;
pub use coverage::{Coverage, ROOM_M, SEEN_M};
pub use honesty::{Class, EDGES, Honesty, SURE, WRONG_M};
pub use report::{
    Claim, CoverageTotal, ErrorColumn, FirstClaims, FlightReport, HeadingColumn, Outcome, Report, Totals,
    quantile,
};

use crate::world::World;
use honesty::Confessor;

/// A landing counts as on the pad within this distance of its centre, metres.
pub const PAD_RADIUS_M: f32 = 0.35;
/// An estimate farther from the truth than this is lost, metres (the limit of sigma in DESIGN 4).
pub const LOST_M: f32 = 0.5;
/// A first fix must stay good for so long, seconds: a mean of scattered guesses may pass the truth by chance.
const FIX_HOLDS_S: f64 = 1.0;
/// From this P(lost) down the drone says that it knows its place: autonomy begins (DESIGN 4).
const CLAIMED: f32 = 0.05;
/// Errors are kept at this period, seconds: 20 Hz poses bring nothing more.
const ERROR_PERIOD_S: f64 = 0.05;

/// One look at the truth, and at what the drone said at that time.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Simulated seconds.
    pub time_s: f64,
    /// World frame.
    pub x: f32,
    /// World frame.
    pub y: f32,
    /// World frame, radians.
    pub yaw: f32,
    /// Armed and off the ground.
    pub airborne: bool,
    /// The newest published estimate (x, y, heading); `None` before the first.
    pub estimate: Option<(f32, f32, f32)>,
    /// Probability that it is wrong, as the drone says; `None` before the first and while it searches for its place from
    /// nothing: then it says that it knows none.
    pub p_lost: Option<f32>,
}

/// How a flight ended, by the simulation's truth.
#[derive(Clone, Debug)]
pub struct Ending {
    /// Seed of the flight.
    pub seed: u64,
    /// Contacts that the simulation counted.
    pub contacts: u32,
    /// Smallest clearance in flight, metres.
    pub min_clearance_m: f32,
    /// Standing on the ground, disarmed, after having flown.
    pub landed: bool,
    /// Where the flight ended, world frame.
    pub place: (f32, f32),
    /// Failsafes that acted, in their order.
    pub failsafes: Vec<String>,
    /// What the patrol skipped and why.
    pub skipped: Vec<String>,
    /// Seconds that the world stood still for, because the machine stalled.
    pub stalled_s: f32,
    /// Hash over the messages of the flight.
    pub digest: u64,
}

/// Follows one flight.
#[derive(Clone, Debug)]
pub struct Scorer {
    coverage: Coverage,
    errors: Vec<f32>,
    heading_errors: Vec<f32>,
    last_error_s: f64,
    start_s: Option<f64>,
    end_s: f64,
    distance: f64,
    last_place: Option<(f32, f32)>,
    good_since: Option<f64>,
    first_fix_s: Option<f64>,
    claim: Option<Claim>,
    lost_s: f64,
    last_s: Option<f64>,
    confessor: Confessor,
}

/// A scored flight: the report, and the columns that totals are pooled from.
#[derive(Clone, Debug)]
pub struct FlightScore {
    /// What is written down.
    pub report: FlightReport,
    /// Position errors over time while airborne, metres.
    pub errors: Vec<f32>,
}

impl Scorer {
    /// A scorer for a disc of this radius in a world as it is now.
    #[must_use]
    pub fn new(world: &World, radius: f32) -> Self {
        Self {
            coverage: Coverage::new(world, radius),
            errors: Vec::new(),
            heading_errors: Vec::new(),
            last_error_s: f64::NEG_INFINITY,
            start_s: None,
            end_s: 0.0,
            distance: 0.0,
            last_place: None,
            good_since: None,
            first_fix_s: None,
            claim: None,
            lost_s: 0.0,
            last_s: None,
            confessor: Confessor::default(),
        }
    }

    /// Takes one look; call at 20 Hz or faster, with the time going on.
    pub fn observe(&mut self, world: &World, seen: &Observation) {
        let dt = self.last_s.map_or(0.0, |last| (seen.time_s - last).max(0.0));
        self.last_s = Some(seen.time_s);
        let error = seen
            .estimate
            .map(|(x, y, heading)| ((x - seen.x).hypot(y - seen.y), wrapped(heading - seen.yaw).abs()));
        self.follow_fix(seen.time_s, error.map(|e| e.0));
        if !seen.airborne {
            self.last_place = None;
            return;
        }
        self.start_s.get_or_insert(seen.time_s);
        self.end_s = seen.time_s;
        self.coverage.visit(world, seen.x, seen.y);
        if let Some((x, y)) = self.last_place {
            self.distance += f64::from((seen.x - x).hypot(seen.y - y));
        }
        self.last_place = Some((seen.x, seen.y));
        if let (Some((metres, _)), Some(p_lost)) = (error, seen.p_lost) {
            self.confessor.hear(seen.time_s, dt, metres, p_lost);
            if self.claim.is_none() && p_lost < CLAIMED {
                let since = seen.time_s - self.start_s.unwrap_or(seen.time_s);
                self.claim =
                    Some(Claim { time_s: report::rounded(since as f32), error_m: report::rounded(metres) });
            }
        }
        if self.first_fix_s.is_none() {
            return;
        }
        let Some((metres, radians)) = error else {
            self.lost_s += dt;
            return;
        };
        if metres.is_nan() || metres > LOST_M {
            self.lost_s += dt;
        }
        if metres.is_finite() && seen.time_s - self.last_error_s >= ERROR_PERIOD_S - 1e-6 {
            self.last_error_s = seen.time_s;
            self.errors.push(metres);
            self.heading_errors.push(radians);
        }
    }

    fn follow_fix(&mut self, now_s: f64, error: Option<f32>) {
        if self.first_fix_s.is_some() {
            return;
        }
        if !error.is_some_and(|metres| metres <= LOST_M) {
            self.good_since = None;
            return;
        }
        let since = *self.good_since.get_or_insert(now_s);
        if now_s - since >= FIX_HOLDS_S {
            // What was known before the take-off was known at once.
            self.first_fix_s = Some(self.start_s.map_or(0.0, |start| (since - start).max(0.0)));
        }
    }

    /// What was seen so far.
    #[must_use]
    pub fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// The report of the flight.
    #[must_use]
    pub fn finish(mut self, world: &World, ending: Ending) -> FlightScore {
        let pad = world.pad();
        let off_pad = (ending.place.0 - pad.x).hypot(ending.place.1 - pad.y);
        let outcome = if ending.contacts > 0 {
            Outcome::Contact
        } else if !ending.landed {
            Outcome::Timeout
        } else if off_pad <= PAD_RADIUS_M {
            Outcome::LandedOnPad
        } else {
            Outcome::LandedElsewhere
        };
        let errors = self.errors.clone();
        let report = FlightReport {
            seed: ending.seed,
            outcome,
            contacts: ending.contacts,
            min_clearance_m: report::rounded(ending.min_clearance_m),
            time_s: report::rounded((self.end_s - self.start_s.unwrap_or(self.end_s)) as f32),
            distance_m: report::rounded(self.distance as f32),
            coverage: report::rounded(self.coverage.fraction()),
            loc_error_m: ErrorColumn::of(&mut self.errors),
            heading_error_rad: HeadingColumn::of(&mut self.heading_errors),
            first_fix_s: self.first_fix_s.map(|s| report::rounded(s as f32)),
            first_claim: self.claim,
            lost_s: report::rounded(self.lost_s as f32),
            failsafes: ending.failsafes,
            skipped: ending.skipped,
            off_pad_m: report::rounded(off_pad),
            stalled_s: report::rounded(ending.stalled_s),
            honesty: self.confessor.finish(),
            digest: format!("{:016x}", ending.digest),
        };
        FlightScore { report, errors }
    }
}

fn wrapped(angle: f32) -> f32 {
    let turn = std::f32::consts::TAU;
    (angle + std::f32::consts::PI).rem_euclid(turn) - std::f32::consts::PI
}
