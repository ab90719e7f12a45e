mod look_up;

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

use crate::{Cell, ConeModel, Hit, Plan, PlanError};

/// Headings a turn: one degree is 7 cm across at 4 m, about a cell.
const HEADINGS: usize = 360;
/// What stands nearer than this many cells is taken to stand there when the parallax is worked out, or the cone would turn
/// to where nothing of it lies: by at most half a cell's diagonal over it, 13.5 degrees.
const NEAREST_CELLS: f32 = 3.0;
/// So many headings before the first and after the last stand in a row once more, for the parallax.
const HALO: usize = 16;
/// Bytes of a place: headings from half a turn below the x axis to half a turn above, and the halo.
const ROW: usize = HEADINGS + 2 * HALO;
/// Cells a side of a tile. Tiles with a free cell have a place in the table, and what is near lies near.
const TILE: usize = 8;

/// Not worked out yet.
const EMPTY: u8 = 0;
/// Nothing is heard.
const NO_ECHO: u8 = u8::MAX;
/// Ranges are stored as 1..=LEVELS.
const LEVELS: f32 = 253.0;
/// Place of the cells of a tile without a free cell, where nobody is: beyond any table, as are its bytes.
const NO_PLACE: u32 = u32::MAX;
const NOWHERE: usize = NO_PLACE as usize * ROW;

/// [`crate::cast_cone`] from memory: one byte for every cell and degree, worked out when first asked for.
///
/// The place is rounded to the middle of its cell. What stands at the range that is heard there is then seen from the
/// place itself: the heading is turned by the parallax, the range shortened by the way along the axis. Without the
/// first, a thing at the edge of the cone is heard or missed for the 3.5 cm that a place may be off its cell's middle:
/// on a scanned hall 1.2 % of the ranges are then off by more than two cells, with it 0.8 %.
///
/// Every value is a function of plan and model alone: threads that share a table and race to fill it
/// write the same bytes, and equal questions have equal answers for ever. No look-up allocates.
#[derive(Debug)]
pub struct ConeTable {
    plan: Arc<Plan>,
    model: ConeModel,
    /// All headings of all places. The system gives zeroed memory page by page as it is written, so that
    /// what is never asked about costs nothing.
    values: Box<[AtomicU8]>,
    /// Place of each cell in the table. A row takes 1 << `stride_bits` entries.
    cells: Box<[u32]>,
    stride_bits: u32,
    /// Cells worked out so far.
    filled: AtomicUsize,
    inverse_resolution: f32,
    /// Metres a level.
    level_m: f32,
    /// By what is stored: headings that it turns by for every metre that one steps aside.
    parallax: Box<[f32; 256]>,
    /// Cosine and sine of every heading.
    directions: Box<[(f32, f32)]>,
    /// The sub-rays as whole headings from the axis.
    offsets: Box<[usize]>,
}

impl ConeTable {
    /// An empty table with room for every tile that has a free cell; nothing is worked out yet.
    ///
    /// # Errors
    /// When this machine has not even the addresses for a plan of that size.
    pub fn new(plan: Arc<Plan>, model: ConeModel) -> Result<Self, PlanError> {
        let stride_bits = plan.width().next_power_of_two().trailing_zeros();
        let (cells, places) = places(&plan, stride_bits);
        let bytes = places * ROW;
        let values = bytemuck::try_zeroed_slice_box(bytes)
            .map_err(|()| PlanError::Memory { megabytes: bytes.div_ceil(1_000_000) })?;
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
        let level_m = (model.max_range_m / LEVELS).max(f32::MIN_POSITIVE);
        let nearest_m = NEAREST_CELLS * plan.resolution();
        let parallax = std::array::from_fn(|value| {
            // No echo as what stands at the end of the reach.
            HEADINGS as f32 / turn / (level_m * (value as f32 - 1.0)).max(nearest_m)
        });
        Ok(Self {
            level_m,
            parallax: Box::new(parallax),
            inverse_resolution: 1.0 / plan.resolution(),
            plan,
            model,
            values,
            cells,
            stride_bits,
            filled: AtomicUsize::new(0),
            directions,
            offsets,
        })
    }

    /// The plan that is asked.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// The sensor that asks.
    pub fn model(&self) -> &ConeModel {
        &self.model
    }

    /// Bytes written so far, the index included: grows with the area that was asked about.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>()
            + self.cells.len() * size_of::<u32>()
            + self.directions.len() * size_of::<(f32, f32)>()
            + self.filled.load(Ordering::Relaxed) * ROW
    }

    /// Works out all headings of a cell: each ray is cast once and serves every cone it lies in.
    fn fill(&self, (ix, iy): (usize, usize), values: &[AtomicU8]) {
        let (origin, resolution) = (self.plan.origin(), self.plan.resolution());
        let x = origin.0 + (ix as f32 + 0.5) * resolution;
        let y = origin.1 + (iy as f32 + 0.5) * resolution;
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
        let mut first = EMPTY;
        for (byte, value) in values.iter().enumerate() {
            let axis = byte + 2 * HEADINGS - HALO - HEADINGS / 2;
            let nearest = self.offsets.iter().map(|offset| rays[(axis + offset) % HEADINGS]);
            let before = value.swap(nearest.min().unwrap_or(NO_ECHO), Ordering::Relaxed);
            if byte == 0 {
                first = before;
            }
        }
        // Of threads that race for a cell one alone finds it empty.
        self.filled.fetch_add(usize::from(first == EMPTY), Ordering::Relaxed);
    }
}

/// Gives each cell of each tile that has a free one a place: the places of the cells, and how many there are.
fn places(plan: &Plan, stride_bits: u32) -> (Box<[u32]>, usize) {
    let (width, height) = (plan.width(), plan.height());
    let mut cells = vec![NO_PLACE; height << stride_bits].into_boxed_slice();
    let mut count = 0;
    for (ty, tx) in (0..height).step_by(TILE).flat_map(|ty| (0..width).step_by(TILE).map(move |tx| (ty, tx)))
    {
        let tile = || {
            (ty..height.min(ty + TILE)).flat_map(move |iy| (tx..width.min(tx + TILE)).map(move |ix| (ix, iy)))
        };
        if tile().any(|(ix, iy)| plan.cell(ix, iy) == Cell::Free) {
            for (ix, iy) in tile() {
                cells[(iy << stride_bits) + ix] = count;
                count += 1;
            }
        }
    }
    (cells, count as usize)
}
