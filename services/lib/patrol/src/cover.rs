use std::cmp::Ordering;
use std::collections::BinaryHeap;

use crate::fan::Fan;
use crate::{Bits, Costmap};

/// Side of a block in metres: the best place of each block is a place to look from.
const BLOCK_M: f32 = 0.5;
/// Places with less clearance than this are looked from only when no other place shows as much, metres.
const ROOMY_M: f32 = 0.6;
/// What a look from a tight or an echoless place is worth, against the same look from a good one.
const TIGHT_WORTH: f32 = 0.7;

/// The places to look from, one a block, and what each shows.
#[derive(Clone, Debug)]
pub(crate) struct Cover {
    fan: Fan,
    blocks_x: usize,
    blocks_y: usize,
    /// Cells a side of a block.
    block: usize,
    /// Next block to look from.
    cursor: usize,
    /// Best reachable cell of each block.
    place: Vec<Option<u32>>,
    /// What each block's place shows: a range of `shown`.
    range: Vec<(u32, u32)>,
    /// Cells shown, a quarter of them all (even columns and rows): enough to count by.
    shown: Vec<u32>,
    /// Last look that touched a cell.
    stamp: Vec<u32>,
    /// Everything that can be seen from anywhere that can be reached.
    to_see: Bits,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Worth {
    worth: f32,
    block: u32,
}

impl Eq for Worth {}

impl Ord for Worth {
    fn cmp(&self, other: &Self) -> Ordering {
        self.worth.total_cmp(&other.worth).then(other.block.cmp(&self.block))
    }
}

impl PartialOrd for Worth {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Cover {
    pub(crate) fn new(map: &Costmap) -> Self {
        let raster = map.raster();
        let block = ((BLOCK_M / raster.cell_m).round() as usize).max(1);
        let (blocks_x, blocks_y) = (raster.width.div_ceil(block), raster.height.div_ceil(block));
        Self {
            fan: Fan::new(raster, map.limits().reach_m.max(map.limits().view_m)),
            blocks_x,
            blocks_y,
            block,
            cursor: 0,
            place: vec![None; blocks_x * blocks_y],
            range: vec![(0, 0); blocks_x * blocks_y],
            shown: Vec::new(),
            stamp: vec![0; raster.len()],
            to_see: Bits::default(),
        }
    }

    /// Looks from the next blocks; returns what is left of the budget, and whether all are done.
    pub(crate) fn look(&mut self, map: &Costmap, reached: &[bool], mut left: usize) -> (usize, bool) {
        while left > 0 && self.cursor < self.place.len() {
            let block = self.cursor;
            self.cursor += 1;
            left = left.saturating_sub(self.block * self.block);
            let Some(cell) = self.best_of(map, reached, block) else { continue };
            left = left.saturating_sub(self.fan.work());
            self.place[block] = Some(cell as u32);
            let first = self.shown.len() as u32;
            let raster = map.raster();
            let (mark, view) = (block as u32 + 1, map.limits().view_m);
            self.fan.look(map, cell, map.limits().reach_m, |seen, metres| {
                if self.stamp[seen] != mark && map.is_floor(seen) {
                    self.stamp[seen] = mark;
                    self.to_see.set(raster, seen, true);
                    let (column, row) = raster.column_row(seen);
                    if metres <= view && column % 2 == 0 && row % 2 == 0 {
                        self.shown.push(seen as u32);
                    }
                }
            });
            self.range[block] = (first, self.shown.len() as u32);
        }
        (left, self.cursor >= self.place.len())
    }

    fn best_of(&self, map: &Costmap, reached: &[bool], block: usize) -> Option<usize> {
        let raster = map.raster();
        let (bx, by) = (block % self.blocks_x * self.block, block / self.blocks_x * self.block);
        let rows = by..(by + self.block).min(raster.height);
        let columns = move || bx..(bx + self.block).min(raster.width);
        rows.flat_map(|row| columns().map(move |column| row * raster.width + column))
            .filter(|cell| reached[*cell])
            // Beyond a comfortable clearance more is no better: the middle of the block then.
            .max_by(|a, b| {
                let clearance = |cell: usize| map.cell_clearance(cell).min(map.limits().comfort_m);
                let middle = |cell: usize| {
                    let (column, row) = raster.column_row(cell);
                    let half = self.block / 2;
                    (column.abs_diff(bx + half)).max(row.abs_diff(by + half))
                };
                clearance(*a).total_cmp(&clearance(*b)).then(middle(*b).cmp(&middle(*a))).then(b.cmp(a))
            })
    }

