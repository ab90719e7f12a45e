//! Many look-ups at once, in loops that vectorise.

use super::{ConeTable, EMPTY, HEADINGS, NO_ECHO, TILE, TILE_BYTES};
use std::sync::atomic::Ordering;

/// Look-ups worked on together: the intermediate columns stay in the first-level cache.
const BLOCK: usize = 128;
/// A tile's side is a power of two.
const TILE_BITS: u32 = TILE.trailing_zeros();
const TILE_MASK: i32 = (1 << TILE_BITS) - 1;
/// 1.5 · 2²³: adding it to an `f32` below 2²² in size rounds it to the nearest integer, found in the low
/// bits. A cast that saturates, or `floor`, costs more than the look-up itself.
const ROUND: f32 = 12_582_912.0;

/// The integer nearest to `v`, as a float and as a number; for |`v`| < 2²².
#[inline]
fn round(v: f32) -> (f32, i32) {
    let shifted = v + ROUND;
    (shifted - ROUND, (shifted.to_bits() & 0x007f_ffff).cast_signed() - 0x0040_0000)
}

/// The part of a batch that is the same for all.
struct Frame {
    origin: (f32, f32),
    inverse_pitch: f32,
    limit: (f32, f32),
    tiles_x: i32,
}

impl ConeTable {
    /// As [`Self::range`] for columns of places and axes: `out[i]` is the range from (`x[i]`, `y[i]`) along
    /// `angle[i]`, whose cosine and sine the caller has at hand. It differs from [`Self::range`] only in
    /// taking the correction for the place along the exact axis rather than along the rounded one (below
    /// 0.4 mm), and in ties. Columns beyond the shortest one's end are left alone.
    pub fn ranges(&self, x: &[f32], y: &[f32], angle: &[f32], cos: &[f32], sin: &[f32], out: &mut [f32]) {
        let lengths = [x.len(), y.len(), angle.len(), cos.len(), sin.len()];
        let n = lengths.into_iter().fold(out.len(), usize::min);
        let frame = Frame {
            origin: self.plan.origin(),
            inverse_pitch: self.inverse_pitch,
            limit: (self.width as f32, self.height as f32),
            tiles_x: self.tiles_x as i32,
        };
        let mut from = 0;
        while from < n {
            let to = (from + BLOCK).min(n);
            self.block(
                &frame,
                [&x[from..to], &y[from..to], &angle[from..to], &cos[from..to], &sin[from..to]],
                &mut out[from..to],
            );
            from = to;
        }
    }

    fn block(&self, frame: &Frame, [x, y, angle, cos, sin]: [&[f32]; 5], out: &mut [f32]) {
        const TURNS: f32 = 1.0 / std::f32::consts::TAU;
        let n = out.len().min(BLOCK);
        let (x, y, angle, cos, sin) = (&x[..n], &y[..n], &angle[..n], &cos[..n], &sin[..n]);
        let out = &mut out[..n];
        // Which tile, and which byte of it.
        let (mut tile, mut byte) = ([0i32; BLOCK], [0i32; BLOCK]);
        let mut value = [NO_ECHO; BLOCK];
        for i in 0..n {
            let fx = (x[i] - frame.origin.0) * frame.inverse_pitch;
            let fy = (y[i] - frame.origin.1) * frame.inverse_pitch;
            let inside = (fx >= 0.0) & (fy >= 0.0) & (fx < frame.limit.0) & (fy < frame.limit.1);
            // Places outside, and those that are no place, are looked up nowhere.
            let (fx, fy) = if inside { (fx, fy) } else { (0.5, 0.5) };
            let (middle_x, ix) = round(fx - 0.5);
            let (middle_y, iy) = round(fy - 0.5);
            let (tx, ty) = (ix >> TILE_BITS, iy >> TILE_BITS);
            tile[i] = if inside { ty * frame.tiles_x + tx } else { -1 };
            // How much nearer the middle of the cell is to what lies ahead, metres.
            let off_x = (fx - 0.5 - middle_x) * self.pitch;
            let off_y = (fy - 0.5 - middle_y) * self.pitch;
            out[i] = -off_x * cos[i] - off_y * sin[i];
            let turns = angle[i] * TURNS;
            let part = turns - round(turns).0;
            let k = round(part * HEADINGS as f32).1;
            let k = if k < 0 { k + HEADINGS as i32 } else { k };
            let place = ((iy & TILE_MASK) << TILE_BITS) + (ix & TILE_MASK);
            byte[i] = place * HEADINGS as i32 + k;
        }
        for i in 0..n {
            value[i] = self.stored(tile[i].cast_unsigned() as usize, byte[i].cast_unsigned() as usize);
        }
        for i in 0..n {
            let range = (f32::from(value[i]) - 1.0) * self.level_m + out[i];
            out[i] = if value[i] == NO_ECHO { f32::INFINITY } else { range.max(0.0) };
        }
    }

