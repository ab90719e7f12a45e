//! Putting a world together, from a plan, a world file and a seed.

use super::draw::stream;
use super::file::{ShapeWord, WorldError, WorldFile};
use super::ground::Ground;
use super::index::Index;
use super::solid::{NO_OBJECT, Role, Solid, Surface};
use super::walls::{Edge, Walls};
use super::{AsBuilt, CEILING_M, ClutterLevel, DoorPlace, FLIGHT_BAND_M, LINTEL_M, Object, PadPlace, World};
use crate::clutter::{self, Piece};
use crate::people::Crowd;
use floorplan::{Plan, Sidecar};

/// The piece of wall over a door is this thick: a common inner wall.
const LINTEL_THICKNESS_M: f32 = 0.12;
/// A shut door leaf is this thick.
const LEAF_THICKNESS_M: f32 = 0.05;
/// Thickness of a table's top and radius of its legs.
const TABLE_TOP_M: f32 = 0.04;
const TABLE_LEG_M: f32 = 0.025;
/// Ground to stand on without touching anything: the smallest airframe's radius.
const PAD_CLEARANCE_M: f32 = 0.2;
/// Vertical edges of boxes narrower than this answer as poles do, not as corners.
const EDGE_LEAST_M: f32 = 0.08;

/// Purposes of the random streams.
const BUILT: u64 = 1;
const CLUTTER: u64 = 2;
const PEOPLE: u64 = 3;

impl World {
    /// Builds the world that a flight of this seed flies in. `side` names doors and the pad (an empty one
    /// is fine when the world file has a pad).
    ///
    /// # Errors
    /// No free cell, no pad, a pad in a wall or in the furniture, a door that the plan does not have.
    pub fn build(
        plan: &Plan,
        side: &Sidecar,
        file: &WorldFile,
        clutter: ClutterLevel,
        seed: u64,
    ) -> Result<Self, WorldError> {
        let (ox, oy) = plan.origin();
        let (w, h) = (plan.width() as f32 * plan.resolution(), plan.height() as f32 * plan.resolution());
        let built = AsBuilt::drawn((ox + w * 0.5, oy + h * 0.5), (w, h), &mut stream(seed, BUILT));
        Self::build_as(plan, side, file, clutter, seed, built)
    }

    /// The same with a building of your own, for instance one that is exactly its plan.
    ///
    /// # Errors
    /// As [`World::build`].
    pub fn build_as(
        plan: &Plan,
        side: &Sidecar,
        file: &WorldFile,
        level: ClutterLevel,
        seed: u64,
        built: AsBuilt,
    ) -> Result<Self, WorldError> {
        let ceiling = file.ceiling_m.unwrap_or(CEILING_M);
        let (walls, mut solids, mut edges) = Walls::new(plan, &built, ceiling);
        let mut ground = Ground::new(plan, FLIGHT_BAND_M);
        if !plan.cells().contains(&floorplan::Cell::Free) {
            return Err(WorldError::NoFreeSpace);
        }
        for solid in &solids {
            ground.place(solid);
        }
        let pad = pad_place(side, file, &built)?;
        let mut doors = door_places(side, &built);
        let lintel = file.lintel_m.unwrap_or(LINTEL_M);
        for door in doors.iter().filter(|_| lintel < ceiling) {
            let size = (door.width + 0.02, LINTEL_THICKNESS_M);
            let over = Solid::new_box(door.middle, size, door.heading, lintel, ceiling);
            solids.push(over.with_role(Role::Lintel));
        }
        let mut objects = Vec::new();
        for piece in file_pieces(file, &built, ceiling) {
            add_piece(piece, Role::Furniture, &mut solids, &mut objects, &mut ground);
        }
        for carpet in &file.carpet {
            let size = (carpet.length_m, carpet.width_m);
            let place = built.place(carpet.x_m, carpet.y_m);
            solids.push(
                Solid::new_box(place, size, carpet.yaw_deg.to_radians(), 0.0, carpet.thickness_m)
                    .with_surface(Surface::Soft)
                    .with_role(Role::SoftFloor),
            );
        }
        check_pad(&ground, &solids, pad)?;
        for entry in &file.door {
            let Some(door) = doors.iter_mut().find(|d| d.name == entry.name) else {
                let known: Vec<_> = side.doors.iter().map(|d| d.name.as_str()).collect();
                return Err(WorldError::UnknownDoor {
                    file: file.file.clone(),
                    name: entry.name.clone(),
                    known: if known.is_empty() { "none".to_owned() } else { known.join(", ") },
                });
            };
            door.shut = true;
        }
        let mut rng = stream(seed, CLUTTER);
        let pieces = clutter::draw(&mut ground, pad, &doors, level, &mut rng);
        for piece in pieces {
            add_piece(piece, Role::Clutter, &mut solids, &mut objects, &mut ground);
        }
        clutter::shut_doors(&mut doors, level, &mut rng);
        for door in doors.iter().filter(|d| d.shut) {
            let leaf = leaf(door, lintel);
            let piece = Piece { name: door.name.clone(), parts: vec![leaf], outline: leaf };
            add_piece(piece, Role::Door, &mut solids, &mut objects, &mut ground);
        }
        add_edges(&solids, &mut edges);
        let (ox, oy) = plan.origin();
        let bounds = [
            ox,
            oy,
            ox + plan.width() as f32 * plan.resolution(),
            oy + plan.height() as f32 * plan.resolution(),
        ];
        let wide = wide(bounds);
        let solid_index = Index::of_solids(wide, &solids);
        let edge_index = Index::new(wide, edges.iter().map(|e| [e.x, e.y, e.x, e.y]));
        let flight_distance = ground.flight_distances();
        let crowd = Crowd::drawn(&ground, pad, file, &built, level, &mut stream(seed, PEOPLE));
        Ok(Self {
            name: file.name.clone(),
            pad,
            ceiling,
            lintel,
            built,
            bounds,
            walls,
            solids,
            solid_index,
            edges,
            edge_index,
            objects,
            doors,
            ground,
            flight_distance,
            crowd,
        })
    }
}

