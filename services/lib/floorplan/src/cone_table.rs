mod batch;

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, OnceLock};

use crate::{Cell, ConeModel, Hit, Plan};

/// Headings a turn: one degree is 7 cm across at 4 m, about a cell.
const HEADINGS: usize = 360;
/// Positions a cell and side.
const SUB: usize = 1;
/// Positions a side of a tile, the unit of allocation.
const TILE: usize = 8;
const TILE_BYTES: usize = TILE * TILE * HEADINGS;

/// Not worked out yet.
const EMPTY: u8 = 0;
/// Nothing is heard.
const NO_ECHO: u8 = u8::MAX;
/// Ranges are stored as 1..=LEVELS.
const LEVELS: f32 = 253.0;

/// [`crate::cast_cone`] from memory: one byte for every place and degree, worked out when first asked for.
///
/// The place is rounded to the middle of its raster cell and the heading to a degree; the range is then
/// corrected by how far the place is along the axis from that middle, so that it still changes smoothly.
/// Every value is a function of plan and model alone: threads that share a table and race to fill it
/// write the same bytes, and equal questions have equal answers for ever.
#[derive(Debug)]
pub struct ConeTable {
    plan: Arc<Plan>,
    model: ConeModel,
    tiles: Vec<OnceLock<Box<[AtomicU8]>>>,
    tiles_x: usize,
    /// Positions across and up.
    width: usize,
    height: usize,
    /// Metres between positions, and its inverse.
    pitch: f32,
    inverse_pitch: f32,
    /// Metres a level.
    level_m: f32,
    /// Cosine and sine of every heading.
    directions: Box<[(f32, f32)]>,
    /// The sub-rays as whole headings from the axis.
    offsets: Box<[usize]>,
}

/// All headings at one place of a [`ConeTable`]: look the place up once, then ask for each sensor.
#[derive(Clone, Copy, Debug)]
pub struct ConeCell<'a> {
    table: &'a ConeTable,
    values: &'a [AtomicU8],
    position: (usize, usize),
    /// From the middle of the position, metres.
    off: (f32, f32),
}

impl ConeTable {
    /// An empty table; nothing is worked out or allocated yet but its index.
    pub fn new(plan: Arc<Plan>, model: ConeModel) -> Self {
        let (width, height) = (plan.width() * SUB, plan.height() * SUB);
        let (tiles_x, tiles_y) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let pitch = plan.resolution() / SUB as f32;
        let turn = std::f32::consts::TAU;
        let directions = (0..HEADINGS)
            .map(|k| {
                let (sin, cos) = (turn * k as f32 / HEADINGS as f32).sin_cos();
                (cos, sin)
            })
            .collect();
        let offsets = model
            .offsets()
            .map(|offset| {
                ((offset * HEADINGS as f32 / turn).round() as i32).rem_euclid(HEADINGS as i32) as usize
            })
            .collect();
        Self {
            level_m: (model.max_range_m / LEVELS).max(f32::MIN_POSITIVE),
            plan,
            model,
            tiles: std::iter::repeat_with(OnceLock::new).take(tiles_x * tiles_y).collect(),
            tiles_x,
            width,
            height,
            pitch,
            inverse_pitch: 1.0 / pitch,
            directions,
            offsets,
        }
    }

    /// The plan that is asked.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// The sensor that asks.
    pub fn model(&self) -> &ConeModel {
        &self.model
    }

    /// Allocates the memory of every tile that has a free cell, so that no later look-up from free space
    /// allocates. Nothing is worked out by this.
    pub fn allocate(&self) {
        for iy in 0..self.plan.height() {
            for ix in 0..self.plan.width() {
                if self.plan.cell(ix, iy) == Cell::Free {
                    self.tile(ix * SUB / TILE, iy * SUB / TILE);
                }
            }
        }
    }

