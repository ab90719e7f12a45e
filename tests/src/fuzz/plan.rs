//! The plan: header, picture and sidecar.

use super::{FILE, check_finite, halves, refused, text_memory, within_memory};
use floorplan::{
    Cell, DistanceField, MAX_CELLS, MAX_ROOMS, MAX_SIDE, Plan, PlanHeader, Rooms, Sidecar, widest_place,
};
use std::collections::BTreeSet;
use std::sync::LazyLock;

/// Memory that a cell may cost while a plan is loaded: two decoded pictures of it (16-bit colour and transparency, 8
/// bytes, and shades, 2 bytes) and a little, or the directions of its surface (12 bytes) with what is kept.
const CELL_MEMORY: usize = 20;
/// The decoders' own: windows, tables, and buffers for chunks that they do not keep.
const DECODER_MEMORY: usize = 1024 * 1024;
/// Every question is asked of plans up to this many cells, so that a search asks many plans.
const LITTLE_PLAN: usize = 4_000;

/// A header's yaml, [`super::BETWEEN`], a picture's bytes.
///
/// A plan that loads has the size and place that its header and picture say, within bounds, a free cell, and an answer
/// to every question.
pub fn plan(data: &[u8]) -> bool {
    let (yaml, picture) = halves(data);
    let header = match within_memory(text_memory(yaml.len()), || PlanHeader::parse(FILE, yaml)) {
        Ok(header) => header,
        Err(error) => return refused(&error),
    };
    check_finite(&header);
    assert!((0.01..=0.5).contains(&header.resolution));
    assert!(header.origin.iter().all(|value| value.abs() <= 5_000.0));
    assert!(header.free_thresh < header.occupied_thresh);
    let most = MAX_CELLS * CELL_MEMORY + DECODER_MEMORY + text_memory(data.len());
    let plan = match within_memory(most, || Plan::load(FILE, &header, picture)) {
        Ok(plan) => plan,
        Err(error) => return refused(&error),
    };
    let (width, height) = (plan.width(), plan.height());
    assert!((3..=MAX_SIDE).contains(&width) && (3..=MAX_SIDE).contains(&height));
    assert!(width * height <= MAX_CELLS && plan.cells().len() == width * height);
    assert!(plan.cells().contains(&Cell::Free) && plan.free_area() > 0.0);
    let (x, y) = plan.origin();
    assert!(x.is_finite() && y.is_finite() && plan.resolution() > 0.0);
    for (ix, iy) in
        [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1), (width / 2, height / 2)]
    {
        let (x, y) = plan.centre(ix, iy);
        assert_eq!(plan.cell_index(x, y), Some((ix, iy)), "the middle of a cell is in the cell");
    }
    if width * height <= LITTLE_PLAN {
        questions(&plan);
    }
    true
}

fn questions(plan: &Plan) {
    /// Farther than any question of the services.
    const FAR_M: f32 = 10.0;
    let field = DistanceField::new(plan, FAR_M);
    let rooms = Rooms::segment(plan);
    assert!(!rooms.is_empty() && rooms.len() <= MAX_ROOMS, "{} rooms", rooms.len());
    for index in 0..plan.cells().len() {
        let (ix, iy) = (index % plan.width(), index / plan.width());
        assert!((0.0..=FAR_M).contains(&field.at_cell(ix, iy)));
        if let Some(room) = rooms.room_of(ix, iy) {
            assert!(room < rooms.len() && plan.cell(ix, iy) == Cell::Free);
        }
    }
    let (x, y) = plan.centre(plan.width() / 2, plan.height() / 2);
    for quarter in 0..16 {
        let angle = f32::from(quarter as u8) * std::f32::consts::FRAC_PI_8;
        if let Some(hit) = plan.cast_ray(x, y, angle, FAR_M) {
            // On the face or within it, as far as this place resolves.
            assert!((0.0..=FAR_M).contains(&hit.range_m));
            assert!((0.0..=std::f32::consts::FRAC_PI_2).contains(&hit.incidence_rad));
        }
    }
    if let Some(pad) = widest_place(plan, 0.1) {
        assert_eq!(plan.check_pad(&field, pad.x, pad.y, 0.0), Ok(()));
    }
}

/// What a sidecar is laid over.
static BUILDING: LazyLock<Plan> = LazyLock::new(building);

/// Ten by eight metres with one wall and a door in it.
fn building() -> Plan {
    let mut rows = vec![format!("#{}#", " ".repeat(38)); 32];
    rows[0] = "#".repeat(40);
    rows[31] = "#".repeat(40);
    for (index, row) in rows.iter_mut().enumerate() {
        if !(14..18).contains(&index) {
            row.replace_range(20..21, "#");
        }
    }
    Plan::from_ascii(&rows.iter().map(String::as_str).collect::<Vec<_>>(), 0.25)
}

/// A sidecar's yaml.
///
/// Names can be shown and told apart, doors can be passed, and every area answers whether a place lies in it.
pub fn sidecar(data: &[u8]) -> bool {
    let sidecar = match within_memory(text_memory(data.len()), || Sidecar::parse(FILE, data)) {
        Ok(sidecar) => sidecar,
        Err(error) => return refused(&error),
    };
    check_finite(&sidecar);
    assert!(sidecar.rooms.len() <= MAX_ROOMS);
    let doors = sidecar.doors.iter().map(|door| &door.name);
    for name in sidecar.rooms.iter().map(|room| &room.name).chain(doors) {
        assert!(
            (1..=31).contains(&name.len()) && name.trim() == name,
            "a name that cannot be shown: {name:?}"
        );
        assert!(!name.chars().any(char::is_control), "{name:?}");
    }
    let names: BTreeSet<&str> = sidecar.rooms.iter().map(|room| room.name.as_str()).collect();
    assert_eq!(names.len(), sidecar.rooms.len(), "two rooms of one name");
    for door in &sidecar.doors {
        let (x, y) = door.middle();
        assert!((0.3..=10.0).contains(&door.width()));
        assert!(door.distance(x, y) < 0.01, "its middle is on its line");
    }
    for room in &sidecar.rooms {
        let (x, y) = room.area.middle();
        assert!(x.is_finite() && y.is_finite());
        assert!(!room.area.contains(f32::NAN, y) && !room.area.contains(x, 2e4));
    }
    let plan = &*BUILDING;
    match Rooms::of(FILE, &sidecar, plan) {
        Ok(rooms) => {
            assert!(!rooms.is_empty() && rooms.len() <= MAX_ROOMS);
            let known = (0..plan.cells().len())
                .filter_map(|index| rooms.room_of(index % plan.width(), index / plan.width()));
            let found: BTreeSet<usize> = known.collect();
            assert!(
                found.into_iter().eq(0..rooms.len()),
                "every room has a cell, and every cell's room a name"
            );
        }
        Err(error) => {
            refused(&error);
        }
    }
    if let Some(pad) = &sidecar.pad {
        // Refused or not, without a panic: the place may be anywhere.
        let _ = plan.check_pad(&DistanceField::new(plan, 2.0), pad.x, pad.y, 0.3);
    }
    true
}
