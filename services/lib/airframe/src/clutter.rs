//! What stands about in a building and is on no plan: drawn by seed on any plan (DESIGN 5).

use crate::world::draw::{chance, index, uniform};
use crate::world::{ClutterLevel, DoorPlace, Ground, PadPlace, Solid, Surface, table_piece};
use rand::Rng;

/// Free floor for each object of full clutter, square metres (DESIGN 5).
pub const AREA_PER_OBJECT_M2: f32 = 15.0;
/// Share of the doors that full clutter shuts (DESIGN 5).
pub const SHUT_SHARE: f32 = 0.2;
/// Light clutter is this much of full clutter.
const LIGHT: f32 = 1.0 / 3.0;
/// Nobody puts things this near to the pad, metres, from edge to centre.
const PAD_FREE_M: f32 = 1.2;
/// Nor into a doorway, metres, from edge to the middle of the opening.
const DOOR_FREE_M: f32 = 0.6;
/// Tries for each object before the floor counts as full.
const TRIES: usize = 200;

/// An object: its parts, and the outline that all of them stay within.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub name: String,
    pub parts: Vec<Solid>,
    pub outline: Solid,
}

/// How many objects a level puts on an area of free floor.
#[must_use]
pub fn object_count(level: ClutterLevel, free_area_m2: f32) -> usize {
    (free_area_m2 / AREA_PER_OBJECT_M2 * share(level)).round() as usize
}

/// How many doors a level shuts.
#[must_use]
pub fn shut_count(level: ClutterLevel, doors: usize) -> usize {
    (doors as f32 * SHUT_SHARE * share(level)).round() as usize
}

fn share(level: ClutterLevel) -> f32 {
    match level {
        ClutterLevel::None => 0.0,
        ClutterLevel::Light => LIGHT,
        ClutterLevel::Full => 1.0,
    }
}

/// Draws objects onto floor that is free and connected with the pad while all doors are open.
pub(crate) fn draw<R: Rng + ?Sized>(
    ground: &mut Ground,
    pad: PadPlace,
    doors: &[DoorPlace],
    level: ClutterLevel,
    rng: &mut R,
) -> Vec<Piece> {
    let mut pieces = Vec::new();
    if level == ClutterLevel::None {
        return pieces;
    }
    let reached = ground.flood(pad.x, pad.y, |cell| ground.is_free_in_flight(cell));
    let floor: Vec<usize> = (0..reached.len()).filter(|cell| reached[*cell]).collect();
    let area = floor.len() as f32 * ground.resolution().powi(2);
    for _ in 0..object_count(level, area) {
        for _ in 0..TRIES {
            let Some(cell) = floor.get(index(rng, floor.len())) else { return pieces };
            let (x, y) = ground.centre(cell % ground.width(), cell / ground.width());
            let yaw = uniform(rng, 0.0, std::f32::consts::TAU);
            let piece = draw_piece((x, y), yaw, rng);
            let away = |at: (f32, f32), free: f32| piece.outline.outline_distance(at.0, at.1) >= free;
            let allowed = away((pad.x, pad.y), PAD_FREE_M)
                && doors.iter().all(|door| away(door.middle, DOOR_FREE_M))
                && ground.is_clear(&piece.outline);
            if allowed {
                // At once, so that the next object does not stand on this one.
                ground.place(&piece.outline);
                pieces.push(piece);
                break;
            }
        }
    }
    pieces
}

/// Shuts doors at random, besides those that are shut already.
pub(crate) fn shut_doors<R: Rng + ?Sized>(doors: &mut [DoorPlace], level: ClutterLevel, rng: &mut R) {
    for _ in 0..shut_count(level, doors.len()) {
        let open: Vec<usize> = (0..doors.len()).filter(|i| !doors[*i].shut).collect();
        if let Some(i) = open.get(index(rng, open.len())) {
            doors[*i].shut = true;
        }
    }
}

fn draw_piece<R: Rng + ?Sized>(at: (f32, f32), yaw: f32, rng: &mut R) -> Piece {
    match index(rng, 8) {
        0 => cupboard(at, yaw, rng),
        1 => carton(at, yaw, rng),
        2 => stack(at, yaw, rng),
        3 => chair(at, yaw, rng),
        4 => {
            let size = (uniform(rng, 0.6, 0.9), uniform(rng, 0.5, 0.7));
            table_piece("table", at, size, yaw, 0.75)
        }
        5 => plant(at, rng),
        6 => lamp(at, rng),
        _ => trolley(at, yaw, rng),
    }
}

fn single(name: &str, solid: Solid) -> Piece {
    Piece { name: name.to_owned(), parts: vec![solid], outline: solid }
}

fn cupboard<R: Rng + ?Sized>(at: (f32, f32), yaw: f32, rng: &mut R) -> Piece {
    let size = (uniform(rng, 0.5, 0.9), uniform(rng, 0.35, 0.5));
    single("cupboard", Solid::new_box(at, size, yaw, 0.0, uniform(rng, 1.5, 2.0)))
}

fn carton<R: Rng + ?Sized>(at: (f32, f32), yaw: f32, rng: &mut R) -> Piece {
    let size = (uniform(rng, 0.3, 0.6), uniform(rng, 0.3, 0.6));
    single("box", Solid::new_box(at, size, yaw, 0.0, uniform(rng, 0.4, 0.7)))
}

