//! The Vector Field Histogram's output layer: direction and speed.

use crate::grid::{CELL_M, SIDE};
use crate::histogram::{SECTOR_RAD, SECTORS, Smoothing, Table, sector_of};
use crate::valley::{self, Border, Valley};
use crate::{Avoider, ConfigError, Decision, Histogram, Reason, Situation, wrap};

/// As it is called in reports.
const NAME: &str = "vfh";
/// Cells are widened by the airframe and this, metres, where there is room: gusts and an error of the velocity carry
/// the drone 0.1 m off its way before it is flown back, and the raster eats five centimetres.
pub const ROOMY_M: f32 = 0.18;
/// And by this where that leaves no way: a passage of the disc + 0.30 m stays open.
pub const TIGHT_M: f32 = 0.10;

/// Parameters of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct VfhConfig {
    /// `a` of equation 9: how strongly a certain cell next to the drone counts.
    pub a: f32,
    /// Distance at which a cell stops counting, metres: `b` of equation 9 is `a` over this, so that a - b d
    /// (d in cells) falls to zero there and never below.
    pub reach_m: f32,
    /// Radius of the vehicle plus a margin, by which every cell is widened, metres; 0 for a point (thesis).
    pub clearance_m: f32,
    /// Equation 13 or 14.
    pub smoothing: Smoothing,
    /// Density above which a free sector becomes blocked, for a smoother of gain 1.
    pub threshold_high: f32,
    /// Density below which a blocked sector becomes free, for a smoother of gain 1.
    pub threshold_low: f32,
    /// Sectors from which on a valley counts as wide.
    pub s_max: usize,
    /// `hm` of the speed law V = Vmax (1 - min(h, hm) / hm), for a smoother of gain 1.
    pub slow_density: f32,
    /// Fly straight at a target whose own sector is free. Off: equation 15 alone, which circles (figure 3.9).
    pub straight_at_target: bool,
    /// Sectors by which the side flown last is preferred: another must be nearer to the target by more.
    pub continuity: usize,
    /// A valley farther than this from the target's direction leads away: blocked.
    pub max_detour_rad: f32,
    /// What stands farther away than the target does not count. Off: every cell of the window counts (thesis).
    pub to_target_only: bool,
}

impl VfhConfig {
    /// The configuration that flies where there is room, for a vehicle of this radius.
    ///
    /// `reach_m` 1.6: at 0.5 m/s the drone stops in 0.36 m (FACTS 2), so what is farther away is the route's
    /// business. `clearance_m`: [`ROOMY_M`] beside the propeller guards. The threshold is passed by two readings of one
    /// cell at half a metre or three at one metre. `s_max` 8: enlargement keeps the distance, so a wide valley need be
    /// entered by 20 degrees only.
    #[must_use]
    pub fn flight(radius_m: f32) -> Self {
        Self {
            a: 1.0,
            reach_m: 1.6,
            clearance_m: radius_m + ROOMY_M,
            smoothing: Smoothing::Hann,
            threshold_high: 2.5,
            threshold_low: 1.5,
            s_max: 8,
            slow_density: 5.0,
            straight_at_target: true,
            continuity: 4,
            max_detour_rad: 75.0_f32.to_radians(),
            to_target_only: true,
        }
    }

    /// The same with as little room as is allowed, [`TIGHT_M`], for where [`Self::flight`] finds no way on.
    #[must_use]
    pub fn tight(radius_m: f32) -> Self {
        Self { clearance_m: radius_m + TIGHT_M, ..Self::flight(radius_m) }
    }

    /// The thesis's text with its author's constants (FACTS 7), each deviation in `docs/thesis-avoidance.md`.
    ///
    /// A point, because the text widens no cell. `a` 5 and b = a / window, with the window of 81 cells of the text:
    /// b is 5/81 a cell, and a - b d is 1.5 in the window's farthest corner, never negative. (The author's code has
    /// 141 cells.) Threshold 2 without hysteresis, `s_max` 15, hm 8, no memory of the side flown last, and no valley
    /// too far from the target: the nearest one is flown, wherever it leads.
    #[must_use]
    pub fn thesis() -> Self {
        Self {
            a: 5.0,
            reach_m: SIDE as f32 * CELL_M,
            clearance_m: 0.0,
            smoothing: Smoothing::Hann,
            threshold_high: 2.0,
            threshold_low: 2.0,
            s_max: 15,
            slow_density: 8.0,
            straight_at_target: true,
            continuity: 0,
            max_detour_rad: core::f32::consts::TAU,
            to_target_only: false,
        }
    }

    fn validate(&self) -> Result<(), ConfigError> {
        let check = |field, value: f32, good: bool, allowed| {
            if value.is_finite() && good {
                Ok(())
            } else {
                Err(ConfigError { method: NAME, field, value, allowed })
            }
        };
        check("a", self.a, self.a > 0.0 && self.a <= 100.0, "0..=100, not 0")?;
        check("reach_m", self.reach_m, (0.2..=20.0).contains(&self.reach_m), "0.2..=20 m")?;
        check("clearance_m", self.clearance_m, (0.0..=2.0).contains(&self.clearance_m), "0..=2 m")?;
        check("threshold_high", self.threshold_high, self.threshold_high > 0.0, "above 0")?;
        check(
            "threshold_low",
            self.threshold_low,
            self.threshold_low > 0.0 && self.threshold_low <= self.threshold_high,
            "above 0 and at most threshold_high",
        )?;
        check("s_max", self.s_max as f32, (1..SECTORS).contains(&self.s_max), "1..=71 sectors")?;
        check("slow_density", self.slow_density, self.slow_density > 0.0, "above 0")?;
        check("continuity", self.continuity as f32, self.continuity < SECTORS / 2, "0..=35 sectors")?;
        check("max_detour_rad", self.max_detour_rad, self.max_detour_rad >= 0.0, "0 or more")
    }
}