    /// A byte of a tile, worked out if need be; no echo for what is off the table.
    #[inline]
    fn stored(&self, tile: usize, byte: usize) -> u8 {
        let Some(values) = self.tiles.get(tile) else { return NO_ECHO };
        let known = values.get().and_then(|values| values.get(byte));
        match known.map_or(EMPTY, |value| value.load(Ordering::Relaxed)) {
            EMPTY => self.work_out(tile, byte),
            value => value,
        }
    }

    #[cold]
    fn work_out(&self, tile: usize, byte: usize) -> u8 {
        let (tx, ty) = (tile % self.tiles_x, tile / self.tiles_x);
        let place = byte / HEADINGS;
        let (px, py) = (tx * TILE + place % TILE, ty * TILE + place / TILE);
        if px >= self.width || py >= self.height || byte >= TILE_BYTES {
            return NO_ECHO;
        }
        let values = &self.tile(tx, ty)[place * HEADINGS..][..HEADINGS];
        self.fill((px, py), values);
        values[byte % HEADINGS].load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use crate::{ConeModel, ConeTable, Plan};
    use std::sync::Arc;

    #[test]
    fn a_batch_says_what_single_look_ups_say() {
        let plan = Plan::from_ascii(
            &[
                "####################",
                "#         #        #",
                "#         #        #",
                "#                  #",
                "#    ##            #",
                "#    ##     #      #",
                "#                  #",
                "####################",
            ],
            0.25,
        );
        let table = ConeTable::new(Arc::new(plan), ConeModel::default());
        let n = 5_000;
        // Steps that meet no cell's edge and no half degree.
        let x: Vec<f32> = (0..n).map(|i| -0.3 + (i as f32 * 0.017_31) % 5.7).collect();
        let y: Vec<f32> = (0..n).map(|i| -0.3 + (i as f32 * 0.012_77) % 2.6).collect();
        let angle: Vec<f32> = (0..n).map(|i| -20.0 + i as f32 * 0.008_13).collect();
        let (sin, cos): (Vec<f32>, Vec<f32>) = angle.iter().map(|a| a.sin_cos()).unzip();
        let mut out = vec![0.0; n];
        table.ranges(&x, &y, &angle, &cos, &sin, &mut out);
        let (mut heard, mut silent) = (0, 0);
        for i in 0..n {
            let single = table.range(x[i], y[i], angle[i]);
            if single.is_finite() {
                assert!((single - out[i]).abs() < 2e-3, "{i}: {single} {}", out[i]);
                heard += 1;
            } else {
                assert_eq!(out[i], f32::INFINITY, "{i}");
                silent += 1;
            }
        }
        assert!(heard > 1_000 && silent > 200, "{heard} {silent}");
    }

    #[test]
    fn nonsense_hears_nothing() {
        let table =
            ConeTable::new(Arc::new(Plan::from_ascii(&["###", "# #", "###"], 1.0)), ConeModel::default());
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30];
        let mut out = [0.0; 4];
        table.ranges(&bad, &[1.5; 4], &[0.0; 4], &[1.0; 4], &[0.0; 4], &mut out);
        assert_eq!(out, [f32::INFINITY; 4]);
        // An angle that is no number must not reach outside the table.
        table.ranges(&[1.5; 4], &[1.5; 4], &bad, &[1.0; 4], &[0.0; 4], &mut out);
        assert!(out.iter().all(|r| r.is_infinite() || *r >= 0.0));
    }
}
