use crate::Plan;

/// Where a ray meets something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Metres along the ray.
    pub range_m: f32,
    /// Angle between the ray and the smoothed normal of the surface, 0 (head on) to pi/2 (grazing); 0 for
    /// things without a direction, such as a table leg.
    pub incidence_rad: f32,
    /// Whether the thing has no direction: a leg, a pole, the end of a wall.
    pub scatters: bool,
}

/// What an ultrasonic sensor hears of a plan: the nearest surface inside its cone that faces it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeModel {
    /// Half of the opening, radians.
    pub half_angle_rad: f32,
    /// Rays spread evenly over the opening, the outermost on its edges; 1 is the axis alone. Few rays
    /// miss thin things between them and find them again a few degrees on: the echo then jumps.
    pub sub_rays: usize,
    /// Beyond this there is no echo, metres.
    pub max_range_m: f32,
    /// A sub-ray that meets its surface at more than this is reflected away, radians.
    pub max_incidence_rad: f32,
    /// What has no direction (poles, legs, the ends of walls in doorways) scatters to all sides, but only so
    /// weakly that it is heard up to here, metres.
    pub scatter_range_m: f32,
}

impl Default for ConeModel {
    /// HC-SR04 class (FACTS 2): 15 degrees to either side, 4 m, a ray every degree. A wall gives an echo as long as the
    /// sub-ray nearest to its normal meets it at 12 degrees or less: it is lost at 27 degrees from the
    /// axis, in the middle of the 25 to 30 that were measured.
    fn default() -> Self {
        Self {
            half_angle_rad: 15_f32.to_radians(),
            sub_rays: 31,
            max_range_m: 4.0,
            max_incidence_rad: 12_f32.to_radians(),
            scatter_range_m: 1.5,
        }
    }
}

impl Plan {
    /// The first occupied cell along a ray from a place in the plan frame, exactly: every cell that the
    /// ray touches is looked at (Amanatides and Woo, "A fast voxel traversal algorithm", 1987), but for
    /// those that are known to be clear all around. Only occupied cells stop a ray. A start inside one is a hit at range 0.
    pub fn cast_ray(&self, x: f32, y: f32, angle: f32, max_range: f32) -> Option<Hit> {
        let (sin, cos) = angle.sin_cos();
        let (index, range_m) = self.walk(x, y, cos, sin, max_range)?;
        let surfaces = self.surfaces();
        let scatters = surfaces.scatters(index);
        Some(Hit { range_m, incidence_rad: surfaces.incidence(index, angle), scatters })
    }

    /// The index of the first occupied cell along a direction of unit length, and its distance.
    pub(crate) fn walk(&self, x: f32, y: f32, cos: f32, sin: f32, max_range: f32) -> Option<(usize, f32)> {
        if !(x.is_finite() && y.is_finite() && cos.is_finite() && sin.is_finite() && max_range >= 0.0) {
            return None;
        }
        let (width, height) = (self.width() as i32, self.height() as i32);
        let resolution = self.resolution();
        let (gx, gy) = ((x - self.origin().0) / resolution, (y - self.origin().1) / resolution);
        // All lengths below are in cells.
        let end = max_range / resolution;
        // Whoever starts so far outside cannot reach the plan, and the indices below stay small.
        if gx < -end - 1.0
            || gy < -end - 1.0
            || gx > width as f32 + end + 1.0
            || gy > height as f32 + end + 1.0
        {
            return None;
        }
        let (mut ix, mut iy) = (gx.floor() as i32, gy.floor() as i32);
        let (along_x, along_y) = (Axis::new(gx, cos), Axis::new(gy, sin));
        let (mut next_x, mut next_y) = (along_x.border(ix), along_y.border(iy));
        // Ray length for one cell along the faster axis.
        let per_cell = 1.0 / cos.abs().max(sin.abs());
        let leaps = self.leaps();
        let mut travelled = 0.0_f32;
        loop {
            // `travelled` never shrinks: after a leap, rounding may put a border just behind the ray.
            let mut leap = 0;
            if ix >= 0 && iy >= 0 && ix < width && iy < height {
                let index = (iy * width + ix) as usize;
                leap = leaps[index];
                if leap == 0 {
                    return Some((index, travelled * resolution));
                }
            } else if leaves(ix, along_x.step, width) || leaves(iy, along_y.step, height) {
                return None;
            }
            if leap > 2 {
                // Nothing stands within `leap - 1` cells to any side.
                travelled += f32::from(leap - 1) * per_cell;
                (ix, iy) = ((gx + travelled * cos).floor() as i32, (gy + travelled * sin).floor() as i32);
                (next_x, next_y) = (along_x.border(ix), along_y.border(iy));
            } else if next_x < next_y {
                travelled = travelled.max(next_x);
                ix += along_x.step;
                next_x = along_x.border(ix);
            } else {
                travelled = travelled.max(next_y);
                iy += along_y.step;
                next_y = along_y.border(iy);
            }
            if travelled > end {
                return None;
            }
        }
    }
}

/// A ray along one axis, in cells.
struct Axis {
    start: f32,
    step: i32,
    /// Ray length for one cell; infinite when the ray does not move along this axis.
    inverse: f32,
    /// Which border of a cell is the next one: 0 the lower, 1 the upper.
    ahead: i32,
}

impl Axis {
    fn new(start: f32, direction: f32) -> Self {
        let step = if direction > 0.0 {
            1
        } else if direction < 0.0 {
            -1
        } else {
            0
        };
        let inverse = if step == 0 { f32::INFINITY } else { 1.0 / direction };
        Self { start, step, inverse, ahead: i32::from(step > 0) }
    }

    /// Ray length to the border where the ray leaves a cell.
    fn border(&self, cell: i32) -> f32 {
        if self.step == 0 { f32::INFINITY } else { ((cell + self.ahead) as f32 - self.start) * self.inverse }
    }
}

/// Outside on one axis and not coming back.
fn leaves(cell: i32, step: i32, size: i32) -> bool {
    (cell < 0 && step <= 0) || (cell >= size && step >= 0)
}

/// The nearest echo of a cone from a place in the plan frame along `angle`, metres; `None` when nothing in
/// the cone sends sound back.
pub fn cast_cone(plan: &Plan, model: &ConeModel, x: f32, y: f32, angle: f32) -> Option<f32> {
    model
        .offsets()
        .filter_map(|offset| plan.cast_ray(x, y, angle + offset, model.max_range_m))
        .filter(|hit| model.hears(hit))
        .map(|hit| hit.range_m)
        .min_by(f32::total_cmp)
}

impl ConeModel {
    /// Whether what a sub-ray met sends sound back.
    #[must_use]
    pub fn hears(&self, hit: &Hit) -> bool {
        let reach = if hit.scatters { self.scatter_range_m } else { self.max_range_m };
        hit.incidence_rad <= self.max_incidence_rad && hit.range_m <= reach
    }

    /// The sub-rays' angles from the axis, from the right edge to the left one.
    pub fn offsets(&self) -> impl Iterator<Item = f32> {
        let (count, half) = (self.sub_rays.max(1), self.half_angle_rad);
        let step = if count > 1 { 2.0 * half / (count - 1) as f32 } else { 0.0 };
        let first = if count > 1 { -half } else { 0.0 };
        (0..count).map(move |k| first + step * k as f32)
    }
}
