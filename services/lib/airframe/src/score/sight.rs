//! Which cells of the true floor are in line of sight of a cell.

use crate::world::Ground;

/// Symmetric shadow casting on the raster: a free cell is seen when the line between the two middles is not
/// cut by a cell that blocks sight; the wall that ends the view is not counted. Scans the four quadrants
/// row by row with a stack of its own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sight {
    rows: Vec<Row>,
}

/// A row of a quadrant, between two slopes given as fractions (columns over depth, doubled to stay whole).
#[derive(Clone, Copy, Debug)]
struct Row {
    depth: i32,
    start: (i32, i32),
    end: (i32, i32),
}

impl Sight {
    /// Calls `seen` with the index of each cell in sight within `reach` cells, the own one first. `seen`
    /// answers whether to go on.
    pub(crate) fn scan(
        &mut self,
        ground: &Ground,
        column: usize,
        row: usize,
        reach: i32,
        mut seen: impl FnMut(usize) -> bool,
    ) {
        let (width, height) = (ground.width() as i32, ground.height() as i32);
        if !seen(row * ground.width() + column) {
            return;
        }
        for quadrant in 0..4 {
            let place = |depth: i32, across: i32| -> Option<usize> {
                let (c, r) = match quadrant {
                    0 => (column as i32 + across, row as i32 + depth),
                    1 => (column as i32 + across, row as i32 - depth),
                    2 => (column as i32 + depth, row as i32 + across),
                    _ => (column as i32 - depth, row as i32 + across),
                };
                (c >= 0 && r >= 0 && c < width && r < height).then(|| (r * width + c) as usize)
            };
            let blocked =
                |depth: i32, across: i32| place(depth, across).is_none_or(|cell| ground.blocks_sight(cell));
            self.rows.clear();
            self.rows.push(Row { depth: 1, start: (-1, 1), end: (1, 1) });
            while let Some(mut line) = self.rows.pop() {
                if line.depth > reach {
                    continue;
                }
                // Columns whose diamond touches the wedge: halves go outwards at the start, inwards at the end.
                let first = div_floor(2 * line.depth * line.start.0 + line.start.1, 2 * line.start.1);
                let last = -div_floor(-(2 * line.depth * line.end.0 - line.end.1), 2 * line.end.1);
                let mut before: Option<bool> = None;
                for across in first..=last {
                    let wall = blocked(line.depth, across);
                    let inside = across * line.start.1 >= line.depth * line.start.0
                        && across * line.end.1 <= line.depth * line.end.0;
                    if !wall
                        && inside
                        && across * across + line.depth * line.depth <= reach * reach
                        && let Some(cell) = place(line.depth, across)
                        && !seen(cell)
                    {
                        return;
                    }
                    let slope = (2 * across - 1, 2 * line.depth);
                    if before == Some(true) && !wall {
                        line.start = slope;
                    }
                    if before == Some(false) && wall {
                        self.rows.push(Row { depth: line.depth + 1, end: slope, ..line });
                    }
                    before = Some(wall);
                }
                if before == Some(false) {
                    self.rows.push(Row { depth: line.depth + 1, ..line });
                }
            }
        }
    }
}

fn div_floor(a: i32, b: i32) -> i32 {
    a.div_euclid(b)
}
