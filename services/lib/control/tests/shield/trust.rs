//! Which sonars are doubted: where a doubted one looks, nobody looks.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// Whether the plan direction is open for a drone with this heading.
fn open(shield: &Shield, now: u64, heading: f32, direction: f32) -> bool {
    let wish = Wish::to(Vector::along(direction) * 0.3);
    let footing = Footing { heading, ..somewhere() };
    shield.guard(now, wish, &footing, &Surroundings::default()).allowed_m_s > 0.0
}

/// The front left sonar of a drone that is turned to the left by 45 degrees looks along y. Whether it is believed after these
/// pings, each from a place on the plan.
fn believed(pings: &[(f32, f32, Echo)]) -> bool {
    let mut shield = eight();
    for (x, y, echo) in pings {
        let place = Vector::new(3.0 + x, 2.0 + y).known();
        let look = |echo: Echo| Look { at_ns: 0, heading: FRAC_PI_4, place, echo };
        for k in 0..8 {
            shield.hear(k, look(if k == 1 { *echo } else { Echo::Nothing }));
        }
    }
    open(&shield, 0, FRAC_PI_4, FRAC_PI_2)
}

/// docs/shield.md: what says the same range while the drone flies towards what it hears, or away, hears nothing. 8 cm are twice
/// what the place errs by meanwhile, 3.1 mm one quantum of the range (FACTS 2).
#[test]
fn a_sonar_that_says_the_same_on_the_way_is_stuck() {
    let same = Echo::Range(1.2);
    assert!(believed(&[(0.0, 0.0, same), (0.0, 0.07, same)]), "7 cm may be the place's error");
    assert!(!believed(&[(0.0, 0.0, same), (0.0, 0.09, same)]));
    assert!(!believed(&[(0.0, 0.0, same), (0.0, -0.09, same)]), "away from it");
    assert!(believed(&[(0.0, 0.0, same), (0.3, 0.0, same)]), "along a wall it is always as far away");
    assert!(believed(&[(0.0, 0.0, same), (0.0, 0.1, Echo::Range(1.1)), (0.0, 0.2, Echo::Range(1.0))]));
    assert!(!believed(&[(0.0, 0.0, same), (0.0, 0.09, Echo::Range(1.203))]), "one quantum is no other range");
    assert!(believed(&[(0.0, 0.0, same), (0.0, 0.09, Echo::Range(1.204))]));
}

#[test]
fn a_sonar_is_stuck_until_it_says_something_else_from_a_known_place() {
    let same = Echo::Range(1.2);
    let stuck = [(0.0, 0.0, same), (0.0, 0.09, same)];
    let then = |x: f32, echo: Echo| believed(&[stuck[0], stuck[1], (x, 0.09, echo)]);
    assert!(!then(0.0, same) && then(0.0, Echo::Range(1.0)) && then(0.0, Echo::Nothing));
    assert!(!then(f32::NAN, same), "who does not know the place cannot tell");
}

/// A room whose left wall ends at x = 0.1 m.
fn room() -> DistanceField {
    let wall: Vec<bool> = (0..40 * 60).map(|cell| cell % 60 == 0).collect();
    DistanceField::from_blocked(&wall, 60, 0.1, (0.0, 0.0), 2.0)
}

/// A drone turned to the left by 45 degrees, its rear left sonar squarely 1.2 m before the wall. Whether that one is believed
/// after these pings.
fn believed_before_a_wall(shield: &mut Shield, echoes: &[Echo]) -> bool {
    let walls = room();
    let place = Vector::new(0.1 + 1.2 + MOUNT, 2.0);
    for echo in echoes {
        for k in 0..8 {
            let echo = if k == 3 { *echo } else { Echo::Nothing };
            shield.hear(k, Look { at_ns: 0, heading: FRAC_PI_4, place: Some(place), echo });
            shield.compare(k, &walls);
        }
    }
    for away in [-FRAC_PI_2, 0.0, FRAC_PI_2] {
        assert!(open(shield, 0, FRAC_PI_4, away), "no wall is expected there, or from too far away");
    }
    open(shield, 0, FRAC_PI_4, PI)
}

/// docs/shield.md: it is doubted when it does not hear a wall of the plan that it looks squarely at, five times, all told.
#[test]
fn a_sonar_that_does_not_hear_a_wall_five_times_is_deaf() {
    let mut shield = eight();
    assert!(believed_before_a_wall(&mut shield, &[Echo::Nothing; 4]));
    assert!(!believed_before_a_wall(&mut shield, &[Echo::Nothing]));
    assert!(
        believed_before_a_wall(&mut shield, &[Echo::Range(1.2)]),
        "an echo makes up for two that were lost"
    );
    assert!(believed_before_a_wall(&mut shield, &[Echo::Nothing]));
    assert!(!believed_before_a_wall(&mut shield, &[Echo::Nothing; 20]));
    assert!(!believed_before_a_wall(&mut shield, &[Echo::Range(1.2)]));
    assert!(believed_before_a_wall(&mut shield, &[Echo::Range(1.2)]), "but for no longer than after eight");
}

/// What is heard from 0.4 m behind the wall was not the wall: the sonar looks elsewhere than its mount says.
#[test]
fn a_sonar_that_hears_what_stands_behind_a_wall_looks_elsewhere() {
    assert!(believed_before_a_wall(&mut eight(), &[Echo::Range(1.55); 5]));
    assert!(!believed_before_a_wall(&mut eight(), &[Echo::Range(1.65); 5]));
}
