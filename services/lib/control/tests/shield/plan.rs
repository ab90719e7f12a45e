//! What the plan says of walls that no sonar hears.

use super::*;
use std::f32::consts::FRAC_PI_2;

/// The lower wall of the room, 0.37 m from the disc's middle, and a way aslant towards it.
#[test]
fn the_plan_is_believed_where_no_cone_looks_at_its_wall() {
    let plan = door();
    let walls = DistanceField::new(&plan, 2.0);
    let below = Vector::new(plan.origin().0 + 1.5, plan.origin().1 + 0.1 + 0.37);
    let flown = |quarters: usize, silent: Option<usize>| {
        let heading = quarters as f32 * FRAC_PI_2;
        let mut shield = eight();
        for k in (0..8).filter(|k| silent != Some((k + 2 * quarters) % 8)) {
            shield.hear(k, Look { at_ns: 0, heading, place: None, echo: Echo::Nothing });
        }
        // Rear right, within the cone of the sonar at 225 degrees.
        let wish = Wish::to(Vector::along(235f32.to_radians()) * 0.4);
        let footing = Footing { sigma_m: 0.08, heading, ..at(below) };
        shield.guard(0, wish, &footing, &among(&walls)).velocity
    };
    for quarters in 0..4 {
        let (heard, silent) = (flown(quarters, None), flown(quarters, Some(6)));
        assert!(
            heard.y < -0.02,
            "it creeps towards a wall that a cone looks at and does not hear: {heard:?}"
        );
        assert!(silent.y > 0.0, "nobody looks at that wall, and it is kept off: {silent:?}");
    }
}

/// What the plan shows is moved away from farther off, the less sure the place is, until it says nothing.
#[test]
fn a_wall_of_the_plan_is_kept_off_by_the_doubt_about_the_place() {
    let plan = door();
    let walls = DistanceField::new(&plan, 2.0);
    let pushed = |gap: f32, sigma_m: f32| {
        let place = Vector::new(plan.origin().0 + 1.5, plan.origin().1 + 0.1 + RADIUS + gap);
        let footing = Footing { sigma_m, ..at(place) };
        shield_at_rest().guard(0, to(0.0, 0.0), &footing, &among(&walls)).velocity.y
    };
    assert!(pushed(0.05, 0.03) > 0.05 && pushed(0.25, 0.03).abs() < 1e-3);
    assert!(pushed(0.18, 0.03).abs() < 1e-3 && pushed(0.18, 0.15) > 0.05);
    assert!(pushed(0.05, 0.3).abs() < 1e-3, "who does not know where it is knows of no wall");
}
