//! The true floor as a raster: where nothing stands at flight height, where people can walk.

use super::field::squared_distances;
use super::solid::{Role, Solid};
use floorplan::{Cell, Plan};

/// Cells are the plan's, but never smaller than this: finer ones would cost time and show nothing more.
const LEAST_CELL_M: f32 = 0.045;
/// What a walking person bumps into: from just above the carpets to the top of the head, metres.
pub(crate) const WALKING_BAND_M: (f32, f32) = (0.07, 1.85);

const FREE: u8 = 1;
const IN_FLIGHT: u8 = 2;
const ON_FOOT: u8 = 4;

/// What is where, in the world frame.
#[derive(Clone, Debug)]
pub struct Ground {
    width: usize,
    height: usize,
    resolution: f32,
    origin: (f32, f32),
    cells: Vec<u8>,
    /// The heights between which a solid blocks flight.
    flight_band: (f32, f32),
}

impl Ground {
    /// The plan's free cells, with nothing standing on them yet.
    pub(crate) fn new(plan: &Plan, flight_band: (f32, f32)) -> Self {
        let factor = (LEAST_CELL_M / plan.resolution()).ceil().max(1.0) as usize;
        let (width, height) = (plan.width().div_ceil(factor), plan.height().div_ceil(factor));
        let mut cells = vec![0u8; width * height];
        for (i, cell) in cells.iter_mut().enumerate() {
            let (c, r) = ((i % width) * factor + factor / 2, (i / width) * factor + factor / 2);
            if plan.cell(c, r) == Cell::Free {
                *cell = FREE;
            }
        }
        let resolution = plan.resolution() * factor as f32;
        Self { width, height, resolution, origin: plan.origin(), cells, flight_band }
    }

    /// Marks the cells whose middle lies in a solid.
    pub(crate) fn place(&mut self, solid: &Solid) {
        if matches!(solid.role, Role::SoftFloor | Role::Person) {
            return;
        }
        let within = |band: (f32, f32)| solid.top > band.0 && solid.bottom < band.1;
        let mut bits = 0;
        if within(self.flight_band) {
            bits |= IN_FLIGHT;
        }
        if within(WALKING_BAND_M) {
            bits |= ON_FOOT;
        }
        if bits != 0 {
            self.for_cells_in(solid, |cell| {
                *cell |= bits;
                true
            });
        }
    }

    /// Whether a solid's outline covers free floor only.
    pub(crate) fn is_clear(&mut self, solid: &Solid) -> bool {
        let mut any = false;
        let clear = self.for_cells_in(solid, |cell| {
            any = true;
            *cell == FREE
        });
        clear && any
    }

    /// Calls `act` for each cell whose middle lies in the outline until it answers no; whether it never did.
    fn for_cells_in(&mut self, solid: &Solid, mut act: impl FnMut(&mut u8) -> bool) -> bool {
        let (hx, hy) = solid.half_extent();
        let low = self.nearest_cell(solid.x - hx, solid.y - hy);
        let high = self.nearest_cell(solid.x + hx, solid.y + hy);
        for row in low.1..=high.1 {
            for column in low.0..=high.0 {
                let (x, y) = self.centre(column, row);
                if solid.outline_distance(x, y) <= 0.0 && !act(&mut self.cells[row * self.width + column]) {
                    return false;
                }
            }
        }
        true
    }

    /// Cells along x.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }
    /// Cells along y.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }
    /// Side of a cell, metres.
    #[must_use]
    pub fn resolution(&self) -> f32 {
        self.resolution
    }
    /// World-frame place of the lower left corner.
    #[must_use]
    pub fn origin(&self) -> (f32, f32) {
        self.origin
    }
    /// The middle of a cell, world frame.
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> (f32, f32) {
        (
            self.origin.0 + (column as f32 + 0.5) * self.resolution,
            self.origin.1 + (row as f32 + 0.5) * self.resolution,
        )
    }
    /// Column and row of a place; `None` outside.
    #[must_use]
    pub fn cell_at(&self, x: f32, y: f32) -> Option<(usize, usize)> {
        let (fx, fy) = ((x - self.origin.0) / self.resolution, (y - self.origin.1) / self.resolution);
        (fx >= 0.0 && fy >= 0.0 && fx < self.width as f32 && fy < self.height as f32)
            .then_some((fx as usize, fy as usize))
    }
    fn nearest_cell(&self, x: f32, y: f32) -> (usize, usize) {
        let along = |v: f32, n: usize| ((v / self.resolution).max(0.0) as usize).min(n.saturating_sub(1));
        (along(x - self.origin.0, self.width), along(y - self.origin.1, self.height))
    }
    /// Whether a cell (its index) is free in the plan and nothing stands on it at flight height.
    #[must_use]
    pub fn is_free_in_flight(&self, cell: usize) -> bool {
        self.cells.get(cell).is_some_and(|c| c & (FREE | IN_FLIGHT) == FREE)
    }
    /// Whether a solid at flight height stands on a cell.
    #[must_use]
    pub fn blocks_sight(&self, cell: usize) -> bool {
        self.cells.get(cell).is_none_or(|c| c & IN_FLIGHT != 0)
    }
    /// Whether a cell is free floor for a walking person.
    #[must_use]
    pub fn is_free_on_foot(&self, cell: usize) -> bool {
        self.cells.get(cell).is_some_and(|c| c & (FREE | ON_FOOT) == FREE)
    }

    /// Distance from each cell to the nearest solid at flight height, metres.
    pub(crate) fn flight_distances(&self) -> Vec<f32> {
        self.distances(|i| self.cells[i] & IN_FLIGHT != 0)
    }
    /// Distance from each cell to the nearest cell where nobody can walk, metres.
    pub(crate) fn walking_distances(&self) -> Vec<f32> {
        self.distances(|i| !self.is_free_on_foot(i))
    }
    fn distances(&self, marked: impl Fn(usize) -> bool) -> Vec<f32> {
        let mut field = squared_distances(self.width, self.height, marked);
        for value in &mut field {
            *value = value.sqrt() * self.resolution;
        }
        field
    }

    /// The cells that can be reached from a place over cells that `open` allows, four neighbours a cell.
    pub(crate) fn flood(&self, x: f32, y: f32, open: impl Fn(usize) -> bool) -> Vec<bool> {
        let mut reached = vec![false; self.cells.len()];
        let Some((column, row)) = self.cell_at(x, y) else { return reached };
        let mut stack = Vec::new();
        let start = row * self.width + column;
        if open(start) {
            reached[start] = true;
            stack.push(start);
        }
        while let Some(cell) = stack.pop() {
            let (c, r) = (cell % self.width, cell / self.width);
            let neighbours = [
                (c > 0).then(|| cell - 1),
                (c + 1 < self.width).then(|| cell + 1),
                (r > 0).then(|| cell - self.width),
                (r + 1 < self.height).then(|| cell + self.width),
            ];
            for next in neighbours.into_iter().flatten() {
                if !reached[next] && open(next) {
                    reached[next] = true;
                    stack.push(next);
                }
            }
        }
        reached
    }
}
