//! A drawing of a building, as an architect or a phone gives it, becomes a plan.

use std::collections::VecDeque;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use serde::{Deserialize, Serialize};

use crate::picture::check_size;
use crate::{Cell, DistanceField, Pad, Plan, PlanError, widest_place};

/// Side of a cell of the plan that is made, metres.
pub const DRAWN_CELL_M: f64 = 0.05;
/// Most lines that are drawn into a drawing, and most rectangles wiped out of it.
const MAX_MENDED: usize = 256;
/// Farthest coordinate, metres, as for a sidecar file.
const MAX_COORDINATE_M: f64 = 10_000.0;
/// Space that a vehicle needs around itself where it starts, metres.
const MARGIN_M: f32 = 0.15;
/// An opening in a wall is narrower than twice this, metres.
const GATE_M: f32 = 1.2;
/// What messages call the plan.
const NAME: &str = "plan";

/// A picture in shades of grey: row by row, the top one first; 0 is black.
#[derive(Clone, Copy, Debug)]
pub struct Drawing<'a> {
    width: usize,
    height: usize,
    shades: &'a [u8],
}

/// How a drawing is to be read.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// Side of a pixel, metres.
    pub metres_per_pixel: f64,
    /// Plan-frame place of the picture's lower left corner, metres.
    #[serde(default)]
    pub origin: [f64; 2],
    /// A pixel darker than this is a wall.
    pub dark_below: u8,
    /// Lines that are walls, too, across gaps: x, y, x, y in metres.
    #[serde(default)]
    pub walls: Vec<[f64; 4]>,
    /// Rectangles in which nothing dark counts, such as lettering: two opposite corners x, y, x, y in metres.
    #[serde(default)]
    pub wiped: Vec<[f64; 4]>,
}

impl<'a> Drawing<'a> {
    /// # Errors
    /// When there are not `width * height` shades.
    pub fn new(width: usize, height: usize, shades: &'a [u8]) -> Result<Self, PlanError> {
        if width.checked_mul(height) == Some(shades.len()) {
            return Ok(Self { width, height, shades });
        }
        let said = format!("{} shades for {width} x {height} pixels", shades.len());
        Err(PlanError::range(NAME, "drawing", &said, "one shade a pixel"))
    }
}

/// The plan that a drawing shows, in cells of [`DRAWN_CELL_M`]: a cell is a wall when any of its pixels is dark, free when
/// it can be reached from the pad without passing a wall, and unknown otherwise. Dark marks that stand in no reached
/// space (lettering, dimensions) become unknown.
///
/// # Errors
/// A value out of range; a building larger than a plan may be, open to the outside, or without room for a vehicle of
/// `radius_m`; a pad in or near a wall.
pub fn plan_of_drawing(
    drawing: &Drawing<'_>,
    reading: &Reading,
    pad: &Pad,
    radius_m: f32,
) -> Result<Plan, PlanError> {
    check(reading)?;
    let side = |pixels: usize| {
        (pixels as f64 * reading.metres_per_pixel / DRAWN_CELL_M - 1e-6).ceil().max(0.0) as u64
    };
    check_size(NAME, side(drawing.width), side(drawing.height))?;
    let mut raster = Raster::new(side(drawing.width) as usize, side(drawing.height) as usize, reading.origin);
    raster.darken(drawing, reading);
    for [ax, ay, bx, by] in &reading.wiped {
        raster.wipe(ax.min(*bx), ay.min(*by), ax.max(*bx), ay.max(*by));
    }
    for line in &reading.walls {
        raster.draw(*line);
    }
    let place = |place| Err(PlanError::PadPlace { x_m: pad.x, y_m: pad.y, place });
    let Some(start) = raster.cell_at(f64::from(pad.x), f64::from(pad.y)) else {
        return place("outside the plan");
    };
    if raster.dark.get(start) != Some(&false) {
        return place("inside a wall");
    }
    let reached = raster.reached(start)?;
    let marks = raster.standing(&reached);
    let cells = reached
        .iter()
        .zip(marks)
        .map(|(reached, mark)| match (reached, mark) {
            (true, _) => Cell::Free,
            (false, true) => Cell::Occupied,
            (false, false) => Cell::Unknown,
        })
        .collect();
    let origin = (reading.origin[0] as f32, reading.origin[1] as f32);
    let plan = Plan::from_cells(raster.width, DRAWN_CELL_M as f32, origin, cells);
    if widest_place(&plan, radius_m).is_none() {
        let needed = 2.0 * (radius_m + MARGIN_M);
        let said = format!("{:.1} m2 of floor, nowhere {needed:.2} m wide", plan.free_area());
        return Err(PlanError::range(NAME, "free space", &said, "room for the vehicle: is the scale right?"));
    }
    let clearance = radius_m + MARGIN_M;
    plan.check_pad(&DistanceField::new(&plan, clearance + 1.0), pad.x, pad.y, clearance)?;
    Ok(plan)
}

