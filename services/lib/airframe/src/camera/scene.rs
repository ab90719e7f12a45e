//! The world as faces: what stands still once, people anew for each picture.

use super::Figure;
use super::lamps::Lamps;
use super::paint::{self, Paint};
use super::person;
use super::shapes::{Face, Mesh};
use crate::world::{DoorPlace, Role, Solid, World};

/// A frame stands this far into the wall's opening and this far out of the wall on either side, metres.
const FRAME_M: f32 = 0.06;
const FRAME_DEPTH_M: f32 = 0.24;
const LEAF_M: f32 = 0.05;
/// A handle: height above the floor, length, thickness and how far it stands off the leaf's middle, metres.
const HANDLE_M: (f32, f32, f32, f32) = (1.05, 0.13, 0.025, 0.05);
/// Legs and poles are thinner than this, metres.
const THIN_M: f32 = 0.06;
/// Doors that a picture can show shut.
const MOST_DOORS: usize = 64;

/// What can be seen.
#[derive(Debug)]
pub(super) struct Scene {
    pub still: Mesh,
    pub walking: Mesh,
    pub lamps: Lamps,
    pub ceiling: f32,
}

impl Scene {
    pub(super) fn of(world: &World) -> Self {
        let ceiling = world.ceiling();
        let mut still = Mesh::default();
        let lamps = Lamps::of(world);
        floor_and_ceiling(world, &mut still);
        for lamp in lamps.places() {
            let (x, y) = *lamp;
            let first = still.faces.len();
            let under = ceiling - 0.015;
            let (a, b) = (0.6, 0.15);
            still.face(
                &[[x - a, y + b, under], [x + a, y + b, under], [x + a, y - b, under], [x - a, y - b, under]],
                paint::LAMP,
                None,
            );
            still.body(first, None);
        }
        for solid in world.solids().iter().filter(|solid| solid.role != Role::Door) {
            let first = still.faces.len();
            still.solid(solid, paint_of(world, solid), ceiling);
            if solid.role == Role::Wall {
                still.drop_faces(first, |corners, normal| is_inside_walls(world, corners, normal));
            }
            if still.faces.len() > first {
                still.body(first, None);
            }
        }
        let lintel = world
            .solids()
            .iter()
            .find(|solid| solid.role == Role::Lintel)
            .map_or(ceiling, |solid| solid.bottom);
        for (index, door) in world.doors().iter().enumerate().take(MOST_DOORS) {
            add_door(door, index as u32, lintel, ceiling, &mut still);
        }
        Self { still, walking: Mesh::default(), lamps, ceiling }
    }

    /// Puts people where they are now.
    pub(super) fn people(&mut self, people: &[Figure], time_s: f64) {
        self.walking.clear();
        for (index, figure) in people.iter().enumerate() {
            person::add(figure, index, time_s, &mut self.walking);
        }
    }

    /// The face with this number: those that stand still first, then those of people.
    pub(super) fn face(&self, number: u32) -> Option<&Face> {
        let still = self.still.faces.len();
        let number = number as usize;
        self.still.faces.get(number).or_else(|| self.walking.faces.get(number.checked_sub(still)?))
    }
}

fn floor_and_ceiling(world: &World, mesh: &mut Mesh) {
    let [x0, y0, x1, y1] = world.bounds();
    let top = world.ceiling();
    for (corners, paint) in [
        ([[x0, y0, 0.0], [x1, y0, 0.0], [x1, y1, 0.0], [x0, y1, 0.0]], paint::FLOOR),
        ([[x0, y1, top], [x1, y1, top], [x1, y0, top], [x0, y0, top]], paint::CEILING),
    ] {
        let first = mesh.faces.len();
        mesh.face(&corners, paint, None);
        mesh.body(first, None);
    }
}

/// Whether a face of a wall's block lies against other blocks all along: nobody sees it, but where blocks of a bent building
/// stand a millimetre apart its edge would show as a crack.
fn is_inside_walls(world: &World, corners: &[[f32; 3]], normal: [f32; 3]) -> bool {
    const OUT_M: f32 = 0.01;
    let (Some(a), Some(b)) = (corners.first(), corners.get(1)) else { return false };
    [0.02f32, 0.25, 0.5, 0.75, 0.98].into_iter().all(|share| {
        let along = |k: usize| a[k] + share * (b[k] - a[k]) + OUT_M * normal[k];
        let (x, y) = (along(0), along(1));
        world.solids_at(x, y).any(|solid| solid.role == Role::Wall && solid.outline_distance(x, y) < 0.0)
    })
}

fn paint_of(world: &World, solid: &Solid) -> Paint {
    match solid.role {
        Role::Wall => paint::WALL,
        Role::Lintel => paint::LINTEL,
        Role::SoftFloor => paint::CARPET,
        Role::Door | Role::Person => paint::DOOR_LEAF,
        Role::Furniture | Role::Clutter => {
            let name = world.objects().get(usize::from(solid.object)).map_or("", |object| &object.name);
            paint::of_thing(name, solid.half_x.min(solid.half_y) < THIN_M * 0.5)
        }
    }
}

/// The frame of a door, and its leaf with a handle on either side for when it is shut.
fn add_door(door: &DoorPlace, index: u32, lintel: f32, ceiling: f32, mesh: &mut Mesh) {
    let (sin, cos) = door.heading.sin_cos();
    let along = |by: f32, across: f32| {
        (door.middle.0 + by * cos - across * sin, door.middle.1 + by * sin + across * cos)
    };
    let top = (lintel + FRAME_M).min(ceiling);
    let half = door.width * 0.5;
    let first = mesh.faces.len();
    for side in [-1.0, 1.0] {
        // The opening's own posts are walls: what is seen of the frame stands in front of them.
        let post = Solid::new_box(
            along(side * (half + FRAME_M * 0.25), 0.0),
            (FRAME_M, FRAME_DEPTH_M),
            door.heading,
            0.0,
            top,
        );
        mesh.solid(&post, paint::DOOR_FRAME, ceiling);
    }
    let head = Solid::new_box(along(0.0, 0.0), (door.width, FRAME_DEPTH_M), door.heading, lintel - 0.01, top);
    mesh.solid(&head, paint::DOOR_FRAME, ceiling);
    mesh.body(first, None);

    let first = mesh.faces.len();
    let leaf = Solid::new_box(along(0.0, 0.0), (door.width, LEAF_M), door.heading, 0.0, lintel);
    mesh.solid(&leaf, paint::DOOR_LEAF, ceiling);
    let (height, length, thick, off) = HANDLE_M;
    for side in [-1.0, 1.0] {
        let place = along(half - 0.12, side * off);
        let handle = Solid::new_box(place, (length, thick), door.heading, height, height + thick);
        mesh.solid(&handle, paint::STEEL, ceiling);
    }
    mesh.body(first, Some(index));
}
