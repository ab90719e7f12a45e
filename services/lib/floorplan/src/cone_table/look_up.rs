//! Look-ups, many at once, in loops that vectorise.

use super::{ConeTable, EMPTY, HALO, HEADINGS, NO_ECHO, NOWHERE, ROW};
use std::sync::atomic::{AtomicU8, Ordering};

/// Look-ups worked on together: the intermediate columns stay in the first-level cache.
const BLOCK: usize = 128;
/// 1.5 · 2²³: adding it to an `f32` below 2²² in size rounds it to the nearest integer, found in the low
/// bits. A cast that saturates, or `floor`, costs more than the look-up itself.
const ROUND: f32 = 12_582_912.0;
const A_TURN: f32 = HEADINGS as f32;
/// Byte of a row that stands for the axis along x.
const MIDDLE: f32 = (HALO + HEADINGS / 2) as f32;

/// The integer nearest to `v`; for |`v`| < 2²².
#[inline]
fn round(v: f32) -> f32 {
    (v + ROUND) - ROUND
}

/// That integer, of a sum `v + ROUND`; for 0 <= `v` < 2²².
#[inline]
fn index(sum: f32) -> u32 {
    sum.to_bits() & 0x003f_ffff
}

impl ConeTable {
    /// The nearest echo from a place in the plan frame along `angle`, metres; infinite when there is none, outside the
    /// plan too.
    pub fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        let (sin, cos) = angle.sin_cos();
        let mut out = [0.0];
        self.block::<1>([&[x], &[y], &[angle], &[cos], &[sin]], &mut out);
        out[0]
    }

    /// As [`Self::range`] for columns of places and axes: `out[i]` is the range from (`x[i]`, `y[i]`) along
    /// `angle[i]`, whose cosine and sine the caller has at hand. Columns beyond the shortest one's end are left alone.
    pub fn ranges(&self, x: &[f32], y: &[f32], angle: &[f32], cos: &[f32], sin: &[f32], out: &mut [f32]) {
        let lengths = [x.len(), y.len(), angle.len(), cos.len(), sin.len()];
        let n = lengths.into_iter().fold(out.len(), usize::min);
        let mut from = 0;
        while from < n {
            let to = (from + BLOCK).min(n);
            self.block::<BLOCK>(
                [&x[from..to], &y[from..to], &angle[from..to], &cos[from..to], &sin[from..to]],
                &mut out[from..to],
            );
            from = to;
        }
    }

    /// At most `N` look-ups.
    #[inline]
    fn block<const N: usize>(&self, [x, y, angle, cos, sin]: [&[f32]; 5], out: &mut [f32]) {
        const TURNS: f32 = 1.0 / std::f32::consts::TAU;
        let n = out.len().min(N);
        let (x, y, angle, cos, sin) = (&x[..n], &y[..n], &angle[..n], &cos[..n], &sin[..n]);
        let out = &mut out[..n];
        let origin = self.plan.origin();
        let (width, height) = (self.plan.width() as f32, self.plan.height() as f32);
        let (resolution, inverse_resolution) = (self.plan.resolution(), self.inverse_resolution);
        let stride_bits = self.stride_bits;
        // Which cell, which byte of its row, and how far from its middle across the axis, metres.
        let (mut cell, mut axis, mut across) = ([0u32; N], [0.0f32; N], [0.0f32; N]);
        for i in 0..n {
            let fx = (x[i] - origin.0) * inverse_resolution;
            let fy = (y[i] - origin.1) * inverse_resolution;
            let inside = (fx >= 0.0) & (fy >= 0.0) & (fx < width) & (fy < height);
            let (ix, iy) = (fx - 0.5 + ROUND, fy - 0.5 + ROUND);
            // Places outside, and those that are no place, are looked up nowhere.
            cell[i] = if inside { (index(iy) << stride_bits) + index(ix) } else { u32::MAX };
            let off_x = (fx - 0.5 - (ix - ROUND)) * resolution;
            let off_y = (fy - 0.5 - (iy - ROUND)) * resolution;
            out[i] = off_x * cos[i] + off_y * sin[i];
            across[i] = off_y * cos[i] - off_x * sin[i];
            let turns = angle[i] * TURNS;
            axis[i] = (turns - round(turns)) * A_TURN + MIDDLE;
        }
        let (cells, values, parallax) = (&*self.cells, &*self.values, &*self.parallax);
        let mut value = [NO_ECHO; N];
        for i in 0..n {
            let row = cells.get(cell[i] as usize).map_or(NOWHERE, |place| *place as usize * ROW);
            let middle = self.known(values, cell[i], row, axis[i]);
            // What is heard from the middle is seen from here a little to the side.
            let aside = across[i] * parallax[usize::from(middle)];
            value[i] = self.known(values, cell[i], row, axis[i] + aside);
        }
        for i in 0..n {
            let range = (f32::from(value[i]) - 1.0) * self.level_m - out[i];
            out[i] = if value[i] == NO_ECHO { f32::INFINITY } else { range.max(0.0) };
        }
    }

    /// A byte of a row, worked out if need be; no echo for what is off the table.
    #[inline]
    fn known(&self, values: &[AtomicU8], cell: u32, row: usize, axis: f32) -> u8 {
        let byte = row + index(axis + ROUND) as usize;
        let stored = || values.get(byte).map_or(NO_ECHO, |value| value.load(Ordering::Relaxed));
        match stored() {
            // Nobody has asked about this cell, or another thread is at it just now.
            EMPTY => {
                self.work_out(cell, row);
                stored()
            }
            value => value,
        }
    }

    #[cold]
    fn work_out(&self, cell: u32, row: usize) {
        if let Some(values) = self.values.get(row..row + ROW) {
            let (ix, iy) = (cell & ((1 << self.stride_bits) - 1), cell >> self.stride_bits);
            self.fill((ix as usize, iy as usize), values);
        }
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
        let table = ConeTable::new(Arc::new(plan), ConeModel::default()).unwrap();
        let n = 5_000;
        let x: Vec<f32> = (0..n).map(|i| -0.3 + (i as f32 * 0.017_31) % 5.7).collect();
        let y: Vec<f32> = (0..n).map(|i| -0.3 + (i as f32 * 0.012_77) % 2.6).collect();
        let angle: Vec<f32> = (0..n).map(|i| -20.0 + i as f32 * 0.008_13).collect();
        let (sin, cos): (Vec<f32>, Vec<f32>) = angle.iter().map(|a| a.sin_cos()).unzip();
        let mut out = vec![0.0; n];
        table.ranges(&x, &y, &angle, &cos, &sin, &mut out);
        let (mut heard, mut silent) = (0, 0);
        for i in 0..n {
            assert_eq!(table.range(x[i], y[i], angle[i]), out[i], "{i}");
            if out[i].is_finite() {
                heard += 1;
            } else {
                silent += 1;
            }
        }
        assert!(heard > 1_000 && silent > 200, "{heard} {silent}");
    }

    #[test]
    fn nonsense_hears_nothing() {
        let plan = Plan::from_ascii(&["###", "# #", "###"], 1.0);
        let table = ConeTable::new(Arc::new(plan), ConeModel::default()).unwrap();
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30];
        let mut out = [0.0; 4];
        table.ranges(&bad, &[1.5; 4], &[0.0; 4], &[1.0; 4], &[0.0; 4], &mut out);
        assert_eq!(out, [f32::INFINITY; 4]);
        // An angle that is no number must not reach outside the table.
        for bad in [bad, [f32::MAX, -1e9, 1e9, f32::MIN]] {
            table.ranges(&[1.5; 4], &[1.5; 4], &bad, &[1.0; 4], &[0.0; 4], &mut out);
            assert!(out.iter().all(|r| r.is_infinite() || *r >= 0.0));
            table.ranges(&[1.2; 4], &[1.7; 4], &[0.3; 4], &bad, &bad, &mut out);
            assert!(out.iter().all(|r| r.is_infinite() || *r >= 0.0), "{out:?}");
        }
    }
}
