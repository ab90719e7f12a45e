use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::Costmap;

/// The shortest-path search that routes and distances share: one cell is settled at a time.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    /// Cost from the start, valid where `stamp` is `now`.
    cost: Vec<f32>,
    from: Vec<u32>,
    /// Last search that touched the cell: twice its number, plus 1 when the cell is settled.
    stamp: Vec<u32>,
    now: u32,
    open: BinaryHeap<Open>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Open {
    total: f32,
    cell: u32,
}

impl Eq for Open {}

impl Ord for Open {
    /// The cheapest first; of equal ones the lower number, so that equal searches find equal paths.
    fn cmp(&self, other: &Self) -> Ordering {
        other.total.total_cmp(&self.total).then(other.cell.cmp(&self.cell))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Columns, rows and length in cells.
const MOVES: [(i32, i32, f32); 8] = [
    (1, 0, 1.0),
    (-1, 0, 1.0),
    (0, 1, 1.0),
    (0, -1, 1.0),
    (1, 1, std::f32::consts::SQRT_2),
    (1, -1, std::f32::consts::SQRT_2),
    (-1, 1, std::f32::consts::SQRT_2),
    (-1, -1, std::f32::consts::SQRT_2),
];

impl Search {
    pub(crate) fn new(cells: usize) -> Self {
        Self {
            cost: vec![0.0; cells],
            from: vec![0; cells],
            stamp: vec![0; cells],
            now: 0,
            open: BinaryHeap::with_capacity(cells.min(16_384)),
        }
    }

    pub(crate) fn begin(&mut self, start: usize) {
        self.now = self.now.wrapping_add(2);
        if self.now == 0 {
            self.stamp.fill(0);
            self.now = 2;
        }
        self.open.clear();
        self.touch(start, 0.0, start, 0.0);
    }

    /// Settles the next cell. `enter` says what a cell costs (a metre through it, and once), `left` how far
    /// it is to the goal at the least.
    pub(crate) fn settle(
        &mut self,
        map: &Costmap,
        enter: impl Fn(usize) -> Option<(f32, f32)>,
        left: impl Fn(usize) -> f32,
    ) -> Option<usize> {
        let cell = loop {
            let cell = self.open.pop()?.cell as usize;
            if self.stamp[cell] == self.now {
                break cell;
            }
        };
        self.stamp[cell] = self.now + 1;
        let raster = map.raster();
        for (columns, rows, length) in MOVES {
            let Some(next) = raster.shifted(cell, columns, rows) else { continue };
            if self.stamp[next] == self.now + 1 {
                continue;
            }
            let Some((metre, once)) = enter(next) else { continue };
            let cost = self.cost[cell] + length * raster.cell_m * metre + once;
            if self.stamp[next] != self.now || cost < self.cost[next] {
                self.touch(next, cost, cell, left(next));
            }
        }
        Some(cell)
    }

    fn touch(&mut self, cell: usize, cost: f32, from: usize, left: f32) {
        self.cost[cell] = cost;
        self.from[cell] = from as u32;
        self.stamp[cell] = self.now;
        self.open.push(Open { total: cost + left, cell: cell as u32 });
    }

    /// Cost of a settled cell.
    pub(crate) fn cost_of(&self, cell: usize) -> f32 {
        self.cost[cell]
    }

    /// The cells from the start to a settled one.
    pub(crate) fn path(&self, end: usize) -> Vec<usize> {
        let mut path = vec![end];
        let mut cell = end;
        while self.from[cell] as usize != cell && path.len() <= self.from.len() {
            cell = self.from[cell] as usize;
            path.push(cell);
        }
        path.reverse();
        path
    }
}
