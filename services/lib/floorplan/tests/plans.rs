#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! The plans that are delivered with the system.

use std::path::Path;

use floorplan::{Cell, DistanceField, Plan, PlanHeader, Rooms, Sidecar};

fn load(name: &str) -> (Plan, Sidecar, Rooms) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../deploy/plans");
    let header =
        PlanHeader::parse(name, &std::fs::read(folder.join(format!("{name}.yaml"))).unwrap()).unwrap();
    let plan = Plan::load(name, &header, &std::fs::read(folder.join(&header.image)).unwrap()).unwrap();
    let sidecar =
        Sidecar::parse(name, &std::fs::read(folder.join(format!("{name}.rooms.yaml"))).unwrap()).unwrap();
    let rooms = Rooms::of(name, &sidecar, &plan).unwrap();
    (plan, sidecar, rooms)
}

#[test]
fn the_demo_building_is_what_it_is_said_to_be() {
    let (plan, sidecar, rooms) = load("demo");
    assert!(plan.free_area() >= 300.0, "{} m2", plan.free_area());
    assert_eq!(rooms.len(), 9, "eight rooms and a corridor");
    let wide = sidecar.doors.iter().filter(|door| (door.width() - 1.2).abs() < 1e-3).count();
    assert_eq!(wide, 2);
    assert!(
        sidecar
            .doors
            .iter()
            .all(|door| (door.width() - 1.2).abs() < 1e-3 || (door.width() - 0.9).abs() < 1e-3)
    );
    let corridor = (0..plan.width()).filter(|ix| {
        let (x, _) = plan.centre(*ix, 0);
        rooms.room_at(x, 7.0).map(|room| rooms.name(room)) == Some("Corridor")
    });
    assert!(corridor.count() as f32 * plan.resolution() >= 18.0);
}

#[test]
fn doors_are_open_as_wide_as_they_say_and_pads_stand_free() {
    for name in ["demo", "hall", "two-rooms"] {
        let (plan, sidecar, rooms) = load(name);
        let field = DistanceField::new(&plan, 4.0);
        let pad = sidecar.pad.unwrap();
        plan.check_pad(&field, pad.x, pad.y, 1.0).unwrap();
        assert!(rooms.room_at(pad.x, pad.y).is_some());
        for door in &sidecar.doors {
            let (x, y) = door.middle();
            assert_eq!(plan.cell_at(x, y), Cell::Free, "{name}: {}", door.name);
            let half = field.distance(x, y);
            assert!((2.0 * half - door.width()).abs() <= 0.051, "{name}: {} {half}", door.name);
        }
        let unnamed = (0..plan.cells().len()).filter(|k| {
            plan.cells()[*k] == Cell::Free && rooms.room_of(k % plan.width(), k / plan.width()).is_none()
        });
        assert_eq!(unnamed.count(), 0, "{name}: every free cell belongs to a room");
    }
}

#[test]
fn without_names_the_demo_building_has_the_same_number_of_rooms() {
    let (plan, _, rooms) = load("demo");
    assert_eq!(Rooms::segment(&plan).len(), rooms.len());
}
