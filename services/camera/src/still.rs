//! A still picture as JPEG, now and then, for whoever cannot decode video.

use crate::source::Frame;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use ipc_types::{Format, MAX_STILL_WIDTH};
use std::io::Cursor;

/// What a source is asked for when nobody wants video.
pub const STILL_FORMAT: Format = Format { width: 640, height: 480, fps: 1, bitrate: 300_000 };
/// Tried one after the other until the picture fits its place.
const QUALITIES: [u8; 4] = [80, 60, 40, 15];

/// Why a still was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StillError {
    /// Not even at the lowest quality.
    #[error("a still of {width}x{height} does not fit into {room} bytes")]
    TooLarge {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// Bytes.
        room: usize,
    },
    /// A frame whose planes are shorter than its size says.
    #[error("a frame whose planes are too short")]
    Broken,
}

/// A still, in the place that was given for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Taken {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// 1 to 100.
    pub quality: u8,
    /// Bytes written.
    pub length: usize,
}

/// Makes stills; keeps its working memory.
#[derive(Debug, Default)]
pub struct Stills {
    pixels: Vec<u8>,
}

impl Stills {
    /// Writes a frame into `out` as JPEG, made smaller by a whole number where it is wider than [`MAX_STILL_WIDTH`].
    ///
    /// # Errors
    /// Frames that do not fit, or whose planes do not go with their size.
    pub fn take(&mut self, frame: &Frame<'_>, out: &mut [u8]) -> Result<Taken, StillError> {
        let step = frame.width.div_ceil(MAX_STILL_WIDTH).max(1);
        let (width, height) = (frame.width / step, frame.height / step);
        self.draw(frame, step as usize).ok_or(StillError::Broken)?;
        let room = out.len();
        for quality in QUALITIES {
            let mut place = Cursor::new(&mut *out);
            let written = JpegEncoder::new_with_quality(&mut place, quality).encode(
                &self.pixels,
                width,
                height,
                ExtendedColorType::Rgb8,
            );
            if written.is_ok() {
                return Ok(Taken { width, height, quality, length: place.position() as usize });
            }
        }
        Err(StillError::TooLarge { width, height, room })
    }

    /// Red, green and blue, each pixel the mean of `step` by `step`; `None` when a plane is too short.
    fn draw(&mut self, frame: &Frame<'_>, step: usize) -> Option<()> {
        let stride = frame.stride as usize;
        let (width, height) = (frame.width as usize / step, frame.height as usize / step);
        let [luma, blue, red] = frame.planes;
        self.pixels.clear();
        self.pixels.reserve(3 * width * height);
        for row in 0..height {
            // The colour of the middle is as good as the mean: it has half the resolution already.
            let colours = (row * step + step / 2) / 2 * (stride / 2);
            for column in 0..width {
                let mut sum = 0;
                for line in row * step..(row + 1) * step {
                    let begin = line * stride + column * step;
                    sum += luma.get(begin..begin + step)?.iter().map(|value| u32::from(*value)).sum::<u32>();
                }
                let at = colours + (column * step + step / 2) / 2;
                let mean = sum / (step * step) as u32;
                self.pixels.extend(rgb(mean as i32, *blue.get(at)?, *red.get(at)?));
            }
        }
        Some(())
    }
}

/// Limited range to full range red, green, blue (ITU-R BT.601-7, 2.5.1 and 2.5.3), in 1/65536.
fn rgb(luma: i32, blue: u8, red: u8) -> [u8; 3] {
    let (y, cb, cr) = (76_309 * (luma - 16), i32::from(blue) - 128, i32::from(red) - 128);
    let clip = |value: i32| ((value + 32_768) >> 16).clamp(0, 255) as u8;
    [clip(y + 104_597 * cr), clip(y - 25_675 * cb - 53_279 * cr), clip(y + 132_201 * cb)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours_come_out_right() {
        // The 75 % bars of ITU-R BT.801: white, yellow, cyan, green, magenta, red, blue; and black.
        for ((y, cb, cr), wanted) in [
            ((180, 128, 128), [191, 191, 191]),
            ((162, 44, 142), [191, 191, 0]),
            ((131, 156, 44), [0, 191, 191]),
            ((112, 72, 58), [0, 191, 0]),
            ((84, 184, 198), [191, 0, 191]),
            ((65, 100, 212), [191, 0, 0]),
            ((35, 212, 114), [0, 0, 191]),
            ((16, 128, 128), [0, 0, 0]),
        ] {
            let got = rgb(y, cb, cr);
            assert!(got.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) <= 3), "{got:?}, wanted {wanted:?}");
        }
    }
}
