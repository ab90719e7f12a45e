//! How far a straight strip ahead is free of what the sonars have seen.

use crate::grid::{CELLS, SIDE, Window};

/// Distance from (x, y) along `angle_rad` to the first cell with at least `certainty` whose centre lies within
/// `half_width_m` of the line, metres along the line; at most `length_m`. Cells behind do not count.
/// Not finite input answers 0: nothing is known to be free.
#[must_use]
pub fn free_length(
    cells: &[u8],
    window: &Window,
    (x, y): (f32, f32),
    angle_rad: f32,
    half_width_m: f32,
    length_m: f32,
    certainty: u8,
) -> f32 {
    if !(x.is_finite()
        && y.is_finite()
        && angle_rad.is_finite()
        && half_width_m.is_finite()
        && length_m >= 0.0)
    {
        return 0.0;
    }
    let (sin, cos) = angle_rad.sin_cos();
    let mut free = length_m;
    for_each_certain(cells, certainty, |index| {
        let (cx, cy) = window.centre(index);
        let (dx, dy) = (cx - x, cy - y);
        let along = dx * cos + dy * sin;
        if along > 0.0 && along < free && (dy * cos - dx * sin).abs() <= half_width_m {
            free = along;
        }
    });
    free
}

/// Calls `visit` with the index of every cell of at least `certainty` (and more than nothing).
pub fn for_each_certain(cells: &[u8], certainty: u8, mut visit: impl FnMut(usize)) {
    let certainty = certainty.max(1);
    for (row, line) in cells.chunks(SIDE).enumerate().take(CELLS / SIDE) {
        // Most rows are empty, and a row's maximum is found eight and more bytes at a time.
        if line.iter().fold(0u8, |most, c| most.max(*c)) < certainty {
            continue;
        }
        for (column, cell) in line.iter().enumerate() {
            if *cell >= certainty {
                visit(row * SIDE + column);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::{FRAC_PI_2, PI};

    #[test]
    fn only_what_stands_in_the_strip_ahead_counts() {
        let window = Window::around(0.0, 0.0).unwrap();
        let mut cells = vec![0u8; CELLS];
        cells[window.index(0.83, 0.21).unwrap()] = 20;
        let free =
            |angle, half, certainty| free_length(&cells, &window, (0.0, 0.0), angle, half, 1.5, certainty);
        assert!((free(0.0, 0.3, 16) - 0.825).abs() < 0.01);
        assert_eq!(free(0.0, 0.15, 16), 1.5, "beside the strip");
        assert_eq!(free(0.0, 0.3, 24), 1.5, "not certain enough");
        assert_eq!(free(PI, 0.3, 16), 1.5, "behind");
        assert_eq!(free(FRAC_PI_2, 0.3, 16), 1.5, "to the side");
        assert_eq!(free(f32::NAN, 0.3, 16), 0.0);
    }
}
