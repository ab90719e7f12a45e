//! Back from what is too near or comes too fast: docs/shield.md, "Retreat".

use super::*;

/// Things heard twice, so that they are no outliers, and nothing that comes nearer.
fn heard_twice(config: ShieldConfig, echoes: &[(usize, f32)]) -> Shield {
    let mut shield = eight_with(config);
    ping(&mut shield, 0, echoes);
    ping(&mut shield, 200 * MS, echoes);
    shield
}

/// Without pushes only the brake is left.
fn no_push() -> ShieldConfig {
    ShieldConfig { push_gain_per_s: 0.0, ..ShieldConfig::default() }
}

fn at_rest(shield: &Shield, footing: &Footing, plan: &Surroundings<'_>) -> Vector {
    shield.guard(200 * MS, to(0.0, 0.0), footing, plan).velocity
}

/// Nearer than 0.2 m each metre costs 2 m/s, up to 0.3 m/s.
#[test]
fn what_is_too_near_pushes_by_as_much_as_it_is_too_near() {
    for (gap, push) in [(0.21, 0.0), (0.15, 0.1), (0.1, 0.2), (0.02, 0.3)] {
        let shield = heard_twice(ShieldConfig::default(), &[(0, range(gap))]);
        let left = at_rest(&shield, &somewhere(), &Surroundings::default());
        assert!((left - Vector::new(-push, 0.0)).norm() < 1e-3, "gap {gap}: {left:?}");
    }
    // Two walls of a corner push each by itself, the two jambs of a door against each other.
    let corner = heard_twice(ShieldConfig::default(), &[(0, range(0.15)), (2, range(0.15))]);
    let left = at_rest(&corner, &somewhere(), &Surroundings::default());
    assert!((left - Vector::new(-0.1, -0.1)).norm() < 1e-3, "{left:?}");
    let jambs = heard_twice(ShieldConfig::default(), &[(2, range(0.05)), (6, range(0.1))]);
    let left = at_rest(&jambs, &somewhere(), &Surroundings::default());
    assert!((left - Vector::new(0.0, -0.1)).norm() < 1e-3, "{left:?}");
}

/// 0.4 m/s away from what touches in front and 0.28 m/s from what is 6 cm behind: the 0.12 m/s that are left would need
/// 7.4 cm to a stop. Half of the margin, 3.5 cm, is kept to what is heard.
#[test]
fn a_push_stops_before_what_is_heard_behind() {
    let shield = heard_twice(ShieldConfig::default(), &[(0, range(0.0)), (4, range(0.06))]);
    let left = at_rest(&shield, &somewhere(), &Surroundings::default());
    let stop = shield.braking().distance(-left.x);
    assert!(stop > 0.02 && stop < 0.0255, "{left:?} stops after {stop}");
}

/// Where nobody looks, 0.1 m/s: whichever way the drone is turned.
#[test]
fn a_push_to_where_no_sonar_looks_is_slow() {
    for (heading, silent, speed) in
        [(0.0, None, 0.3), (0.0, Some(4), 0.1), (0.6, Some(4), 0.1), (0.6, Some(2), 0.3)]
    {
        let mut shield = eight();
        for at_ns in [0, 200 * MS] {
            for k in (0..8).filter(|k| Some(*k) != silent) {
                let echo = if k == 0 { Echo::Range(range(0.05)) } else { Echo::Nothing };
                shield.hear(k, Look { at_ns, heading, place: None, echo });
            }
        }
        let footing = Footing { heading, ..somewhere() };
        let left = at_rest(&shield, &footing, &Surroundings::default()).rotated(-heading);
        assert!((left - Vector::new(-speed, 0.0)).norm() < 1e-3, "{heading}, {silent:?}: {left:?}");
    }
}

/// The cones look down by 15 degrees, and by 10 more when the body tilts: from 0.1 m over the floor their lower edge meets
/// it 0.24 m away. What is nearer than four fifths of that, 0.19 m, is not the floor.
#[test]
fn what_may_be_the_floor_neither_pushes_nor_brakes() {
    let low = Footing { clearance_m: 0.1, ..somewhere() };
    let fast = Footing { velocity: Vector::new(0.6, 0.0), ..low };
    for (echo, believed) in [(0.185, true), (0.197, false)] {
        let shield = heard_twice(ShieldConfig::default(), &[(0, echo)]);
        for footing in [low, fast] {
            let left = at_rest(&shield, &footing, &Surroundings::default());
            assert_eq!(left.x < -0.01, believed, "{echo} m: {left:?}");
            assert!(believed || left == Vector::ZERO, "{echo} m: {left:?}");
        }
    }
    // Nobody knows how far the floor is: what is near is believed.
    let shield = heard_twice(ShieldConfig::default(), &[(0, range(0.15))]);
    let unknown = Footing { clearance_m: f32::NAN, ..somewhere() };
    assert!(at_rest(&shield, &unknown, &Surroundings::default()).x < -0.05);
}

