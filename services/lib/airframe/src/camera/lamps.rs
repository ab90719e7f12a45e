//! The lamps on the ceiling, and how much of their light comes where: baked once for a world.

use crate::world::{Role, World};

/// Lamps hang on a raster of this width, where there is free floor under them and no wall nearer than this, metres.
const RASTER_M: f32 = 2.4;
const OFF_WALL_M: f32 = 0.5;
/// Width of a cell of baked light, metres.
const CELL_M: f32 = 0.25;
/// Heights at which light is baked: on the floor, where things throw shadows, and at chest height.
const FLOOR_M: f32 = 0.03;
pub(super) const CHEST_M: f32 = 1.2;
/// A lamp farther away is not felt, metres.
const REACH_M: f32 = 6.0;
/// What comes back from walls and ceiling all the same, where a lamp shines near and where none does.
const BOUNCED: f32 = 0.22;
const STRAY: f32 = 0.06;
/// Walls take their light from the room before them: so many cells are filled in from their neighbours.
const SPREAD: usize = 4;

/// Light on the floor and at chest height; 1 is bright.
type Cell = [f32; 2];

/// Lamps and their light.
#[derive(Debug)]
pub(super) struct Lamps {
    places: Vec<(f32, f32)>,
    origin: (f32, f32),
    width: usize,
    height: usize,
    cells: Vec<Cell>,
}

impl Lamps {
    pub(super) fn of(world: &World) -> Self {
        let [x0, y0, x1, y1] = world.bounds();
        let places = places(world);
        let (width, height) = (((x1 - x0) / CELL_M) as usize + 2, ((y1 - y0) / CELL_M) as usize + 2);
        let mut lamps =
            Self { places, origin: (x0, y0), width, height, cells: vec![[0.0; 2]; width * height] };
        let mut known = vec![false; width * height];
        for row in 0..height {
            for column in 0..width {
                let (x, y) = (x0 + column as f32 * CELL_M, y0 + row as f32 * CELL_M);
                if world.wall_distance(x, y) > 0.0 && world.is_free_in_flight(x, y) {
                    let cell = row * width + column;
                    lamps.cells[cell] =
                        [lamps.shine(world, x, y, FLOOR_M), lamps.shine(world, x, y, CHEST_M)];
                    known[cell] = true;
                }
            }
        }
        for _ in 0..SPREAD {
            lamps.spread(&mut known);
        }
        lamps
    }

    /// Where the lamps hang, world frame.
    pub(super) fn places(&self) -> &[(f32, f32)] {
        &self.places
    }

    fn shine(&self, world: &World, x: f32, y: f32, z: f32) -> f32 {
        let (mut direct, mut near) = (0.0f32, 0.0f32);
        for (lx, ly) in &self.places {
            let to = [lx - x, ly - y, world.ceiling() - 0.05 - z];
            let square = super::look::dot(to, to);
            let range = square.sqrt();
            if range > REACH_M {
                continue;
            }
            let hidden = world.cast([x, y, z], to.map(|v| v / range), range).is_some_and(|hit| {
                hit.range < range - 0.1 && hit.role.is_some_and(|role| role != Role::Person)
            });
            if !hidden {
                // A panel shines straight down most.
                direct += 1.5 * (to[2] / range) / (1.0 + square * 0.55);
            }
            near = near.max(1.0 - range / REACH_M);
        }
        STRAY + BOUNCED * near.sqrt() + direct
    }

    /// Gives each cell that has no light the mean of its neighbours that have.
    fn spread(&mut self, known: &mut [bool]) {
        let before = known.to_vec();
        for row in 0..self.height {
            for column in 0..self.width {
                let cell = row * self.width + column;
                if before[cell] {
                    continue;
                }
                let (mut sum, mut count) = ([0.0; 2], 0.0);
                for r in row.saturating_sub(1)..=(row + 1).min(self.height - 1) {
                    for c in column.saturating_sub(1)..=(column + 1).min(self.width - 1) {
                        let other = r * self.width + c;
                        if before[other] {
                            sum = [sum[0] + self.cells[other][0], sum[1] + self.cells[other][1]];
                            count += 1.0;
                        }
                    }
                }
                if count > 0.0 {
                    self.cells[cell] = sum.map(|v| v / count);
                    known[cell] = true;
                }
            }
        }
    }

    /// Light at a place of the world, bilinear between the cells.
    #[inline]
    pub(super) fn at(&self, x: f32, y: f32) -> Cell {
        let fx = ((x - self.origin.0) * (1.0 / CELL_M)).clamp(0.0, (self.width - 2) as f32);
        let fy = ((y - self.origin.1) * (1.0 / CELL_M)).clamp(0.0, (self.height - 2) as f32);
        let (column, row) = (fx as usize, fy as usize);
        let (tx, ty) = (fx - column as f32, fy - row as f32);
        let low = row * self.width + column;
        let pair = |from: usize| self.cells.get(from..from + 2);
        let (Some([a, b]), Some([c, d])) = (pair(low), pair(low + self.width)) else {
            return [STRAY; 2];
        };
        std::array::from_fn(|k| {
            let near = a[k] + (b[k] - a[k]) * tx;
            let far = c[k] + (d[k] - c[k]) * tx;
            near + (far - near) * ty
        })
    }
}

fn places(world: &World) -> Vec<(f32, f32)> {
    let [x0, y0, x1, y1] = world.bounds();
    let count = |length: f32| (length / RASTER_M).ceil().max(1.0) as usize;
    let (across, up) = (count(x1 - x0), count(y1 - y0));
    let middle = |k: usize, n: usize, from: f32, to: f32| from + (k as f32 + 0.5) * (to - from) / n as f32;
    let mut places = Vec::new();
    for row in 0..up {
        for column in 0..across {
            let (x, y) = (middle(column, across, x0, x1), middle(row, up, y0, y1));
            // A raster point on a wall or on furniture moves a little aside before it is given up.
            let near = [(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)];
            let free = |(dx, dy): &(f32, f32)| {
                let (x, y) = (x + dx, y + dy);
                world.is_free_in_flight(x, y) && world.wall_distance(x, y) > OFF_WALL_M
            };
            if let Some((dx, dy)) = near.iter().find(|by| free(by)) {
                places.push((x + dx, y + dy));
            }
        }
    }
    places
}
