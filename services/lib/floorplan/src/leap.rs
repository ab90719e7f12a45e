use crate::Cell;

/// For each cell the number of steps (over sides and corners) to the nearest occupied one, at most 255:
/// 0 is occupied, and a ray in a cell with `n` may leap `n - 1` cells at once.
pub(crate) fn leaps(width: usize, height: usize, cells: &[Cell]) -> Vec<u8> {
    let mut steps: Vec<u8> =
        cells.iter().map(|cell| if *cell == Cell::Occupied { 0 } else { u8::MAX }).collect();
    let nearest = |steps: &[u8], x: usize, y: usize, side: isize| -> u8 {
        // The neighbours that the sweep has passed: the row before, and the cell before in this row.
        let mut least = steps[y * width + x];
        let mut look = |nx: Option<usize>, ny: Option<usize>| {
            if let (Some(nx), Some(ny)) = (nx, ny)
                && nx < width
                && ny < height
            {
                least = least.min(steps[ny * width + nx].saturating_add(1));
            }
        };
        for dx in [-1, 0, 1] {
            look(x.checked_add_signed(dx), y.checked_add_signed(side));
        }
        look(x.checked_add_signed(side), Some(y));
        least
    };
    for y in 0..height {
        for x in 0..width {
            steps[y * width + x] = nearest(&steps, x, y, -1);
        }
    }
    for y in (0..height).rev() {
        for x in (0..width).rev() {
            steps[y * width + x] = nearest(&steps, x, y, 1);
        }
    }
    steps
}
