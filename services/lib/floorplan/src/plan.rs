use crate::surface::Surfaces;
use crate::{DistanceField, NamedArea, PlanError, PlanHeader, leap, picture};

/// Most cells a side.
pub const MAX_SIDE: usize = 8_192;
/// Most cells in all: 200 m x 200 m at 5 cm.
pub const MAX_CELLS: usize = 16_000_000;

/// What the plan says of one cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Cell {
    /// Nothing stands here.
    Free = 0,
    /// A wall or something else that reaches the flight height.
    Occupied = 1,
    /// Nobody looked: not to be flown through, but sound passes.
    Unknown = 2,
}

/// The building as a raster in the plan frame: x right, y up, metres; cell (0, 0) is the lower left one.
#[derive(Clone, Debug)]
pub struct Plan {
    width: usize,
    height: usize,
    resolution: f32,
    origin: (f32, f32),
    cells: Vec<Cell>,
    surfaces: Surfaces,
    leaps: Vec<u8>,
    hash: u64,
}

impl Plan {
    /// Makes a plan of a checked header and the bytes of its picture (PGM or PNG). `file` is for messages.
    ///
    /// # Errors
    /// Not a picture, of an absurd size, or without a free cell.
    pub fn load(file: &str, header: &PlanHeader, image: &[u8]) -> Result<Self, PlanError> {
        let (width, cells) = picture::read(file, header, image)?;
        if !cells.contains(&Cell::Free) {
            return Err(PlanError::NoFreeCell { file: file.to_owned() });
        }
        let origin = (header.origin[0] as f32, header.origin[1] as f32);
        Ok(Self::from_cells(width, header.resolution as f32, origin, cells))
    }

    /// Makes a plan of drawn rows, the first one on top, with its lower left corner at (0, 0): `#` occupied,
    /// `?` unknown, everything else free (so that a test can mark places). Short rows end in unknown cells.
    pub fn from_ascii(rows: &[&str], resolution: f64) -> Self {
        let width = rows.iter().map(|row| row.chars().count()).max().unwrap_or(0).max(1);
        let mut cells = Vec::with_capacity(width * rows.len().max(1));
        for row in rows.iter().rev() {
            let before = cells.len();
            cells.extend(row.chars().map(|symbol| match symbol {
                '#' => Cell::Occupied,
                '?' => Cell::Unknown,
                _ => Cell::Free,
            }));
            cells.resize(before + width, Cell::Unknown);
        }
        cells.resize(cells.len().max(width), Cell::Unknown);
        let resolution = if resolution > 0.0 { resolution as f32 } else { 1.0 };
        Self::from_cells(width, resolution, (0.0, 0.0), cells)
    }

    /// `cells` row by row, the lowest first; a last row that is not full is dropped.
    pub(crate) fn from_cells(
        width: usize,
        resolution: f32,
        origin: (f32, f32),
        mut cells: Vec<Cell>,
    ) -> Self {
        let height = cells.len() / width;
        cells.truncate(width * height);
        let surfaces = Surfaces::new(width, height, resolution, &cells);
        let leaps = leap::leaps(width, height, &cells);
        let hash = hash(width, resolution, origin, &cells);
        Self { width, height, resolution, origin, cells, surfaces, leaps, hash }
    }

    /// Cells in x.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Cells in y.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Side of a cell, metres.
    pub fn resolution(&self) -> f32 {
        self.resolution
    }

    /// Plan-frame place of the lower left corner of cell (0, 0), metres.
    pub fn origin(&self) -> (f32, f32) {
        self.origin
    }

    /// One number for size, place and every cell: equal plans have equal hashes on every machine.
    pub fn hash(&self) -> u64 {
        self.hash
    }

    /// Which cells lie in one of these areas, row by row, x fastest, the lowest row first; `None` when none does.
    #[must_use]
    pub fn within(&self, areas: &[NamedArea]) -> Option<Vec<bool>> {
        if areas.is_empty() {
            return None;
        }
        let within = |cell: usize| {
            let (x, y) = self.centre(cell % self.width, cell / self.width);
            areas.iter().any(|named| named.area.contains(x, y))
        };
        let cells: Vec<bool> = (0..self.cells.len()).map(within).collect();
        cells.contains(&true).then_some(cells)
    }

