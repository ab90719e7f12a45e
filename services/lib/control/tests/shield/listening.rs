//! What is taken for an echo, for how long, and where it lies.

use super::*;

const FORWARD: Vector = Vector::new(1.0, 0.0);

/// One ping of the front sonar, the others hear nothing.
fn front(shield: &mut Shield, now: u64, range: Option<f32>) {
    let echoes: Vec<_> = range.into_iter().map(|range| (0, range)).collect();
    ping(shield, now, &echoes);
}

fn at_rest(shield: &Shield, now: u64) -> Vector {
    shield.guard(now, to(0.0, 0.0), &somewhere(), &Surroundings::default()).velocity
}

#[test]
fn a_ping_that_makes_no_sense_is_refused() {
    let mut shield = eight();
    let mut heard = |sensor: usize, heading: f32, echo: Echo| {
        shield.hear(sensor, Look { at_ns: 0, heading, place: None, echo })
    };
    for range in [0.0, -0.1, 20.0, 25.0, f32::NAN, f32::INFINITY] {
        assert!(!heard(0, 0.0, Echo::Range(range)), "{range} m");
    }
    assert!(!heard(0, f32::NAN, Echo::Nothing) && !heard(0, f32::NAN, Echo::Range(1.0)));
    assert!(!heard(8, 0.0, Echo::Nothing) && !heard(99, 0.0, Echo::Nothing), "there is no such sonar");
    assert!(heard(0, 0.0, Echo::Range(19.9)) && heard(0, 0.0, Echo::Range(0.01)));
    assert_eq!(shield.silent(0), (7, 8));
}

/// What answers from more than 3 cm within the airframe is its own propeller wash: no echo, and no answer either.
#[test]
fn the_airframe_hears_itself_and_nobody_listens() {
    let mount = 0.1;
    for (range, listened) in [(RADIUS - 0.035 - mount, false), (RADIUS - 0.025 - mount, true)] {
        let mut shield = Shield::new(ShieldConfig::default(), RADIUS, [(0, 0.0, Vector::new(mount, 0.0))]);
        let look = Look { at_ns: 0, heading: 0.0, place: None, echo: Echo::Range(range) };
        assert!(shield.hear(0, look), "it is in order all the same");
        assert_eq!(shield.silent(0).0 == 0, listened, "{range} m from the face");
    }
}

/// DESIGN 4: a reading older than two turns is worth nothing.
#[test]
fn a_reading_lasts_for_two_turns() {
    let mut shield = eight();
    shield.set_sweep(0.5);
    assert!((shield.braking().delay_s - 0.85).abs() < 1e-6, "a sweep and 0.35 s (FACTS 2)");
    front(&mut shield, 0, Some(0.5));
    assert_eq!((shield.silent(990 * MS), shield.silent(1010 * MS)), ((0, 8), (8, 8)));
    assert!((shield.nearest_m(990 * MS) - (MOUNT + 0.5 - RADIUS)).abs() < 1e-5);
    assert_eq!(shield.nearest_m(1010 * MS), f32::INFINITY);
    assert_eq!((shield.silent_for(1000 * MS, 1.0), shield.silent_for(1010 * MS, 1.0)), (0, 8));
    // One that has never answered has been silent for ever.
    assert_eq!((eight().silent_for(0, 1e6), eight().silent(0)), (8, (8, 8)));
}

/// An echo lies where the sonar's axis pointed when it was heard, nearer by what was flown towards it since.
#[test]
fn an_echo_lies_along_the_axis_and_comes_nearer_as_it_is_flown_at() {
    let heading = 0.6;
    let mut shield = eight();
    shield.hear(1, Look { at_ns: 0, heading, place: None, echo: Echo::Range(0.5) });
    let axis = Vector::along(FRAC_PI_4 + heading);
    let free = |now: u64, velocity: Vector| {
        shield.free_way(now, axis, &Footing { heading, velocity, ..somewhere() })
    };
    let way = MOUNT + 0.5 - RADIUS - 0.07;
    assert!((free(200 * MS, Vector::ZERO) - way).abs() < 1e-3);
    assert!((free(200 * MS, axis * 0.5) - (way - 0.1)).abs() < 1e-3);
    assert!((free(200 * MS, axis * -0.5) - (way + 0.1)).abs() < 1e-3);
}