/// The Vector Field Histogram with its tables and what it remembers: which sectors were blocked (hysteresis of
/// the threshold) and which one it flew (continuity).
#[derive(Clone, Debug)]
pub struct Vfh {
    config: VfhConfig,
    table: Table,
    blocked: [u8; SECTORS],
    chosen: Option<usize>,
    side: Option<Side>,
}

/// The side of the target that a valley lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

impl Side {
    fn of(sector: usize, target: usize) -> Self {
        if (sector + SECTORS - target) % SECTORS <= SECTORS / 2 { Self::Left } else { Self::Right }
    }
}

impl Vfh {
    /// Builds the per-cell tables.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn new(config: VfhConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        let b = config.a * CELL_M / config.reach_m;
        let table = Table::new(config.a, b, config.clearance_m);
        Ok(Self { config, table, blocked: [0; SECTORS], chosen: None, side: None })
    }

    /// The parameters in use.
    #[must_use]
    pub fn config(&self) -> &VfhConfig {
        &self.config
    }

    /// The valley to fly, the middle of equation 15 in sectors, and whether it counts as wide.
    fn choose(&self, target: usize) -> Option<(Valley, f32, bool)> {
        let config = &self.config;
        let limit = (config.max_detour_rad / SECTOR_RAD) as usize;
        let mut around: Option<Valley> = None;
        let mut best: Option<(usize, Valley, f32, bool)> = None;
        valley::for_each(&self.blocked, |valley| {
            if valley.contains(target) {
                around = Some(valley);
                return;
            }
            // Both ends compete: a lone obstacle leaves one valley that can be entered on either side of it.
            for border in [Border::First, Border::Last] {
                let distance = valley::apart(valley.border(border), target);
                let (middle, wide) = valley::from_border(valley, border, config.s_max);
                let sector = middle.round() as usize % SECTORS;
                let flown = self.side.is_some_and(|side| side == Side::of(sector, target));
                // On the way round something the target turns to its side: no reason to try the other one.
                let cost = if flown { distance.saturating_sub(config.continuity) } else { distance };
                if cost > limit {
                    continue;
                }
                // Of equal ones the wider, so that the choice does not hang on the numbering of the sectors.
                if best.is_none_or(|(c, v, _, _)| cost < c || (cost == c && valley.width > v.width)) {
                    best = Some((cost, valley, middle, wide));
                }
            }
        });
        if let Some(valley) = around {
            let (middle, wide) = valley::from_inside(valley, target, config.s_max);
            return Some((valley, middle, wide));
        }
        best.map(|(_, valley, middle, wide)| (valley, middle, wide))
    }
}

impl Avoider for Vfh {
    fn name(&self) -> &'static str {
        NAME
    }

    fn decide(&mut self, situation: &Situation<'_>, histogram: &mut Histogram<'_>) -> Decision {
        let config = &self.config;
        let gain = config.smoothing.gain();
        let (high, low) = (config.threshold_high * gain, config.threshold_low * gain);
        // The target hides what is behind it: only what the vehicle would touch on the way there counts.
        let farthest = situation.target_m.max(0.0) + config.clearance_m;
        let limited = config.to_target_only && situation.target_m.is_finite();
        let farthest = if limited { farthest } else { f32::NAN };
        self.table.density(situation.cells, situation.walls, farthest, histogram.raw);
        config.smoothing.apply(histogram.raw, histogram.smoothed);
        for (blocked, h) in self.blocked.iter_mut().zip(histogram.smoothed.iter()) {
            if *h > high {
                *blocked = 1;
            } else if *h < low {
                *blocked = 0;
            }
        }
        *histogram.blocked = self.blocked;

        let stop = |reason| Decision {
            direction_rad: None,
            speed_m_s: 0.0,
            reason,
            valley: None,
            threshold_high: high,
            threshold_low: low,
        };
        if !situation.target_rad.is_finite() {
            (self.chosen, self.side) = (None, None);
            return stop(Reason::Holding);
        }
        // Folded once: its sector and the direction flown must be the same angle to the last bit.
        let target_rad = wrap(situation.target_rad);
        let target = sector_of(target_rad);
        let Some((valley, middle, wide)) = self.choose(target) else {
            (self.chosen, self.side) = (None, None);
            return stop(Reason::Blocked);
        };
        let straight = self.config.straight_at_target && valley.contains(target);
        let (direction, sector, reason) = if straight {
            (target_rad, target, Reason::TargetSafe)
        } else {
            let mut k = middle;
            // A neighbour of the sector flown last is not worth a turn.
            if let Some(last) = self.chosen
                && self.config.continuity > 0
                && valley.contains(last)
                && valley::apart(last, middle.round() as usize % SECTORS) <= 1
            {
                k = last as f32;
            }
            let reason = if wide { Reason::WideValley } else { Reason::NarrowValley };
            (wrap(k * SECTOR_RAD), k.round() as usize % SECTORS, reason)
        };
        self.chosen = Some(sector);
        self.side = (!straight).then(|| Side::of(sector, target));
        let slow = self.config.slow_density * gain;
        let density = histogram.smoothed[sector].min(slow);
        let max_speed =
            if situation.max_speed_m_s.is_finite() { situation.max_speed_m_s.max(0.0) } else { 0.0 };
        Decision {
            direction_rad: Some(direction),
            speed_m_s: max_speed * (1.0 - density / slow),
            reason,
            valley: Some((valley.first as u8, valley.last() as u8)),
            threshold_high: high,
            threshold_low: low,
        }
    }

    fn forget(&mut self) {
        self.blocked = [0; SECTORS];
        (self.chosen, self.side) = (None, None);
    }
}