    /// The plan for whoever plans a flight: what must not be entered counts as unknown there. `None` when that is the plan
    /// itself.
    #[must_use]
    pub fn without(&self, areas: &[NamedArea]) -> Option<Self> {
        let within = self.within(areas)?;
        let close = |(cell, closed): (&Cell, bool)| match cell {
            Cell::Free if closed => Cell::Unknown,
            cell => *cell,
        };
        let cells = self.cells.iter().zip(within).map(close).collect();
        Some(Self::from_cells(self.width, self.resolution, self.origin, cells))
    }

    /// All cells, row by row, x fastest, the lowest row first.
    pub fn cells(&self) -> &[Cell] {
        &self.cells
    }

    /// One cell; outside the plan is unknown.
    pub fn cell(&self, ix: usize, iy: usize) -> Cell {
        if ix < self.width && iy < self.height { self.cells[iy * self.width + ix] } else { Cell::Unknown }
    }

    /// The cell at a place in the plan frame; outside the plan is unknown.
    pub fn cell_at(&self, x: f32, y: f32) -> Cell {
        self.cell_index(x, y).map_or(Cell::Unknown, |(ix, iy)| self.cell(ix, iy))
    }

    /// The indices of the cell at a place; `None` outside the plan.
    pub fn cell_index(&self, x: f32, y: f32) -> Option<(usize, usize)> {
        let fx = ((x - self.origin.0) / self.resolution).floor();
        let fy = ((y - self.origin.1) / self.resolution).floor();
        (fx >= 0.0 && fy >= 0.0 && fx < self.width as f32 && fy < self.height as f32)
            .then_some((fx as usize, fy as usize))
    }

    /// The middle of a cell in the plan frame, metres.
    pub fn centre(&self, ix: usize, iy: usize) -> (f32, f32) {
        (
            self.origin.0 + (ix as f32 + 0.5) * self.resolution,
            self.origin.1 + (iy as f32 + 0.5) * self.resolution,
        )
    }

    /// Area of the free cells, square metres.
    pub fn free_area(&self) -> f32 {
        let free = self.cells.iter().filter(|cell| **cell == Cell::Free).count();
        free as f32 * self.resolution * self.resolution
    }

    /// Whether a vehicle may start at this pad.
    ///
    /// # Errors
    /// The pad is not on a free cell, or nearer than `clearance_m` to something occupied.
    pub fn check_pad(
        &self,
        field: &DistanceField,
        x: f32,
        y: f32,
        clearance_m: f32,
    ) -> Result<(), PlanError> {
        let place = match self.cell_index(x, y) {
            None => "outside the plan",
            Some((ix, iy)) => match self.cell(ix, iy) {
                Cell::Occupied => "inside a wall",
                Cell::Unknown => "in unknown space",
                Cell::Free => {
                    let found = field.distance(x, y);
                    if found < clearance_m {
                        return Err(PlanError::PadClearance {
                            x_m: x,
                            y_m: y,
                            clearance_m: found,
                            needed_m: clearance_m,
                        });
                    }
                    return Ok(());
                }
            },
        };
        Err(PlanError::PadPlace { x_m: x, y_m: y, place })
    }

    /// Steps to the nearest occupied cell, see [`leap::leaps`].
    pub(crate) fn leaps(&self) -> &[u8] {
        &self.leaps
    }

    pub(crate) fn surfaces(&self) -> &Surfaces {
        &self.surfaces
    }
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo): not for secrets, but the same everywhere.
fn hash(width: usize, resolution: f32, origin: (f32, f32), cells: &[Cell]) -> u64 {
    let head = [
        width as u64,
        u64::from(resolution.to_bits()),
        u64::from(origin.0.to_bits()),
        u64::from(origin.1.to_bits()),
    ];
    let bytes = head.iter().flat_map(|word| word.to_le_bytes()).chain(cells.iter().map(|cell| *cell as u8));
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
