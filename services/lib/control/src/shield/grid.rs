//! What navigation's certainty grid holds near the drone: it remembers for longer than the shield does, and forgets what
//! was heard through.

use crate::held::seconds;
use crate::planar::Vector;
use core::f32::consts::TAU;

/// Directions in which the nearest cell is kept: 5 degrees, as in the polar histogram (thesis equation 10).
const SECTORS: usize = 72;
/// Farther cells are not looked at, metres: what can be flown at is heard or seen again before.
const NEAR_M: f32 = 1.0;
/// A grid older than this says nothing, seconds: it comes twenty times a second.
const FRESH_S: f32 = 0.5;

/// A certainty grid, row by row from its lower left corner, x fastest.
#[derive(Clone, Copy, Debug)]
pub struct GridView<'a> {
    /// Lower left corner of the first cell, plan frame.
    pub origin: Vector,
    /// Side of a cell, metres.
    pub cell_m: f32,
    /// Cells in a row.
    pub side: usize,
    /// Certainty of each.
    pub cells: &'a [u8],
}

/// The nearest certain cell in every direction.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    seen_ns: Option<u64>,
    points: [Option<Vector>; SECTORS],
}

impl Grid {
    pub(super) fn new() -> Self {
        Self { seen_ns: None, points: [None; SECTORS] }
    }

    /// Takes a grid for a drone at `place`: cells of at least this certainty stand.
    pub(super) fn see(&mut self, at_ns: u64, place: Vector, grid: &GridView<'_>, stands: u8) {
        self.points = [None; SECTORS];
        self.seen_ns = Some(at_ns);
        if !(0.01..=0.5).contains(&grid.cell_m) || !grid.origin.is_finite() || grid.side == 0 {
            return;
        }
        let mut nearest = [NEAR_M; SECTORS];
        for (row, cells) in grid.cells.chunks_exact(grid.side).enumerate() {
            let y = grid.origin.y + (row as f32 + 0.5) * grid.cell_m - place.y;
            if y.abs() > NEAR_M {
                continue;
            }
            for (column, _) in cells.iter().enumerate().filter(|(_, cell)| **cell >= stands) {
                let off = Vector::new(grid.origin.x + (column as f32 + 0.5) * grid.cell_m - place.x, y);
                let sector = (off.angle().rem_euclid(TAU) / TAU * SECTORS as f32) as usize % SECTORS;
                let distance = off.norm();
                if distance < nearest[sector] {
                    nearest[sector] = distance;
                    self.points[sector] = Some(place + off);
                }
            }
        }
    }

    /// Points that stand, plan frame.
    pub(super) fn points(&self, now: u64) -> impl Iterator<Item = Vector> + '_ {
        // A time that has not come yet is a broken stamp: it would be fresh for ever.
        let fresh = |at: u64| seconds(at, now) < FRESH_S && seconds(now, at) < FRESH_S;
        let fresh = self.seen_ns.is_some_and(fresh);
        self.points.iter().flatten().copied().filter(move |_| fresh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_cell_of_every_direction_is_kept_for_half_a_second() {
        let mut cells = [0u8; 20 * 20];
        // The drone stands at the middle of cell (10, 10); cells are 0.1 m.
        cells[10 * 20 + 14] = 9;
        cells[10 * 20 + 17] = 9;
        cells[13 * 20 + 10] = 5;
        cells[7 * 20 + 10] = 4;
        let view = GridView { origin: Vector::new(2.0, 3.0), cell_m: 0.1, side: 20, cells: &cells };
        let mut grid = Grid::new();
        assert_eq!(grid.points(0).count(), 0);
        grid.see(0, Vector::new(3.05, 4.05), &view, 5);
        let points: Vec<Vector> = grid.points(400_000_000).collect();
        assert_eq!(points.len(), 2, "the nearer of two in a row, and none that is not certain: {points:?}");
        assert!(points.iter().any(|p| (*p - Vector::new(3.45, 4.05)).norm() < 1e-3));
        assert!(points.iter().any(|p| (*p - Vector::new(3.05, 4.35)).norm() < 1e-3));
        assert_eq!(grid.points(600_000_000).count(), 0);
        grid.see(u64::MAX, Vector::new(3.05, 4.05), &view, 5);
        assert_eq!(grid.points(700_000_000).count(), 0, "from the end of time");
        grid.see(1, Vector::ZERO, &GridView { cell_m: f32::NAN, ..view }, 5);
        assert_eq!(grid.points(2).count(), 0);
    }

    #[test]
    fn a_sector_is_five_degrees_and_holds_the_nearest_cell_within_a_metre() {
        let points = |offs: &[(usize, usize)]| {
            let mut cells = [0u8; 31 * 31];
            for (x, y) in offs {
                cells[(15 + y) * 31 + 15 + x] = 9;
            }
            let view = GridView { origin: Vector::new(-1.55, -1.55), cell_m: 0.1, side: 31, cells: &cells };
            let mut grid = Grid::new();
            grid.see(0, Vector::ZERO, &view, 5);
            grid.points(0).collect::<Vec<_>>()
        };
        // Seen at 7.1, 9.5 and 11.3 degrees.
        let one = points(&[(8, 1), (6, 1)]);
        assert!(one.len() == 1 && (one[0] - Vector::new(0.6, 0.1)).norm() < 1e-3, "{one:?}");
        assert_eq!(points(&[(6, 1), (5, 1)]).len(), 2);
        assert_eq!((points(&[(9, 0), (0, 9)]).len(), points(&[(11, 0), (0, 11), (8, 8)]).len()), (2, 0));
    }

    #[test]
    fn a_grid_that_cannot_be_holds_nothing() {
        let cells = [9u8; 4];
        let view = GridView { origin: Vector::new(-0.1, -0.1), cell_m: 0.1, side: 2, cells: &cells };
        let points = |view: &GridView<'_>| {
            let mut grid = Grid::new();
            grid.see(0, Vector::ZERO, view, 5);
            grid.points(0).count()
        };
        assert_eq!(points(&view), 4);
        assert_eq!(points(&GridView { cell_m: 0.6, ..view }), 0, "so coarse is none");
        assert_eq!(points(&GridView { side: 0, ..view }), 0);
        assert_eq!(points(&GridView { origin: Vector::new(f32::NAN, 0.0), ..view }), 0);
    }
}
