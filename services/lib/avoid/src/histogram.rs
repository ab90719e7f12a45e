//! From the grid to the polar obstacle density: equations 8 to 14.

use crate::grid::{CELL_M, CELLS, HALF, SIDE, UNITS_PER_READING};
use core::f32::consts::{PI, TAU};

/// Sectors of the polar histogram (thesis: n = 72 of alpha = 5 degrees).
pub const SECTORS: usize = 72;
/// Width of a sector, radians.
pub const SECTOR_RAD: f32 = TAU / SECTORS as f32;

/// The sector whose middle is nearest to `angle_rad` (equation 10): sector k looks along k times 5 degrees.
/// 0 for an angle that is not finite.
#[must_use]
pub fn sector_of(angle_rad: f32) -> usize {
    let turns = (angle_rad / SECTOR_RAD).round();
    if turns.is_finite() { (turns.rem_euclid(SECTORS as f32)) as usize % SECTORS } else { 0 }
}

/// Direction of a cell from the middle one, radians counter-clockwise from +x (equation 8 with atan2, as its
/// own footnote asks). Thesis figure 3.6 has the same angles clockwise.
#[must_use]
pub fn bearing(right: i32, up: i32) -> f32 {
    (up as f32).atan2(right as f32)
}

/// How the density is smoothed over neighbouring sectors. Both wrap from 71 to 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoothing {
    /// Equation 13 with l = 5: a triangle of 11 sectors. Its weights sum to 36 and are divided by 11.
    Triangle,
    /// Equation 14 with M = 5: a Hann window, whose two end points are zero: 1/4, 1/2, 1/4.
    Hann,
}

impl Smoothing {
    /// What a constant histogram is multiplied by. Thresholds are stated for gain 1 and scaled by this.
    #[must_use]
    pub const fn gain(self) -> f32 {
        match self {
            Self::Triangle => 36.0 / 11.0,
            Self::Hann => 1.0,
        }
    }

    pub(crate) fn apply(self, raw: &[f32; SECTORS], smoothed: &mut [f32; SECTORS]) {
        match self {
            Self::Hann => {
                for (k, out) in smoothed.iter_mut().enumerate() {
                    let (before, after) = (raw[(k + SECTORS - 1) % SECTORS], raw[(k + 1) % SECTORS]);
                    *out = 0.5 * raw[k] + 0.25 * (before + after);
                }
            }
            Self::Triangle => {
                const L: usize = 5;
                for (k, out) in smoothed.iter_mut().enumerate() {
                    let mut sum = 0.0;
                    for n in 0..=2 * L {
                        let weight = (L + 1 - n.abs_diff(L)) as f32;
                        sum += weight * raw[(k + SECTORS + n - L) % SECTORS];
                    }
                    *out = sum / (2 * L + 1) as f32;
                }
            }
        }
    }
}

/// Fixed-point scale of a - b d: sums of integers are exact whatever their order.
const WEIGHT_SCALE: f32 = 4096.0;

/// Cells that are looked at together to skip empty ones.
pub(crate) const WORD: usize = 8;

/// The more certain of the two layers, many bytes at a time; padded so that it falls into whole words.
pub(crate) fn more_certain(cells: &[u8], walls: &[u8]) -> [u8; CELLS.next_multiple_of(WORD)] {
    let mut certain = [0u8; CELLS.next_multiple_of(WORD)];
    for (out, c) in certain.iter_mut().zip(cells.iter().take(CELLS)) {
        *out = *c;
    }
    for (out, c) in certain.iter_mut().zip(walls.iter().take(CELLS)) {
        *out = (*out).max(*c);
    }
    certain
}

/// What one cell contributes, worked out once.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    /// a - b d, times [`WEIGHT_SCALE`].
    weight: u32,
    /// Distance, millimetres.
    distance_mm: u16,
    /// First sector that the enlarged cell covers.
    first: u8,
    /// How many it covers.
    span: u8,
}

