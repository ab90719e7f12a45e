//! Light and paint for each pixel.

use super::lamps::CHEST_M;
use super::look::{FAR_M, Look, dot};
use super::paint::{Paint, Pattern};
use super::raster::{NOTHING, Raster};
use super::scene::Scene;
use super::shapes::Face;
use super::{Canvas, Light};
use std::sync::OnceLock;

/// Luma of black and white in limited range (BT.601).
const BLACK: f32 = 16.0;
const WHITE: f32 = 235.0;
/// Brightest light that the table of the camera's curve knows, and its steps.
const BRIGHTEST: f32 = 4.0;
const STEPS: usize = 2048;
/// Light of the infra-red ring on a wall a metre ahead, and how it falls off away from the lens's axis.
const RING: f32 = 4.5;
/// What there is at night besides: the glow of signs and screens.
const GLOW: f32 = 0.004;
/// Light changes slowly: it is worked out at every so many pixels of a face and drawn straight between them.
const BLOCK: usize = 8;
/// Largest deviation of a pixel by the sensor's noise, steps of luma.
const NOISE: (u32, u32) = (2, 7);
/// Tiles and ceiling panels, metres; lines fade with distance, or they would flicker.
const TILE_M: f32 = 0.6;
const LINE_M: f32 = 0.012;
const LINES_TO_M: f32 = 9.0;
/// Heights on a wall, metres: skirting board, dado.
const SKIRTING_M: f32 = 0.09;
const DADO_M: f32 = 1.0;

/// The camera's curve: light to luma.
fn curve() -> &'static [u8; STEPS] {
    static CURVE: OnceLock<[u8; STEPS]> = OnceLock::new();
    CURVE.get_or_init(|| {
        std::array::from_fn(|i| {
            let light = (i as f32 + 0.5) / STEPS as f32 * BRIGHTEST;
            // Bright light saturates softly, as a sensor's shoulder does.
            let held = light / (1.0 + (light * 0.5).powi(2)).sqrt();
            let shown = (held * 0.92).clamp(0.0, 1.0).powf(1.0 / 2.0);
            (BLACK + (WHITE - BLACK) * shown).round() as u8
        })
    })
}

/// What is the same for all pixels of a face.
struct Painted<'a> {
    face: &'a Face,
    paint: Paint,
    /// By the direction in which the face looks.
    facing: f32,
}

impl<'a> Painted<'a> {
    fn new(face: &'a Face, light: Light) -> Self {
        let paint = face.paint;
        let [nx, ny, nz] = face.normal;
        let facing = match light {
            Light::Night => 1.0,
            Light::Day if nz > 0.7 => 1.0,
            Light::Day if nz < -0.7 => 0.55,
            Light::Day => sideways(nx, ny),
        };
        Self { face, paint, facing }
    }
}

/// How much a face that looks sideways gets of the lamps: more one way than the other, so that corners are seen.
fn sideways(nx: f32, ny: f32) -> f32 {
    0.74 + 0.14 * (0.55 * nx + 0.83 * ny)
}

/// Paints a rastered picture.
pub(super) fn picture(
    scene: &Scene,
    raster: &Raster,
    look: &Look,
    light: Light,
    noise: u64,
    canvas: &mut Canvas<'_>,
) {
    let curve = curve();
    let (width, stride) = (canvas.width, canvas.stride);
    let [luma, blue, red] = &mut canvas.planes;
    let swing = if light == Light::Day { NOISE.0 } else { NOISE.1 };
    let step = look.right.map(|v| v / look.focal);
    let mut random = Noise::new(noise);
    for (row, line) in luma.chunks_exact_mut(stride).take(canvas.height).enumerate() {
        let (faces, nearness) = raster.row(row);
        let line = &mut line[..width];
        let begin = look.ray(0.5, row as f32 + 0.5);
        let mut at = 0;
        while at < width {
            let number = faces[at];
            let end = at + faces[at..].iter().position(|other| *other != number).unwrap_or(width - at);
            match scene.face(number).filter(|_| number != NOTHING) {
                None => line[at..end].fill(BLACK as u8),
                Some(face) => {
                    let run = Run { scene, look, light, painted: Painted::new(face, light), begin, step };
                    run.paint(at, &mut line[at..end], &nearness[at..end], curve);
                }
            }
            at = end;
        }
        random.over(line, swing);
        if row % 2 == 0 {
            let half = row / 2 * (stride / 2);
            let (blue, red) = (&mut blue[half..half + width / 2], &mut red[half..half + width / 2]);
            match light {
                Light::Night => {
                    blue.fill(128);
                    red.fill(128);
                }
                Light::Day => colours(scene, faces, line, blue, red),
            }
        }
    }
}

