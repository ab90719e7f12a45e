use super::*;
use crate::clutter;
use floorplan::{Door, Plan, Sidecar};

/// A building of 20 x 12 m: five rooms a side of a corridor, ten doors of 0.9 m, drawn in 10 cm cells.
fn office() -> (Plan, Sidecar) {
    let (w, h) = (202usize, 122usize);
    let mut cells = vec![vec![' '; w]; h];
    for row in &mut cells {
        (row[0], row[w - 1]) = ('#', '#');
    }
    let mut doors = Vec::new();
    for row in [0, 50, 71, h - 1] {
        cells[row].fill('#');
    }
    for room in 0..5 {
        let left = room * 40 + 1;
        for (wall, rows) in [(50, 1..50), (71, 72..h - 1)] {
            for row in &mut cells[rows] {
                row[left + 39] = '#';
            }
            cells[wall][left + 15..left + 24].fill(' ');
            let y = (h - 1 - wall) as f32 * 0.1 + 0.05;
            let (a, b) = ((left + 15) as f32 * 0.1, (left + 24) as f32 * 0.1);
            doors.push(Door { name: format!("Door {wall} {room}"), a: (a, y), b: (b, y) });
        }
    }
    let rows: Vec<String> = cells.into_iter().map(|row| row.into_iter().collect()).collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let side = Sidecar { doors, ..Sidecar::default() };
    (Plan::from_ascii(&rows, 0.1), side)
}

fn with_pad(x: f32, y: f32) -> WorldFile {
    WorldFile { pad: Some(PadEntry { x_m: x, y_m: y, heading_deg: 90.0 }), ..WorldFile::default() }
}

fn build(level: ClutterLevel, seed: u64) -> World {
    let (plan, side) = office();
    World::build(&plan, &side, &with_pad(2.0, 2.0), level, seed).expect("an office")
}

#[test]
fn clutter_has_its_density_and_keeps_off_the_pad_and_the_walls() {
    let (plan, _) = office();
    let wanted = clutter::object_count(ClutterLevel::Full, plan.free_area());
    for seed in 0..8 {
        let world = build(ClutterLevel::Full, seed);
        let objects: Vec<_> = world.objects().iter().filter(|o| o.outline.role == Role::Clutter).collect();
        // Bent walls cover a little free floor, and a place is not always found.
        assert!(objects.len() + 1 >= wanted && objects.len() <= wanted + 1, "{} of {wanted}", objects.len());
        let pad = world.pad();
        for (i, object) in objects.iter().enumerate() {
            assert!(object.outline.outline_distance(pad.x, pad.y) >= 1.2, "{}", object.name);
            for wall in world.solids().iter().filter(|s| s.role == Role::Wall) {
                let centre = wall.outline_distance(object.outline.x, object.outline.y);
                assert!(centre > 0.0, "{} stands in a wall", object.name);
            }
            for other in &objects[..i] {
                let gap = other.outline.outline_distance(object.outline.x, object.outline.y);
                assert!(gap > 0.0, "{} stands in {}", object.name, other.name);
            }
        }
    }
    assert!(build(ClutterLevel::None, 1).objects().is_empty());
    let light = build(ClutterLevel::Light, 1);
    let third = clutter::object_count(ClutterLevel::Light, plan.free_area()) as isize;
    let some = light.objects().iter().filter(|o| o.outline.role == Role::Clutter).count() as isize;
    assert!((some - third).abs() <= 1 && light.people().people().is_empty());
}

#[test]
fn a_fifth_of_the_doors_is_shut_not_always_the_same_and_the_scorer_sees_it() {
    let mut shut_before = std::collections::BTreeSet::new();
    for seed in 0..12 {
        let world = build(ClutterLevel::Full, seed);
        let shut: Vec<_> = world.doors().iter().filter(|d| d.shut).collect();
        assert_eq!(shut.len(), 2, "of ten doors");
        for door in shut {
            shut_before.insert(door.name.clone());
            let (x, y) = door.middle;
            let (column, row) = world.ground().cell_at(x, y).expect("inside");
            assert!(world.ground().blocks_sight(row * world.ground().width() + column));
            assert!(world.clearance(x, y, 1.1, 0.2, 0.2) < 0.0);
        }
        for door in world.doors().iter().filter(|d| !d.shut) {
            let (x, y) = door.middle;
            let clearance = world.still_clearance(x, y, 1.1, 0.2, 0.225);
            assert!((clearance - 0.225).abs() < 0.03, "{clearance} in {}", door.name);
        }
    }
    assert!(shut_before.len() > 5);
}

