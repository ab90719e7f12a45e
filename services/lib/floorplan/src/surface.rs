use crate::Cell;

/// Radius in metres over which the direction of a surface is averaged: long enough that the steps of a
/// slanted wall and the ragged edge of a scanned one disappear, short enough for a door leaf.
const WINDOW_M: f32 = 0.30;
/// Two cells belong to the same face when the cosine between their outward directions is above this: it
/// keeps the steps of a slanted wall (cosine 0.7) and leaves out the next wall round a corner (0).
const SAME_FACE: f32 = 0.3;
/// Spread across over spread along, both as standard deviations, above which a surface has no direction:
/// a leg, a pole, a heap. They scatter sound to all sides.
const ROUND: f32 = 0.5;

/// No direction: scatters to all sides.
const DIFFUSE: u8 = u8::MAX;
/// Not on a surface at all.
const INSIDE: u8 = u8::MAX - 1;
/// Directions in half a turn.
const STEPS: f32 = 240.0;

/// The direction of the wall at every occupied cell, smoothed over its neighbours on the same face.
#[derive(Clone, Debug)]
pub(crate) struct Surfaces {
    /// Tangent in steps of half a turn / 240, or one of the marks above.
    tangent: Vec<u8>,
}

impl Surfaces {
    pub(crate) fn new(width: usize, height: usize, resolution: f32, cells: &[Cell]) -> Self {
        let raster = Raster { width: width as i32, height: height as i32, cells };
        let reach = (WINDOW_M / resolution).round().clamp(2.0, 30.0) as i32;
        let outward: Vec<Outward> = (0..raster.height)
            .flat_map(|y| (0..raster.width).map(move |x| (x, y)))
            .map(|(x, y)| raster.outward(x, y))
            .collect();
        let tangent = (0..raster.height)
            .flat_map(|y| (0..raster.width).map(move |x| (x, y)))
            .map(|(x, y)| raster.tangent(&outward, x, y, reach))
            .collect();
        Self { tangent }
    }

    /// Whether the surface at cell `index` has no direction.
    pub(crate) fn scatters(&self, index: usize) -> bool {
        self.tangent.get(index).is_none_or(|tangent| *tangent >= INSIDE)
    }

    /// Angle between a ray's direction and the surface's normal at cell `index`, 0..=pi/2.
    pub(crate) fn incidence(&self, index: usize, ray: f32) -> f32 {
        match self.tangent.get(index) {
            Some(&tangent) if tangent < INSIDE => {
                let along = f32::from(tangent) * (std::f32::consts::PI / STEPS);
                // The normal is a quarter turn from the tangent; which side it shows does not matter.
                (ray - along).sin().abs().clamp(0.0, 1.0).acos()
            }
            _ => 0.0,
        }
    }
}

/// Which way the open side of a surface cell lies.
#[derive(Clone, Copy)]
enum Outward {
    /// Free, unknown or with occupied cells all around.
    None,
    /// Open on opposite sides, as a wall one cell thick.
    Both,
    Towards(f32, f32),
}

struct Raster<'a> {
    width: i32,
    height: i32,
    cells: &'a [Cell],
}