/// Neighbouring pixels of one row that show one face.
struct Run<'a> {
    scene: &'a Scene,
    look: &'a Look,
    light: Light,
    painted: Painted<'a>,
    /// Direction through the row's first pixel, and from each to the next.
    begin: [f32; 3],
    step: [f32; 3],
}

impl Run<'_> {
    fn paint(&self, first: usize, pixels: &mut [u8], nearness: &[f32], curve: &[u8; STEPS]) {
        let last = pixels.len().saturating_sub(1);
        let steps = STEPS as f32 / BRIGHTEST;
        let mut here = self.light(first, nearness[0]) * steps;
        let blocks = pixels.chunks_mut(BLOCK).zip(nearness.chunks(BLOCK)).enumerate();
        for (block, (pixels, near)) in blocks {
            let start = block * BLOCK;
            let end = (start + BLOCK).min(last);
            let there = if end > start { self.light(first + end, nearness[end]) * steps } else { here };
            let slope = (there - here) / (end - start).max(1) as f32;
            if matches!(self.painted.paint.pattern, Pattern::Plain | Pattern::Lamp) {
                for (k, pixel) in pixels.iter_mut().enumerate() {
                    *pixel = shown(curve, here + slope * k as f32);
                }
            } else {
                for (k, (pixel, near)) in pixels.iter_mut().zip(near).enumerate() {
                    let (place, _, ahead) = self.place(first + start + k, *near);
                    let share = pattern(self.scene, &self.painted, place, ahead);
                    *pixel = shown(curve, (here + slope * k as f32) * share);
                }
            }
            here = there;
        }
    }

    /// World-frame place of a pixel, the direction to it one metre ahead, and how far ahead it is.
    #[inline]
    fn place(&self, column: usize, near: f32) -> ([f32; 3], [f32; 3], f32) {
        let across = column as f32;
        let ray: [f32; 3] = std::array::from_fn(|i| self.begin[i] + across * self.step[i]);
        let ahead = 1.0 / near.max(1.0 / FAR_M);
        (std::array::from_fn(|i| self.look.eye[i] + ray[i] * ahead), ray, ahead)
    }

    /// Light that comes back from a pixel, without its pattern.
    fn light(&self, column: usize, near: f32) -> f32 {
        let (place, ray, ahead) = self.place(column, near);
        match self.light {
            Light::Day => by_day(self.scene, &self.painted, place),
            Light::Night => by_night(&self.painted, place, ray, ahead),
        }
    }
}

#[inline]
fn shown(curve: &[u8; STEPS], step: f32) -> u8 {
    curve[(step as usize).min(STEPS - 1)]
}

/// The whole number below, without a call into the library of mathematics.
#[inline]
fn floor(v: f32) -> f32 {
    let whole = v as i32;
    (whole - i32::from((whole as f32) > v)) as f32
}

/// Colour of every second pixel of a row: that of its face's paint, weaker in the dark.
fn colours(scene: &Scene, faces: &[u32], luma: &[u8], blue: &mut [u8], red: &mut [u8]) {
    let mut known = NOTHING;
    let (mut b, mut r) = (0.0, 0.0);
    let pairs = faces.chunks_exact(2).zip(luma.chunks_exact(2));
    for ((faces, luma), (blue, red)) in pairs.zip(blue.iter_mut().zip(red)) {
        if faces[0] != known {
            known = faces[0];
            let paint = scene.face(known).map(|face| face.paint);
            let shown = paint.map_or(1.0, |paint| paint.albedo.max(0.02).sqrt());
            (b, r) = paint.map_or((0.0, 0.0), |paint| (paint.chroma.0 / shown, paint.chroma.1 / shown));
        }
        let share = (f32::from(luma[0]) - BLACK) / (WHITE - BLACK);
        *blue = (128.0 + b * share).clamp(16.0, 240.0) as u8;
        *red = (128.0 + r * share).clamp(16.0, 240.0) as u8;
    }
}

#[inline]
fn by_day(scene: &Scene, painted: &Painted<'_>, place: [f32; 3]) -> f32 {
    if painted.paint.pattern == Pattern::Lamp {
        return BRIGHTEST;
    }
    let [x, y, z] = place;
    let [nx, ny, _] = painted.face.normal;
    // Light is that of the room before the face, not of the wall behind it.
    let [floor, chest] = scene.lamps.at(x + 0.2 * nx, y + 0.2 * ny);
    let lit = floor + (chest - floor) * (z * (1.0 / CHEST_M)).clamp(0.0, 1.0);
    let facing = match painted.face.axis {
        Some((ax, ay)) => {
            let (dx, dy) = (x - ax, y - ay);
            let scale = 1.0 / (dx * dx + dy * dy).max(1e-6).sqrt();
            sideways(dx * scale * 1.8, dy * scale * 1.8)
        }
        None => painted.facing,
    };
    painted.paint.albedo * lit * facing
}

