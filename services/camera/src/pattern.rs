//! A test pattern: colour bars, a grey ramp, and a white block that moves by one column of blocks a frame.

use crate::source::{Frame, Pace, Source};
use ipc_types::{Format, PICTURE_BYTES};

/// Luma, blue and red difference of the bars (75 % bars of ITU-R BT.801, in BT.601).
const BARS: [[u8; 3]; 8] = [
    [180, 128, 128],
    [162, 44, 142],
    [131, 156, 44],
    [112, 72, 58],
    [84, 184, 198],
    [65, 100, 212],
    [35, 212, 114],
    [16, 128, 128],
];
/// Side of the moving block, pixels.
const BLOCK: usize = 32;

/// The pattern and its place to be drawn in.
#[derive(Debug)]
pub struct Pattern {
    bytes: Vec<u8>,
    pace: Pace,
    number: u64,
}

impl Default for Pattern {
    fn default() -> Self {
        Self { bytes: vec![0; PICTURE_BYTES], pace: Pace::default(), number: 0 }
    }
}

impl Source for Pattern {
    fn frame(&mut self, now: u64, wanted: Option<&Format>) -> Option<Frame<'_>> {
        let format = wanted?;
        if !format.is_valid() || !self.pace.is_due(now, format.fps, 1_000_000) {
            return None;
        }
        self.number += 1;
        let (width, height) = (format.width as usize, format.height as usize);
        let (luma, rest) = self.bytes.split_at_mut(width * height);
        let (blue, rest) = rest.split_at_mut(width * height / 4);
        let red = &mut rest[..width * height / 4];
        for (row, line) in luma.chunks_exact_mut(width).enumerate() {
            for (column, pixel) in line.iter_mut().enumerate() {
                *pixel = if row * 4 < height * 3 {
                    BARS[column * 8 / width][0]
                } else {
                    (16 + column * 219 / width) as u8
                };
            }
        }
        let side = BLOCK.min(height / 4);
        let left = (self.number as usize * 16) % (width - side);
        for line in luma.chunks_exact_mut(width).skip(height / 2).take(side) {
            line[left..left + side].fill(235);
        }
        let half = width / 2;
        for (plane, which) in [(&mut *blue, 1), (&mut *red, 2)] {
            for (row, line) in plane.chunks_exact_mut(half).enumerate() {
                for (column, pixel) in line.iter_mut().enumerate() {
                    *pixel = if row * 8 < height * 3 { BARS[column * 8 / half][which] } else { 128 };
                }
            }
        }
        Some(Frame {
            capture_ns: now,
            number: self.number,
            width: format.width,
            height: format.height,
            stride: format.width,
            planes: [luma, blue, red],
        })
    }
}