/// One echo may be an outlier. Two make a thing that pushes when they differ by 0.1 m and what a person walks meanwhile,
/// 2 m/s, and when no more than 0.6 s lie between them.
#[test]
fn two_echoes_that_agree_make_a_thing() {
    for (before, later_ms, confirmed) in
        [(0.15, 200, true), (0.62, 200, true), (0.68, 200, false), (0.15, 550, true), (0.15, 650, false)]
    {
        let mut shield = eight();
        front(&mut shield, 0, Some(before));
        front(&mut shield, later_ms * MS, Some(0.15));
        let left = at_rest(&shield, later_ms * MS);
        assert_eq!(left.x < -0.05, confirmed, "{before} m, {later_ms} ms later 0.15 m: {left:?}");
    }
}

/// What was near and is not heard once or twice still stands and still pushes; an outlier does not push because of that.
#[test]
fn what_is_not_heard_again_pushes_as_it_did() {
    let mut shield = eight();
    front(&mut shield, 0, Some(range(0.15)));
    front(&mut shield, 200 * MS, None);
    assert!(shield.free_way(200 * MS, FORWARD, &somewhere()) < 0.1);
    assert_eq!(at_rest(&shield, 200 * MS), Vector::ZERO);
    front(&mut shield, 400 * MS, Some(range(0.15)));
    let heard = at_rest(&shield, 400 * MS);
    front(&mut shield, 600 * MS, None);
    assert!((heard.x + 0.1).abs() < 1e-3 && (at_rest(&shield, 600 * MS) - heard).norm() < 1e-5);
}

/// For 0.6 s, however few pings there were meanwhile.
#[test]
fn what_is_not_heard_again_is_gone_after_0_6_s() {
    let mut shield = eight();
    front(&mut shield, 0, Some(0.5));
    front(&mut shield, 300 * MS, None);
    assert!(shield.free_way(590 * MS, FORWARD, &somewhere()) < 1.0);
    assert!(shield.free_way(610 * MS, FORWARD, &somewhere()) > 3.9);
}

/// From 1 m on a face answers surely: what it does not is gone at once.
#[test]
fn what_was_heard_from_afar_is_gone_when_it_is_not_heard() {
    for (heard, stays) in [(0.99, true), (1.0, false), (1.5, false)] {
        let mut shield = eight();
        front(&mut shield, 0, Some(heard));
        front(&mut shield, 200 * MS, None);
        assert_eq!(shield.free_way(200 * MS, FORWARD, &somewhere()) < 2.0, stays, "{heard} m");
    }
}

/// Four seconds long, at the place where it was heard: other axes, other places of the drone do not move it.
#[test]
fn what_was_heard_is_remembered_where_it_was() {
    let (place, heading) = (Vector::new(3.0, 2.0), 0.6);
    let axis = Vector::along(FRAC_PI_4 + heading);
    let mut shield = eight();
    for at_ns in [0, 200 * MS] {
        shield.hear(1, Look { at_ns, heading, place: Some(place), echo: Echo::Range(0.5) });
    }
    ping(&mut shield, 1000 * MS, &[]);
    let free = |now: u64, from: Vector| shield.free_way(now, axis, &at(from));
    let way = MOUNT + 0.5 - RADIUS - 0.07;
    assert!((free(1000 * MS, place) - way).abs() < 1e-3);
    assert!((free(1000 * MS, place + axis * 0.2) - (way - 0.2)).abs() < 1e-3);
    assert!((free(4150 * MS, place) - way).abs() < 1e-3);
    assert!(free(4250 * MS, place) > 3.9);
}
