//! Ways for people: shortest paths over the true floor, with room for the shoulders.

use crate::world::draw::{chance, index};
use crate::world::{Ground, PadPlace};
use rand::Rng;
use std::collections::VecDeque;

/// Room between the shoulders and what stands about, metres.
const SHOULDER_ROOM_M: f32 = 0.06;
/// How far apart the places of a way lie, metres walked.
const HOP_M: (f32, f32) = (3.0, 14.0);
/// Most cells that a search looks at: bounds the time on a huge plan.
const MOST_CELLS: usize = 400_000;

/// The floor as seen by somebody who walks.
pub(crate) struct Walker<'a> {
    ground: &'a Ground,
    open: Vec<bool>,
    /// The same where one can walk to from the pad: where the drone flies, too.
    shared: Vec<usize>,
    /// Steps from the last search's start; `u32::MAX` where it did not come.
    steps: Vec<u32>,
    touched: Vec<usize>,
}

impl<'a> Walker<'a> {
    pub(crate) fn new(ground: &'a Ground, pad: PadPlace, radius: f32, pad_free: f32) -> Self {
        // Distances run between the middles of cells: half a diagonal may be missing at the far end.
        let needed = radius + SHOULDER_ROOM_M + 0.5 * ground.resolution();
        let distances = ground.walking_distances();
        let open: Vec<bool> = distances
            .iter()
            .enumerate()
            .map(|(cell, distance)| {
                let (x, y) = ground.centre(cell % ground.width(), cell / ground.width());
                *distance >= needed && (x - pad.x).hypot(y - pad.y) >= pad_free
            })
            .collect();
        let joined = ground.flood(pad.x, pad.y, |cell| ground.is_free_on_foot(cell));
        let shared = (0..open.len()).filter(|cell| open[*cell] && joined[*cell]).collect();
        Self { ground, steps: vec![u32::MAX; open.len()], touched: Vec::new(), open, shared }
    }

    /// Places that lie a walk apart from each other, where the drone flies too; fewer when there is no room.
    pub(crate) fn draw_places<R: Rng + ?Sized>(&mut self, count: usize, rng: &mut R) -> Vec<(f32, f32)> {
        let Some(&start) = self.shared.get(index(rng, self.shared.len())) else { return Vec::new() };
        let mut places = vec![start];
        let mut here = start;
        while places.len() < count {
            self.search(here);
            let resolution = self.ground.resolution();
            let hop = |cell: &&usize| {
                let walked = self.steps[**cell] as f32 * resolution;
                self.steps[**cell] != u32::MAX && walked >= HOP_M.0 && walked <= HOP_M.1
            };
            let mut near: Vec<usize> = self.touched.iter().filter(hop).copied().collect();
            if near.is_empty() {
                near.clone_from(&self.touched);
            }
            let Some(&next) = near.get(index(rng, near.len())) else { break };
            // Now and then back to where it began: ways cross themselves as they do in offices.
            here = if places.len() > 2 && chance(rng, 0.2) { places[0] } else { next };
            places.push(here);
        }
        places.iter().map(|cell| self.centre(*cell)).collect()
    }

    /// A way through the places, around what stands between them; places that cannot be reached are left out.
    pub(crate) fn join(&mut self, places: &[(f32, f32)], circle: bool) -> Vec<(f32, f32)> {
        let mut cells: Vec<usize> = places.iter().filter_map(|(x, y)| self.nearest_open(*x, *y)).collect();
        if circle && cells.len() > 1 {
            cells.push(cells[0]);
        }
        let Some(&first) = cells.first() else { return Vec::new() };
        let mut way = vec![self.centre(first)];
        let mut here = first;
        for target in cells.into_iter().skip(1) {
            if target == here {
                continue;
            }
            // From the target, so that walking downhill leads to it.
            self.search(target);
            if self.steps[here] == u32::MAX {
                continue;
            }
            let mut path = vec![here];
            while here != target {
                let next = self.neighbours(here).into_iter().flatten().min_by_key(|n| self.steps[*n]);
                match next {
                    Some(next) if self.steps[next] < self.steps[here] => here = next,
                    _ => break,
                }
                path.push(here);
            }
            self.straighten(&path, &mut way);
        }
        if circle && way.len() > 2 {
            way.pop();
        }
        way
    }

    /// Appends the corners that are needed to walk along a path of cells.
    fn straighten(&self, path: &[usize], way: &mut Vec<(f32, f32)>) {
        let mut from = 0;
        while from + 1 < path.len() {
            let mut to = from + 1;
            // Doubling strides keep the number of checks small on long paths.
            let mut stride = 1;
            while stride > 0 {
                let next = (to + stride).min(path.len() - 1);
                if next > to && self.is_straight(path[from], path[next]) {
                    to = next;
                    stride *= 2;
                } else {
                    stride /= 2;
                }
            }
            way.push(self.centre(path[to]));
            from = to;
        }
    }

    fn is_straight(&self, a: usize, b: usize) -> bool {
        let ((ax, ay), (bx, by)) = (self.centre(a), self.centre(b));
        let length = (bx - ax).hypot(by - ay);
        let steps = (length / (0.5 * self.ground.resolution())).ceil().max(1.0) as usize;
        (0..=steps).all(|i| {
            let t = i as f32 / steps as f32;
            self.ground
                .cell_at(ax + t * (bx - ax), ay + t * (by - ay))
                .is_some_and(|(c, r)| self.open[r * self.ground.width() + c])
        })
    }

    fn centre(&self, cell: usize) -> (f32, f32) {
        self.ground.centre(cell % self.ground.width(), cell / self.ground.width())
    }

    fn neighbours(&self, cell: usize) -> [Option<usize>; 4] {
        let (w, h) = (self.ground.width(), self.ground.height());
        let (c, r) = (cell % w, cell / w);
        [
            (c > 0).then(|| cell - 1),
            (c + 1 < w).then(|| cell + 1),
            (r > 0).then(|| cell - w),
            (r + 1 < h).then(|| cell + w),
        ]
    }

    fn nearest_open(&self, x: f32, y: f32) -> Option<usize> {
        let distance = |cell: usize| {
            let (cx, cy) = self.centre(cell);
            (cx - x).powi(2) + (cy - y).powi(2)
        };
        (0..self.open.len())
            .filter(|cell| self.open[*cell])
            .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
    }

    /// Steps from a cell to all that can be walked to.
    fn search(&mut self, start: usize) {
        for cell in self.touched.drain(..) {
            self.steps[cell] = u32::MAX;
        }
        let mut queue = VecDeque::from([start]);
        self.steps[start] = 0;
        self.touched.push(start);
        while let Some(cell) = queue.pop_front() {
            if self.touched.len() > MOST_CELLS {
                return;
            }
            for next in self.neighbours(cell).into_iter().flatten() {
                if self.open[next] && self.steps[next] == u32::MAX {
                    self.steps[next] = self.steps[cell] + 1;
                    self.touched.push(next);
                    queue.push_back(next);
                }
            }
        }
    }
}