#[test]
fn people_walk_and_are_never_inside_anything() {
    for seed in 0..6 {
        let mut world = build(ClutterLevel::Full, seed);
        assert_eq!(world.people().people().len(), 3);
        let start: Vec<_> = world.people().people().iter().map(crate::people::Person::place).collect();
        let mut walked = 0.0;
        let mut before = start.clone();
        for tick in 1..=3000 {
            world.advance(f64::from(tick) * 0.02, (-50.0, -50.0));
            for (person, last) in world.people().people().iter().zip(&mut before) {
                let (x, y) = person.place();
                let body = person.solid();
                let step = (x - last.0).hypot(y - last.1);
                assert!(step <= 1.4 * 0.02 + 1e-4, "a leap of {step}");
                walked += step;
                *last = (x, y);
                // Carpets apart, nothing from the floor to the head may come within 1 cm.
                let clearance = world.still_clearance(x, y, 0.07, body.top - 0.07, body.half_x);
                assert!(clearance > 0.01, "seed {seed}: {clearance} at {x} {y}");
                assert!(x > 0.1 && y > 0.1 && x < 20.1 && y < 12.1);
            }
        }
        // Three people, a minute, at least 0.5 m/s with pauses of up to 4 s at the ends.
        assert!(walked > 45.0, "seed {seed}: walked {walked}");
    }
}

#[test]
fn equal_seeds_build_equal_worlds() {
    let text = |seed: u64| format!("{:?}", build(ClutterLevel::Full, seed));
    assert_eq!(text(4), text(4));
    assert_ne!(text(4), text(5));
}

#[test]
fn clearance_counts_walls_people_and_ceiling_but_not_the_floor() {
    let (plan, side) = office();
    let file = with_pad(2.0, 2.0);
    let world =
        World::build_as(&plan, &side, &file, ClutterLevel::None, 1, AsBuilt::exact()).expect("an office");
    let near = |got: f32, wanted: f32| assert!((got - wanted).abs() < 1e-3, "{got} is not {wanted}");
    // The west wall's face is at x = 0.1; the cylinder has 0.225 m.
    near(world.clearance(1.0, 2.5, 1.1, 0.2, 0.225), 0.675);
    near(world.clearance(0.25, 2.5, 1.1, 0.2, 0.225), -0.075);
    near(world.clearance(2.0, 2.5, 0.0, 0.2, 0.225), CLEARANCE_CAP_M);
    near(world.clearance(2.0, 2.5, 2.3, 0.2, 0.225), 0.1);
    assert_eq!(world.nearest(2.0, 2.5, 2.3, 0.2, 0.225).name, "the ceiling");
    assert_eq!(world.nearest(1.0, 2.5, 1.1, 0.2, 0.225).name, "a wall");
    // Under the lintel of a door: 2.03 m less the top at 1.9 m.
    let door = world.doors()[0].middle;
    near(world.clearance(door.0, door.1, 1.7, 0.2, 0.1), 0.13);
    near(world.wall_distance(1.05, 2.55), 1.0);
    near(world.surface_below(2.0, 2.5, 1.2), 0.0);
}

#[test]
fn tables_are_landed_on_and_flown_over() {
    let (plan, side) = office();
    let mut file = with_pad(2.0, 2.0);
    file.table.push(TableEntry {
        name: "desk".into(),
        x_m: 2.0,
        y_m: 3.5,
        yaw_deg: 0.0,
        length_m: 1.2,
        width_m: 0.8,
        top_m: 0.75,
    });
    let world =
        World::build_as(&plan, &side, &file, ClutterLevel::None, 1, AsBuilt::exact()).expect("an office");
    assert!((world.surface_below(2.0, 3.5, 1.2) - 0.75).abs() < 1e-6);
    assert!(world.surface_below(2.0, 3.5, 0.5).abs() < 1e-6, "under the top is the floor");
    assert!((world.clearance(2.0, 3.5, 1.1, 0.2, 0.225) - 0.35).abs() < 1e-4);
    assert_eq!(world.nearest(2.0, 3.5, 1.1, 0.2, 0.225).name, "desk");
    let cell = world.ground().cell_at(2.0, 3.5).map(|(c, r)| r * world.ground().width() + c).expect("inside");
    assert!(world.ground().is_free_in_flight(cell) && !world.ground().is_free_on_foot(cell));
}

#[test]
fn rays_agree_with_the_geometry_of_a_room() {
    let (plan, side) = office();
    let world = World::build_as(&plan, &side, &with_pad(2.0, 2.0), ClutterLevel::None, 1, AsBuilt::exact())
        .expect("an office");
    let from = [2.0, 2.5, 1.2];
    for step in 0..72 {
        let angle = (step as f32 * 5.0 + 1.3).to_radians();
        let (sin, cos) = angle.sin_cos();
        // The room spans 0.1..4.0 in x and 0.1..5.0 in y; its door in the north wall is at 1.6..2.5.
        let tx = if cos > 0.0 { (4.0 - from[0]) / cos } else { (0.1 - from[0]) / cos };
        let ty = if sin > 0.0 { (5.0 - from[1]) / sin } else { (0.1 - from[1]) / sin };
        let crossing = from[0] + ty * cos;
        if ty < tx && sin > 0.0 && (1.55..2.55).contains(&crossing) {
            continue;
        }
        let hit = world.cast(from, [cos, sin, 0.0], 4.0).map(|h| h.range);
        let wanted = tx.min(ty);
        if wanted < 3.99 {
            assert!((hit.unwrap_or(9.0) - wanted).abs() < 1e-3, "{hit:?} is not {wanted}");
        } else if wanted > 4.01 {
            assert!(hit.is_none());
        }
    }
    let down = world.cast(from, [0.0, 0.0, -1.0], 4.0).expect("the floor");
    assert!((down.range - 1.2).abs() < 1e-5 && down.role.is_none());
    let up = world.cast(from, [0.0, 0.0, 1.0], 4.0).expect("the ceiling");
    assert!((up.range - 1.4).abs() < 1e-5);
}

