//! A picture that somebody sends: looked at before it is decoded, and kept in shades of grey.

use crate::refusal::Refusal;
use axum::http::StatusCode;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::metadata::Orientation;
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// Most pixels of a picture: an A0 sheet at 150 dots an inch has 35 million.
const MOST_PIXELS: u64 = 40_000_000;
/// Pixels a side.
const SIDE: std::ops::RangeInclusive<u32> = 16..=20_000;
/// Bytes that decoding may take.
const MOST_BYTES: u64 = 256 * 1024 * 1024;
/// Pixels a side of the copy that the page shows.
const PREVIEW: usize = 2_000;

/// A picture in shades of grey, row by row, the top one first.
#[derive(Debug)]
pub(super) struct Grey {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) shades: Vec<u8>,
}

impl Grey {
    /// Reads a PNG or JPEG, turned as its camera held it; what is transparent is white.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let none = |reason: &dyn std::fmt::Display| {
            // On one line.
            let reason = reason.to_string();
            let mut reason = reason.split_whitespace().collect::<Vec<_>>().join(" ");
            crate::text::shorten(&mut reason, 200);
            Refusal::bad(format!("this is no PNG or JPEG picture that can be read: {reason}"))
        };
        let open =
            || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| none(&error));
        let reader = open()?;
        if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Err(Refusal::bad("this is no PNG or JPEG picture: save the plan as one of these"));
        }
        // Before decoding: a header may claim gigabytes.
        let (width, height) = reader.into_dimensions().map_err(|error| none(&error))?;
        if !SIDE.contains(&width)
            || !SIDE.contains(&height)
            || u64::from(width) * u64::from(height) > MOST_PIXELS
        {
            return Err(Refusal::new(
                StatusCode::PAYLOAD_TOO_LARGE,
                format!(
                    "the picture is {width} x {height} pixels, allowed is 16 to 20000 a side and 40 megapixels in all"
                ),
            ));
        }
        let mut limits = Limits::default();
        limits.max_alloc = Some(MOST_BYTES);
        let mut reader = open()?;
        reader.limits(limits);
        let mut decoder = reader.into_decoder().map_err(|error| none(&error))?;
        if decoder.total_bytes() > MOST_BYTES {
            return Err(Refusal::new(
                StatusCode::PAYLOAD_TOO_LARGE,
                "the picture has too many colours for its size: save it in shades of grey, 8 bits each",
            ));
        }
        // One whose camera does not say is as it is.
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let picture = DynamicImage::from_decoder(decoder).map_err(|error| none(&error))?;
        let mut grey = DynamicImage::ImageLuma8(if picture.color().has_alpha() {
            let shades = picture.into_luma_alpha8();
            let (width, height) = shades.dimensions();
            let on_white = |pixel: &image::LumaA<u8>| {
                let [shade, alpha] = pixel.0;
                255 - (u16::from(alpha) * u16::from(255 - shade) / 255) as u8
            };
            let flat = shades.pixels().map(on_white).collect();
            image::GrayImage::from_raw(width, height, flat).ok_or_else(|| none(&"it has no pixels"))?
        } else {
            picture.into_luma8()
        });
        grey.apply_orientation(orientation);
        let (width, height) = (grey.width() as usize, grey.height() as usize);
        Ok(Self { width, height, shades: grey.into_luma8().into_raw() })
    }

    /// As PNG.
    pub(super) fn png(&self) -> Result<Vec<u8>, Refusal> {
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
            .write_image(&self.shades, self.width as u32, self.height as u32, ExtendedColorType::L8)
            .map_err(|error| Refusal::bad(format!("the picture cannot be kept: {error}")))?;
        Ok(bytes)
    }

    /// A smaller copy; each of its pixels is the darkest of those it stands for, so that thin lines stay.
    pub(super) fn preview(&self) -> Self {
        let times = self.width.max(self.height).div_ceil(PREVIEW).max(1);
        let (width, height) = (self.width.div_ceil(times), self.height.div_ceil(times));
        let mut shades = vec![255_u8; width * height];
        for (index, shade) in self.shades.iter().enumerate() {
            let (x, y) = (index % self.width / times, index / self.width / times);
            if let Some(darkest) = shades.get_mut(y * width + x) {
                *darkest = (*darkest).min(*shade);
            }
        }
        Self { width, height, shades }
    }
}
