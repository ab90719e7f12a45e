use crate::{Costmap, Raster};

/// Everything in sight of a cell, by rays that are one cell apart at their ends.
#[derive(Clone, Debug)]
pub(crate) struct Fan {
    /// End of each ray in `steps`.
    ends: Vec<usize>,
    steps: Vec<FanStep>,
}

#[derive(Clone, Copy, Debug)]
struct FanStep {
    columns: i16,
    rows: i16,
    metres: f32,
}

impl Fan {
    /// Rays as long as `reach_m`.
    pub(crate) fn new(raster: &Raster, reach_m: f32) -> Self {
        let reach = (reach_m / raster.cell_m).clamp(1.0, 200.0);
        let rays = (std::f32::consts::TAU * reach * 1.2).ceil() as usize;
        let (mut ends, mut steps) = (Vec::with_capacity(rays), Vec::new());
        for ray in 0..rays {
            let (sin, cos) = (std::f32::consts::TAU * ray as f32 / rays as f32).sin_cos();
            let mut last = (0, 0);
            // Half a cell a step: no cell that the ray crosses for long is missed.
            for k in 1..=(2.0 * reach) as usize {
                let along = 0.5 * k as f32;
                let here = ((along * cos).round() as i16, (along * sin).round() as i16);
                if here != last {
                    last = here;
                    let metres = f32::from(here.0).hypot(f32::from(here.1)) * raster.cell_m;
                    steps.push(FanStep { columns: here.0, rows: here.1, metres });
                }
            }
            ends.push(steps.len());
        }
        Self { ends, steps }
    }

    /// Most cells that one look costs.
    pub(crate) fn work(&self) -> usize {
        self.steps.len()
    }

    /// Calls `see` with every cell in sight of `from` within `reach_m` and its distance; most cells are
    /// called more than once.
    pub(crate) fn look(&self, map: &Costmap, from: usize, reach_m: f32, mut see: impl FnMut(usize, f32)) {
        let raster = map.raster();
        see(from, 0.0);
        let mut start = 0;
        for end in &self.ends {
            for step in &self.steps[start..*end] {
                if step.metres > reach_m {
                    break;
                }
                match raster.shifted(from, i32::from(step.columns), i32::from(step.rows)) {
                    Some(cell) if !map.is_opaque(cell) => see(cell, step.metres),
                    _ => break,
                }
            }
            start = *end;
        }
    }

    /// Whether nothing hides two cells from each other.
    pub(crate) fn clear_between(map: &Costmap, a: usize, b: usize) -> bool {
        let raster = map.raster();
        let ((ax, ay), (bx, by)) = (raster.column_row(a), raster.column_row(b));
        let (dx, dy) = (bx as f32 - ax as f32, by as f32 - ay as f32);
        let steps = (2.0 * dx.abs().max(dy.abs())).ceil().max(1.0);
        (0..=steps as usize).all(|k| {
            let t = k as f32 / steps;
            let (x, y) = (ax as f32 + t * dx, ay as f32 + t * dy);
            !map.is_opaque(y.round() as usize * raster.width + x.round() as usize)
        })
    }
}
