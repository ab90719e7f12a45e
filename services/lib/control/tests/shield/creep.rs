//! How fast it goes where the plan sees what no sonar hears: slowly, and how near by how sure the place is.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// A wall up to y = 1 m in a hall of 10 m by 8 m, nothing else.
fn hall() -> DistanceField {
    let wall: Vec<bool> = (0..80 * 100).map(|cell| cell < 10 * 100).collect();
    DistanceField::from_blocked(&wall, 100, 0.1, (0.0, 0.0), 4.0)
}

/// The disc's edge so far from that wall.
fn beside_wall(gap: f32, sigma_m: f32) -> Footing {
    Footing { sigma_m, ..at(Vector::new(5.0, 1.0 + RADIUS + gap)) }
}

/// What may be flown in a direction, degrees, while no sonar hears anything.
fn allowed(plan: &Surroundings<'_>, footing: &Footing, degrees: f32) -> f32 {
    let wish = Wish::to(Vector::along(degrees.to_radians()) * 2.0);
    shield_at_rest().guard(0, wish, footing, plan).allowed_m_s
}

/// Ten degrees off the wall's normal, within the cone that looks at it; the field is followed by steps of 3 cm.
const ASLANT: f32 = -80.0;

fn stops_at(speed: f32, gap: f32) -> bool {
    let way = gap / 10f32.to_radians().cos();
    let stop = shield_at_rest().braking().distance(speed);
    stop > way - 0.032 && stop < way + 1e-3
}

/// 3 cm, which the plan is wrong by, and the sigma are kept, of which no more than 8 cm count.
#[test]
fn a_wall_of_the_plan_is_stopped_before() {
    let walls = hall();
    for (sigma_m, room) in [(0.02, 0.05), (0.08, 0.11), (0.3, 0.11), (f32::NAN, 0.11)] {
        let speed = allowed(&among(&walls), &beside_wall(0.5, sigma_m), ASLANT);
        assert!(stops_at(speed, 0.5 - room), "sigma {sigma_m}: {speed}");
    }
    assert!(allowed(&among(&walls), &beside_wall(0.5, 0.02), 90.0) > 1.0, "away from it");
}

/// What a cone looks at and does not hear is crept at by 0.15 m/s: up to 8 cm while the place is sure (sigma up to 4 cm),
/// up to the wall at a sigma of 8 cm, and 8 cm into the plan's wall from 12 cm on.
#[test]
fn the_less_sure_the_place_is_the_nearer_an_unheard_wall_is_crept_at() {
    let walls = hall();
    let creeps = |gap: f32, sigma_m: f32| allowed(&among(&walls), &beside_wall(gap, sigma_m), ASLANT);
    for (gap, sigma_m, room) in [(0.11, 0.06, 0.04), (0.06, 0.08, 0.0), (0.03, 0.1, -0.04), (0.0, 0.2, -0.08)]
    {
        let speed = creeps(gap, sigma_m);
        assert!(stops_at(speed, gap - room) && speed < 0.15, "gap {gap}, sigma {sigma_m}: {speed}");
    }
    assert!((creeps(0.2, 0.08) - 0.15).abs() < 1e-4 && (creeps(0.18, 0.1) - 0.15).abs() < 1e-4);
    assert_eq!(creeps(0.05, 0.03), 0.0, "nearer than 8 cm while the place is sure");
}

/// Whoever is nearer to a wall than the plan would like, be it by the plan's error, may go along it and away from it.
#[test]
fn beside_a_wall_along_and_away_are_free_and_towards_is_not() {
    let walls = hall();
    let footing = beside_wall(0.02, 0.03);
    for degrees in [0.0, 180.0, 90.0, 45.0] {
        assert!(allowed(&among(&walls), &footing, degrees) > 2.9, "{degrees}");
    }
    assert_eq!(allowed(&among(&walls), &footing, ASLANT), 0.0);
}

/// At a shallow angle it comes nearer slowly, and there is an end to it all the same.
#[test]
fn a_wall_is_stopped_before_at_a_shallow_angle_too() {
    let walls = hall();
    let down = 8f32.to_radians();
    let speed = allowed(&among(&walls), &beside_wall(0.175, 0.03), -8.0);
    let (stop, way) = (shield_at_rest().braking().distance(speed), (0.175 - 0.06) / down.sin());
    assert!(stop > way - 0.04 && stop < way + 1e-3, "{stop} of {way}");
}

/// 0.1 m and the sigma are kept to a zone, of which 0.5 m count at most: beyond that the failsafe table sees to it.
#[test]
fn a_zone_is_stopped_before_by_all_of_the_doubt() {
    let zones = hall();
    let plan = Surroundings { walls: None, zones: Some(&zones) };
    for (sigma_m, room) in [(0.0, 0.1), (0.3, 0.4), (0.9, 0.6), (f32::NAN, 0.6)] {
        let speed = allowed(&plan, &beside_wall(1.0, sigma_m), ASLANT);
        assert!(stops_at(speed, 1.0 - room), "sigma {sigma_m}: {speed}");
    }
}

/// A corner of two walls up to x = 1 m and y = 1 m, drawn at 2 cm. Flown down along the left one, the lower one is what is met:
/// a cone looks at it, so it is crept at, though nobody looks to the left.
#[test]
fn the_wall_that_would_be_met_is_the_one_that_a_cone_must_look_at() {
    let wall: Vec<bool> = (0..150 * 150).map(|cell| cell % 150 < 50 || cell / 150 < 50).collect();
    let walls = DistanceField::from_blocked(&wall, 150, 0.02, (0.0, 0.0), 2.0);
    let footing = Footing { sigma_m: 0.08, ..at(Vector::new(1.38, 1.38)) };
    for quarters in 0..4u8 {
        let heading = f32::from(quarters) * FRAC_PI_2;
        let looks_left = (12 - 2 * usize::from(quarters)) % 8;
        let mut shield = eight();
        for k in (0..8).filter(|k| *k != looks_left) {
            shield.hear(k, Look { at_ns: 0, heading, place: None, echo: Echo::Nothing });
        }
        let wish = Wish::to(Vector::along(-78f32.to_radians()) * 0.5);
        let allowed = shield.guard(0, wish, &Footing { heading, ..footing }, &among(&walls)).allowed_m_s;
        assert!((allowed - 0.15).abs() < 1e-4, "heading {heading}: {allowed}");
    }
}
