//! Local obstacle avoidance on a certainty grid that moves with the drone (thesis 3.1, Borenstein and Koren 1991).
//!
//! The parts, in the order in which a decision uses them:
//!
//! 1. [`grid`]: the Cartesian Histogram Grid, 81 x 81 cells of 5 cm in the plan frame with the drone in the
//!    middle one. One cell is incremented a reading, on the bisector of the cone (figure 3.5). Beyond the
//!    thesis: certainty decays with time and is cleared along the beam, because a grid that is only ever
//!    incremented keeps a passer-by as a wall for ever.
//! 2. [`walls`]: the same raster holding what the floor plan knows, so that sonars need not discover walls.
//! 3. [`vfh`]: the polar histogram and the choice of a direction and a speed, behind the trait [`Avoider`],
//!    so that other methods are compared with it on the same inputs.
//! 4. [`potential`]: the method that the thesis weighs first and puts aside, artificial potential fields, behind the
//!    same trait.
//! 5. [`swath`]: how far a straight strip ahead is free of what the sonars have seen.
//!
//! Angles are counter-clockwise from the plan's +x, as everywhere in this house; the thesis counts clockwise
//! (figure 3.6), so its numbers appear here with the other sign.
//!
//! Grids are plain columns of bytes: a loaned shared-memory sample is the working memory. No function here
//! allocates after construction, and no byte pattern or float makes one panic.
#![forbid(unsafe_code)]

mod error;
pub mod grid;
mod histogram;
pub mod potential;
pub mod swath;
mod valley;
pub mod vfh;
pub mod walls;

pub use error::ConfigError;
pub use grid::{Beam, CELL_M, CELLS, Echo, GridRules, SIDE, Window};
pub use histogram::{SECTOR_RAD, SECTORS, Smoothing, bearing, sector_of};
pub use potential::{PotentialConfig, PotentialField};
pub use vfh::{ROOMY_M, TIGHT_M, Vfh, VfhConfig};
pub use walls::WallLayer;

/// What an avoider is asked.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    /// Certainty of what the sonars have seen, [`CELLS`] bytes; a shorter column counts as empty beyond its end.
    pub cells: &'a [u8],
    /// Certainty of what the plan knows on the same raster; empty when there is no plan.
    pub walls: &'a [u8],
    /// Direction of the target, plan frame, radians; NaN for no target.
    pub target_rad: f32,
    /// Distance of the target, metres: what stands farther away than the target does not hide it.
    /// Infinite or NaN when the target has a direction only.
    pub target_m: f32,
    /// Speed in free space, metres a second.
    pub max_speed_m_s: f32,
}

/// Where an avoider writes how it came to its decision, one entry a sector.
#[derive(Debug)]
pub struct Histogram<'a> {
    /// Polar obstacle density (equation 11); of a potential field the push away from what stands in the sector, m/s.
    pub raw: &'a mut [f32; SECTORS],
    /// Smoothed density.
    pub smoothed: &'a mut [f32; SECTORS],
    /// 1 where the sector is blocked.
    pub blocked: &'a mut [u8; SECTORS],
}

/// Why a direction and speed were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// No target.
    Holding,
    /// The target's own sector is safe.
    TargetSafe,
    /// The middle of a narrow valley (equation 15).
    NarrowValley,
    /// Along the near border of a wide valley (equation 15).
    WideValley,
    /// What a potential field's pushes leave of its pull.
    Deflected,
    /// No valley leads on, or a potential field pushes as much as it pulls.
    Blocked,
}

/// What an avoider answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Direction to fly, plan frame, radians in -pi..pi; `None` to stop.
    pub direction_rad: Option<f32>,
    /// Speed along it, metres a second; 0 when stopped.
    pub speed_m_s: f32,
    /// Why.
    pub reason: Reason,
    /// First and last sector of the chosen valley, inclusive, counting upwards and wrapping.
    pub valley: Option<(u8, u8)>,
    /// Density above which a free sector becomes blocked; NaN of a method without thresholds.
    pub threshold_high: f32,
    /// Density below which a blocked sector becomes free; NaN of a method without thresholds.
    pub threshold_low: f32,
}

/// A method of local avoidance: asked at each decision, it may remember its last ones.
pub trait Avoider {
    /// Its name in reports.
    fn name(&self) -> &'static str;

    /// Chooses direction and speed, and fills the histogram.
    fn decide(&mut self, situation: &Situation<'_>, histogram: &mut Histogram<'_>) -> Decision;

    /// Forgets earlier decisions (after a stop, a jump of the pose or a new route).
    fn forget(&mut self);
}

/// `angle` folded into -pi..=pi; NaN stays NaN.
#[must_use]
pub fn wrap(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    let folded = angle - TAU * (angle / TAU).round();
    folded.clamp(-PI, PI)
}