    /// The nearest echo from a place in the plan frame along `angle`, metres; infinite when there is none,
    /// outside the plan too.
    pub fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        self.at(x, y).map_or(f32::INFINITY, |cell| cell.range(angle))
    }

    /// The table's cell at a place; `None` outside the plan.
    #[inline]
    pub fn at(&self, x: f32, y: f32) -> Option<ConeCell<'_>> {
        let origin = self.plan.origin();
        let (fx, fy) = ((x - origin.0) * self.inverse_pitch, (y - origin.1) * self.inverse_pitch);
        if !(fx >= 0.0 && fy >= 0.0 && fx < self.width as f32 && fy < self.height as f32) {
            return None;
        }
        let (px, py) = (fx as usize, fy as usize);
        let off = ((fx - px as f32 - 0.5) * self.pitch, (fy - py as f32 - 0.5) * self.pitch);
        let tile = self.tile(px / TILE, py / TILE);
        let first = ((py % TILE) * TILE + px % TILE) * HEADINGS;
        Some(ConeCell { table: self, values: &tile[first..first + HEADINGS], position: (px, py), off })
    }

    /// Bytes held now: grows with the area that was asked about.
    pub fn memory_bytes(&self) -> usize {
        let filled = self.tiles.iter().filter(|tile| tile.get().is_some()).count();
        size_of::<Self>()
            + self.tiles.len() * size_of::<OnceLock<Box<[AtomicU8]>>>()
            + self.directions.len() * size_of::<(f32, f32)>()
            + filled * TILE_BYTES
    }

    #[inline]
    fn tile(&self, tx: usize, ty: usize) -> &[AtomicU8] {
        self.tiles[ty * self.tiles_x + tx]
            .get_or_init(|| std::iter::repeat_with(|| AtomicU8::new(EMPTY)).take(TILE_BYTES).collect())
    }

    /// Works out all headings of a place: each ray is cast once and serves every cone it lies in.
    #[cold]
    fn fill(&self, (px, py): (usize, usize), values: &[AtomicU8]) {
        let origin = self.plan.origin();
        let x = origin.0 + (px as f32 + 0.5) * self.pitch;
        let y = origin.1 + (py as f32 + 0.5) * self.pitch;
        let mut rays = [NO_ECHO; HEADINGS];
        for (k, (ray, (cos, sin))) in rays.iter_mut().zip(&self.directions).enumerate() {
            if let Some((index, range)) = self.plan.walk(x, y, *cos, *sin, self.model.max_range_m) {
                let angle = std::f32::consts::TAU * k as f32 / HEADINGS as f32;
                let surfaces = self.plan.surfaces();
                let scatters = surfaces.scatters(index);
                let incidence_rad = surfaces.incidence(index, angle);
                if self.model.hears(&Hit { range_m: range, incidence_rad, scatters }) {
                    *ray = 1 + (range / self.level_m).round().min(LEVELS - 1.0) as u8;
                }
            }
        }
        for (axis, value) in values.iter().enumerate() {
            let nearest = self.offsets.iter().map(|offset| {
                let k = axis + offset;
                rays[if k < HEADINGS { k } else { k - HEADINGS }]
            });
            value.store(nearest.min().unwrap_or(NO_ECHO), Ordering::Relaxed);
        }
    }
}

impl ConeCell<'_> {
    /// As [`ConeTable::range`], for this place.
    #[inline]
    pub fn range(&self, angle: f32) -> f32 {
        const A_TURN: f32 = HEADINGS as f32 / std::f32::consts::TAU;
        // An angle that is no number becomes heading 0; half a turn more keeps the usual ones positive.
        let heading = (angle * A_TURN + 0.5).floor() as i32;
        let heading = heading.rem_euclid(HEADINGS as i32) as usize;
        let mut value = self.values[heading].load(Ordering::Relaxed);
        if value == EMPTY {
            self.table.fill(self.position, self.values);
            value = self.values[heading].load(Ordering::Relaxed);
        }
        if value == NO_ECHO {
            return f32::INFINITY;
        }
        let (cos, sin) = self.table.directions[heading];
        let range = f32::from(value - 1) * self.table.level_m;
        (range - self.off.0 * cos - self.off.1 * sin).max(0.0)
    }
}
