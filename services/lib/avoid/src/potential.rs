//! Artificial potential fields (thesis 3.1, "Campos Potenciales", its second set of equations 1 to 7; Khatib 1986):
//! the target pulls, obstacles push, and the drone goes where the sum points.
//!
//! What the equations leave open is decided here:
//!
//! - **The factor 2.** The gradients 5 and 7 are half of those of the potentials 4 and 6. They are taken as they are
//!   written, so epsilon and eta here are twice those of the potentials.
//! - **delta = 0.** Equation 6 leaves it out, and below a cell's width a distance is not known. So delta never counts as
//!   less than [`PotentialConfig::least_m`]. What stands in the drone's own cell has no direction and pushes nowhere.
//! - **delta is measured from the edge of a disc**, [`PotentialConfig::radius_m`]; 0 is the thesis's point.
//! - **Which cells are obstacles.** The sum of equation 2 runs over what the sensors detect: in each of the 72 sectors
//!   the nearest cell of enough certainty, of whichever of the two layers. A sum over all cells would push the harder the
//!   thicker a wall is drawn, and a plan is solid all the way behind its walls. More certainty pushes no harder: the
//!   equations have no place for it.
//! - **From force to motion.** The force is the wished velocity, as the thesis reads its magnitude: m/s, cut off at the
//!   speed in free space. The pull alone is cut off there too. Equation 4 grows without end, and a target in the next
//!   room would pull through the wall.
//! - **Balance.** Where what is left is slower than [`PotentialConfig::stuck_m_s`] the method has no answer: blocked.

use crate::grid::{CELL_M, CELLS, HALF, SIDE};
use crate::histogram::{SECTORS, WORD, bearing, more_certain, sector_of};
use crate::{Avoider, ConfigError, Decision, Histogram, Reason, Situation};

/// As it is called in reports.
const NAME: &str = "potential";

/// Equation 5: the pull of a target at `to_target` from here, metres, scaled by `epsilon`, 1/s: m/s towards it.
#[must_use]
pub fn attraction(epsilon: f32, to_target: (f32, f32)) -> (f32, f32) {
    (epsilon * to_target.0, epsilon * to_target.1)
}

/// Equation 7: the push of an obstacle at `to_obstacle` from here, metres, of which the last `radius_m` are the vehicle.
/// `eta` in m^4/s, `rho` and `least_m` in metres: m/s away from it. delta counts as at least `least_m`; an obstacle
/// without a direction pushes nowhere.
#[must_use]
pub fn repulsion(eta: f32, rho: f32, radius_m: f32, least_m: f32, to_obstacle: (f32, f32)) -> (f32, f32) {
    let distance = to_obstacle.0.hypot(to_obstacle.1);
    let delta = (distance - radius_m).max(least_m);
    // A distance of nothing or not a number, or a delta that divides by nothing, pushes nowhere.
    if !(distance > 0.0 && delta > 0.0 && delta <= rho) {
        return (0.0, 0.0);
    }
    let push = eta * (1.0 / delta - 1.0 / rho) / (delta * delta);
    (-push * to_obstacle.0 / distance, -push * to_obstacle.1 / distance)
}

/// Parameters of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct PotentialConfig {
    /// epsilon of equation 5, 1/s.
    pub attraction_per_s: f32,
    /// eta of equation 7, m^4/s, for each sector that something stands in.
    pub repulsion: f32,
    /// rho of equation 7: what is farther than this from the edge of the disc does not push, metres.
    pub influence_m: f32,
    /// Radius of the vehicle, metres; 0 for a point (thesis).
    pub radius_m: f32,
    /// delta never counts as less, metres.
    pub least_m: f32,
    /// Certainty from which on a cell is an obstacle, units (8 a reading).
    pub certainty: u8,
    /// Slower than this is no motion, metres a second.
    pub stuck_m_s: f32,
}