impl Raster<'_> {
    fn index(&self, x: i32, y: i32) -> Option<usize> {
        (x >= 0 && y >= 0 && x < self.width && y < self.height).then(|| (y * self.width + x) as usize)
    }

    fn occupied(&self, x: i32, y: i32) -> bool {
        self.index(x, y).is_some_and(|index| self.cells[index] == Cell::Occupied)
    }

    fn outward(&self, x: i32, y: i32) -> Outward {
        if !self.occupied(x, y) {
            return Outward::None;
        }
        let (mut sum_x, mut sum_y, mut open) = (0.0_f32, 0.0_f32, false);
        for (dx, dy) in NEIGHBOURS {
            if !self.occupied(x + dx, y + dy) {
                sum_x += dx as f32;
                sum_y += dy as f32;
                open |= dx == 0 || dy == 0;
            }
        }
        let length = sum_x.hypot(sum_y);
        if !open {
            Outward::None
        } else if length < 0.5 {
            Outward::Both
        } else {
            Outward::Towards(sum_x / length, sum_y / length)
        }
    }

    /// Whether a cell is part of the end of a wall, as in a doorway: a face so short, between two corners, that
    /// its direction cannot be told from its cells.
    fn is_end(&self, x: i32, y: i32, reach: i32) -> bool {
        // A wall is at most half of the averaging window thick.
        let longest = (reach / 2).max(2);
        AXES.iter().any(|(nx, ny)| {
            // Open towards n; the face runs along t to both sides, and must be closed by a corner at each.
            let (tx, ty) = (*ny, *nx);
            if self.occupied(x + nx, y + ny) {
                return false;
            }
            let run = |sign: i32| {
                (1..=longest).find(|k| {
                    let (cx, cy) = (x + sign * k * tx, y + sign * k * ty);
                    !self.occupied(cx, cy)
                })
            };
            let flush = |sign: i32, length: i32| {
                (1..=length).all(|k| !self.occupied(x + sign * k * tx + nx, y + sign * k * ty + ny))
            };
            match (run(1), run(-1)) {
                (Some(a), Some(b)) => {
                    a + b - 1 <= longest && flush(1, a) && flush(-1, b) && self.deep(x, y, -nx, -ny, longest)
                }
                _ => false,
            }
        })
    }

    /// Whether the wall goes on behind an end: longer than it is thick.
    fn deep(&self, x: i32, y: i32, dx: i32, dy: i32, length: i32) -> bool {
        (1..=length).all(|k| self.occupied(x + k * dx, y + k * dy))
    }

    /// Principal direction of the surface cells of the same face around a cell.
    fn tangent(&self, outward: &[Outward], x: i32, y: i32, reach: i32) -> u8 {
        let Some(index) = self.index(x, y) else { return INSIDE };
        let own = outward[index];
        if matches!(own, Outward::None) {
            return INSIDE;
        }
        if self.is_end(x, y, reach) {
            return DIFFUSE;
        }
        let (mut n, mut mx, mut my, mut xx, mut xy, mut yy) = (0.0_f32, 0.0, 0.0, 0.0, 0.0, 0.0);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                if dx * dx + dy * dy > reach * reach {
                    continue;
                }
                let Some(other) = self.index(x + dx, y + dy) else { continue };
                if !same_face(own, outward[other]) {
                    continue;
                }
                let (fx, fy) = (dx as f32, dy as f32);
                n += 1.0;
                mx += fx;
                my += fy;
                xx += fx * fx;
                xy += fx * fy;
                yy += fy * fy;
            }
        }
        if n < 3.0 {
            return DIFFUSE;
        }
        let (xx, xy, yy) =
            (xx / n - mx * mx / (n * n), xy / n - mx * my / (n * n), yy / n - my * my / (n * n));
        let half_trace = 0.5 * (xx + yy);
        let root = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        let (along, across) = (half_trace + root, (half_trace - root).max(0.0));
        if across > ROUND * ROUND * along {
            return DIFFUSE;
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let steps = (angle.rem_euclid(std::f32::consts::PI) * (STEPS / std::f32::consts::PI)).round();
        if steps >= STEPS { 0 } else { steps as u8 }
    }
}

fn same_face(own: Outward, other: Outward) -> bool {
    match (own, other) {
        (_, Outward::None) | (Outward::None, _) => false,
        (Outward::Both, _) | (_, Outward::Both) => true,
        (Outward::Towards(ax, ay), Outward::Towards(bx, by)) => ax * bx + ay * by > SAME_FACE,
    }
}

const AXES: [(i32, i32); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];
const NEIGHBOURS: [(i32, i32); 8] = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];