/// So much is taken off that what remains stops the margin, 7 cm, before the thing; 0.4 m/s at most.
#[test]
fn what_is_flown_too_fast_is_braked_beyond_zero() {
    let gap = 0.3;
    let shield = heard_twice(no_push(), &[(0, range(gap))]);
    let braked = |x: f32| {
        let footing = Footing { velocity: Vector::new(x, 0.0), ..somewhere() };
        at_rest(&shield, &footing, &Surroundings::default())
    };
    let left = braked(0.6);
    assert!((shield.braking().distance(0.6 + left.x) - (gap - 0.07)).abs() < 1e-3, "{left:?}");
    assert!(left.x < -0.2 && left.y.abs() < 1e-6, "{left:?}");
    assert!((braked(1.5) - Vector::new(-0.4, 0.0)).norm() < 1e-3);
    for slow in [0.3, 0.0, -0.6] {
        assert_eq!(braked(slow), Vector::ZERO, "{slow} m/s needs no brake");
    }
}

/// Two sonars that hear one thing do not brake twice.
#[test]
fn one_thing_brakes_once_however_many_hear_it() {
    let braked = |twins: usize| {
        let sonars =
            (0..twins).map(|k| (k, 0.0, Vector::new(MOUNT, 0.0))).chain([(4, PI, Vector::new(-MOUNT, 0.0))]);
        let mut shield = Shield::new(no_push(), RADIUS, sonars);
        for k in 0..5 {
            let echo = if k < 4 { Echo::Range(range(0.3)) } else { Echo::Nothing };
            shield.hear(k, Look { at_ns: 0, heading: 0.0, place: None, echo });
        }
        let footing = Footing { velocity: Vector::new(0.5, 0.0), ..somewhere() };
        shield.guard(0, to(0.0, 0.0), &footing, &Surroundings::default()).velocity
    };
    assert!(braked(1).x < -0.1 && (braked(1) - braked(2)).norm() < 1e-5, "{:?}, {:?}", braked(1), braked(2));
}

/// Three pings in a row tell how fast a person comes; 0.3 m/s more than the drone flies are believed (docs/shield.md), and
/// never less than it flies.
#[test]
fn who_comes_nearer_is_braked_for_as_the_echoes_say() {
    let gap = 0.13;
    let coming = |each_ping_m: f32, flown: f32, behind: &[(usize, f32)]| {
        let mut shield = eight_with(no_push());
        for k in 0..3u8 {
            let ahead = (0, range(gap) + f32::from(2 - k) * each_ping_m);
            let echoes: Vec<_> = behind.iter().copied().chain([ahead]).collect();
            ping(&mut shield, u64::from(k) * 200 * MS, &echoes);
        }
        let footing = Footing { velocity: Vector::new(flown, 0.0), ..somewhere() };
        let left = shield.guard(400 * MS, to(0.0, 0.0), &footing, &Surroundings::default()).velocity;
        (left, shield.braking().speed(gap - 0.07))
    };
    for (each_ping_m, flown, closing) in
        [(0.04, 0.0, 0.2), (0.1, 0.0, 0.3), (0.04, 0.4, 0.4), (0.1, 0.15, 0.45)]
    {
        let (left, stops) = coming(each_ping_m, flown, &[]);
        assert!((left.x + (closing - stops)).abs() < 2e-3, "{each_ping_m} m a ping, {flown} m/s: {left:?}");
    }
    // A wall 10 cm behind that comes no nearer takes nothing of the brake: only the way to it counts.
    let (left, _) = coming(0.1, 0.0, &[(4, range(0.1))]);
    assert!(left.x < -0.09, "{left:?}");
}

/// A wall along y = 0.1 m in a hall of 6 m by 4 m.
fn hall() -> DistanceField {
    let wall: Vec<bool> = (0..40 * 60).map(|cell| cell < 60).collect();
    DistanceField::from_blocked(&wall, 60, 0.1, (0.0, 0.0), 2.0)
}

/// The disc's edge so far from that wall.
fn beside_wall(gap: f32, sigma_m: f32) -> Footing {
    Footing { sigma_m, ..at(Vector::new(3.0, 0.1 + RADIUS + gap)) }
}

