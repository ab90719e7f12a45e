//! Walls of the plan's raster: blocks to hit, directions in which they face, and corners.

use super::as_built::AsBuilt;
use super::solid::{Role, Solid};
use floorplan::{Cell, Plan};

/// Blocks are cut to this size so that each can follow the bending of the building.
const BLOCK_M: f32 = 0.5;
/// A block reaches this far into solid neighbours, so that bending opens no seam.
const OVERLAP_M: f32 = 0.02;
/// A row of faces at least this long is a wall along an axis; shorter ones are the stairs of a slanted wall
/// (5 cm cells of a wall turned by 10 degrees make rows of 0.28 m).
const STRAIGHT_M: f32 = 0.3;
/// Slanted and ragged walls take their direction from the cells within this radius.
const SMOOTH_M: f32 = 0.25;
/// A corner needs a long side of this length...
const CORNER_LONG_M: f32 = 0.25;
/// ...and a short side of this one, the thickness of a thin wall.
const CORNER_SHORT_M: f32 = 0.075;

/// The four faces of a cell in the order +x, -x, +y, -y: outward step.
const FACES: [(isize, isize); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// A block of wall cells: the solid is where it was built, the cells where it was drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    /// First and last column and row.
    cells: [u16; 4],
    /// From the plan to the building.
    shift: (f32, f32),
}

/// A vertical edge that scatters sound.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub x: f32,
    pub y: f32,
    pub bottom: f32,
    pub top: f32,
    /// An inner corner sends sound back the way it came; an outer one only scatters a little.
    pub inner: bool,
}

/// The walls of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Walls {
    width: usize,
    resolution: f32,
    origin: (f32, f32),
    /// A face's direction in 256ths of a turn, four a cell.
    facing: Vec<[u8; 4]>,
    blocks: Vec<Block>,
}

impl Walls {
    /// Cuts the raster into blocks. The solids come first in the world's list, in the order of the blocks.
    pub(crate) fn new(plan: &Plan, built: &AsBuilt, ceiling: f32) -> (Self, Vec<Solid>, Vec<Edge>) {
        let (width, height, resolution) = (plan.width(), plan.height(), plan.resolution());
        let solid: Vec<bool> = plan.cells().iter().map(|c| *c == Cell::Occupied).collect();
        let raster = Raster { width, height, solid: &solid };
        let runs = raster.runs();
        let facing = raster.facing(&runs, resolution);
        let mut walls = Self { width, resolution, origin: plan.origin(), facing, blocks: Vec::new() };
        let limit = ((BLOCK_M / resolution).round() as usize).max(1);
        let mut solids = Vec::new();
        let rectangles = rectangles(width, height, limit, |i| solid[i]);
        for [c0, r0, c1, r1] in rectangles {
            let (x0, y0) = walls.corner(c0, r0);
            let (x1, y1) = walls.corner(c1 + 1, r1 + 1);
            let shift = built.shift((x0 + x1) * 0.5, (y0 + y1) * 0.5);
            let all =
                |mut cells: Box<dyn Iterator<Item = (isize, isize)>>| cells.all(|(c, r)| raster.at(c, r));
            let (ic0, ir0, ic1, ir1) = (c0 as isize, r0 as isize, c1 as isize, r1 as isize);
            let grow = |covered: bool| if covered { OVERLAP_M } else { 0.0 };
            let east = grow(all(Box::new((ir0..=ir1).map(move |r| (ic1 + 1, r)))));
            let west = grow(all(Box::new((ir0..=ir1).map(move |r| (ic0 - 1, r)))));
            let north = grow(all(Box::new((ic0..=ic1).map(move |c| (c, ir1 + 1)))));
            let south = grow(all(Box::new((ic0..=ic1).map(move |c| (c, ir0 - 1)))));
            let (x0, x1) = (x0 + shift.0 - west, x1 + shift.0 + east);
            let (y0, y1) = (y0 + shift.1 - south, y1 + shift.1 + north);
            let centre = ((x0 + x1) * 0.5, (y0 + y1) * 0.5);
            solids.push(Solid::new_box(centre, (x1 - x0, y1 - y0), 0.0, 0.0, ceiling).with_role(Role::Wall));
            walls.blocks.push(Block { cells: [c0 as u16, r0 as u16, c1 as u16, r1 as u16], shift });
        }
        let edges = raster
            .corners(&runs, resolution)
            .into_iter()
            .map(|(column, row, inner)| {
                let (x, y) = walls.corner(column, row);
                let (x, y) = built.place(x, y);
                Edge { x, y, bottom: 0.0, top: ceiling, inner }
            })
            .collect();
        (walls, solids, edges)
    }

    fn corner(&self, column: usize, row: usize) -> (f32, f32) {
        (self.origin.0 + column as f32 * self.resolution, self.origin.1 + row as f32 * self.resolution)
    }