impl World {
    /// Shuts or opens a door of the plan while the world goes on; false when there is none of this name. Where people
    /// walk and how gusts feel the walls stays as it was when the world was built.
    pub(crate) fn set_door(&mut self, name: &str, shut: bool) -> bool {
        let Some(door) = self.doors.iter_mut().find(|door| door.name == name) else { return false };
        if door.shut == shut {
            return true;
        }
        door.shut = shut;
        let leaf = leaf(door, self.lintel);
        if shut {
            let object = u16::try_from(self.objects.len()).unwrap_or(NO_OBJECT);
            let leaf = Solid { object, ..leaf.with_role(Role::Door) };
            self.solids.push(leaf);
            self.objects.push(Object { name: name.to_owned(), outline: leaf });
        } else {
            // Names of objects stay: solids point at them by number.
            self.solids.retain(|solid| solid.role != Role::Door || (solid.x, solid.y) != (leaf.x, leaf.y));
        }
        self.solid_index = Index::of_solids(wide(self.bounds), &self.solids);
        true
    }
}

/// The leaf of a shut door.
fn leaf(door: &DoorPlace, lintel: f32) -> Solid {
    Solid::new_box(door.middle, (door.width + 0.02, LEAF_THICKNESS_M), door.heading, 0.0, lintel)
}

/// Bounds for an index: bending moves walls out of the plan's frame by centimetres.
fn wide(bounds: [f32; 4]) -> [f32; 4] {
    [bounds[0] - 1.0, bounds[1] - 1.0, bounds[2] + 1.0, bounds[3] + 1.0]
}

fn pad_place(side: &Sidecar, file: &WorldFile, built: &AsBuilt) -> Result<PadPlace, WorldError> {
    let (x, y, degrees) = match (&file.pad, &side.pad) {
        (Some(pad), _) => (pad.x_m, pad.y_m, pad.heading_deg),
        (None, Some(pad)) => (pad.x, pad.y, pad.heading_deg),
        (None, None) => return Err(WorldError::NoPad),
    };
    // The pad lies where it was measured from the walls around it.
    let (x, y) = built.place(x, y);
    Ok(PadPlace { x, y, heading: degrees.to_radians() })
}