/// The plan as PNG in the shades that every reader of such plans knows: 0 wall, 205 unknown, 254 free.
///
/// # Errors
/// When it cannot be encoded: never for a plan of a size that a plan may have.
pub fn picture_of_plan(plan: &Plan) -> Result<Vec<u8>, PlanError> {
    let shade = |cell: &Cell| match cell {
        Cell::Occupied => 0_u8,
        Cell::Unknown => 205,
        Cell::Free => 254,
    };
    let rows = plan.cells().chunks(plan.width()).rev();
    let shades: Vec<u8> = rows.flatten().map(shade).collect();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(&shades, plan.width() as u32, plan.height() as u32, ExtendedColorType::L8)
        .map_err(|error| PlanError::NotAnImage {
            file: NAME.to_owned(),
            picture: "png".to_owned(),
            reason: error.to_string(),
        })?;
    Ok(bytes)
}

fn check(reading: &Reading) -> Result<(), PlanError> {
    let fail =
        |field: &str, value: &dyn ToString, allowed| Err(PlanError::range(NAME, field, value, allowed));
    if !(0.0005..=0.5).contains(&reading.metres_per_pixel) {
        return fail("metres_per_pixel", &reading.metres_per_pixel, "0.0005 to 0.5 m");
    }
    for value in reading.origin {
        if !(-5_000.0..=5_000.0).contains(&value) {
            return fail("origin", &value, "-5000 to 5000 m");
        }
    }
    for (field, shapes) in [("walls", &reading.walls), ("wiped", &reading.wiped)] {
        if shapes.len() > MAX_MENDED {
            return fail(field, &format!("{} of them", shapes.len()), "at most 256");
        }
        if let Some(value) =
            shapes.iter().flatten().find(|value| !(-MAX_COORDINATE_M..=MAX_COORDINATE_M).contains(*value))
        {
            return fail(field, value, "-10000 to 10000 m");
        }
    }
    Ok(())
}

/// Which cells are dark; the lowest row first.
struct Raster {
    width: usize,
    height: usize,
    origin: [f64; 2],
    dark: Vec<bool>,
}

impl Raster {
    fn new(width: usize, height: usize, origin: [f64; 2]) -> Self {
        Self { width, height, origin, dark: vec![false; width * height] }
    }

    fn darken(&mut self, drawing: &Drawing<'_>, reading: &Reading) {
        let pixel = reading.metres_per_pixel;
        let dark = |x: usize, row: usize| {
            drawing.shades.get(row * drawing.width + x).is_some_and(|shade| *shade < reading.dark_below)
        };
        if pixel <= DRAWN_CELL_M {
            // By their middles: then neighbours stay neighbours, and a line one pixel wide stays whole.
            let cell = |k: usize, most: usize| {
                (((k as f64 + 0.5) * pixel / DRAWN_CELL_M) as usize).min(most.saturating_sub(1))
            };
            let columns: Vec<usize> = (0..drawing.width).map(|x| cell(x, self.width)).collect();
            for row in 0..drawing.height {
                let start = cell(drawing.height - 1 - row, self.height) * self.width;
                for (x, column) in columns.iter().enumerate() {
                    if dark(x, row)
                        && let Some(cell) = self.dark.get_mut(start + column)
                    {
                        *cell = true;
                    }
                }
            }
        } else {
            let of = |k: usize, most: usize| {
                (((k as f64 + 0.5) * DRAWN_CELL_M / pixel) as usize).min(most.saturating_sub(1))
            };
            for (index, cell) in self.dark.iter_mut().enumerate() {
                let (x, y) = (of(index % self.width, drawing.width), of(index / self.width, drawing.height));
                *cell = dark(x, drawing.height - 1 - y);
            }
        }
    }

    fn cell_at(&self, x: f64, y: f64) -> Option<usize> {
        let fx = ((x - self.origin[0]) / DRAWN_CELL_M).floor();
        let fy = ((y - self.origin[1]) / DRAWN_CELL_M).floor();
        (fx >= 0.0 && fy >= 0.0 && fx < self.width as f64 && fy < self.height as f64)
            .then_some(fy as usize * self.width + fx as usize)
    }

    fn middle(&self, cell: usize) -> (f64, f64) {
        let at = |k: usize, origin: f64| origin + (k as f64 + 0.5) * DRAWN_CELL_M;
        (at(cell % self.width, self.origin[0]), at(cell / self.width, self.origin[1]))
    }

