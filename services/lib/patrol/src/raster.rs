use floorplan::Plan;

/// Most cells a side of the planning grid, and the cells in a row of [`Bits`].
pub const SIDE: usize = 512;
/// Words in a [`Bits`].
pub const WORDS: usize = SIDE * SIDE / 64;

/// Side of a cell of the planning grid, metres: half a door post. Larger plans have larger cells.
const CELL_M: f32 = 0.10;

/// The planning grid's place in the plan frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    /// Cells in x, at most [`SIDE`].
    pub width: usize,
    /// Cells in y, at most [`SIDE`].
    pub height: usize,
    /// Side of a cell, metres.
    pub cell_m: f32,
    /// Lower left corner of cell (0, 0), plan frame, metres.
    pub origin: (f32, f32),
}

impl Raster {
    /// The raster that covers a plan.
    pub fn over(plan: &Plan) -> Self {
        let extent = (plan.width() as f32 * plan.resolution(), plan.height() as f32 * plan.resolution());
        let cell_m = CELL_M.max(plan.resolution()).max(extent.0.max(extent.1) / SIDE as f32);
        // A hair less, so that an exact multiple does not get one column more.
        let cells = |metres: f32| ((metres / cell_m - 1e-3).ceil().max(1.0) as usize).min(SIDE);
        Self { width: cells(extent.0), height: cells(extent.1), cell_m, origin: plan.origin() }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of the cell at a place, row by row; `None` outside.
    pub fn cell(&self, x: f32, y: f32) -> Option<usize> {
        let fx = ((x - self.origin.0) / self.cell_m).floor();
        let fy = ((y - self.origin.1) / self.cell_m).floor();
        (fx >= 0.0 && fy >= 0.0 && fx < self.width as f32 && fy < self.height as f32)
            .then(|| fy as usize * self.width + fx as usize)
    }

    /// Column and row of a cell.
    pub fn column_row(&self, cell: usize) -> (usize, usize) {
        (cell % self.width, cell / self.width)
    }

    /// The middle of a cell, plan frame, metres.
    pub fn centre(&self, cell: usize) -> (f32, f32) {
        let (column, row) = self.column_row(cell);
        (
            self.origin.0 + (column as f32 + 0.5) * self.cell_m,
            self.origin.1 + (row as f32 + 0.5) * self.cell_m,
        )
    }

    /// The cell some columns and rows away; `None` outside.
    pub(crate) fn shifted(&self, cell: usize, columns: i32, rows: i32) -> Option<usize> {
        let (column, row) = self.column_row(cell);
        let (column, row) = (column as i32 + columns, row as i32 + rows);
        (column >= 0 && row >= 0 && column < self.width as i32 && row < self.height as i32)
            .then(|| row as usize * self.width + column as usize)
    }

    /// Metres between the middles of two cells.
    pub(crate) fn between(&self, a: usize, b: usize) -> f32 {
        let ((ax, ay), (bx, by)) = (self.column_row(a), self.column_row(b));
        (ax as f32 - bx as f32).hypot(ay as f32 - by as f32) * self.cell_m
    }

    /// Number of cells of an area in square metres, at least 1.
    pub(crate) fn cells_of(&self, area_m2: f32) -> usize {
        ((area_m2 / (self.cell_m * self.cell_m)).round() as usize).max(1)
    }
}

/// One bit for each cell of a [`Raster`]: bit `row * 512 + column`, as in the message `navigation/patrol`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bits {
    words: Box<[u64]>,
}

impl Default for Bits {
    fn default() -> Self {
        Self { words: vec![0; WORDS].into_boxed_slice() }
    }
}

impl Bits {
    /// A copy of words as [`Bits::words`] gives them; missing ones are zero, further ones ignored.
    pub fn from_words(words: &[u64]) -> Self {
        let mut bits = Self::default();
        bits.copy_from_words(words);
        bits
    }

    /// As [`Bits::from_words`], in place.
    pub fn copy_from_words(&mut self, words: &[u64]) {
        self.words.fill(0);
        for (to, from) in self.words.iter_mut().zip(words) {
            *to = *from;
        }
    }

    /// All bits, 64 a word, the lowest first; [`WORDS`] words.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Whether any bit is set.
    pub fn any(&self) -> bool {
        self.words.iter().any(|word| *word != 0)
    }

    /// The bit of a cell.
    pub fn get(&self, raster: &Raster, cell: usize) -> bool {
        let (word, bit) = place(raster, cell);
        self.words.get(word).is_some_and(|word| word >> bit & 1 == 1)
    }

    /// Sets or clears the bit of a cell.
    pub fn set(&mut self, raster: &Raster, cell: usize, value: bool) {
        let (word, bit) = place(raster, cell);
        if let Some(word) = self.words.get_mut(word) {
            *word = *word & !(1 << bit) | u64::from(value) << bit;
        }
    }

    /// Clears all.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// How many are set.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// How many are set here and in `other`.
    pub fn count_both(&self, other: &Self) -> usize {
        self.words.iter().zip(&other.words).map(|(a, b)| (a & b).count_ones() as usize).sum()
    }

    /// Sets what is set in `other`.
    pub fn add(&mut self, other: &Self) {
        for (to, from) in self.words.iter_mut().zip(&other.words) {
            *to |= from;
        }
    }

    /// The cells that are set.
    pub fn cells<'a>(&'a self, raster: &'a Raster) -> impl Iterator<Item = usize> + 'a {
        (0..raster.len()).filter(|cell| self.get(raster, *cell))
    }
}

fn place(raster: &Raster, cell: usize) -> (usize, usize) {
    let (column, row) = raster.column_row(cell);
    let bit = row * SIDE + column;
    (bit / 64, bit % 64)
}
