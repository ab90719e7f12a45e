//! The figures of flights, with the keys that DESIGN 5 promises.

use super::{FlightScore, Honesty, LOST_M};
use serde::{Deserialize, Serialize};

/// How a flight ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Disarmed on the ground within 0.35 m of the pad's centre, nothing touched.
    LandedOnPad,
    /// Disarmed on the ground somewhere else; `failsafes` says why.
    LandedElsewhere,
    /// Something was touched.
    Contact,
    /// Still flying when the time was up, or never flown.
    Timeout,
}

impl std::fmt::Display for Outcome {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::LandedOnPad => "landed on the pad",
            Self::LandedElsewhere => "landed elsewhere",
            Self::Contact => "contact",
            Self::Timeout => "timeout",
        })
    }
}

/// Position errors, metres; `null` in JSON when there were none to measure.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorColumn {
    /// Half of the time it was smaller.
    pub median: Option<f64>,
    /// 95 % of the time it was smaller.
    pub p95: Option<f64>,
    /// It was never larger.
    pub max: Option<f64>,
}

impl ErrorColumn {
    /// The figures of a column, which is sorted on the way.
    #[must_use]
    pub fn of(column: &mut [f32]) -> Self {
        let at = |column: &mut [f32], q: f64| quantile(column, q).map(rounded);
        Self { median: at(column, 0.5), p95: at(column, 0.95), max: at(column, 1.0) }
    }
}

/// Heading errors, radians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeadingColumn {
    /// Half of the time it was smaller.
    pub median: Option<f64>,
    /// 95 % of the time it was smaller.
    pub p95: Option<f64>,
}

impl HeadingColumn {
    /// The figures of a column, which is sorted on the way.
    #[must_use]
    pub fn of(column: &mut [f32]) -> Self {
        let ErrorColumn { median, p95, .. } = ErrorColumn::of(column);
        Self { median, p95 }
    }
}

/// The first time in the air that the drone said to know its place: P(lost) under 5 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// Since the take-off, seconds.
    pub time_s: f64,
    /// How far off it was, metres.
    pub error_m: f64,
}

/// First claims over flights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FirstClaims {
    /// Flights that said to know their place at all.
    pub made: usize,
    /// Of these within 0.5 m of the truth.
    pub right: usize,
    /// Half of the flights that made one had made it by then, seconds since the take-off; `null` when none did.
    pub median_s: Option<f64>,
    /// Nineteen of twenty of these, seconds.
    pub p95_s: Option<f64>,
}

impl FirstClaims {
    fn of(flights: &[FlightReport]) -> Self {
        let claims = flights.iter().filter_map(|flight| flight.first_claim);
        let mut times: Vec<f32> = claims.clone().map(|claim| claim.time_s as f32).collect();
        Self {
            made: times.len(),
            right: claims.filter(|claim| claim.error_m <= f64::from(LOST_M)).count(),
            median_s: quantile(&mut times, 0.5).map(rounded),
            p95_s: quantile(&mut times, 0.95).map(rounded),
        }
    }
}

/// One flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlightReport {
    /// Seed of the flight.
    pub seed: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// Touches.
    pub contacts: u32,
    /// Smallest distance between the airframe's cylinder and anything solid in flight, metres.
    pub min_clearance_m: f64,
    /// From take-off to touch-down, seconds.
    pub time_s: f64,
    /// Way flown, metres.
    pub distance_m: f64,
    /// Seen of what ought to be seen, 0..=1.
    pub coverage: f64,
    /// Between estimate and truth, over the time in the air since the first fix.
    pub loc_error_m: ErrorColumn,
    /// The same for the heading.
    pub heading_error_rad: HeadingColumn,
    /// From take-off to the first estimate within 0.5 m of the truth that stayed so; `null` for never.
    pub first_fix_s: Option<f64>,
    /// When the drone first said in the air that it knows its place, and how far off it was; `null` for never.
    pub first_claim: Option<Claim>,
    /// Time in the air since then with an error over 0.5 m, seconds.
    pub lost_s: f64,
    /// Failsafes that acted.
    pub failsafes: Vec<String>,
    /// What the patrol skipped and why.
    pub skipped: Vec<String>,
    /// Distance between the place of the end and the pad's centre, metres.
    pub off_pad_m: f64,
    /// Seconds that the world stood still for, because the machine stalled: 0 in every rehearsal.
    pub stalled_s: f64,
    /// P(lost) against the truth.
    pub honesty: Honesty,
    /// Hash (FNV-1a, 64 bits, hexadecimal) over every truth and every pose of the flight: equal for equal flights.
    pub digest: String,
}