/// Per cell: magnitude, sector and how many sectors the vehicle's width makes of it.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    entries: Vec<Entry>,
}

impl Table {
    /// `a` and `b` of equation 9 with d in cells; a - b d is cut off at zero, so that a far cell never counts
    /// as the opposite of an obstacle. Every cell is widened by the angle under which a disc of
    /// `clearance_m` (vehicle radius plus margin; 0: a point) touches it.
    pub(crate) fn new(a: f32, b: f32, clearance_m: f32) -> Self {
        let mut entries = vec![Entry::default(); CELLS];
        for (index, entry) in entries.iter_mut().enumerate() {
            let right = (index % SIDE) as i32 - HALF as i32;
            let up = (index / SIDE) as i32 - HALF as i32;
            if right == 0 && up == 0 {
                // The drone's own cell has no direction, and nothing solid is where the drone is.
                continue;
            }
            let cells = (right as f32).hypot(up as f32);
            let distance = cells * CELL_M;
            let half =
                if clearance_m >= distance { PI / 2.0 } else { (clearance_m / distance).max(0.0).asin() };
            let beta = bearing(right, up);
            let low = ((beta - half) / SECTOR_RAD).round() as i32;
            let high = ((beta + half) / SECTOR_RAD).round() as i32;
            *entry = Entry {
                weight: ((a - b * cells).max(0.0) * WEIGHT_SCALE) as u32,
                distance_mm: (distance * 1000.0) as u16,
                first: low.rem_euclid(SECTORS as i32) as u8,
                span: (high - low + 1).clamp(1, SECTORS as i32) as u8,
            };
        }
        Self { entries }
    }