fn stack<R: Rng + ?Sized>(at: (f32, f32), yaw: f32, rng: &mut R) -> Piece {
    let size = (uniform(rng, 0.4, 0.65), uniform(rng, 0.35, 0.6));
    let (mut bottom, mut parts) = (0.0, Vec::new());
    for level in 0..2 + usize::from(chance(rng, 0.6)) {
        let shrink = 1.0 - 0.12 * level as f32;
        let turn = uniform(rng, -0.15, 0.15);
        let top = bottom + uniform(rng, 0.35, 0.55);
        // Turned boxes stay within the outline below.
        let part = (size.0 * shrink * 0.85, size.1 * shrink * 0.85);
        parts.push(Solid::new_box(at, part, yaw + turn, bottom, top));
        bottom = top;
    }
    Piece { name: "stacked boxes".to_owned(), parts, outline: Solid::new_box(at, size, yaw, 0.0, bottom) }
}

fn chair<R: Rng + ?Sized>(at: (f32, f32), yaw: f32, rng: &mut R) -> Piece {
    let side = uniform(rng, 0.42, 0.5);
    let back_top = uniform(rng, 0.85, 1.05);
    let (sin, cos) = yaw.sin_cos();
    let place = |lx: f32, ly: f32| (at.0 + lx * cos - ly * sin, at.1 + lx * sin + ly * cos);
    let mut parts = vec![Solid::new_box(at, (side, side), yaw, 0.41, 0.45)];
    parts.push(Solid::new_box(place(-side * 0.46, 0.0), (side * 0.08, side), yaw, 0.45, back_top));
    let foot = side * 0.5 - 0.02;
    for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        parts.push(Solid::new_cylinder(place(sx * foot, sy * foot), 0.015, 0.0, 0.41));
    }
    Piece { name: "chair".to_owned(), parts, outline: Solid::new_box(at, (side, side), yaw, 0.0, back_top) }
}

fn plant<R: Rng + ?Sized>(at: (f32, f32), rng: &mut R) -> Piece {
    let leaves = uniform(rng, 0.22, 0.42);
    let top = uniform(rng, 1.0, 1.7);
    let pot = Solid::new_cylinder(at, leaves * 0.6, 0.0, 0.4);
    let crown = Solid::new_cylinder(at, leaves, 0.45, top).with_surface(Surface::Soft);
    Piece {
        name: "plant".to_owned(),
        parts: vec![pot, Solid::new_cylinder(at, 0.02, 0.4, 0.45), crown],
        outline: Solid::new_cylinder(at, leaves, 0.0, top),
    }
}

fn lamp<R: Rng + ?Sized>(at: (f32, f32), rng: &mut R) -> Piece {
    let shade = uniform(rng, 0.15, 0.22);
    let from = uniform(rng, 1.4, 1.55);
    let pole = uniform(rng, 0.015, 0.03);
    Piece {
        name: "floor lamp".to_owned(),
        parts: vec![
            Solid::new_cylinder(at, shade, 0.0, 0.03),
            Solid::new_cylinder(at, pole, 0.03, from),
            Solid::new_cylinder(at, shade, from, from + 0.25).with_surface(Surface::Soft),
        ],
        outline: Solid::new_cylinder(at, shade, 0.0, from + 0.25),
    }
}

fn trolley<R: Rng + ?Sized>(at: (f32, f32), yaw: f32, rng: &mut R) -> Piece {
    let size = (uniform(rng, 0.7, 0.9), uniform(rng, 0.45, 0.55));
    let handle = uniform(rng, 0.95, 1.1);
    let load = uniform(rng, 0.5, 1.4);
    let mut parts = vec![
        Solid::new_box(at, size, yaw, 0.12, 0.2),
        Solid::new_box(at, (size.0 * 0.8, size.1 * 0.85), yaw, 0.2, load),
    ];
    let posts = Solid::new_box(at, (size.0 - 0.04, size.1 - 0.04), yaw, 0.0, handle).corners();
    for post in [posts[1], posts[2]] {
        parts.push(Solid::new_cylinder(post, 0.015, 0.2, handle));
    }
    let top = handle.max(load);
    Piece { name: "trolley".to_owned(), parts, outline: Solid::new_box(at, size, yaw, 0.0, top) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::draw::stream;

    #[test]
    fn parts_stay_within_their_outline_and_sizes_within_their_bounds() {
        let mut rng = stream(3, 9);
        for _ in 0..400 {
            let yaw = uniform(&mut rng, 0.0, 6.0);
            let piece = draw_piece((4.0, 7.0), yaw, &mut rng);
            let outline = piece.outline;
            let size = 2.0 * outline.half_x.max(outline.half_y);
            assert!((0.3..=0.9).contains(&size), "{}: {size}", piece.name);
            assert!((0.4..=2.0).contains(&outline.top), "{}: {}", piece.name, outline.top);
            for part in &piece.parts {
                assert!(part.top <= outline.top + 1e-5 && part.bottom >= 0.0 && part.bottom < part.top);
                for (x, y) in part.corners() {
                    if part.shape == crate::world::Shape::Box {
                        assert!(outline.outline_distance(x, y) < 0.02, "{}", piece.name);
                    }
                }
                assert!(outline.outline_distance(part.x, part.y) < 0.0);
            }
        }
    }

    #[test]
    fn levels_mean_what_the_command_line_says() {
        assert_eq!(object_count(ClutterLevel::Full, 300.0), 20);
        assert_eq!(object_count(ClutterLevel::Light, 300.0), 7);
        assert_eq!(object_count(ClutterLevel::None, 300.0), 0);
        assert_eq!(shut_count(ClutterLevel::Full, 10), 2);
        assert_eq!(shut_count(ClutterLevel::Light, 15), 1);
    }
}