    /// Which way the wall faces where block `block` was met at a place on its face.
    pub(crate) fn normal(&self, block: usize, face: u8, x: f32, y: f32) -> Option<[f32; 3]> {
        let block = self.blocks.get(block)?;
        let step = FACES.get(face as usize)?;
        let inward = 0.5 * self.resolution;
        let px = x - block.shift.0 - step.0 as f32 * inward - self.origin.0;
        let py = y - block.shift.1 - step.1 as f32 * inward - self.origin.1;
        let [c0, r0, c1, r1] = block.cells.map(usize::from);
        let column = ((px / self.resolution).max(0.0) as usize).clamp(c0, c1);
        let row = ((py / self.resolution).max(0.0) as usize).clamp(r0, r1);
        let turn = self.facing.get(row * self.width + column)?[face as usize];
        let (sin, cos) = (f32::from(turn) / 256.0 * std::f32::consts::TAU).sin_cos();
        Some([cos, sin, 0.0])
    }
}

/// Cuts the marked cells into rectangles (first and last column and row) of at most `limit` cells a side:
/// as wide as possible, then as high as possible.
pub(crate) fn rectangles(
    width: usize,
    height: usize,
    limit: usize,
    marked: impl Fn(usize) -> bool,
) -> Vec<[usize; 4]> {
    let mut taken = vec![false; width * height];
    let mut found = Vec::new();
    for row in 0..height {
        for column in 0..width {
            let open = |taken: &[bool], c: usize, r: usize| marked(r * width + c) && !taken[r * width + c];
            if !open(&taken, column, row) {
                continue;
            }
            let mut last = column;
            while last + 1 < width && last + 1 < column + limit && open(&taken, last + 1, row) {
                last += 1;
            }
            let mut high = row;
            while high + 1 < height
                && high + 1 < row + limit
                && (column..=last).all(|c| open(&taken, c, high + 1))
            {
                high += 1;
            }
            for r in row..=high {
                taken[r * width + column..=r * width + last].fill(true);
            }
            found.push([column, row, last, high]);
        }
    }
    found
}

struct Raster<'a> {
    width: usize,
    height: usize,
    solid: &'a [bool],
}

