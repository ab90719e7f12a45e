#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! Distances, rooms and sidecar files.

use floorplan::{Area, Cell, DistanceField, Plan, Rooms, Sidecar, widest_place};
use proptest::prelude::*;

/// Two rooms joined by a door of 0.8 m, at 0.2 m a cell.
#[rustfmt::skip]
const TWO: [&str; 13] = [
    "#########################",
    "#           #           #",
    "#           #           #",
    "#           #           #",
    "#           #           #",
    "#                       #",
    "#                       #",
    "#                       #",
    "#                       #",
    "#           #           #",
    "#           #           #",
    "#           #           #",
    "#########################",
];

#[test]
fn distance_is_zero_on_a_face_and_grows_by_one_a_metre() {
    let plan = Plan::from_ascii(&TWO, 0.2);
    let field = DistanceField::new(&plan, 5.0);
    assert!(field.distance(0.2, 0.6).abs() < 1e-5, "on the left wall's face");
    assert!((field.distance(0.5, 1.3) - 0.3).abs() < 1e-5);
    assert_eq!(field.distance(0.05, 0.6), 0.0, "inside the wall");
    let (gx, gy) = field.gradient(0.6, 1.3);
    assert!((gx - 1.0).abs() < 1e-4 && gy.abs() < 1e-4);
    assert_eq!(field.distance(f32::NAN, 1.0), 0.0);
    assert!(DistanceField::new(&plan, 0.25).distance(1.3, 1.3) <= 0.25);
    let none = DistanceField::new(&Plan::from_ascii(&["  ", "  "], 0.5), 3.0);
    assert_eq!(none.distance(0.5, 0.5), 3.0, "nothing to be near to");
}

proptest! {
    #[test]
    fn distance_agrees_with_looking_at_every_cell(drawn in proptest::collection::vec(0_u8..8, 12 * 9)) {
        let rows: Vec<String> =
            drawn.chunks(12).map(|row| row.iter().map(|v| if *v == 0 { '#' } else { ' ' }).collect()).collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let plan = Plan::from_ascii(&rows, 0.1);
        let field = DistanceField::new(&plan, 100.0);
        for iy in 0..plan.height() {
            for ix in 0..plan.width() {
                let nearest = (0..plan.cells().len())
                    .filter(|k| plan.cells()[*k] == Cell::Occupied)
                    .map(|k| (ix as f32 - (k % 12) as f32).hypot(iy as f32 - (k / 12) as f32))
                    .min_by(f32::total_cmp);
                let expected = nearest.map_or(100.0, |cells| ((cells - 0.5) * 0.1).max(0.0));
                prop_assert!((field.at_cell(ix, iy) - expected).abs() < 1e-4);
            }
        }
    }
}

#[test]
fn rooms_are_found_by_their_narrow_doors_and_numbered() {
    let plan = Plan::from_ascii(&TWO, 0.2);
    let rooms = Rooms::segment(&plan);
    assert_eq!(rooms.names, ["Room 1", "Room 2"]);
    assert_eq!(rooms.room_at(0.5, 2.2), Some(0));
    assert_eq!(rooms.room_at(4.5, 0.5), Some(1));
    assert_eq!(rooms.room_at(2.5, 2.2), None, "the wall between them");
    assert!(rooms.room_at(2.5, 1.3).is_some(), "the doorway belongs to one of them");
    assert_eq!(rooms.room_at(-3.0, 1.0), None);
    let free = (0..plan.height()).flat_map(|iy| (0..plan.width()).map(move |ix| (ix, iy)));
    for (ix, iy) in free.filter(|(ix, iy)| plan.cell(*ix, *iy) == Cell::Free) {
        assert!(rooms.room_of(ix, iy).is_some(), "({ix}, {iy}) belongs to a room");
    }
    let narrow = Rooms::segment(&Plan::from_ascii(&["######", "#    #", "######"], 0.2));
    assert_eq!(narrow.names, ["Room 1"], "too narrow for a core is a room all the same");
    assert!(Rooms::segment(&Plan::from_ascii(&["##", "##"], 0.2)).is_empty());
}

const SIDECAR: &str = "pad: {x: 1.0, y: 1.2, heading_deg: 90}
doors:
  - {name: Door, a: [2.5, 0.8], b: [2.5, 1.6]}
rooms:
  - {name: Hall, rectangle: [2.5, 2.6, 0, 0]}
  - name: Triangle
    polygon: [[2.6, 0.2], [4.8, 0.2], [4.8, 2.4]]
";