impl PotentialConfig {
    /// For a vehicle of this radius that cruises at about 0.5 m/s.
    ///
    /// `attraction_per_s` 1: at full speed to half a metre before the target. `influence_m` 0.8: the sides of a corridor
    /// of two metres push, those of a hall do not. `repulsion`: a wall across the way holds the drone where there are
    /// 0.3 m left (at 0.5 m/s it stops in 0.36 m, FACTS 2, and it slows down before). `least_m`: a cell. `certainty`: one
    /// reading, for a second or two, as elsewhere in navigation.
    #[must_use]
    pub fn flight(radius_m: f32) -> Self {
        Self {
            attraction_per_s: 1.0,
            repulsion: 0.002,
            influence_m: 0.8,
            radius_m,
            least_m: CELL_M,
            certainty: 5,
            stuck_m_s: 0.03,
        }
    }

    fn validate(&self) -> Result<(), ConfigError> {
        let check = |field, value: f32, low: f32, high: f32, allowed| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(ConfigError { method: NAME, field, value, allowed })
            }
        };
        check("attraction_per_s", self.attraction_per_s, 0.001, 100.0, "0.001..=100 1/s")?;
        check("repulsion", self.repulsion, 0.0, 100.0, "0..=100 m^4/s")?;
        check("influence_m", self.influence_m, CELL_M, 20.0, "0.05..=20 m")?;
        check("radius_m", self.radius_m, 0.0, 2.0, "0..=2 m")?;
        check("least_m", self.least_m, 0.01, 1.0, "0.01..=1 m")?;
        check("certainty", f32::from(self.certainty), 1.0, 255.0, "1..=255 units")?;
        check("stuck_m_s", self.stuck_m_s, 0.001, 1.0, "0.001..=1 m/s")
    }
}

/// What a cell does, worked out once.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Its push, m/s, plan frame.
    push: (f32, f32),
    /// From the middle cell to its centre, millimetres.
    distance_mm: u16,
    sector: u8,
}

/// The method with its table. It remembers nothing from one decision to the next.
#[derive(Clone, Debug)]
pub struct PotentialField {
    config: PotentialConfig,
    entries: Vec<Entry>,
}

impl PotentialField {
    /// Builds the per-cell table.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn new(config: PotentialConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        let entry = |index: usize| {
            let right = (index % SIDE) as i32 - HALF as i32;
            let up = (index / SIDE) as i32 - HALF as i32;
            let to_cell = (right as f32 * CELL_M, up as f32 * CELL_M);
            let PotentialConfig { repulsion: eta, influence_m, radius_m, least_m, .. } = config;
            Entry {
                push: repulsion(eta, influence_m, radius_m, least_m, to_cell),
                distance_mm: (to_cell.0.hypot(to_cell.1) * 1000.0) as u16,
                sector: sector_of(bearing(right, up)) as u8,
            }
        };
        Ok(Self { entries: (0..CELLS).map(entry).collect(), config })
    }

    /// The parameters in use.
    #[must_use]
    pub fn config(&self) -> &PotentialConfig {
        &self.config
    }

    /// Equations 2 and 7: the push of what is nearest in each sector.
    fn pushes(&self, cells: &[u8], walls: &[u8]) -> [(f32, f32); SECTORS] {
        let mut nearest = [u16::MAX; SECTORS];
        let mut pushes = [(0.0, 0.0); SECTORS];
        let certain = more_certain(cells, walls);
        for (word, eight) in certain.as_chunks::<WORD>().0.iter().enumerate() {
            if u64::from_ne_bytes(*eight) == 0 {
                continue;
            }
            for (entry, certainty) in self.entries[word * WORD..].iter().zip(eight) {
                let sector = entry.sector as usize;
                if *certainty >= self.config.certainty && entry.distance_mm < nearest[sector] {
                    (nearest[sector], pushes[sector]) = (entry.distance_mm, entry.push);
                }
            }
        }
        pushes
    }
}

