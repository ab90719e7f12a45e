//! Pictures of a small house with two rooms.

use image::{ExtendedColorType, ImageEncoder};

/// Pixels of a metre.
pub const PIXELS_A_METRE: u32 = 40;
pub const SCALE: f64 = 1.0 / PIXELS_A_METRE as f64;
/// The house with the space around it, pixels: 10 m x 7 m.
pub const WIDTH: u32 = 400;
pub const HEIGHT: u32 = 280;

/// Shades of the house: outer walls 1 m inside the picture, a wall between two rooms with an opening 1.2 m wide, and, if
/// `open`, a gap to the outside.
pub fn house(open: bool) -> Vec<u8> {
    let metre = |value: u32| value as f64 / f64::from(PIXELS_A_METRE);
    let mut shades = Vec::new();
    for row in 0..HEIGHT {
        for column in 0..WIDTH {
            let (x, y) = (metre(column), metre(HEIGHT - 1 - row));
            let inside = (1.0..9.0).contains(&x) && (1.0..6.0).contains(&y);
            let room = (1.1..8.9).contains(&x) && (1.1..5.9).contains(&y);
            let between = (4.9..5.0).contains(&x) && !(2.8..4.0).contains(&y);
            let gap = open && (6.0..7.0).contains(&x) && y < 3.0;
            shades.push(if inside && !gap && (!room || between) { 20 } else { 240 });
        }
    }
    shades
}

pub fn png(width: u32, height: u32, shades: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    encoder.write_image(shades, width, height, ExtendedColorType::L8).unwrap();
    bytes
}

pub fn jpeg(width: u32, height: u32, shades: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 90);
    encoder.write_image(shades, width, height, ExtendedColorType::L8).unwrap();
    bytes
}

/// A PNG whose header claims a size that its few bytes do not have.
pub fn claiming(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = png(16, 16, &[255; 256]);
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    // Over the chunk's name and what is in it.
    let sum = crc(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&sum.to_be_bytes());
    bytes
}

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| (sum >> 1) ^ (0xedb8_8320 & (sum & 1).wrapping_neg()))
    })
}