#[test]
fn a_sidecar_names_the_rooms_the_doors_and_the_pad() {
    let plan = Plan::from_ascii(&TWO, 0.2);
    let sidecar = Sidecar::parse("a.rooms.yaml", SIDECAR.as_bytes()).unwrap();
    let pad = sidecar.pad.unwrap();
    assert_eq!((pad.x, pad.y), (1.0, 1.2));
    assert!((pad.heading_rad() - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
    let door = &sidecar.doors[0];
    assert!((door.width() - 0.8).abs() < 1e-5 && (door.distance(3.0, 1.2) - 0.5).abs() < 1e-5);
    assert_eq!(door.middle(), (2.5, 1.2));
    assert!(matches!(sidecar.rooms[1].area, Area::Polygon(_)));
    let rooms = Rooms::of("a.rooms.yaml", &sidecar, &plan).unwrap();
    assert_eq!(rooms.room_at(1.0, 1.0).map(|room| rooms.name(room)), Some("Hall"));
    assert_eq!(rooms.room_at(4.5, 0.5).map(|room| rooms.name(room)), Some("Triangle"));
    assert_eq!(rooms.room_at(3.0, 2.3), None, "above the triangle");
    assert_eq!(Rooms::parse("a", b"{}", &plan).unwrap().names.len(), 2, "without names they are found");
}

#[test]
fn a_wrong_sidecar_is_refused_in_one_sentence() {
    let cases = [
        ("heading_deg: 90", "heading: 90", "cannot be read"),
        ("x: 1.0", "x: .nan", "`pad.x` is NaN"),
        ("heading_deg: 90", "heading_deg: 720", "allowed is -360 to 360 degrees"),
        ("b: [2.5, 1.6]", "b: [2.5, 0.8]", "`doors: Door` is 0.00 m wide"),
        ("name: Hall", "name: Triangle", "used twice"),
        ("name: Hall", "name: \"\"", "1 to 31 bytes of text"),
        ("name: Hall", "name: \" Triangle \"", "used twice"),
        ("name: Hall", r#"name: "Hall\nall is well""#, r#"is "Hall\nall is well""#),
        ("[2.6, 0.2], [4.8, 0.2], [4.8, 2.4]", "[2.6, 0.2]", "`rooms: Triangle` is 1 corners"),
        ("[2.5, 2.6, 0, 0]", "[2.5, 2.6, 0]", "cannot be read"),
        ("[2.5, 2.6, 0, 0]", "[70, 70, 80, 80]", "without a free cell of the plan"),
    ];
    let plan = Plan::from_ascii(&TWO, 0.2);
    for (from, to, expected) in cases {
        let text = Rooms::parse("a.rooms.yaml", SIDECAR.replace(from, to).as_bytes(), &plan)
            .unwrap_err()
            .to_string();
        assert!(text.starts_with("a.rooms.yaml: ") && text.contains(expected), "{to}: {text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
}

#[test]
fn the_widest_place_lies_in_the_largest_part_that_can_be_flown_in() {
    // A yard on the left that is wider but cut off by a gap of one cell, two rooms with a door on the right.
    let rows = [
        "#############################################",
        "#             #                  #          #",
        "#             #                  #          #",
        "#             #                             #",
        "#                                           #",
        "#             #                             #",
        "#             #                  #          #",
        "#             #                  #          #",
        "#             #####################       ###",
        "#             #                             #",
        "#             #                             #",
        "#             #                             #",
        "#             #                             #",
        "#             #                             #",
        "#############################################",
    ];
    let plan = Plan::from_ascii(&rows, 0.3);
    let pad = widest_place(&plan, 0.2).unwrap();
    let field = DistanceField::of_not_free(&plan, 5.0);
    assert!(pad.x > 15.0 * 0.3, "in the part of the two rooms, not in the yard: {pad:?}");
    let widest = (15..45)
        .flat_map(|ix| (0..15).map(move |iy| (ix, iy)))
        .map(|(ix, iy)| field.at_cell(ix, iy))
        .fold(0.0, f32::max);
    assert!((field.distance(pad.x, pad.y) - widest).abs() < 1e-4, "{pad:?}: {widest}");
    // Of equal places the lowest, then the leftmost: the answer does not depend on who asks.
    for (ix, iy) in (15..45).flat_map(|ix| (0..15).map(move |iy| (ix, iy))) {
        let (x, y) = plan.centre(ix, iy);
        let equal = field.at_cell(ix, iy) >= widest - 1e-6;
        assert!(
            !equal || y > pad.y - 1e-4 && (y > pad.y + 1e-4 || x > pad.x - 1e-4),
            "({x}, {y}) before {pad:?}"
        );
    }
    assert_eq!(widest_place(&plan, 3.0), None, "a giant fits nowhere");
    // In an endless hall every place is wide enough: not its middle, out of earshot of the walls.
    let hall = vec![" ".repeat(300); 300];
    let rows: Vec<&str> = hall.iter().map(String::as_str).collect();
    let plan = Plan::from_ascii(&rows, 0.1);
    assert!(widest_place(&plan, 0.2).is_some());
}

#[test]
fn what_must_not_be_entered_is_closed_to_whoever_plans_and_to_nobody_else() {
    let plan = Plan::from_ascii(&TWO, 0.2);
    let no_fly = "no_fly:\n  - {name: Rack, rectangle: [3.0, 1.0, 4.0, 2.0]}\n";
    let sidecar = Sidecar::parse("a.rooms.yaml", format!("{SIDECAR}{no_fly}").as_bytes()).unwrap();
    let open = plan.without(&sidecar.no_fly).unwrap();
    assert_eq!((plan.cell_at(3.5, 1.5), open.cell_at(3.5, 1.5)), (Cell::Free, Cell::Unknown));
    let changed = plan.cells().iter().zip(open.cells()).filter(|(a, b)| a != b).count();
    let within = plan.within(&sidecar.no_fly).unwrap();
    assert!(changed > 0 && changed <= within.iter().filter(|cell| **cell).count());
    assert!(plan.cells().iter().zip(open.cells()).zip(within).all(|((a, b), within)| a == b || within));
    // A wall inside stays one.
    assert_eq!(
        plan.cells().iter().filter(|c| **c == Cell::Occupied).count(),
        open.cells().iter().filter(|c| **c == Cell::Occupied).count()
    );
    // Nothing to close: no copy.
    assert!(plan.without(&[]).is_none());
    let outside = "no_fly:\n  - {name: Garden, rectangle: [70, 70, 80, 80]}\n";
    let sidecar = Sidecar::parse("a.rooms.yaml", outside.as_bytes()).unwrap();
    assert!(plan.without(&sidecar.no_fly).is_none());
}

#[test]
fn what_is_wrong_with_a_no_fly_zone_is_named() {
    for (zone, expected) in [
        ("{name: Rack, rectangle: [0, 0, 2, 2]}", "`pad` is in the no-fly zone Rack"),
        ("{name: Rack, polygon: [[3, 1]]}", "`no_fly: Rack` is 1 corners"),
        ("{name: \"\", rectangle: [3, 1, 4, 2]}", "`no_fly.name`"),
        ("{name: Rack, rectangle: [3, 1, 20000, 2]}", "`no_fly: Rack` is 20000"),
        ("{name: Rack, circle: 3}", "cannot be read"),
    ] {
        let text = format!("{SIDECAR}no_fly:\n  - {zone}\n");
        let text = Sidecar::parse("a.rooms.yaml", text.as_bytes()).unwrap_err().to_string();
        assert!(text.starts_with("a.rooms.yaml: ") && text.contains(expected), "{zone}: {text}");
    }
}

const ROUND: &str = "round:
  order: [Two]
  leave_out: [One]
  points:
    - {name: Safe, x: 1.5, y: 2.5}
privacy:
  - {name: Washroom, rectangle: [3.0, 1.0, 4.0, 2.0]}
";

fn with_round(round: &str) -> Result<Sidecar, floorplan::PlanError> {
    let rooms = "rooms:\n  - {name: One, rectangle: [0, 0, 2, 4]}\n  - {name: Two, polygon: [[2, 0], [6, 0], [6, 4]]}\n";
    let rack = "no_fly:\n  - {name: Rack, rectangle: [3.0, 1.0, 4.0, 2.0]}\n";
    let pad = "pad: {x: 1.0, y: 1.0}\ndoors:\n  - {name: Door, a: [2, 1], b: [2, 2]}\n";
    Sidecar::parse("a.rooms.yaml", format!("{rooms}{rack}{pad}{round}").as_bytes())
}

#[test]
fn a_sidecar_is_written_as_it_is_read() {
    let sidecar = with_round(ROUND).unwrap();
    assert_eq!(sidecar.round.points[0].name, "Safe");
    let yaml = sidecar.yaml("a.rooms.yaml").unwrap();
    assert_eq!(Sidecar::parse("a.rooms.yaml", yaml.as_bytes()).unwrap(), sidecar, "{yaml}");
    let empty = Sidecar::default();
    let yaml = empty.yaml("a.rooms.yaml").unwrap();
    assert_eq!(Sidecar::parse("a.rooms.yaml", yaml.as_bytes()).unwrap(), empty, "{yaml}");
}

#[test]
fn what_is_wrong_with_a_round_is_named() {
    for (round, said) in [
        ("round: {order: [Three]}", "`round.order` is \"Three\", allowed is names that stand in rooms"),
        ("round: {leave_out: [One, One]}", "`round.leave_out` is \"One\" twice"),
        ("round: {order: [One], leave_out: [One]}", "`round.order` is \"One\" is left out, too"),
        (
            "round: {points: [{name: Safe, x: 3.5, y: 1.5}]}",
            "`round.points: Safe` is in the no-fly zone Rack",
        ),
        ("round: {points: [{name: Safe, x: .nan, y: 1.5}]}", "`round.points: Safe` is NaN"),
        (
            "round: {points: [{name: A, x: 1, y: 1}, {name: A, x: 1, y: 2}]}",
            "`round.points: A` is used twice",
        ),
        ("round: {points: [{name: \"\", x: 1, y: 1}]}", "`round.points.name`"),
        ("round: {colour: red}", "colour"),
        ("privacy:\n  - {name: W, polygon: [[3, 1]]}", "`privacy: W` is 1 corners"),
    ] {
        let error = with_round(round).unwrap_err().to_string();
        assert!(error.contains(said), "{round}: {error}");
    }
    let many: Vec<String> = (0..33).map(|k| format!("{{name: P{k}, x: 1, y: 1}}")).collect();
    let error = with_round(&format!("round: {{points: [{}]}}", many.join(", "))).unwrap_err().to_string();
    assert!(error.contains("33 points, allowed is at most 32"), "{error}");
}