impl Avoider for PotentialField {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The histogram holds the push of each sector, smoothed by nothing; no sector is ever blocked.
    fn decide(&mut self, situation: &Situation<'_>, histogram: &mut Histogram<'_>) -> Decision {
        let pushes = self.pushes(situation.cells, situation.walls);
        for (raw, push) in histogram.raw.iter_mut().zip(&pushes) {
            *raw = push.0.hypot(push.1);
        }
        *histogram.smoothed = *histogram.raw;
        *histogram.blocked = [0; SECTORS];

        let decision = |direction_rad, speed_m_s, reason| Decision {
            direction_rad,
            speed_m_s,
            reason,
            valley: None,
            threshold_high: f32::NAN,
            threshold_low: f32::NAN,
        };
        if !situation.target_rad.is_finite() {
            return decision(None, 0.0, Reason::Holding);
        }
        let max_speed =
            if situation.max_speed_m_s.is_finite() { situation.max_speed_m_s.max(0.0) } else { 0.0 };
        // A target with a direction only is far away. So far a distance keeps the numbers finite.
        let target_m = if situation.target_m.is_finite() { situation.target_m.clamp(0.0, 1e6) } else { 1e6 };
        let (sin, cos) = situation.target_rad.sin_cos();
        let (ax, ay) = attraction(self.config.attraction_per_s, (target_m * cos, target_m * sin));
        let share = if max_speed > 0.0 { (max_speed / ax.hypot(ay).max(1e-6)).min(1.0) } else { 0.0 };
        let (px, py) = pushes.iter().fold((0.0, 0.0), |sum, push| (sum.0 + push.0, sum.1 + push.1));
        // Equation 3.
        let (fx, fy) = (share * ax + px, share * ay + py);
        let force = fx.hypot(fy);
        if (px, py) == (0.0, 0.0) {
            let direction = crate::wrap(situation.target_rad);
            return decision(Some(direction), force.min(max_speed), Reason::TargetSafe);
        }
        if force < self.config.stuck_m_s {
            return decision(None, 0.0, Reason::Blocked);
        }
        decision(Some(fy.atan2(fx)), force.min(max_speed), Reason::Deflected)
    }

    fn forget(&mut self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decide(cells: &[u8], target_rad: f32, target_m: f32) -> (Decision, [f32; SECTORS]) {
        let (mut raw, mut smoothed, mut blocked) = ([9.0; SECTORS], [9.0; SECTORS], [9; SECTORS]);
        let decision = PotentialField::new(PotentialConfig::flight(0.225)).unwrap().decide(
            &Situation { cells, walls: &[], target_rad, target_m, max_speed_m_s: 0.5 },
            &mut Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked },
        );
        (decision, raw)
    }

    /// The middle cell and so many cells beside it.
    fn cell(right: i32, up: i32) -> usize {
        ((HALF as i32 + up) * SIDE as i32 + HALF as i32 + right) as usize
    }

    #[test]
    fn equations_5_and_7_by_hand_with_the_constants_of_figures_3_1_and_3_2() {
        // Agent (10, 12), goal (0, 0), epsilon 1/16.
        assert_eq!(attraction(1.0 / 16.0, (-10.0, -12.0)), (-0.625, -0.75));
        // Obstacle (9, 12), eta 5, rho 5: delta 1, 5 (1 - 1/5) = 4, to the right.
        assert_eq!(repulsion(5.0, 5.0, 0.0, 0.01, (-1.0, 0.0)), (4.0, 0.0));
        // delta 2: 5 (1/2 - 1/5) / 4 = 0.375, down.
        let (x, y) = repulsion(5.0, 5.0, 0.0, 0.01, (0.0, 2.0));
        assert!(x.abs() < 1e-6 && (y + 0.375).abs() < 1e-6);
        assert_eq!(repulsion(5.0, 5.0, 0.0, 0.01, (5.1, 0.0)), (0.0, 0.0), "beyond rho");
        // The same from the edge of a disc.
        let (x, _) = repulsion(5.0, 5.0, 0.5, 0.01, (-1.5, 0.0));
        assert!((x - 4.0).abs() < 1e-5);
    }

