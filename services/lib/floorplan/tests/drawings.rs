//! Drawings become plans: scale, thin lines, outside, and what is no building.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

use floorplan::{Cell, Drawing, Pad, Plan, PlanError, PlanHeader, Reading, picture_of_plan, plan_of_drawing};

const RADIUS_M: f32 = 0.2;

/// Pixels of an art: `#` black, `+` grey, everything else white; each sign is a square of `times` pixels.
fn pixels(rows: &[&str], times: usize) -> (usize, usize, Vec<u8>) {
    let width = rows.iter().map(|row| row.len()).max().unwrap();
    let mut shades = Vec::new();
    for row in rows {
        let line: Vec<u8> = (0..width)
            .map(|x| match row.as_bytes().get(x) {
                Some(b'#') => 0,
                Some(b'+') => 150,
                _ => 255,
            })
            .flat_map(|shade| std::iter::repeat_n(shade, times))
            .collect();
        for _ in 0..times {
            shades.extend_from_slice(&line);
        }
    }
    (width * times, rows.len() * times, shades)
}

fn reading(metres_per_pixel: f64) -> Reading {
    Reading { metres_per_pixel, origin: [0.0, 0.0], dark_below: 128, walls: Vec::new(), wiped: Vec::new() }
}

fn pad(x: f32, y: f32) -> Pad {
    Pad { x, y, heading_deg: 0.0 }
}

fn make(rows: &[&str], times: usize, reading: &Reading, pad: Pad) -> Result<Plan, PlanError> {
    let (width, height, shades) = pixels(rows, times);
    plan_of_drawing(&Drawing::new(width, height, &shades).unwrap(), reading, &pad, RADIUS_M)
}

fn sentence(result: Result<Plan, PlanError>) -> String {
    result.unwrap_err().to_string()
}

/// Two rooms with a door between them, 20 x 12 signs, with room around.
const HOUSE: [&str; 14] = [
    "                            ",
    "  ####################  ",
    "  #        #         #  ",
    "  #        #         #  ",
    "  #        #         #  ",
    "  #                  #  ",
    "  #                  #  ",
    "  #                  #  ",
    "  #        #         #  ",
    "  #        #         #  ",
    "  #        #         #  ",
    "  #        #         #  ",
    "  ####################  ",
    "                        ",
];

#[test]
fn inside_is_free_walls_are_occupied_and_outside_is_unknown() {
    let plan = make(&HOUSE, 1, &reading(0.2), pad(1.6, 1.4)).unwrap();
    assert_eq!((plan.width(), plan.height()), (112, 56));
    assert!((plan.resolution() - 0.05).abs() < 1e-6);
    let at = |x: f32, y: f32| plan.cell_at(x, y);
    assert_eq!(at(1.6, 1.4), Cell::Free);
    assert_eq!(at(3.5, 1.4), Cell::Free, "the other room, through the door");
    assert_eq!(at(0.5, 1.4), Cell::Occupied);
    assert_eq!(at(0.1, 0.1), Cell::Unknown);
    // 18 x 10 signs of 0.2 m, less seven of the wall between.
    assert!((plan.free_area() - (18.0 * 10.0 - 7.0) * 0.04).abs() < 1e-3, "{}", plan.free_area());
}

#[test]
fn the_origin_is_the_lower_left_corner_of_the_picture() {
    let moved = Reading { origin: [-10.0, 5.0], ..reading(0.2) };
    let plan = make(&HOUSE, 1, &moved, pad(-8.4, 6.4)).unwrap();
    assert_eq!(plan.origin(), (-10.0, 5.0));
    assert_eq!(plan.cell_at(-8.4, 6.4), Cell::Free);
    assert_eq!(
        sentence(make(&HOUSE, 1, &moved, pad(1.6, 1.4))),
        "the pad at (1.60, 1.40) is outside the plan: it must stand in free space"
    );
}

#[test]
fn the_same_house_comes_of_a_coarse_and_of_a_fine_drawing() {
    let coarse = make(&HOUSE, 1, &reading(0.2), pad(1.6, 1.4)).unwrap();
    for times in [2, 4, 8, 10] {
        let fine = make(&HOUSE, times, &reading(0.2 / times as f64), pad(1.6, 1.4)).unwrap();
        assert_eq!(fine.cells(), coarse.cells(), "{times}");
    }
}

/// A wall of one pixel, upright, level and slanting, at a scale at which a cell is seven pixels wide.
#[test]
fn a_line_one_pixel_wide_keeps_the_outside_out() {
    let side = 700;
    let mut shades = vec![255_u8; side * side];
    let mut dot = |x: usize, y: usize| shades[y * side + x] = 0;
    for k in 0..=250 {
        for (x, y) in [(350 - k, 100 + k), (350 + k, 100 + k), (100 + k, 350 + k), (600 - k, 350 + k)] {
            dot(x, y);
        }
    }
    let drawing = Drawing::new(side, side, &shades).unwrap();
    let scale = 0.05 / 7.0;
    let plan = plan_of_drawing(&drawing, &reading(scale), &pad(2.5, 2.5), RADIUS_M).unwrap();
    // A square on its corner with a diagonal of 500 pixels.
    let area = 0.5 * (500.0 * scale).powi(2);
    assert!(
        f64::from(plan.free_area()) < area && f64::from(plan.free_area()) > 0.85 * area,
        "{}",
        plan.free_area()
    );
    assert_eq!(plan.cell_at(0.2, 0.2), Cell::Unknown);
}

