//! A uniform grid over the ground: which solids stand in which square.

use super::solid::Solid;

/// Side of a square: most queries touch a handful of squares with a handful of solids each.
const SIDE_M: f32 = 0.5;

/// Squares with lists of indices, in compressed rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Index {
    origin: (f32, f32),
    width: usize,
    height: usize,
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Index {
    /// An index of things given by their extents (low x, low y, high x, high y).
    pub(crate) fn new(bounds: [f32; 4], extents: impl Iterator<Item = [f32; 4]> + Clone) -> Self {
        let width = (((bounds[2] - bounds[0]) / SIDE_M).ceil().max(1.0)) as usize;
        let height = (((bounds[3] - bounds[1]) / SIDE_M).ceil().max(1.0)) as usize;
        let mut index = Self {
            origin: (bounds[0], bounds[1]),
            width,
            height,
            starts: vec![0; width * height + 1],
            entries: Vec::new(),
        };
        for extent in extents.clone() {
            index.for_squares(extent, |square, starts, _| starts[square + 1] += 1);
        }
        for i in 1..index.starts.len() {
            index.starts[i] += index.starts[i - 1];
        }
        index.entries = vec![0; index.starts.last().copied().unwrap_or(0) as usize];
        let mut next = index.starts.clone();
        for (id, extent) in extents.enumerate() {
            index.for_squares(extent, |square, _, entries| {
                if let Some(slot) = entries.get_mut(next[square] as usize) {
                    *slot = id as u32;
                }
                next[square] += 1;
            });
        }
        index
    }

    /// An index of solids.
    pub(crate) fn of_solids(bounds: [f32; 4], solids: &[Solid]) -> Self {
        Self::new(
            bounds,
            solids.iter().map(|s| {
                let (hx, hy) = s.half_extent();
                [s.x - hx, s.y - hy, s.x + hx, s.y + hy]
            }),
        )
    }

    fn for_squares(&mut self, extent: [f32; 4], mut act: impl FnMut(usize, &mut [u32], &mut [u32])) {
        let (low, high) = (self.clamped(extent[0], extent[1]), self.clamped(extent[2], extent[3]));
        for row in low.1..=high.1 {
            for column in low.0..=high.0 {
                act(row * self.width + column, &mut self.starts, &mut self.entries);
            }
        }
    }

    fn clamped(&self, x: f32, y: f32) -> (usize, usize) {
        let along = |v: f32, n: usize| ((v / SIDE_M).max(0.0) as usize).min(n - 1);
        (along(x - self.origin.0, self.width), along(y - self.origin.1, self.height))
    }

    /// Everything in the square of a point; empty outside.
    pub(crate) fn at(&self, x: f32, y: f32) -> &[u32] {
        let (fx, fy) = ((x - self.origin.0) / SIDE_M, (y - self.origin.1) / SIDE_M);
        if fx < 0.0 || fy < 0.0 || fx >= self.width as f32 || fy >= self.height as f32 {
            return &[];
        }
        self.square(fx as usize, fy as usize)
    }

    fn square(&self, column: usize, row: usize) -> &[u32] {
        let square = row * self.width + column;
        let range = self.starts[square] as usize..self.starts[square + 1] as usize;
        &self.entries[range]
    }

    /// Calls `act` with each square's list in the rectangle around a point. A thing that spans squares
    /// comes more than once.
    pub(crate) fn around(&self, x: f32, y: f32, reach: f32, act: impl FnMut(u32)) {
        self.within([x - reach, y - reach, x + reach, y + reach], act);
    }

    /// The same for any rectangle.
    pub(crate) fn within(&self, extent: [f32; 4], mut act: impl FnMut(u32)) {
        let (low, high) = (self.clamped(extent[0], extent[1]), self.clamped(extent[2], extent[3]));
        for row in low.1..=high.1 {
            for column in low.0..=high.0 {
                for id in self.square(column, row) {
                    act(*id);
                }
            }
        }
    }

    /// Walks the squares that a ray crosses, nearest first (Amanatides and Woo 1987). `visit` gets a
    /// square's list and the distance at which the ray leaves the square, and answers whether to go on.
    pub(crate) fn walk(
        &self,
        from: (f32, f32),
        along: (f32, f32),
        reach: f32,
        mut visit: impl FnMut(&[u32], f32) -> bool,
    ) {
        let (fx, fy) = ((from.0 - self.origin.0) / SIDE_M, (from.1 - self.origin.1) / SIDE_M);
        if !(fx >= 0.0 && fy >= 0.0 && fx < self.width as f32 && fy < self.height as f32) {
            return;
        }
        let (mut column, mut row) = (fx as isize, fy as isize);
        let axis = |f: f32, cell: isize, d: f32| -> (isize, f32, f32) {
            if d > 0.0 {
                (1, (cell as f32 + 1.0 - f) * SIDE_M / d, SIDE_M / d)
            } else if d < 0.0 {
                (-1, (cell as f32 - f) * SIDE_M / d, -SIDE_M / d)
            } else {
                (0, f32::INFINITY, f32::INFINITY)
            }
        };
        let (step_x, mut next_x, width_x) = axis(fx, column, along.0);
        let (step_y, mut next_y, width_y) = axis(fy, row, along.1);
        loop {
            let leave = next_x.min(next_y);
            if !visit(self.square(column as usize, row as usize), leave) || leave > reach {
                return;
            }
            if next_x < next_y {
                column += step_x;
                next_x += width_x;
            } else {
                row += step_y;
                next_y += width_y;
            }
            let inside =
                column >= 0 && row >= 0 && column < self.width as isize && row < self.height as isize;
            if !inside {
                return;
            }
        }
    }
}