    /// Equations 9 to 11: the density of each sector, of whichever of the two layers is more certain, from
    /// cells no farther than `farthest_m`.
    pub(crate) fn density(&self, cells: &[u8], walls: &[u8], farthest_m: f32, raw: &mut [f32; SECTORS]) {
        let farthest = if farthest_m.is_nan() { u16::MAX } else { (farthest_m * 1000.0) as u16 };
        // Where the density rises and falls going round twice: enlarged cells may cross from sector 71 to 0.
        let mut change = [0i64; 2 * SECTORS + 1];
        let certain = more_certain(cells, walls);
        for (word, eight) in certain.as_chunks::<WORD>().0.iter().enumerate() {
            if u64::from_ne_bytes(*eight) == 0 {
                continue;
            }
            for (entry, certainty) in self.entries[word * WORD..].iter().zip(eight) {
                if *certainty > 0 && entry.distance_mm <= farthest {
                    let c = i64::from(*certainty);
                    let magnitude = c * c * i64::from(entry.weight);
                    change[entry.first as usize] += magnitude;
                    change[entry.first as usize + entry.span as usize] -= magnitude;
                }
            }
        }
        let unit = f32::from(UNITS_PER_READING);
        let scale = 1.0 / (f64::from(WEIGHT_SCALE) * f64::from(unit * unit));
        let mut sum = 0i64;
        raw.fill(0.0);
        for (k, delta) in change[..2 * SECTORS].iter().enumerate() {
            sum += delta;
            raw[k % SECTORS] += (sum as f64 * scale) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figure_3_6_with_our_sign() {
        // The figure, clockwise positive with 0 to the right; rows from the top, (right, up, degrees).
        let figure = [
            (-3, 3, -135),
            (0, 3, -90),
            (3, 3, -45),
            (-2, 2, -135),
            (0, 2, -90),
            (2, 2, -45),
            (-1, 1, -135),
            (0, 1, -90),
            (1, 1, -45),
            (-3, 0, 180),
            (-2, 0, 180),
            (-1, 0, 180),
            (1, 0, 0),
            (2, 0, 0),
            (3, 0, 0),
            (-1, -1, 135),
            (0, -1, 90),
            (1, -1, 45),
            (-2, -2, 135),
            (0, -2, 90),
            (2, -2, 45),
            (-3, -3, 135),
            (0, -3, 90),
            (3, -3, 45),
        ];
        for (right, up, clockwise) in figure {
            let ours = bearing(right, up).to_degrees().round() as i32;
            let expected = if clockwise == 180 { 180 } else { -clockwise };
            assert_eq!(ours, expected, "cell {right} {up}");
        }
    }

    #[test]
    fn sectors_wrap() {
        assert_eq!(sector_of(0.0), 0);
        assert_eq!(sector_of(-0.04), 0);
        assert_eq!(sector_of(-0.05), 71);
        assert_eq!(sector_of(PI), 36);
        assert_eq!(sector_of(-PI), 36);
        assert_eq!(sector_of(TAU - 0.001), 0);
        assert_eq!(sector_of(f32::NAN), 0);
    }

    #[test]
    fn smoothing_wraps_and_has_its_stated_gain() {
        for smoothing in [Smoothing::Hann, Smoothing::Triangle] {
            let mut smoothed = [0.0; SECTORS];
            smoothing.apply(&[1.0; SECTORS], &mut smoothed);
            assert!(smoothed.iter().all(|h| (h - smoothing.gain()).abs() < 1e-5));
            let mut raw = [0.0; SECTORS];
            raw[0] = 4.0;
            smoothing.apply(&raw, &mut smoothed);
            assert!((smoothed[71] - smoothed[1]).abs() < 1e-6 && smoothed[1] > 0.0);
            assert_eq!(smoothed[36], 0.0);
        }
        let mut smoothed = [0.0; SECTORS];
        let mut raw = [0.0; SECTORS];
        raw[10] = 4.0;
        Smoothing::Hann.apply(&raw, &mut smoothed);
        assert_eq!([smoothed[9], smoothed[10], smoothed[11], smoothed[12]], [1.0, 2.0, 1.0, 0.0]);
    }

    #[test]
    fn density_is_certainty_squared_times_falling_weight() {
        let table = Table::new(5.0, 0.1, 0.0);
        let mut cells = vec![0u8; CELLS];
        // 20 cells to the right, 3 readings: 9 (5 - 0.1 * 20) = 27.
        cells[HALF * SIDE + HALF + 20] = 3 * UNITS_PER_READING;
        let mut raw = [0.0; SECTORS];
        table.density(&cells, &[], f32::INFINITY, &mut raw);
        assert!((raw[0] - 27.0).abs() < 0.01, "{}", raw[0]);
        assert_eq!(raw.iter().filter(|h| **h > 0.0).count(), 1);
        table.density(&cells, &[], 0.9, &mut raw);
        assert_eq!(raw[0], 0.0, "behind the target");
        table.density(&[], &cells, 1.1, &mut raw);
        assert!((raw[0] - 27.0).abs() < 0.01, "a wall counts alike");
    }

    #[test]
    fn far_cells_never_count_negatively() {
        let table = Table::new(1.0, 0.1, 0.1);
        let cells = vec![255u8; CELLS];
        let mut raw = [0.0; SECTORS];
        table.density(&cells, &cells, f32::NAN, &mut raw);
        assert!(raw.iter().all(|h| *h >= 0.0 && h.is_finite()));
    }

    #[test]
    fn the_vehicle_width_widens_a_near_cell_more() {
        let covered = |distance: usize| {
            let table = Table::new(1.0, 0.0, 0.3);
            let mut cells = vec![0u8; CELLS];
            cells[HALF * SIDE + HALF + distance] = 80;
            let mut raw = [0.0; SECTORS];
            table.density(&cells, &[], f32::INFINITY, &mut raw);
            raw.iter().filter(|h| **h > 0.0).count()
        };
        // asin(0.3 / 0.6) = 30 degrees to each side; asin(0.3 / 1.5) = 11.5.
        assert_eq!(covered(12), 13);
        assert_eq!(covered(30), 5);
        // Nearer than the disc: everything towards it, nothing away from it.
        assert_eq!(covered(4), 37);
    }
}
