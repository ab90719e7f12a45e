use crate::Costmap;

/// A straight line may cost this much more than the cells it replaces: less than the difference between
/// the middle of a door and its post.
const DEARER: f32 = 1.02;
/// Longest straight line tried, cells.
const LONGEST: usize = 120;
/// Cost of a metre through cells that are not to be flown through: no line pays this to be straight.
const BLOCKED_COST: f32 = 300.0;
/// Corners are moved towards the middle of a passage by at most this, metres.
const CENTRE_M: f32 = 0.12;

/// Turns a path over cells into a few corners: pulls it straight where that costs no more than the path
/// itself, and moves the corners to the middle of what they pass.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoother {
    points: Vec<(f32, f32)>,
    /// Cost of the path up to each point.
    costs: Vec<f32>,
    corners: Vec<(f32, f32)>,
    anchor: usize,
    done: bool,
}

impl Smoother {
    pub(crate) fn begin(&mut self, map: &Costmap, path: &[usize], from: (f32, f32), to: (f32, f32)) {
        self.points.clear();
        self.points.extend(path.iter().map(|cell| map.raster().centre(*cell)));
        if let Some(first) = self.points.first_mut() {
            *first = from;
        }
        if self.points.len() > 1
            && let Some(last) = self.points.last_mut()
        {
            *last = to;
        } else {
            self.points.push(to);
        }
        let mut total = 0.0;
        self.costs.clear();
        self.costs.push(0.0);
        for pair in self.points.windows(2) {
            total += line_cost(map, pair[0], pair[1]);
            self.costs.push(total);
        }
        self.corners.clear();
        self.corners.push(from);
        self.anchor = 0;
        self.done = false;
    }

    pub(crate) fn is_done(&self) -> bool {
        self.done
    }

    pub(crate) fn take(&mut self) -> Vec<(f32, f32)> {
        std::mem::take(&mut self.corners)
    }

    /// Returns what is left of the budget.
    pub(crate) fn advance(&mut self, map: &Costmap, mut left: usize) -> usize {
        let last = self.points.len() - 1;
        while left > 0 && !self.done {
            // The farthest point that a straight line reaches. Far ones are tried in steps that grow, then
            // each one back to the nearest that worked.
            let mut reached = self.anchor + 1;
            let mut next = self.anchor + 2;
            while next <= last.min(self.anchor + LONGEST) {
                left = left.saturating_sub(next - self.anchor);
                if self.straight(map, next) {
                    reached = next;
                } else if next > reached + 12 {
                    break;
                }
                next += 1;
            }
            self.anchor = reached.min(last);
            let point = self.points[self.anchor];
            if self.anchor == last {
                self.corners.push(point);
                self.done = true;
            } else {
                self.corners.push(centred(map, point));
            }
        }
        left
    }

    fn straight(&self, map: &Costmap, end: usize) -> bool {
        let (a, b) = (self.corners.last().copied().unwrap_or_default(), self.points[end]);
        let along = self.costs[end] - self.costs[self.anchor];
        line_cost(map, a, b) <= along * DEARER + 1e-3
    }
}

/// Cost of a straight line, sampled twice a cell.
fn line_cost(map: &Costmap, a: (f32, f32), b: (f32, f32)) -> f32 {
    let length = (a.0 - b.0).hypot(a.1 - b.1);
    let count = (2.0 * length / map.raster().cell_m).ceil().max(1.0);
    let sum: f32 = (0..count as usize)
        .map(|k| {
            let t = (k as f32 + 0.5) / count;
            let cost = map.cost_at(a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            // Only a start that is being left runs over cells without a finite cost.
            if cost.is_finite() { cost } else { BLOCKED_COST }
        })
        .sum();
    sum / count * length
}

/// Climbs the clearance a little where there is not much of it.
fn centred(map: &Costmap, point: (f32, f32)) -> (f32, f32) {
    let field = map.field();
    let step = 0.02;
    let (mut x, mut y) = point;
    for _ in 0..(CENTRE_M / step) as usize {
        let here = map.clearance(x, y);
        if here >= map.limits().comfort_m {
            break;
        }
        let (gx, gy) = field.gradient(x, y);
        let length = gx.hypot(gy);
        if length < 0.2 {
            break;
        }
        let (nx, ny) = (x + step * gx / length, y + step * gy / length);
        if map.clearance(nx, ny) <= here {
            break;
        }
        (x, y) = (nx, ny);
    }
    (x, y)
}