/// Coverage over flights.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageTotal {
    /// Half of the flights saw more.
    pub median: f64,
    /// One flight in twenty saw less.
    pub p5: f64,
}

/// All flights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// How many.
    pub flights: usize,
    /// Touches in all.
    pub contacts: u32,
    /// Flights that ended on the pad.
    pub landed_on_pad: usize,
    /// Coverage over flights.
    pub coverage: CoverageTotal,
    /// Position error pooled over the time of all flights.
    pub loc_error_m: ErrorColumn,
    /// Smallest clearance of any flight, metres.
    pub min_clearance_m: f64,
    /// When the flights first said to know their place, and how many were right.
    pub first_claims: FirstClaims,
    /// P(lost) against the truth, over all flights.
    pub honesty: Honesty,
    /// Simulated over wall seconds, summed over flights flown at once: the one figure that may differ
    /// between equal seeds.
    pub real_time_factor: f64,
}

/// What `rehearse` writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// One entry a flight, in the order of the seeds.
    pub flights: Vec<FlightReport>,
    /// All together.
    pub total: Totals,
    /// What a reader of the figures must know of the building: where the pad was put and why, what is not known.
    pub remarks: Vec<String>,
}

impl Report {
    /// Puts flights together, in the order given.
    #[must_use]
    pub fn of(flights: Vec<FlightScore>, real_time_factor: f64) -> Self {
        let mut pooled: Vec<f32> = flights.iter().flat_map(|f| f.errors.iter().copied()).collect();
        let mut coverage: Vec<f32> = flights.iter().map(|f| f.report.coverage as f32).collect();
        let reports: Vec<FlightReport> = flights.into_iter().map(|f| f.report).collect();
        let share = |column: &mut [f32], q: f64| quantile(column, q).map_or(0.0, rounded);
        let mut honesty = Honesty::default();
        for report in &reports {
            honesty.add(&report.honesty);
        }
        let nearest = reports.iter().map(|r| r.min_clearance_m).fold(f64::INFINITY, f64::min);
        let total = Totals {
            flights: reports.len(),
            contacts: reports.iter().map(|r| r.contacts).sum(),
            landed_on_pad: reports.iter().filter(|r| r.outcome == Outcome::LandedOnPad).count(),
            coverage: CoverageTotal { median: share(&mut coverage, 0.5), p5: share(&mut coverage, 0.05) },
            loc_error_m: ErrorColumn::of(&mut pooled),
            min_clearance_m: if nearest.is_finite() { nearest } else { 0.0 },
            first_claims: FirstClaims::of(&reports),
            honesty: honesty.rounded(),
            real_time_factor,
        };
        Self { flights: reports, total, remarks: Vec::new() }
    }
}

/// The value below which a share `q` of a column lies (nearest rank); `None` for an empty column. The column
/// is partly sorted on the way.
#[must_use]
pub fn quantile(column: &mut [f32], q: f64) -> Option<f32> {
    if column.is_empty() {
        return None;
    }
    let rank = (q.clamp(0.0, 1.0) * column.len() as f64).ceil().max(1.0) as usize - 1;
    let rank = rank.min(column.len() - 1);
    let (_, value, _) = column.select_nth_unstable_by(rank, f32::total_cmp);
    Some(*value)
}

/// Four decimals: a tenth of a millimetre, and equal text on every machine.
pub(crate) fn rounded(value: f32) -> f64 {
    (f64::from(value) * 1e4).round() / 1e4 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_nearest_ranks() {
        let mut column: Vec<f32> = (1..=20).rev().map(|v| v as f32).collect();
        assert_eq!(quantile(&mut column, 0.5), Some(10.0));
        assert_eq!(quantile(&mut column, 0.05), Some(1.0));
        assert_eq!(quantile(&mut column, 0.95), Some(19.0));
        assert_eq!(quantile(&mut column, 1.0), Some(20.0));
        assert_eq!(quantile(&mut [], 0.5), None);
    }
}