    pub(crate) fn to_see(&self) -> &Bits {
        &self.to_see
    }

    pub(crate) fn place(&self, block: usize) -> Option<usize> {
        self.place.get(block).copied().flatten().map(|cell| cell as usize)
    }

    pub(crate) fn shown(&self, block: usize) -> &[u32] {
        self.range.get(block).map_or(&[], |(first, end)| &self.shown[*first as usize..*end as usize])
    }

    /// The block that holds a cell.
    pub(crate) fn block_of(&self, map: &Costmap, cell: usize) -> usize {
        let (column, row) = map.raster().column_row(cell);
        row / self.block * self.blocks_x + column / self.block
    }

    /// The blocks within some blocks of one.
    pub(crate) fn around(&self, block: usize, reach: usize) -> impl Iterator<Item = usize> + '_ {
        let (bx, by) = (block % self.blocks_x, block / self.blocks_x);
        let rows = by.saturating_sub(reach)..(by + reach + 1).min(self.blocks_y);
        let columns = bx.saturating_sub(reach)..(bx + reach + 1).min(self.blocks_x);
        rows.flat_map(move |row| columns.clone().map(move |column| row * self.blocks_x + column))
    }

    pub(crate) fn worth(map: &Costmap, cell: usize) -> f32 {
        let tight = map.cell_clearance(cell) < ROOMY_M;
        let deaf = map.surface(cell) > map.limits().horizon_m;
        if tight || deaf { TIGHT_WORTH } else { 1.0 }
    }
}

/// Chooses places one by one, each time the one that shows most of what no other shows: at most a factor
/// 1 + ln n from the fewest (Chvatal 1979). Values only shrink, so old ones bound new ones and few are
/// worked out again.
#[derive(Clone, Debug)]
pub(crate) struct Choice {
    queue: BinaryHeap<Worth>,
    covered: Vec<bool>,
    chosen: Vec<usize>,
    /// Shown cells that make a place worth the way.
    least: usize,
}

impl Choice {
    /// `seen` has one entry a cell: what need not be shown.
    pub(crate) fn new(map: &Costmap, cover: &Cover, seen: &[bool]) -> Self {
        let raster = map.raster();
        let queue = (0..cover.place.len())
            .filter_map(|block| {
                let cell = cover.place(block)?;
                let worth = cover.shown(block).len() as f32 * Cover::worth(map, cell);
                Some(Worth { worth, block: block as u32 })
            })
            .collect();
        let least = raster.cells_of(map.limits().least_gain_m2 / 4.0);
        Self { queue, covered: seen.to_vec(), chosen: Vec::new(), least }
    }

    /// Works on; returns what is left of the budget, and whether nothing worth a look is left.
    pub(crate) fn advance(&mut self, map: &Costmap, cover: &Cover, mut left: usize) -> (usize, bool) {
        while left > 0 {
            let Some(top) = self.queue.pop() else { return (left, true) };
            let block = top.block as usize;
            let Some(cell) = cover.place(block) else { continue };
            let shown = cover.shown(block);
            left = left.saturating_sub(shown.len() + 8);
            let fresh = shown.iter().filter(|cell| !self.covered[**cell as usize]).count();
            if fresh < self.least {
                continue;
            }
            let worth = fresh as f32 * Cover::worth(map, cell);
            if self.queue.peek().is_some_and(|next| next.worth > worth) {
                self.queue.push(Worth { worth, ..top });
                continue;
            }
            for cell in shown {
                self.covered[*cell as usize] = true;
            }
            self.chosen.push(block);
        }
        (left, false)
    }

    pub(crate) fn chosen(&self) -> &[usize] {
        &self.chosen
    }
}
