//! Carried off in flight: the drone is suddenly elsewhere, and nothing on board has felt it.
//!
//! Nobody carries a flying drone two metres in no time. It stands for all that makes a filter wrong at once and
//! unnoticed (a gap that looked like another, a door taken for the next one), and it is the hardest of them: there is no
//! way between the places by which the truth could be found again.

use crate::vehicle::Quadrotor;
use crate::world::World;
use rand::{Rng, RngExt};

/// It happens this long after the take-off, seconds.
const AFTER_S: core::ops::Range<f64> = 20.0..120.0;
/// Higher than this it flies, metres.
const FLYING_M: f64 = 0.9;
/// Kept from everything at the new place beside the airframe, metres.
const CLEARANCE_M: f32 = 0.3;
/// Directions tried at once; if none is free, again so much later, seconds.
const DIRECTIONS: u32 = 16;
const AGAIN_S: f64 = 0.5;

/// A displacement that is still to come.
#[derive(Clone, Debug)]
pub(super) struct Displacement {
    distance_m: f64,
    left_s: f64,
    direction_rad: f64,
}

impl Displacement {
    /// By `distance_m`, at a time and in a direction that are drawn; `None` for no distance.
    pub(super) fn draw<R: Rng + ?Sized>(distance_m: f64, random: &mut R) -> Option<Self> {
        (distance_m > 0.0).then(|| Self {
            distance_m,
            left_s: random.random_range(AFTER_S),
            direction_rad: random.random_range(0.0..std::f64::consts::TAU),
        })
    }

    /// By `distance_m` as soon as it flies; in `direction_rad` (world frame) or the next one round that is free.
    pub(super) fn at_once(distance_m: f64, direction_rad: f64) -> Self {
        Self { distance_m, left_s: 0.0, direction_rad }
    }

    /// Where to, when it is time.
    pub(super) fn due(
        &mut self,
        world: &World,
        craft: &Quadrotor,
        on_ground: bool,
        dt_s: f64,
    ) -> Option<(f64, f64)> {
        if on_ground || craft.lowest_m() < FLYING_M {
            return None;
        }
        self.left_s -= dt_s;
        if self.left_s > 0.0 {
            return None;
        }
        self.left_s = AGAIN_S;
        let from = craft.motion().position;
        let (bottom, height) = (craft.lowest_m() as f32, craft.shape().height_m as f32);
        let reach = craft.shape().radius_m as f32 + CLEARANCE_M;
        (0..DIRECTIONS)
            .map(|k| {
                let turn = std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS);
                let (sin, cos) = (self.direction_rad + turn).sin_cos();
                (from.x + self.distance_m * cos, from.y + self.distance_m * sin)
            })
            .find(|(x, y)| {
                let (x, y) = (*x as f32, *y as f32);
                world.is_free_in_flight(x, y) && world.clearance(x, y, bottom, height, reach) >= 0.0
            })
    }
}
