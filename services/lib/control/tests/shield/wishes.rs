//! What is left of a wish: where it stops, how it slides, into what it is turned.

use super::*;

/// FACTS 2: an echo on the axis is where it says. What is flown straight at is left the margin (7 cm) and the standoff
/// (12 cm); the speed that may be flown at all leaves the margin only.
#[test]
fn a_stop_ends_the_margin_and_the_standoff_before_what_is_flown_at() {
    let mut shield = eight();
    let gap = 0.685;
    ping(&mut shield, 0, &[(0, range(gap))]);
    let law = shield.braking();
    for wished in [0.8, 1.7] {
        let left = shield.guard(0, to(wished, 0.0), &somewhere(), &Surroundings::default());
        assert!(left.limited);
        assert!((law.distance(left.velocity.x) - (gap - 0.07 - 0.12)).abs() < 1e-3, "{left:?}");
        assert!((law.distance(left.allowed_m_s) - (gap - 0.07)).abs() < 1e-3, "{left:?}");
    }
}

/// FACTS 2: an echo may come from anywhere on the arc across its cone, 15 degrees to either side of the axis.
#[test]
fn an_echo_stands_everywhere_on_the_arc_of_its_cone() {
    let mut shield = eight();
    ping(&mut shield, 0, &[(0, 1.0)]);
    let free = |radians: f32| shield.free_way(0, Vector::along(radians), &somewhere());
    let end = Vector::new(MOUNT, 0.0) + Vector::along(15f32.to_radians());
    assert!((free(end.angle()) - (end.norm() - RADIUS - 0.07)).abs() < 1e-3);
    // The disc with its margin passes the end of the arc when it goes by at more than both together.
    let past = ((RADIUS + 0.07) / end.norm()).asin();
    assert!(free(end.angle() + past - 0.01) < 1.3 && free(end.angle() + past + 0.01) > 3.9);
    for degrees in 1..40 {
        let aside = (degrees as f32).to_radians();
        assert!((free(aside) - free(-aside)).abs() < 1e-4, "left and right differ at {degrees} degrees");
    }
}

/// Whoever passes a door soon leaves it: the standoff is for what is flown straight at. All of it up to 28 degrees, none
/// from 40 on, half of it where the cosine is half way. What goes past the thing is left as it was wished.
#[test]
fn the_standoff_ends_beside_and_the_rest_of_a_wish_slides() {
    let fast = ShieldConfig { beside_m_s: 1.0, beside_gain_per_s: 10.0, ..ShieldConfig::default() };
    let mut shield = eight_with(fast);
    let gap = 0.975;
    ping(&mut shield, 0, &[(0, range(gap))]);
    for (degrees, standoff) in [(0.0, 0.12), (26.0, 0.12), (34.46, 0.06), (45.0, 0.0), (52.0, 0.0)] {
        let wish = Vector::along(f32::to_radians(degrees)) * 2.2;
        let left = shield.guard(0, Wish::to(wish), &somewhere(), &Surroundings::default()).velocity;
        let stop = shield.braking().distance(left.x);
        assert!((stop - (gap - 0.07 - standoff)).abs() < 1e-3, "{degrees}: stops after {stop}");
        assert!((left.y - wish.y).abs() < 1e-3, "{degrees}: {left:?} of {wish:?}");
    }
}

/// 0.1 m/s with something at the disc's edge, and 1.5 m/s more for each metre of the gap: some 0.4 m/s in the middle of a
/// door of 0.9 m.
#[test]
fn what_is_beside_slows_and_the_nearest_counts() {
    for (near, far, most) in [(0.1, 0.5, 0.25), (0.225, 0.225, 0.4375), (0.5, 0.4, 0.7)] {
        let mut shield = eight();
        ping(&mut shield, 0, &[(2, range(near)), (6, range(far))]);
        let left = shield.guard(0, to(1.0, 0.0), &somewhere(), &Surroundings::default());
        assert!((left.velocity - Vector::new(most, 0.0)).norm() < 1e-3, "{near}, {far}: {left:?}");
    }
}