/// 0.11 m and the standard deviation of the place are kept to a wall of the plan (docs/shield.md); each metre less is 2 m/s.
#[test]
fn the_plan_pushes_by_as_much_as_its_wall_is_too_near() {
    let walls = hall();
    for (gap, sigma_m, push) in [(0.05, 0.03, 0.18), (0.18, 0.15, 0.16), (0.145, 0.03, 0.0), (0.3, 0.03, 0.0)]
    {
        let left = at_rest(&shield_at_rest_now(), &beside_wall(gap, sigma_m), &among(&walls));
        assert!((left - Vector::new(0.0, push)).norm() < 2e-3, "gap {gap}, sigma {sigma_m}: {left:?}");
    }
    // Carried to where its middle is in the wall: out by the most, though the field is less steep there.
    let left = at_rest(&shield_at_rest_now(), &beside_wall(-RADIUS, 0.2), &among(&walls));
    assert!((left - Vector::new(0.0, 0.3)).norm() < 2e-3, "{left:?}");
}

/// All eight heard nothing twice.
fn shield_at_rest_now() -> Shield {
    heard_twice(ShieldConfig::default(), &[])
}

/// 0.1 m are kept to a zone, however sure the place is of itself up to 0.2 m; walls push besides.
#[test]
fn zones_push_too() {
    let walls = hall();
    let zone: Vec<bool> = (0..40 * 60).map(|cell| cell % 60 >= 40).collect();
    let zones = DistanceField::from_blocked(&zone, 60, 0.1, (0.0, 0.0), 2.0);
    let corner = Vector::new(4.0 - RADIUS - 0.05, 0.1 + RADIUS + 0.05);
    for (sigma_m, by_wall) in [(0.03, 0.18), (0.06, 0.24)] {
        let footing = Footing { sigma_m, ..at(corner) };
        let plan = Surroundings { walls: Some(&walls), zones: Some(&zones) };
        let left = at_rest(&shield_at_rest_now(), &footing, &plan);
        assert!((left - Vector::new(-0.1, by_wall)).norm() < 2e-3, "sigma {sigma_m}: {left:?}");
    }
}

/// In the middle of a corridor that is 0.6 m wide both walls are too near and neither is the nearer one.
#[test]
fn the_walls_of_a_narrow_corridor_do_not_push_to_and_fro() {
    let wall: Vec<bool> = (0..8 * 60).map(|cell| !(60..7 * 60).contains(&cell)).collect();
    let walls = DistanceField::from_blocked(&wall, 60, 0.1, (0.0, 0.0), 2.0);
    for y in [0.38, 0.42] {
        let left = at_rest(&shield_at_rest_now(), &at(Vector::new(3.0, y)), &among(&walls));
        assert_eq!(left, Vector::ZERO, "at {y}");
    }
}

/// What is flown towards a wall of the plan, 30 degrees off its normal, is braked to what stops where the plan, its 3 cm and
/// the sigma end; the field is followed by steps of 3 cm. Beyond a sigma of 8 cm the plan brakes nothing.
#[test]
fn a_sure_plan_brakes_what_nobody_hears() {
    let walls = hall();
    let shield = heard_twice(no_push(), &[]);
    let towards = Vector::along(-60f32.to_radians());
    let braked = |gap: f32, sigma_m: f32, fast: f32| {
        let footing = Footing { velocity: towards * fast, ..beside_wall(gap, sigma_m) };
        at_rest(&shield, &footing, &among(&walls))
    };
    for sigma_m in [0.02, 0.07] {
        let way = (0.3 - 0.03 - sigma_m) / 30f32.to_radians().cos();
        let left = braked(0.3, sigma_m, 0.6);
        let stop = shield.braking().distance(0.6 - left.norm());
        assert!(stop > way - 0.032 && stop < way + 1e-3, "sigma {sigma_m}: {stop} of {way}");
        assert!((left + towards * left.norm()).norm() < 1e-3, "sigma {sigma_m}: {left:?}");
    }
    assert_eq!(braked(0.3, 0.1, 0.6), Vector::ZERO);
    // At the wall itself it may still creep, 0.15 m/s.
    assert_eq!(braked(0.02, 0.03, 0.14), Vector::ZERO);
    assert!((braked(0.02, 0.03, 0.3).norm() - 0.15).abs() < 1e-3);
}

/// What the echoes already brake, the plan does not brake once more.
#[test]
fn plan_and_echo_brake_one_wall_once() {
    let walls = hall();
    let footing = Footing { velocity: Vector::along(-70f32.to_radians()) * 0.45, ..beside_wall(0.3, 0.03) };
    let shield = heard_twice(no_push(), &[(6, range(0.2))]);
    let (both, echo) =
        (at_rest(&shield, &footing, &among(&walls)), at_rest(&shield, &footing, &Surroundings::default()));
    assert!(echo.y > 0.2 && (both - echo).norm() < 1e-4, "{both:?}, {echo:?}");
}