#[inline]
fn by_night(painted: &Painted<'_>, place: [f32; 3], ray: [f32; 3], ahead: f32) -> f32 {
    // `ray` is a metre ahead and so the longer the farther off the axis.
    let square = dot(ray, ray);
    let towards = match painted.face.axis {
        Some((ax, ay)) => {
            let (dx, dy) = (place[0] - ax, place[1] - ay);
            let scale = 1.0 / ((dx * dx + dy * dy) * square).max(1e-9).sqrt();
            -(dx * ray[0] + dy * ray[1]) * scale
        }
        None => -dot(painted.face.normal, ray) / square.sqrt(),
    };
    let range_square = ahead * ahead * square;
    // The ring's beam: cosine to the fourth off its axis.
    let beam = 1.0 / (square * square);
    let ring = RING * beam * (0.25 + 0.75 * towards.max(0.0)) / (0.35 + range_square);
    let painted_as = if painted.paint.pattern == Pattern::Lamp { 0.5 } else { painted.paint.infrared };
    painted_as * (ring + GLOW)
}

/// How much darker than its paint a place on a face is.
#[inline]
fn pattern(scene: &Scene, painted: &Painted<'_>, place: [f32; 3], ahead: f32) -> f32 {
    let [x, y, z] = place;
    match painted.paint.pattern {
        Pattern::Plain | Pattern::Lamp => 1.0,
        Pattern::Wall => {
            let corner = (z * 3.0).min((scene.ceiling - z) * 4.0).clamp(0.0, 1.0);
            let band = if z < SKIRTING_M {
                0.25
            } else if z < DADO_M {
                0.62
            } else if z < DADO_M + 0.03 {
                0.4
            } else {
                1.0
            };
            band * (0.78 + 0.22 * corner)
        }
        Pattern::Tiles => {
            let (tile_x, tile_y) = (x * (1.0 / TILE_M), y * (1.0 / TILE_M));
            let (cx, cy) = (floor(tile_x), floor(tile_y));
            let odd = if (cx as i32 ^ cy as i32) & 1 == 0 { 0.06 } else { -0.06 };
            1.0 + odd - line(tile_x - cx, tile_y - cy, ahead) * 0.45
        }
        Pattern::Panels => {
            let (panel_x, panel_y) = (x * (1.0 / TILE_M), y * (1.0 / TILE_M));
            1.0 - line(panel_x - floor(panel_x), panel_y - floor(panel_y), ahead) * 0.4
        }
        Pattern::Cloth => {
            let at = |v: f32| floor(v * 40.0) as i32 as u32;
            let mixed = at(x).wrapping_mul(0x9e37_79b1)
                ^ at(y).wrapping_mul(0x85eb_ca77)
                ^ at(z).wrapping_mul(0xc2b2_ae3d);
            let speck = (mixed.wrapping_mul(0x27d4_eb2f) >> 24) as f32 * (1.0 / 255.0) - 0.5;
            1.0 + speck * 0.35 * (1.0 - ahead * (1.0 / 4.0)).max(0.0)
        }
        Pattern::Seams => {
            let seam = z * (1.0 / 0.5) + 0.5;
            let off = (seam - floor(seam + 0.5)).abs() * 0.5;
            if off < 0.012 { 0.55 } else { 1.0 }
        }
    }
}

/// 1 on the line between tiles, fading with distance; `u` and `v` in tiles.
#[inline]
fn line(u: f32, v: f32, ahead: f32) -> f32 {
    // A line is never thinner than a pixel or so, and the paler for it.
    let wide = (LINE_M / TILE_M) * (1.0 + ahead * 0.3);
    let on = u < wide || v < wide;
    let fade = (1.0 - ahead * (1.0 / LINES_TO_M)).max(0.0) / (1.0 + ahead * 0.3);
    if on { fade } else { 0.0 }
}

/// The sensor's noise: a fast generator (xorshift, Marsaglia 2003), the same for equal seeds.
struct Noise(u32);

impl Noise {
    fn new(seed: u64) -> Self {
        let mixed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29) ^ seed;
        Self(((mixed >> 16) as u32) | 1)
    }

    fn over(&mut self, line: &mut [u8], swing: u32) {
        let wide = 2 * swing + 1;
        for four in line.chunks_mut(4) {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 17;
            self.0 ^= self.0 << 5;
            for (pixel, byte) in four.iter_mut().zip(self.0.to_le_bytes()) {
                let by = (u32::from(byte) * wide) >> 8;
                *pixel = (u32::from(*pixel) + by).saturating_sub(swing).min(255) as u8;
            }
        }
    }
}
