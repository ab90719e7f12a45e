use std::io::Cursor;

use image::{DynamicImage, ImageReader, Limits};

use crate::error::plain;
use crate::plan::{MAX_CELLS, MAX_SIDE};
use crate::{Cell, PictureMode, PlanError, PlanHeader};

/// Decodes the picture and sorts its shades; returns (width, cells with the lowest row first).
pub(crate) fn read(file: &str, header: &PlanHeader, bytes: &[u8]) -> Result<(usize, Vec<Cell>), PlanError> {
    let not_an_image = |reason: &dyn ToString| PlanError::NotAnImage {
        file: file.to_owned(),
        picture: plain(&header.image),
        reason: plain(&reason.to_string()),
    };
    if bytes.is_empty() {
        return Err(not_an_image(&"it is empty"));
    }
    let open =
        || ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| not_an_image(&error));
    let (width, height) = open()?.into_dimensions().map_err(|error| not_an_image(&error))?;
    // Before decoding: a header may claim gigabytes.
    check_size(file, u64::from(width), u64::from(height))?;
    let mut reader = open()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE as u32);
    limits.max_image_height = Some(MAX_SIDE as u32);
    reader.limits(limits);
    let picture = reader.decode().map_err(|error| not_an_image(&error))?;
    if header.mode == PictureMode::Raw && picture.color().bytes_per_pixel() != picture.color().channel_count()
    {
        // Percents of a 16-bit scale would all be taken for nought: free, every wall of them.
        return Err(PlanError::range(
            file,
            "mode",
            &"raw with a 16-bit picture",
            "raw with an 8-bit picture",
        ));
    }
    Ok((width as usize, cells(header, &picture)))
}

pub(crate) fn check_size(file: &str, width: u64, height: u64) -> Result<(), PlanError> {
    let side = 3..=MAX_SIDE as u64;
    if side.contains(&width) && side.contains(&height) && width * height <= MAX_CELLS as u64 {
        return Ok(());
    }
    Err(PlanError::Size {
        file: file.to_owned(),
        width,
        height,
        side: MAX_SIDE as u64,
        cells: MAX_CELLS as u64,
    })
}

fn cells(header: &PlanHeader, picture: &DynamicImage) -> Vec<Cell> {
    let shades = picture.to_luma_alpha8();
    let mut cells = Vec::with_capacity(shades.width() as usize * shades.height() as usize);
    // The picture's first row is the top, the plan's is the bottom.
    for y in (0..shades.height()).rev() {
        for x in 0..shades.width() {
            let [shade, alpha] = shades.get_pixel(x, y).0;
            cells.push(sort(header, shade, alpha));
        }
    }
    cells
}

fn sort(header: &PlanHeader, shade: u8, alpha: u8) -> Cell {
    let occupancy = match header.mode {
        PictureMode::Raw if shade > 100 => return Cell::Unknown,
        PictureMode::Raw => f64::from(shade) / 100.0,
        PictureMode::Scale if alpha < 255 => return Cell::Unknown,
        _ if header.negate => f64::from(shade) / 255.0,
        _ => f64::from(255 - shade) / 255.0,
    };
    if occupancy >= header.occupied_thresh {
        Cell::Occupied
    } else if occupancy <= header.free_thresh {
        Cell::Free
    } else {
        Cell::Unknown
    }
}
