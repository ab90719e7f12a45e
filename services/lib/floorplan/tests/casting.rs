#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]
//! Rays and cones against drawn plans and against brute force.

use std::f32::consts::{FRAC_PI_2, PI};

use floorplan::{Cell, ConeModel, Plan, cast_cone};
use proptest::prelude::*;

#[rustfmt::skip]
const ROOM: [&str; 10] = [
    "####################",
    "#                  #",
    "#                  #",
    "#        ##        #",
    "#        ##        #",
    "#                  #",
    "#                  #",
    "#             #    #",
    "#                  #",
    "####################",
];

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-4
}

#[test]
fn a_ray_stops_at_the_face_of_the_first_occupied_cell() {
    let plan = Plan::from_ascii(&ROOM, 0.1);
    let range = |x, y, degrees: f32| plan.cast_ray(x, y, degrees.to_radians(), 4.0).map(|hit| hit.range_m);
    assert!(close(range(0.55, 0.15, 0.0).unwrap(), 1.35), "the right wall");
    assert!(close(range(0.55, 0.25, 180.0).unwrap(), 0.45), "the left wall");
    assert!(close(range(0.95, 0.15, 90.0).unwrap(), 0.35), "up to the block that spans y 0.5 to 0.7");
    assert!(close(range(0.95, 0.85, -90.0).unwrap(), 0.15), "down to the block");
    assert!(
        close(range(0.25, 0.15, 45.0).unwrap(), 0.75 * 2.0_f32.sqrt()),
        "past the corner, up to the ceiling"
    );
    assert_eq!(plan.cast_ray(0.55, 0.15, 0.0, 1.3), None, "out of reach");
    assert_eq!(plan.cast_ray(0.95, 0.55, 1.0, 1.0).unwrap().range_m, 0.0, "inside the block");
    assert_eq!(plan.cast_ray(f32::NAN, 0.55, 1.0, 1.0), None);
    assert_eq!(plan.cast_ray(0.5, 0.5, f32::INFINITY, 1.0), None);
    assert!(close(plan.cast_ray(-1.0, 0.25, 0.0, 4.0).unwrap().range_m, 1.0), "from outside");
    assert_eq!(plan.cast_ray(-1.0, 0.25, PI, 4.0), None, "away from the plan");
    assert_eq!(plan.cast_ray(1e9, 0.25, PI, 1e12), None, "so far that no index would hold it, or a hit");
}

#[test]
fn unknown_cells_are_transparent() {
    let plan = Plan::from_ascii(&["   ??   #"], 0.5);
    assert!(close(plan.cast_ray(0.25, 0.25, 0.0, 9.0).unwrap().range_m, 3.75));
}

#[test]
fn incidence_is_measured_from_the_wall_not_from_its_cells() {
    let plan = Plan::from_ascii(&ROOM, 0.1);
    for degrees in [0.0_f32, 10.0, 25.0, -30.0] {
        let hit = plan.cast_ray(0.35, 0.45, PI + degrees.to_radians(), 4.0).unwrap();
        assert!((hit.incidence_rad - degrees.abs().to_radians()).abs() < 0.02, "{degrees}: {hit:?}");
    }
    let leg = plan.cast_ray(1.45, 0.65, -FRAC_PI_2 + 0.1, 4.0).unwrap();
    assert_eq!(leg.incidence_rad, 0.0, "a leg scatters to all sides");
}

/// A wall that climbs 1 in 3, drawn as a scanner would draw it.
fn slanted(thickness: i32) -> Plan {
    let rows: Vec<String> = (0..80)
        .rev()
        .map(|y| {
            (0..80)
                .map(|x| if (x / 3 + 20 - y).clamp(0, thickness - 1) == x / 3 + 20 - y { '#' } else { ' ' })
                .collect()
        })
        .collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    Plan::from_ascii(&rows, 0.05)
}

#[test]
fn a_slanted_wall_has_a_slanted_normal() {
    let wall = (1.0_f32 / 3.0).atan();
    for thickness in [1, 2, 3, 5] {
        let plan = slanted(thickness);
        let towards = wall + FRAC_PI_2 + PI;
        for k in 0..20 {
            let x = 1.2 + 0.05 * k as f32;
            let hit = plan.cast_ray(x, 3.0, towards, 4.0).unwrap();
            assert!(hit.incidence_rad < 5_f32.to_radians(), "thickness {thickness}, x {x}: {hit:?}");
            let hit = plan.cast_ray(x, 3.0, -FRAC_PI_2, 4.0).unwrap();
            assert!(
                (hit.incidence_rad - wall).abs() < 5_f32.to_radians(),
                "thickness {thickness}, x {x}: {hit:?}"
            );
        }
    }
}