impl Raster<'_> {
    fn at(&self, column: isize, row: isize) -> bool {
        column >= 0
            && row >= 0
            && column < self.width as isize
            && row < self.height as isize
            && self.solid[row as usize * self.width + column as usize]
    }

    fn bare(&self, column: isize, row: isize, face: usize) -> bool {
        let (dx, dy) = FACES[face];
        self.at(column, row) && !self.at(column + dx, row + dy)
    }

    /// Length in cells of the straight row of bare faces that each face belongs to.
    fn runs(&self) -> Vec<[u16; 4]> {
        let mut runs = vec![[0u16; 4]; self.width * self.height];
        for face in 0..FACES.len() {
            // Faces towards x line up along y and the other way round.
            let along_y = face < 2;
            let (lines, length) = if along_y { (self.width, self.height) } else { (self.height, self.width) };
            for line in 0..lines {
                let cell = |i: usize| if along_y { (line, i) } else { (i, line) };
                let mut start = 0;
                while start < length {
                    let mut end = start;
                    while end < length && {
                        let (c, r) = cell(end);
                        self.bare(c as isize, r as isize, face)
                    } {
                        end += 1;
                    }
                    let length = u16::try_from(end - start).unwrap_or(u16::MAX);
                    for (c, r) in (start..end).map(cell) {
                        if let Some(run) = runs[r * self.width + c].get_mut(face) {
                            *run = length;
                        }
                    }
                    start = end.max(start + 1);
                }
            }
        }
        runs
    }

    fn facing(&self, runs: &[[u16; 4]], resolution: f32) -> Vec<[u8; 4]> {
        let straight = (STRAIGHT_M / resolution).round() as u16;
        let radius = ((SMOOTH_M / resolution).round() as isize).clamp(1, 10);
        runs.iter()
            .enumerate()
            .map(|(i, lengths)| {
                let (column, row) = ((i % self.width) as isize, (i / self.width) as isize);
                std::array::from_fn(|face| {
                    let axis = [0u8, 128, 64, 192][face];
                    if lengths[face] == 0 || lengths[face] >= straight {
                        return axis;
                    }
                    self.smooth(column, row, face, radius).unwrap_or(axis)
                })
            })
            .collect()
    }

    /// Away from the mean of the solid cells around the place just before the face.
    fn smooth(&self, column: isize, row: isize, face: usize, radius: isize) -> Option<u8> {
        let (dx, dy) = FACES[face];
        let (mut sum_x, mut sum_y) = (0.0f32, 0.0f32);
        for oy in -radius..=radius {
            for ox in -radius..=radius {
                let squared = (ox * ox + oy * oy) as f32;
                if squared > 0.0
                    && ox * ox + oy * oy <= radius * radius
                    && self.at(column + dx + ox, row + dy + oy)
                {
                    // Near cells say more about this face than the next wall does.
                    let weight = 1.0 / squared;
                    sum_x -= ox as f32 * weight;
                    sum_y -= oy as f32 * weight;
                }
            }
        }
        if sum_x.hypot(sum_y) < 1e-3 {
            return None;
        }
        let turn = sum_y.atan2(sum_x) / std::f32::consts::TAU * 256.0;
        Some((turn.round() as i32).rem_euclid(256) as u8)
    }

    /// Lattice points where a long and a sufficiently long straight face meet: column, row, inner.
    fn corners(&self, runs: &[[u16; 4]], resolution: f32) -> Vec<(usize, usize, bool)> {
        let cells = |metres: f32| (metres / resolution).round().max(1.0) as u16;
        let (long, short) = (cells(CORNER_LONG_M), cells(CORNER_SHORT_M));
        let run = |column: isize, row: isize, face: usize| -> u16 {
            if self.bare(column, row, face) {
                runs[row as usize * self.width + column as usize][face]
            } else {
                0
            }
        };
        let mut found = Vec::new();
        for row in 1..self.height as isize {
            for column in 1..self.width as isize {
                let quad = [(column - 1, row - 1), (column, row - 1), (column - 1, row), (column, row)];
                let count = quad.iter().filter(|(c, r)| self.at(*c, *r)).count();
                if count != 1 && count != 3 {
                    continue;
                }
                let inner = count == 3;
                // The odd one out: its mirror images across the lattice point carry the faces.
                let Some((c, r)) = quad.into_iter().find(|(c, r)| self.at(*c, *r) != inner) else {
                    continue;
                };
                let (right, up) = (c == column, r == row);
                let lengths = if inner {
                    // The free cell is bounded by its neighbours inside the quad.
                    let beside = if right { (c - 1, 0) } else { (c + 1, 1) };
                    let stacked = if up { (r - 1, 2) } else { (r + 1, 3) };
                    (run(beside.0, r, beside.1), run(c, stacked.0, stacked.1))
                } else {
                    (run(c, r, if right { 1 } else { 0 }), run(c, r, if up { 3 } else { 2 }))
                };
                if lengths.0.max(lengths.1) >= long && lengths.0.min(lengths.1) >= short {
                    found.push((column as usize, row as usize, inner));
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walls(rows: &[&str], resolution: f64) -> (Walls, Vec<Solid>, Vec<Edge>) {
        Walls::new(&Plan::from_ascii(rows, resolution), &AsBuilt::exact(), 2.6)
    }

    #[test]
    fn blocks_cover_the_walls_and_nothing_else() {
        let rows = ["##########", "#   #    #", "#   ##   #", "#        #", "##########"];
        let (_, solids, _) = walls(&rows, 0.1);
        let plan = Plan::from_ascii(&rows, 0.1);
        for iy in 0..plan.height() {
            for ix in 0..plan.width() {
                let (x, y) = plan.centre(ix, iy);
                let inside = solids.iter().any(|s| s.outline_distance(x, y) < 0.0);
                assert_eq!(inside, plan.cell(ix, iy) == Cell::Occupied, "at {ix} {iy}");
            }
        }
        assert!(solids.len() < 20, "{} blocks", solids.len());
    }

    #[test]
    fn a_slanted_wall_faces_one_way_and_a_straight_one_its_axis() {
        // A staircase that rises one cell a cell; free space is above and left of it.
        let rows: Vec<String> =
            (0..40).map(|r| (0..40).map(|c| if c >= 40 - r { '#' } else { ' ' }).collect()).collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let (slanted, solids, _) = walls(&rows, 0.05);
        let mut checked = 0;
        for (i, solid) in solids.iter().enumerate() {
            let west = (solid.x - solid.half_x, solid.y + solid.half_y - 0.025);
            let middle = (0.5..1.5).contains(&west.0) && (0.5..1.5).contains(&west.1);
            // Blocks on the surface only: the cell before the face is free.
            if middle && Plan::from_ascii(&rows, 0.05).cell_at(west.0 - 0.02, west.1) == Cell::Free {
                let normal = slanted.normal(i, 1, west.0, west.1).expect("a face");
                let angle = normal[1].atan2(normal[0]).to_degrees();
                assert!((angle - 135.0).abs() < 12.0, "faces {angle} at {west:?}");
                checked += 1;
            }
        }
        assert!(checked > 3);
        let (straight, solids, _) = walls(&["          ", "##########"], 0.1);
        let normal = straight.normal(0, 2, solids[0].x, 0.1).expect("a face");
        assert!(normal[1] > 0.999);
    }

    #[test]
    fn corners_are_told_apart() {
        let rows = [
            "##########",
            "#        #",
            "#        #",
            "#   ###  #",
            "#   ###  #",
            "#   ###  #",
            "#        #",
            "##########",
        ];
        let (_, _, edges) = walls(&rows, 0.1);
        assert_eq!(edges.iter().filter(|e| e.inner).count(), 4);
        let outer: Vec<_> = edges.iter().filter(|e| !e.inner).collect();
        assert_eq!(outer.len(), 4, "{outer:?}");
        assert!(outer.iter().any(|e| (e.x - 0.4).abs() < 1e-4 && (e.y - 0.5).abs() < 1e-4));
    }
}
