use crate::fan::Fan;
use crate::{Bits, Costmap};

/// What has been seen of the floor.
#[derive(Clone, Debug)]
pub struct Seen {
    bits: Bits,
    fan: Fan,
}

/// How much of a part is seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Cells seen of those to be seen.
    pub seen: usize,
    /// Cells to be seen.
    pub all: usize,
}

impl Tally {
    /// Seen share, 0..1; 1 where there is nothing to see.
    pub fn share(&self) -> f32 {
        if self.all == 0 { 1.0 } else { self.seen as f32 / self.all as f32 }
    }
}

impl Seen {
    /// Nothing seen.
    pub fn new(map: &Costmap) -> Self {
        Self { bits: Bits::default(), fan: Fan::new(map.raster(), map.limits().seen_m) }
    }

    /// What was seen before, such as after a restart.
    pub fn restore(&mut self, words: &[u64]) {
        self.bits.copy_from_words(words);
    }

    /// Marks the floor in sight of a place, as far as it counts. The work is bounded: a fan of rays.
    pub fn mark(&mut self, map: &Costmap, x: f32, y: f32) {
        let raster = *map.raster();
        let Some(from) = raster.cell(x, y) else { return };
        let bits = &mut self.bits;
        self.fan.look(map, from, map.limits().seen_m, |cell, _| {
            if map.is_floor(cell) {
                bits.set(&raster, cell, true);
            }
        });
    }

    /// Unseen floor that a look from a place would show, square metres, counting `wanted` cells only.
    pub fn gain_m2(&self, map: &Costmap, wanted: &Bits, x: f32, y: f32) -> f32 {
        let raster = *map.raster();
        let Some(from) = raster.cell(x, y) else { return 0.0 };
        let mut fresh = Bits::default();
        self.fan.look(map, from, map.limits().view_m, |cell, _| {
            if wanted.get(&raster, cell) && !self.bits.get(&raster, cell) {
                fresh.set(&raster, cell, true);
            }
        });
        fresh.count() as f32 * raster.cell_m * raster.cell_m
    }

    /// One bit a cell.
    pub fn bits(&self) -> &Bits {
        &self.bits
    }

    /// Seen of all that is `wanted`.
    pub fn total(&self, wanted: &Bits) -> Tally {
        Tally { seen: self.bits.count_both(wanted), all: wanted.count() }
    }

    /// Seen of what is `wanted` in each room; `out` has one entry for each room and is overwritten.
    pub fn by_room(&self, map: &Costmap, wanted: &Bits, out: &mut [Tally]) {
        out.fill(Tally::default());
        let raster = map.raster();
        for cell in wanted.cells(raster) {
            if let Some(tally) = map.room_of(cell).and_then(|room| out.get_mut(room)) {
                tally.all += 1;
                tally.seen += usize::from(self.bits.get(raster, cell));
            }
        }
    }
}