#[test]
fn a_cone_hears_the_nearest_surface_that_faces_it() {
    let rows: Vec<String> = (0..120)
        .map(|y| if !(2..=117).contains(&y) { "#".repeat(120) } else { format!("##{}##", " ".repeat(116)) })
        .collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let plan = Plan::from_ascii(&rows, 0.05);
    // Short of the corners, which scatter.
    let model = ConeModel { max_range_m: 3.0, ..ConeModel::default() };
    // The left wall's face is at x = 0.1; from 2.1 it is 2 m away.
    let heard = |degrees: f32| cast_cone(&plan, &model, 2.1, 3.0, PI + degrees.to_radians());
    for degrees in [0.0, 5.0, 10.0, 15.0] {
        assert!((heard(degrees).unwrap() - 2.0).abs() < 0.02, "the perpendicular, not the axis: {degrees}");
    }
    assert!((heard(20.0).unwrap() - 2.0).abs() < 0.04, "at the edge of the cone");
    assert!(heard(25.0).is_some());
    for degrees in [29.0, 35.0, 45.0] {
        assert_eq!(heard(degrees), None, "reflected away: {degrees}");
        assert_eq!(heard(-degrees), None, "reflected away: -{degrees}");
    }
    let axis = ConeModel { sub_rays: 1, ..model };
    assert!((cast_cone(&plan, &axis, 2.1, 3.0, PI + 0.15).unwrap() - 2.0 / 0.15_f32.cos()).abs() < 0.01);
    assert_eq!(cast_cone(&plan, &model, 3.0, 3.0, 0.0).map(|r| r < 2.91), Some(true));
    assert_eq!(cast_cone(&plan, &ConeModel { max_range_m: 2.0, ..model }, 3.0, 3.0, 0.0), None);
}

proptest! {
    /// Stepping along the ray a hundredth of a cell at a time finds the same first cell.
    #[test]
    fn the_walk_agrees_with_dense_sampling(x in 0.11_f32..1.89, y in 0.11_f32..0.89, angle in -PI..PI) {
        let plan = Plan::from_ascii(&ROOM, 0.1);
        let hit = plan.cast_ray(x, y, angle, 4.0);
        let step = 0.001;
        let sampled = (0..4000).map(|k| k as f32 * step).find(|r| {
            plan.cell_at(x + r * angle.cos(), y + r * angle.sin()) == Cell::Occupied
        });
        let hit = hit.unwrap().range_m;
        let sampled = sampled.unwrap();
        // Sampling may jump over a corner that the ray only clips: then the walk is nearer, and a corner
        // must be there.
        if (hit - sampled).abs() > 2.0 * step {
            prop_assert!(hit < sampled);
            let just_behind = hit + 1e-4;
            let (px, py) = (x + just_behind * angle.cos(), y + just_behind * angle.sin());
            let near_corner = (-1..=1).any(|dx| (-1..=1).any(|dy| {
                plan.cell_at(px + dx as f32 * 0.002, py + dy as f32 * 0.002) == Cell::Occupied
            }));
            prop_assert!(near_corner, "hit {hit} sampled {sampled}");
        }
    }

    /// Starts on cell borders and rays along an axis but for one rounding: what a walk may get stuck on.
    #[test]
    fn a_walk_always_ends(ix in 1_u8..19, iy in 1_u8..9, quarter in 0_u8..5, tiny in -3_i32..4) {
        let plan = Plan::from_ascii(&ROOM, 0.1);
        let angle = f32::from(quarter) * FRAC_PI_2;
        let angle = f32::from_bits(angle.to_bits().saturating_add_signed(tiny)).clamp(0.0, 7.0);
        let hit = plan.cast_ray(f32::from(ix) * 0.1, f32::from(iy) * 0.1, angle, 4.0);
        prop_assert!(hit.is_some());
    }

    #[test]
    fn no_input_panics(x in any::<f32>(), y in any::<f32>(), angle in any::<f32>(), range in any::<f32>()) {
        let plan = Plan::from_ascii(&ROOM, 0.1);
        let range = range.min(1e4);
        plan.cast_ray(x, y, angle, range);
        cast_cone(&plan, &ConeModel { max_range_m: range, ..ConeModel::default() }, x, y, angle);
        plan.cell_at(x, y);
    }
}
