use crate::{Cell, Plan};

/// How far the nearest occupied cell is, from anywhere.
#[derive(Clone, Debug)]
pub struct DistanceField {
    width: usize,
    height: usize,
    resolution: f32,
    origin: (f32, f32),
    /// Metres from the middle of the cell to the face of the nearest occupied cell, capped; minus half a
    /// cell where the cell itself is occupied, so that the field is zero on the face.
    metres: Vec<f32>,
}

impl DistanceField {
    /// Works out the field: exact Euclidean distance between cell centres (Felzenszwalb and Huttenlocher,
    /// "Distance transforms of sampled functions", 2012), less half a cell for the face. Values are capped
    /// at `max_m`.
    pub fn new(plan: &Plan, max_m: f32) -> Self {
        Self::of(plan, max_m, |cell| cell == Cell::Occupied)
    }

    /// As [`DistanceField::new`], with unknown cells in the way too: for whoever plans a path.
    pub fn of_not_free(plan: &Plan, max_m: f32) -> Self {
        Self::of(plan, max_m, |cell| cell != Cell::Free)
    }

    fn of(plan: &Plan, max_m: f32, blocked: impl Fn(Cell) -> bool) -> Self {
        let blocked: Vec<bool> = plan.cells().iter().map(|cell| blocked(*cell)).collect();
        Self::from_blocked(&blocked, plan.width(), plan.resolution(), plan.origin(), max_m)
    }

    /// The field of any raster, row by row, x fastest; a last row that is not full is dropped.
    pub fn from_blocked(
        blocked: &[bool],
        width: usize,
        resolution: f32,
        origin: (f32, f32),
        max_m: f32,
    ) -> Self {
        let width = width.max(1);
        let height = blocked.len() / width;
        let squared = squared_distances(blocked, width, height);
        let cap = if max_m > 0.0 { max_m } else { 0.0 };
        let metres = squared.iter().map(|d| ((d.sqrt() - 0.5) * resolution).min(cap)).collect();
        Self { width, height, resolution, origin, metres }
    }

    /// Metres to the nearest occupied face, 0 inside one, capped; interpolated between cells. A place
    /// outside the plan has the distance of the nearest place inside; one that is no number has 0.
    pub fn distance(&self, x: f32, y: f32) -> f32 {
        let fx = (x - self.origin.0) / self.resolution - 0.5;
        let fy = (y - self.origin.1) / self.resolution - 0.5;
        if !(fx.is_finite() && fy.is_finite()) || self.metres.is_empty() {
            return 0.0;
        }
        let fx = fx.clamp(0.0, (self.width - 1) as f32);
        let fy = fy.clamp(0.0, (self.height - 1) as f32);
        let (ix, iy) = (fx as usize, fy as usize);
        let (jx, jy) = ((ix + 1).min(self.width - 1), (iy + 1).min(self.height - 1));
        let (tx, ty) = (fx - ix as f32, fy - iy as f32);
        let at = |x: usize, y: usize| self.metres[y * self.width + x];
        let low = at(ix, iy) + (at(jx, iy) - at(ix, iy)) * tx;
        let high = at(ix, jy) + (at(jx, jy) - at(ix, jy)) * tx;
        (low + (high - low) * ty).max(0.0)
    }

    /// The direction in which the distance grows, and how fast (about 1, 0 on ridges and where capped).
    pub fn gradient(&self, x: f32, y: f32) -> (f32, f32) {
        let h = self.resolution;
        (
            (self.distance(x + h, y) - self.distance(x - h, y)) / (2.0 * h),
            (self.distance(x, y + h) - self.distance(x, y - h)) / (2.0 * h),
        )
    }

    /// The value at the middle of a cell, metres; 0 inside something occupied and outside the plan.
    pub fn at_cell(&self, ix: usize, iy: usize) -> f32 {
        if ix < self.width && iy < self.height { self.metres[iy * self.width + ix].max(0.0) } else { 0.0 }
    }
}

/// Squared distance in cells between centres: columns first, then rows.
fn squared_distances(blocked: &[bool], width: usize, height: usize) -> Vec<f32> {
    // Larger than any distance in a plan and small enough that the sums below stay finite.
    const FAR: f32 = 1e9;
    let mut values: Vec<f32> =
        blocked[..width * height].iter().map(|blocked| if *blocked { 0.0 } else { FAR }).collect();
    let longest = width.max(height);
    let mut envelope = Envelope::new(longest);
    let mut line = vec![0.0_f32; longest];
    for x in 0..width {
        for y in 0..height {
            line[y] = values[y * width + x];
        }
        envelope.transform(&line[..height], |y, value| values[y * width + x] = value);
    }
    for row in values.chunks_exact_mut(width) {
        line[..width].copy_from_slice(row);
        envelope.transform(&line[..width], |x, value| row[x] = value);
    }
    values
}

/// The lower envelope of parabolas over one line.
struct Envelope {
    apex: Vec<usize>,
    border: Vec<f64>,
}

impl Envelope {
    fn new(longest: usize) -> Self {
        Self { apex: vec![0; longest], border: vec![0.0; longest + 1] }
    }

    fn transform(&mut self, line: &[f32], mut put: impl FnMut(usize, f32)) {
        // f64: the heights of far parabolas cancel.
        let height = |q: usize| f64::from(line[q]) + (q * q) as f64;
        let mut last = 0;
        self.apex[0] = 0;
        self.border[0] = f64::NEG_INFINITY;
        self.border[1] = f64::INFINITY;
        for q in 1..line.len() {
            loop {
                let v = self.apex[last];
                let crossing = (height(q) - height(v)) / (2.0 * (q - v) as f64);
                // Always true for the first parabola, whose border is minus infinity.
                if crossing > self.border[last] {
                    last += 1;
                    self.apex[last] = q;
                    self.border[last] = crossing;
                    self.border[last + 1] = f64::INFINITY;
                    break;
                }
                last = last.saturating_sub(1);
            }
        }
        let mut k = 0;
        for q in 0..line.len() {
            while self.border[k + 1] < q as f64 {
                k += 1;
            }
            let v = self.apex[k];
            let d = q as f64 - v as f64;
            put(q, (d * d + f64::from(line[v])) as f32);
        }
    }
}
