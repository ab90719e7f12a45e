use crate::Costmap;
use crate::cover::Cover;
use crate::fan::Fan;

/// Blocks around a place among which a better one is looked for: 1.5 m.
const REACH: usize = 3;
/// Share of what only one place shows that its substitute must show.
const KEEP: f32 = 0.98;
/// A move must shorten the way by this, metres.
const GAIN_M: f32 = 0.15;

/// Shortens a tour: leaves out what the way shows anyhow, and pulls the others towards the way as long as
/// everything stays in view.
#[derive(Clone, Debug)]
pub(crate) struct Refine {
    /// Blocks in order; the first and the last stay.
    tour: Vec<usize>,
    /// Blocks that stay whatever they show.
    fixed: Vec<usize>,
    /// How many looks and ways show each cell.
    count: Vec<u16>,
    position: usize,
    least: usize,
}

impl Refine {
    pub(crate) fn new(
        map: &Costmap,
        cover: &Cover,
        seen: &[bool],
        tour: Vec<usize>,
        fixed: Vec<usize>,
    ) -> Self {
        let mut refine = Self {
            tour,
            fixed,
            count: seen.iter().map(|seen| u16::from(*seen)).collect(),
            position: 1,
            least: map.raster().cells_of(map.limits().least_gain_m2 / 4.0),
        };
        for k in 0..refine.tour.len() {
            refine.add(cover, refine.tour[k], 1);
            if k > 0 {
                refine.add_way(map, cover, refine.tour[k - 1], refine.tour[k], 1);
            }
        }
        refine
    }

    pub(crate) fn tour(&self) -> &[usize] {
        &self.tour
    }

    /// Works on; returns what is left of the budget, and whether every place was looked at.
    pub(crate) fn advance(&mut self, map: &Costmap, cover: &Cover, mut left: usize) -> (usize, bool) {
        while left > 0 && self.position + 1 < self.tour.len() {
            let used = self.step(map, cover);
            left = left.saturating_sub(used);
        }
        (left, self.position + 1 >= self.tour.len())
    }

    fn step(&mut self, map: &Costmap, cover: &Cover) -> usize {
        let k = self.position;
        let (before, here, after) = (self.tour[k - 1], self.tour[k], self.tour[k + 1]);
        if self.fixed.contains(&here) {
            self.position += 1;
            return 1;
        }
        self.add(cover, here, -1);
        self.add_way(map, cover, before, here, -1);
        self.add_way(map, cover, here, after, -1);
        self.add_way(map, cover, before, after, 1);
        let alone: Vec<u32> =
            cover.shown(here).iter().copied().filter(|cell| self.count[*cell as usize] == 0).collect();
        if alone.len() < self.least {
            self.tour.remove(k);
            return 8 * cover.shown(here).len();
        }
        self.add_way(map, cover, before, after, -1);
        let (better, used) = self.better(map, cover, k, &alone);
        let block = better.unwrap_or(here);
        self.tour[k] = block;
        self.add(cover, block, 1);
        self.add_way(map, cover, before, block, 1);
        self.add_way(map, cover, block, after, 1);
        self.position += 1;
        used + 12 * cover.shown(here).len()
    }

    /// A block near the `k`th that shows all that only the `k`th shows and lies better on the way.
    fn better(&self, map: &Costmap, cover: &Cover, k: usize, alone: &[u32]) -> (Option<usize>, usize) {
        let (before, here, after) = (self.tour[k - 1], self.tour[k], self.tour[k + 1]);
        let (Some(a), Some(p), Some(b)) = (cover.place(before), cover.place(here), cover.place(after)) else {
            return (None, 0);
        };
        let raster = map.raster();
        let length = |cell: usize| raster.between(a, cell) + raster.between(cell, b);
        let mut best = (length(p) - GAIN_M, None);
        let mut used = 0;
        for block in cover.around(here, REACH) {
            let Some(cell) = cover.place(block) else { continue };
            if block == here
                || length(cell) >= best.0
                || map.room_of(cell) != map.room_of(p)
                || Cover::worth(map, cell) < Cover::worth(map, p)
                || !Fan::clear_between(map, cell, p)
            {
                continue;
            }
            // Both lists are in the order of the fan, not sorted: mark by counting.
            let shown = cover.shown(block);
            used += shown.len() + alone.len();
            let kept = count_common(alone, shown);
            if kept as f32 >= KEEP * alone.len() as f32 {
                best = (length(cell), Some(block));
            }
        }
        (best.1, used)
    }

    fn add(&mut self, cover: &Cover, block: usize, by: i32) {
        for cell in cover.shown(block) {
            let count = &mut self.count[*cell as usize];
            *count = count.saturating_add_signed(by as i16);
        }
    }

    /// Counts what the straight way between two places shows, when it is one.
    fn add_way(&mut self, map: &Costmap, cover: &Cover, from: usize, to: usize, by: i32) {
        let (Some(a), Some(b)) = (cover.place(from), cover.place(to)) else { return };
        let raster = map.raster();
        let length = raster.between(a, b);
        if length > 12.0 || !straight(map, a, b) {
            return;
        }
        let ((ax, ay), (bx, by_)) = (raster.centre(a), raster.centre(b));
        let count = length.ceil() as usize;
        for k in 1..count {
            let t = k as f32 / count as f32;
            if let Some(cell) = raster.cell(ax + t * (bx - ax), ay + t * (by_ - ay)) {
                let block = cover.block_of(map, cell);
                // The block's own place may be beside the way, behind a corner.
                if cover.place(block).is_some_and(|place| Fan::clear_between(map, place, cell)) {
                    self.add(cover, block, by);
                }
            }
        }
    }
}

/// Whether the straight way between two cells can be flown.
fn straight(map: &Costmap, a: usize, b: usize) -> bool {
    let raster = map.raster();
    let ((ax, ay), (bx, by)) = (raster.centre(a), raster.centre(b));
    let count = (raster.between(a, b) / raster.cell_m).ceil().max(1.0);
    (0..=count as usize).all(|k| {
        let t = k as f32 / count;
        raster.cell(ax + t * (bx - ax), ay + t * (by - ay)).is_some_and(|cell| map.is_passable(cell))
    })
}

fn count_common(a: &[u32], b: &[u32]) -> usize {
    let mut sorted: Vec<u32> = b.to_vec();
    sorted.sort_unstable();
    a.iter().filter(|cell| sorted.binary_search(cell).is_ok()).count()
}
