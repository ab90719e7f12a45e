//! A time stamp in the picture that survives encoding: to measure how old a picture is where it is shown.
//!
//! Two rows of twenty square cells in the upper left corner, black or white, each a whole number of macroblocks (16 pixels)
//! wide: white, black, white; 32 bits, the highest first; four bits that are the exclusive or of the eight groups of four; white.

/// Cells a row.
pub const COLUMNS: usize = 20;
/// Rows.
pub const ROWS: usize = 2;
const CELLS: usize = COLUMNS * ROWS;
const WHITE: u8 = 235;
const BLACK: u8 = 16;
const BEGIN: [bool; 3] = [true, false, true];

/// Side of a cell in a picture of this width, pixels; 0 when there is no room for the code.
#[must_use]
pub fn cell_side(width: usize) -> usize {
    (width / (2 * COLUMNS)) / 16 * 16
}

fn cells(number: u32) -> [bool; CELLS] {
    let check = (0..8).fold(0, |sum, k| sum ^ (number >> (4 * k) & 15));
    std::array::from_fn(|i| match i {
        0..3 => BEGIN[i],
        3..35 => number >> (34 - i) & 1 == 1,
        35..39 => check >> (38 - i) & 1 == 1,
        _ => true,
    })
}

/// Draws a number over the luma of a picture. False when the picture is too small.
pub fn draw(luma: &mut [u8], stride: usize, width: usize, height: usize, number: u32) -> bool {
    let side = cell_side(width);
    if side == 0 || height < ROWS * side || luma.len() < stride * ROWS * side || stride < width {
        return false;
    }
    for (i, white) in cells(number).into_iter().enumerate() {
        let (column, row) = (i % COLUMNS * side, i / COLUMNS * side);
        for line in luma.chunks_exact_mut(stride).skip(row).take(side) {
            line[column..column + side].fill(if white { WHITE } else { BLACK });
        }
    }
    true
}

/// Reads a number back; `None` when there is none.
#[must_use]
pub fn read(luma: &[u8], stride: usize, width: usize) -> Option<u32> {
    let side = cell_side(width);
    if side == 0 || luma.len() < stride * ROWS * side {
        return None;
    }
    let white = |i: usize| {
        let (column, row) = (i % COLUMNS * side + side / 2, i / COLUMNS * side + side / 2);
        luma[row * stride + column] > 128
    };
    let number = (3..35).fold(0, |sum: u32, i| sum << 1 | u32::from(white(i)));
    (0..CELLS).map(white).eq(cells(number)).then_some(number)
}