    fn wipe(&mut self, left: f64, bottom: f64, right: f64, top: f64) {
        let cells = |from: f64, to: f64, most: usize| {
            let bound = |value: f64| (value / DRAWN_CELL_M).round().clamp(0.0, most as f64) as usize;
            bound(from)..bound(to)
        };
        for y in cells(bottom - self.origin[1], top - self.origin[1], self.height) {
            for x in cells(left - self.origin[0], right - self.origin[0], self.width) {
                if let Some(cell) = self.dark.get_mut(y * self.width + x) {
                    *cell = false;
                }
            }
        }
    }

    fn draw(&mut self, [ax, ay, bx, by]: [f64; 4]) {
        // A quarter of a cell at a time leaves no gap; longer than the raster's diagonal is outside it.
        let diagonal = (self.width + self.height) as f64 * DRAWN_CELL_M;
        let length = (bx - ax).hypot(by - ay);
        let steps = (length / DRAWN_CELL_M * 4.0).ceil().max(1.0);
        let most = (diagonal / DRAWN_CELL_M * 4.0).max(1.0) * 4.0;
        for k in 0..=steps.min(most) as usize {
            let t = k as f64 / steps.min(most);
            if let Some(cell) = self.cell_at(ax + t * (bx - ax), ay + t * (by - ay))
                && let Some(dark) = self.dark.get_mut(cell)
            {
                *dark = true;
            }
        }
    }

    fn beside(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (x, y, width) = (cell % self.width, cell / self.width, self.width);
        [
            (x > 0).then(|| cell - 1),
            (x + 1 < width).then(|| cell + 1),
            (y > 0).then(|| cell - width),
            (y + 1 < self.height).then(|| cell + width),
        ]
        .into_iter()
        .flatten()
    }

    fn around(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        let (x, y, width, height) = (cell % self.width, cell / self.width, self.width, self.height);
        (y.saturating_sub(1)..=(y + 1).min(height - 1))
            .flat_map(move |ny| (x.saturating_sub(1)..=(x + 1).min(width - 1)).map(move |nx| ny * width + nx))
    }

    /// What can be reached from `start` over the sides of cells.
    fn reached(&self, start: usize) -> Result<Vec<bool>, PlanError> {
        const NONE: u32 = u32::MAX;
        // By way of which cell each was reached: a plan has fewer than 2^32.
        let mut by = vec![NONE; self.dark.len()];
        let mut next = VecDeque::from([start]);
        if let Some(first) = by.get_mut(start) {
            *first = start as u32;
        }
        while let Some(cell) = next.pop_front() {
            let (x, y) = (cell % self.width, cell / self.width);
            if x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height {
                return Err(self.open(cell, &by));
            }
            for other in self.beside(cell) {
                if self.dark.get(other) == Some(&false)
                    && let Some(way @ &mut NONE) = by.get_mut(other)
                {
                    *way = cell as u32;
                    next.push_back(other);
                }
            }
        }
        Ok(by.into_iter().map(|way| way != NONE).collect())
    }

    /// The building is not closed: one comes out at `edge`. Names the last narrow place on the way there, most likely the gap.
    fn open(&self, edge: usize, by: &[u32]) -> PlanError {
        let field =
            DistanceField::from_blocked(&self.dark, self.width, DRAWN_CELL_M as f32, (0.0, 0.0), GATE_M);
        let mut gap = edge;
        let mut least = f32::INFINITY;
        let mut cell = edge;
        while let Some(way) = by.get(cell).map(|way| *way as usize)
            && way != cell
        {
            let clear = field.at_cell(cell % self.width, cell / self.width);
            if clear < GATE_M && clear < least {
                (gap, least) = (cell, clear);
            } else if least < f32::INFINITY && clear > least + 0.2 {
                break;
            }
            cell = way;
        }
        let (x, y) = self.middle(gap);
        let said = format!("open to the outside, most likely at ({x:.2}, {y:.2})");
        PlanError::range(NAME, "walls", &said, "walls all around: draw one across the gap")
    }

    /// Dark cells that belong to something that stands in, or around, what was reached.
    fn standing(&self, reached: &[bool]) -> Vec<bool> {
        let mut standing = vec![false; self.dark.len()];
        let mut next: Vec<usize> = Vec::new();
        for (cell, dark) in self.dark.iter().enumerate() {
            if *dark && self.around(cell).any(|other| reached.get(other) == Some(&true)) {
                next.push(cell);
            }
        }
        for cell in &next {
            if let Some(stands) = standing.get_mut(*cell) {
                *stands = true;
            }
        }
        while let Some(cell) = next.pop() {
            for other in self.around(cell) {
                if self.dark.get(other) == Some(&true)
                    && let Some(stands @ &mut false) = standing.get_mut(other)
                {
                    *stands = true;
                    next.push(other);
                }
            }
        }
        standing
    }
}