/// A wish into a hole leaves it by the nearer edge, as fast as it points there and not faster than 0.25 m/s.
#[test]
fn a_wish_into_a_hole_is_turned_to_its_nearer_edge() {
    for heading in [0.0, 0.6] {
        let mut shield = eight();
        for k in (0..8).filter(|k| *k != 2) {
            shield.hear(k, Look { at_ns: 0, heading, place: None, echo: Echo::Nothing });
        }
        let footing = Footing { heading, ..somewhere() };
        let guard = |degrees: f32, speed: f32| {
            let wish = Wish::to(Vector::along(heading + degrees.to_radians()) * speed);
            shield.guard(0, wish, &footing, &Surroundings::default())
        };
        // Beside the silent sonar at 90 degrees its neighbours' cones end at 60 and begin at 120.
        for (degrees, edge) in [(70.0, 60f32), (110.0, 120.0)] {
            let left = guard(degrees, 0.2);
            let turned = left.velocity.rotated(-heading);
            assert!((turned.angle() - edge.to_radians()).abs() < 2e-3, "{degrees}: {turned:?}");
            assert!((turned.norm() - 0.2 * 10f32.to_radians().cos()).abs() < 1e-3, "{degrees}: {turned:?}");
            assert_eq!(left.allowed_m_s, 0.0, "nobody looks where it was wished to");
            assert!((guard(degrees, 1.0).velocity.norm() - 0.25).abs() < 1e-3);
        }
    }
}

/// Three silent sonars leave a hole from 15 to 165 degrees: 50 degrees are the most that a wish is turned by. Back to where
/// it came from a moment ago it may go by 0.1 m/s all the same.
#[test]
fn from_the_middle_of_a_wide_hole_there_is_only_the_way_back() {
    let mut shield = eight();
    for k in [0, 4, 5, 6, 7] {
        shield.hear(k, Look { at_ns: 0, heading: 0.0, place: None, echo: Echo::Nothing });
    }
    let left = |degrees: f32, back: bool| {
        let wish = Wish { velocity: Vector::along(degrees.to_radians()) * 0.2, back };
        shield.guard(0, wish, &somewhere(), &Surroundings::default()).velocity
    };
    let turned = left(63.0, false);
    assert!((turned.angle().to_degrees() - 15.0).abs() < 0.1, "{turned:?}");
    assert!((turned.norm() - 0.2 * 48f32.to_radians().cos()).abs() < 1e-3, "{turned:?}");
    assert_eq!(left(67.0, false), Vector::ZERO);
    assert!((left(67.0, true) - Vector::along(67f32.to_radians()) * 0.1).norm() < 1e-3);
}

/// 0.25 m/s into a gap, until a cone has swept over it: for 1.6 s, the period of navigation's scan.
#[test]
fn a_gap_is_flown_slowly_unless_a_cone_swept_over_it() {
    let mut shield = eight();
    let between = 0.5 * FRAC_PI_4;
    let left = |shield: &mut Shield, now: u64| {
        ping(shield, now, &[]);
        let wish = Wish::to(Vector::along(between) * 0.6);
        shield.guard(now, wish, &somewhere(), &Surroundings::default()).velocity.norm()
    };
    assert!((left(&mut shield, 0) - 0.25).abs() < 1e-3);
    // Turned to the left by half of a gap, the front sonar looks into it.
    shield.hear(0, Look { at_ns: 1000 * MS, heading: between, place: None, echo: Echo::Nothing });
    assert!((left(&mut shield, 2550 * MS) - 0.6).abs() < 1e-3);
    assert!((left(&mut shield, 2650 * MS) - 0.25).abs() < 1e-3);
}

/// A velocity that is no number is as good as none: what is heard stands where it was heard.
#[test]
fn an_unknown_velocity_moves_no_echo() {
    let mut shield = eight();
    ping(&mut shield, 0, &[(0, range(0.4))]);
    let left = |velocity: Vector| {
        let footing = Footing { velocity, ..somewhere() };
        shield.guard(0, to(0.8, 0.0), &footing, &Surroundings::default())
    };
    assert_eq!(left(Vector::new(f32::NAN, 0.0)), left(Vector::ZERO));
}