fn check_pad(ground: &Ground, solids: &[Solid], pad: PadPlace) -> Result<(), WorldError> {
    let blocked = |what: &str| WorldError::PadBlocked { x: pad.x, y: pad.y, what: what.to_owned() };
    let Some((column, row)) = ground.cell_at(pad.x, pad.y) else {
        return Err(blocked("outside the plan"));
    };
    for solid in solids.iter().filter(|s| s.role != Role::SoftFloor && s.bottom < 0.5) {
        let distance = solid.outline_distance(pad.x, pad.y);
        if distance < 0.0 {
            let what = if solid.role == Role::Wall { "inside a wall" } else { "under furniture" };
            return Err(blocked(what));
        }
        if distance < PAD_CLEARANCE_M {
            return Err(blocked(&format!("only {distance:.2} m from something solid (0.20 m needed)")));
        }
    }
    if !ground.is_free_in_flight(row * ground.width() + column) {
        return Err(blocked("not on free floor"));
    }
    Ok(())
}

fn door_places(side: &Sidecar, built: &AsBuilt) -> Vec<DoorPlace> {
    side.doors
        .iter()
        .map(|door| {
            let (a, b) = (built.place(door.a.0, door.a.1), built.place(door.b.0, door.b.1));
            DoorPlace {
                name: door.name.clone(),
                middle: ((a.0 + b.0) * 0.5, (a.1 + b.1) * 0.5),
                heading: (b.1 - a.1).atan2(b.0 - a.0),
                width: (b.0 - a.0).hypot(b.1 - a.1),
                shut: false,
            }
        })
        .collect()
}

fn file_pieces(file: &WorldFile, built: &AsBuilt, ceiling: f32) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for entry in &file.solid {
        let place = built.place(entry.x_m, entry.y_m);
        let (bottom, top) = (entry.bottom_m, entry.top_m.min(ceiling.max(entry.bottom_m + 0.005)));
        let solid = match entry.shape {
            ShapeWord::Box => Solid::new_box(
                place,
                (entry.length_m.unwrap_or(0.1), entry.width_m.unwrap_or(0.1)),
                entry.yaw_deg.to_radians(),
                bottom,
                top,
            ),
            ShapeWord::Cylinder => Solid::new_cylinder(place, entry.radius_m.unwrap_or(0.1), bottom, top),
        };
        let solid = solid.with_surface(entry.surface);
        pieces.push(Piece { name: entry.name.clone(), parts: vec![solid], outline: solid });
    }
    for entry in &file.table {
        let place = built.place(entry.x_m, entry.y_m);
        let yaw = entry.yaw_deg.to_radians();
        pieces.push(table(&entry.name, place, (entry.length_m, entry.width_m), yaw, entry.top_m));
    }
    pieces
}

/// A table: a thin top on four legs.
pub(crate) fn table(name: &str, place: (f32, f32), size: (f32, f32), yaw: f32, top: f32) -> Piece {
    let under = (top - TABLE_TOP_M).max(0.05);
    let plate = Solid::new_box(place, size, yaw, under, top);
    let inset = Solid::new_box(place, (size.0 - 0.1, size.1 - 0.1), yaw, 0.0, under);
    let mut parts = vec![plate];
    parts.extend(inset.corners().map(|corner| Solid::new_cylinder(corner, TABLE_LEG_M, 0.0, under)));
    Piece { name: name.to_owned(), parts, outline: Solid::new_box(place, size, yaw, 0.0, top) }
}

fn add_piece(
    piece: Piece,
    role: Role,
    solids: &mut Vec<Solid>,
    objects: &mut Vec<Object>,
    ground: &mut Ground,
) {
    let object = u16::try_from(objects.len()).unwrap_or(NO_OBJECT);
    for part in piece.parts {
        let part = Solid { object, ..part.with_role(role) };
        ground.place(&part);
        solids.push(part);
    }
    objects.push(Object { name: piece.name, outline: Solid { object, ..piece.outline.with_role(role) } });
}

fn add_edges(solids: &[Solid], edges: &mut Vec<Edge>) {
    for solid in solids {
        let upright = matches!(solid.role, Role::Furniture | Role::Clutter)
            && solid.shape == super::Shape::Box
            && solid.half_x.min(solid.half_y) * 2.0 >= EDGE_LEAST_M
            && solid.surface != Surface::Soft;
        if upright {
            edges.extend(solid.corners().map(|(x, y)| Edge {
                x,
                y,
                bottom: solid.bottom,
                top: solid.top,
                inner: false,
            }));
        }
    }
}