    #[test]
    fn gradients_lack_the_factor_two_of_their_potentials() {
        let (epsilon, eta, rho) = (0.7, 0.3, 2.0);
        let pull = |d: f64| epsilon * d * d;
        let push = |d: f64| eta * (1.0 / d - 1.0 / rho) * (1.0 / d - 1.0 / rho);
        let slope = |u: &dyn Fn(f64) -> f64, d: f64| (u(d + 1e-5) - u(d - 1e-5)) / 2e-5;
        for d in [0.5, 1.0, 1.7] {
            let (five, _) = attraction(epsilon as f32, (d as f32, 0.0));
            assert!((slope(&pull, d) - 2.0 * f64::from(five)).abs() < 1e-4);
            let (seven, _) = repulsion(eta as f32, rho as f32, 0.0, 0.01, (-d as f32, 0.0));
            assert!((-slope(&push, d) - 2.0 * f64::from(seven)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_distance_of_nothing_is_defined() {
        assert_eq!(repulsion(1.0, 1.0, 0.0, 0.05, (0.0, 0.0)), (0.0, 0.0), "no direction");
        let least = repulsion(1.0, 1.0, 0.2, 0.05, (0.25, 0.0));
        assert_eq!(repulsion(1.0, 1.0, 0.2, 0.05, (0.1, 0.0)), least, "inside the disc");
        assert!(least.0 < 0.0 && least.0.is_finite());
        assert_eq!(repulsion(1.0, 1.0, 0.0, 0.0, (f32::NAN, 0.0)), (0.0, 0.0));
    }

    #[test]
    fn in_free_space_the_target_is_flown_at_and_slowly_when_near() {
        let (decision, raw) = decide(&[], 0.3, 3.0);
        assert_eq!((decision.direction_rad, decision.speed_m_s), (Some(0.3), 0.5));
        assert_eq!(decision.reason, Reason::TargetSafe);
        assert!(raw.iter().all(|r| *r == 0.0));
        assert!((decide(&[], 0.3, 0.2).0.speed_m_s - 0.2).abs() < 1e-6, "epsilon delta");
        assert_eq!(decide(&[], 0.3, f32::INFINITY).0.speed_m_s, 0.5);
    }

    #[test]
    fn only_the_nearest_cell_of_a_sector_pushes() {
        let mut cells = vec![0u8; CELLS];
        cells[cell(12, 0)] = 8;
        // Thresholds are NaN, so that decisions do not compare as a whole.
        let felt = |cells: &[u8]| {
            let (decision, raw) = decide(cells, 1.0, 3.0);
            (decision.direction_rad, decision.speed_m_s, raw)
        };
        let one = felt(&cells);
        assert!(one.2[0] > 0.0);
        for behind in 13..30 {
            cells[cell(behind, 0)] = 255;
        }
        assert_eq!(felt(&cells), one, "however thick the wall and however certain");
        cells[cell(12, 0)] = 4;
        assert_ne!(felt(&cells), one, "half a reading is no obstacle");
    }

    #[test]
    fn a_wall_across_the_way_holds_the_drone_where_the_configuration_says() {
        // A long wall, its near face so many cells ahead: blocked or pushed back nearer than 0.3 m, onward beyond.
        let towards = |cells_ahead: i32| {
            let mut cells = vec![0u8; CELLS];
            for up in -(HALF as i32)..=HALF as i32 {
                cells[cell(cells_ahead, up)] = 16;
            }
            let decision = decide(&cells, 0.0, 3.0).0;
            decision.direction_rad.map_or(0.0, |d| decision.speed_m_s * d.cos())
        };
        // 0.45 - 0.225 = 0.225 m left, and 0.60 - 0.225 = 0.375 m.
        assert!(towards(9) < 0.0, "{}", towards(9));
        assert!(towards(12) > 0.0, "{}", towards(12));
    }

    #[test]
    fn a_parameter_out_of_range_is_refused_by_name() {
        let refuse = |config: PotentialConfig| PotentialField::new(config).unwrap_err().to_string();
        let good = PotentialConfig::flight(0.225);
        assert!(refuse(PotentialConfig { least_m: 0.0, ..good.clone() }).contains("0.01..=1 m"));
        assert!(
            refuse(PotentialConfig { repulsion: f32::NAN, ..good.clone() }).contains("potential: repulsion")
        );
        assert!(refuse(PotentialConfig { certainty: 0, ..good }).contains("certainty is 0"));
    }
}