#[test]
fn grey_is_a_wall_or_none_as_the_threshold_says() {
    let mut grey = HOUSE;
    grey[5] = "  #        +         #  ";
    grey[6] = "  #        +         #  ";
    grey[7] = "  #        +         #  ";
    let through = make(&grey, 1, &reading(0.2), pad(1.6, 1.4)).unwrap();
    assert_eq!(through.cell_at(3.5, 1.4), Cell::Free);
    let shut = make(&grey, 1, &Reading { dark_below: 200, ..reading(0.2) }, pad(1.6, 1.4)).unwrap();
    assert_eq!(shut.cell_at(3.5, 1.4), Cell::Unknown);
}

#[test]
fn a_gap_is_found_and_a_line_across_it_closes_the_building() {
    let mut open = HOUSE;
    open[12] = "  ######    ##########  ";
    let said = sentence(make(&open, 1, &reading(0.2), pad(1.6, 1.4)));
    let (before, after) = said.split_once("most likely at (").unwrap();
    assert_eq!(before, "plan: `walls` is open to the outside, ");
    let (place, rest) = after.split_once(')').unwrap();
    assert_eq!(rest, ", allowed is walls all around: draw one across the gap");
    let (x, y) = place.split_once(", ").unwrap();
    let (x, y): (f64, f64) = (x.parse().unwrap(), y.parse().unwrap());
    assert!((1.6..=2.4).contains(&x) && (0.0..=0.6).contains(&y), "{place}");
    let closed = Reading { walls: vec![[1.5, 0.3, 2.5, 0.3]], ..reading(0.2) };
    let plan = make(&open, 1, &closed, pad(1.6, 1.4)).unwrap();
    assert_eq!(plan.cell_at(2.0, 0.28), Cell::Occupied);
    assert_eq!(plan.cell_at(2.0, 0.1), Cell::Unknown);
}

#[test]
fn what_is_wiped_out_is_no_wall_and_lettering_outside_is_unknown() {
    let mut lettered = HOUSE;
    lettered[5] = "  #                  #  ### ";
    let plan = make(&HOUSE, 1, &reading(0.2), pad(1.6, 1.4)).unwrap();
    lettered[3] = "  #   ##   #         #  ";
    let written = make(&lettered, 1, &reading(0.2), pad(1.6, 1.4)).unwrap();
    assert_eq!(written.cell_at(1.4, 2.1), Cell::Occupied);
    assert_eq!(written.cell_at(5.0, 1.7), Cell::Unknown, "no wall of the building");
    let wiped = Reading { wiped: vec![[1.6, 2.2, 1.2, 2.0]], ..reading(0.2) };
    assert_eq!(make(&lettered, 1, &wiped, pad(1.6, 1.4)).unwrap().cells(), plan.cells());
}

#[test]
fn what_is_no_building_is_refused_in_a_sentence() {
    let said = |reading: &Reading, pad| sentence(make(&HOUSE, 1, reading, pad));
    let good = reading(0.2);
    assert_eq!(
        said(&good, pad(0.5, 1.4)),
        "the pad at (0.50, 1.40) is inside a wall: it must stand in free space"
    );
    assert_eq!(
        said(&good, pad(f32::NAN, 1.4)),
        "the pad at (NaN, 1.40) is outside the plan: it must stand in free space"
    );
    assert!(
        said(&good, pad(0.8, 1.4)).contains("is 0.20 m from a wall, needed is 0.35 m"),
        "{}",
        said(&good, pad(0.8, 1.4))
    );
    // A house for dolls: the vehicle fits nowhere.
    let tiny = said(&reading(0.03), pad(0.21, 0.21));
    assert!(tiny.contains("`free space`") && tiny.contains("is the scale right?"), "{tiny}");
    for (wrong, says) in [
        (reading(0.0), "plan: `metres_per_pixel` is 0, allowed is 0.0005 to 0.5 m"),
        (reading(f64::NAN), "plan: `metres_per_pixel` is NaN, allowed is 0.0005 to 0.5 m"),
        (
            Reading { origin: [0.0, 6000.0], ..good.clone() },
            "plan: `origin` is 6000, allowed is -5000 to 5000 m",
        ),
        (
            Reading { walls: vec![[0.0; 4]; 257], ..good.clone() },
            "plan: `walls` is 257 of them, allowed is at most 256",
        ),
        (
            Reading { wiped: vec![[0.0, 0.0, f64::INFINITY, 0.0]], ..good.clone() },
            "plan: `wiped` is inf, allowed is -10000 to 10000 m",
        ),
    ] {
        assert_eq!(said(&wrong, pad(1.6, 1.4)), says);
    }
    // 500 m x 500 m.
    let wide = vec![255_u8; 1_000 * 1_000];
    let huge =
        plan_of_drawing(&Drawing::new(1_000, 1_000, &wide).unwrap(), &reading(0.5), &pad(1.0, 1.0), RADIUS_M);
    assert_eq!(
        sentence(huge),
        "plan: the picture is 10000 x 10000 cells, allowed is 3 to 8192 a side and 16000000 in all"
    );
    assert!(Drawing::new(3, 3, &[0; 8]).is_err());
    // Lines from far away, and a wall along the whole raster.
    let far = Reading { walls: vec![[-10_000.0, 1.4, 10_000.0, 1.4]], ..good };
    assert!(make(&HOUSE, 1, &far, pad(1.6, 1.0)).is_ok());
}

#[test]
fn the_picture_of_a_plan_is_read_as_the_same_plan() {
    let plan = make(&HOUSE, 1, &Reading { origin: [1.0, -2.0], ..reading(0.2) }, pad(2.6, -0.6)).unwrap();
    let header = "image: x.png\nresolution: 0.05\norigin: [1, -2, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    let header = PlanHeader::parse("x.yaml", header.as_bytes()).unwrap();
    let again = Plan::load("x.yaml", &header, &picture_of_plan(&plan).unwrap()).unwrap();
    assert_eq!(again.cells(), plan.cells());
    assert_eq!(again.hash(), plan.hash());
}
