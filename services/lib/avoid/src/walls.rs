//! What the floor plan knows, on the raster of the certainty grid.

use crate::grid::{CELLS, Faded, SIDE, Window, scroll};

/// Certainty of a mapped wall, in the units of the grid: four readings. A plan is believed more than a single
/// ping and no more than a few, because it is up to 3 cm off.
pub const WALL_CERTAINTY: u8 = 32;

/// The walls around the drone. Moves with the window and asks the plan only about cells that enter it.
#[derive(Clone, Debug)]
pub struct WallLayer {
    cells: Vec<u8>,
    spare: Vec<u8>,
    window: Option<Window>,
}

impl Default for WallLayer {
    fn default() -> Self {
        Self::new()
    }
}

impl WallLayer {
    /// An empty layer.
    #[must_use]
    pub fn new() -> Self {
        Self { cells: vec![0; CELLS], spare: vec![0; CELLS], window: None }
    }

    /// Moves the layer to `window`; `solid` says whether the cell with this centre (plan frame, metres) is
    /// not free on the plan.
    pub fn follow(&mut self, window: &Window, mut solid: impl FnMut(f32, f32) -> bool) {
        let side = SIDE as i32;
        let (right, up) = match self.window {
            Some(last) if last == *window => return,
            Some(last) => {
                scroll(&self.cells, &last, &mut self.spare, window, Faded::default());
                core::mem::swap(&mut self.cells, &mut self.spare);
                last.shift_to(window)
            }
            None => (side, side),
        };
        self.window = Some(*window);
        let kept =
            |shift: i32| shift.saturating_neg().clamp(0, side)..side.saturating_sub(shift).clamp(0, side);
        let (columns, rows) = (kept(right), kept(up));
        for row in 0..side {
            let kept = if rows.contains(&row) { columns.clone() } else { 0..0 };
            for column in (0..kept.start).chain(kept.end..side) {
                let index = row as usize * SIDE + column as usize;
                let (x, y) = window.centre(index);
                self.cells[index] = if solid(x, y) { WALL_CERTAINTY } else { 0 };
            }
        }
    }

    /// Asks the plan about every cell again at the next [`Self::follow`]: the plan's picture has changed.
    pub fn forget(&mut self) {
        self.window = None;
    }

    /// Certainty, row by row from the lower left.
    #[must_use]
    pub fn cells(&self) -> &[u8] {
        &self.cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scrolling_gives_the_same_walls_as_asking_for_all() {
        let solid = |x: f32, y: f32| (x - 1.0).abs() < 0.1 || (y + 0.5).abs() < 0.06 || x * x + y * y < 0.2;
        let mut moving = WallLayer::new();
        let mut asked = 0usize;
        for (x, y) in [(0.0, 0.0), (0.3, -0.2), (0.31, 0.9), (-3.0, 0.0), (9.0, 9.0), (9.05, 9.0)] {
            let window = Window::around(x, y).unwrap();
            asked = 0;
            moving.follow(&window, |x, y| {
                asked += 1;
                solid(x, y)
            });
            let mut fresh = WallLayer::new();
            fresh.follow(&window, solid);
            assert_eq!(moving.cells(), fresh.cells());
        }
        assert_eq!(asked, SIDE, "one cell to the right: one new column");
    }
}