#[test]
fn bad_pads_and_doors_are_refused_in_words() {
    let (plan, side) = office();
    let refuse = |side: &Sidecar, file: &WorldFile| {
        World::build(&plan, side, file, ClutterLevel::None, 1).expect_err("refused").to_string()
    };
    assert!(refuse(&side, &WorldFile::default()).contains("no pad"));
    assert!(refuse(&side, &with_pad(0.05, 2.0)).contains("inside a wall"));
    assert!(refuse(&side, &with_pad(-5.0, 2.0)).contains("outside the plan"));
    assert!(refuse(&side, &with_pad(0.2, 2.0)).contains("from something solid"));
    let mut file = with_pad(2.0, 2.0);
    file.door.push(DoorEntry { name: "Door to nowhere".into() });
    let message = refuse(&side, &file);
    assert!(message.contains("Door to nowhere") && message.contains("Door 50 0"), "{message}");
    let solid = Plan::from_ascii(&["###", "###"], 0.1);
    let error = World::build(&solid, &Sidecar::default(), &with_pad(0.1, 0.1), ClutterLevel::None, 1);
    assert_eq!(error.err(), Some(WorldError::NoFreeSpace));
}

#[test]
fn a_start_away_from_the_pad_is_free_and_reachable() {
    let world = build(ClutterLevel::Full, 3);
    for seed in 0..20 {
        let start = world.draw_start(0.3, 0.4, &mut draw::stream(seed, 8));
        assert!(world.still_clearance(start.x, start.y, 0.0, 0.3, 0.35) >= 0.0);
    }
}

/// The worlds that are shipped, on the plans that are shipped.
fn shipped(name: &str, seed: u64) -> World {
    macro_rules! files {
        ($($known:literal),*) => {
            match name {
                $($known => (
                    &include_bytes!(concat!("../../../../../deploy/plans/", $known, ".yaml"))[..],
                    &include_bytes!(concat!("../../../../../deploy/plans/", $known, ".png"))[..],
                    &include_bytes!(concat!("../../../../../deploy/plans/", $known, ".rooms.yaml"))[..],
                    include_str!(concat!("../../../../../deploy/worlds/", $known, ".toml")),
                ),)*
                other => panic!("no such world: {other}"),
            }
        };
    }
    let (header, image, side, world) = files!("demo", "hall", "two-rooms");
    let header = floorplan::PlanHeader::parse(name, header).expect("a header");
    let plan = Plan::load(name, &header, image).expect("a plan");
    let side = Sidecar::parse(name, side).expect("a side file");
    let file = WorldFile::parse(name, world).expect("a world file");
    World::build(&plan, &side, &file, ClutterLevel::Full, seed).expect("a world")
}

#[test]
fn the_shipped_worlds_stand_up_and_leave_room_to_fly() {
    for (name, least_m2) in [("demo", 100.0), ("hall", 20.0), ("two-rooms", 10.0)] {
        let mut open = 0;
        for seed in 1..=8 {
            let world = shipped(name, seed);
            // A draw may shut every way out of the rooms about the pad: nobody leaves them then.
            let shut = |door: &str| world.doors().iter().any(|known| known.name == door && known.shut);
            if shut("Lobby") && (shut("Lobby to Office 1") || shut("Office 1")) {
                continue;
            }
            open += 1;
            let coverage = crate::score::Coverage::new(&world, 0.225);
            let cells = coverage.reachable().iter().filter(|r| **r).count() as f32;
            let area = cells * world.ground().resolution().powi(2);
            assert!(area > least_m2, "{name}, seed {seed}: {area} m2");
            let furniture: Vec<_> =
                world.objects().iter().filter(|o| o.outline.role == Role::Furniture).collect();
            for object in &furniture {
                for wall in world.solids().iter().filter(|s| s.role == Role::Wall) {
                    let depth = wall.outline_distance(object.outline.x, object.outline.y);
                    assert!(depth > 0.0, "{} stands in a wall", object.name);
                }
            }
        }
        assert!(open >= 6, "{name}: {open} of 8 draws leave the pad's room open");
    }
}
