use super::*;
use crate::flow::Frame;

pub(crate) const MS: u64 = 1_000_000;

pub(crate) fn level() -> Attitudes {
    let mut attitudes = Attitudes::default();
    for i in 1..60 {
        attitudes.push(i * 33 * MS, 0.0, 0.0, 0.0);
    }
    attitudes
}

#[test]
fn a_gust_is_followed_within_a_frame_and_a_half() {
    // 0.5 m/s² from a level body: tilt alone would see nothing.
    let (attitudes, frames) = (level(), Frames::default());
    let mut velocity = Velocity::default();
    velocity.begin(100 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
    for i in 0..30u64 {
        let time_ns = (100 + 40 * i) * MS;
        let frame = Frame { time_ns, velocity: [0.5 * 0.04 * i as f32, 0.0], sigma: 0.07 };
        velocity.flow(&frame, &attitudes, &frames);
    }
    let Swept { velocity: v, sigma, .. } =
        velocity.at((100 + 40 * 29 + 60) * MS, &attitudes, &frames).unwrap();
    let truth = 0.5 * (0.04 * 29.0 + 0.06);
    assert!((v[0] - truth).abs() < 0.06 * 0.5 && v[1].abs() < 1e-6, "{v:?}, true {truth}");
    assert!((0.01..0.07).contains(&sigma), "{sigma}");
}

#[test]
fn the_place_alone_shows_a_drift_within_a_second() {
    // 0.4 m/s that neither tilt nor flow tell of.
    let (attitudes, frames) = (level(), Frames::default());
    let mut velocity = Velocity::default();
    velocity.begin(100 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
    for i in 1..=20u64 {
        let place = [0.4 * 0.06 * i as f32, 1.0];
        velocity.place((100 + 60 * i) * MS, place, [0.0; 2], [0.0; 2], &attitudes, &frames);
        if i == 1 {
            // The jump across y began it anew.
            let v = velocity.at(170 * MS, &attitudes, &frames).unwrap().velocity;
            assert!(v[0].abs() < 0.05 && v[1].abs() < 0.05, "{v:?}");
        }
    }
    let v = velocity.at((100 + 60 * 20) * MS, &attitudes, &frames).unwrap().velocity;
    assert!((v[0] - 0.4).abs() < 0.12 && v[1].abs() < 0.02, "{v:?}");
}

#[test]
fn a_poor_floor_teaches_its_share_and_then_shows_the_velocity_by_it() {
    // 0.4 m/s, well known; the floor shows four tenths of it. Then a draught that nothing else shows takes three
    // quarters of the speed away.
    let (attitudes, frames) = (level(), Frames::default());
    let mut velocity = Velocity::default();
    velocity.begin(100 * MS, [0.0; 2], [0.4, 0.0], [0.0; 2]);
    for i in 0..50u64 {
        let time_ns = (100 + 20 * i) * MS;
        velocity.flow(&Frame { time_ns, velocity: [0.4, 0.0], sigma: 0.05 }, &attitudes, &frames);
    }
    let dim = |velocity: &mut Velocity, frames_: std::ops::Range<u64>, speed: f32| {
        for i in frames_ {
            let frame = Frame { time_ns: (1100 + 20 * i) * MS, velocity: [0.4 * speed, 0.0], sigma: 0.1 };
            velocity.dim(&frame, &attitudes, &frames);
        }
    };
    dim(&mut velocity, 0..10, 0.4);
    assert!(
        velocity.filter.state[SHARE_AT] < 0.55,
        "the share is nearer to 0.4 than to {SHARE}: {}",
        velocity.filter.state[SHARE_AT]
    );
    assert!((velocity.velocity_now()[0] - 0.4).abs() < 0.08, "{:?}", velocity.velocity_now());
    let before = velocity.velocity_now()[0];
    dim(&mut velocity, 10..40, 0.1);
    let [after, across] = velocity.velocity_now();
    assert!(after < before - 0.15 && after > 0.0 && across.abs() < 1e-3, "{before} {after}");
    // A good floor again: nothing of the poor one is kept.
    let frame = Frame { time_ns: 1920 * MS, velocity: [0.1, 0.0], sigma: 0.05 };
    velocity.flow(&frame, &attitudes, &frames);
    assert_eq!(velocity.filter.state[SHARE_AT], f64::from(SHARE));
}

/// What a controller tells of a level body that air pushes about: it sits aslant by `level` (roll, pitch), has settled
/// so, and turns its vertical towards what it feels (plan frame: error of the vertical as an acceleration).
fn told(
    level: [f32; 2],
    seconds: f32,
    pushed: impl Fn(f32) -> [f32; 2],
    yaw: impl Fn(f32) -> f32,
) -> Attitudes {
    let mut attitudes = Attitudes::default();
    let aslant = [GRAVITY * level[1].tan(), -GRAVITY * level[0].tan()];
    let turned = |[x, y]: [f32; 2], angle: f32| {
        let (sin, cos) = angle.sin_cos();
        [cos * x - sin * y, sin * x + cos * y]
    };
    let mut error = turned(aslant, yaw(0.0));
    let steps = (seconds / 0.001) as u64;
    for i in 0..steps {
        let t = 0.001 * i as f32;
        let (push, out) = (pushed(t), turned(aslant, yaw(t)));
        error = [0, 1].map(|axis| error[axis] + 0.25 * 0.001 * (out[axis] - push[axis] - error[axis]));
        if i % 33 == 0 {
            let (read, felt) = (turned(error, -yaw(t)), turned(push, -yaw(t)));
            let [pitch, left] = read.map(|axis| (axis / GRAVITY).atan());
            let force = [felt[0] - aslant[0], felt[1] - aslant[1]];
            attitudes.push_felt((1000 + i) * MS, -left, pitch, yaw(t), force);
        }
    }
    attitudes
}

/// Flies on what is told from rest, the set knowing nothing of the place, and says what is believed at the end.
fn believed(level: [f32; 2], seconds: u64, attitudes: &Attitudes, frames: &Frames) -> Swept {
    let mut velocity = Velocity::default();
    velocity.stand(1000 * MS, [0.0; 2], level);
    for i in 1..=seconds * 20 {
        // The ring of attitudes holds two seconds: taken as they come.
        velocity.place((1000 + 50 * i) * MS, velocity.place_now(), [50.0; 2], [0.0; 2], attitudes, frames);
    }
    velocity.at((1000 + 1000 * seconds) * MS, attitudes, frames).unwrap()
}

#[test]
fn a_gust_that_is_felt_is_known_without_flow_and_an_error_of_level_is_none() {
    // A draught of 0.5 m/s2 for 0.8 s, which no place shows yet. The controller sits 1.5 degrees aslant.
    let frames = Frames::default();
    let draught = |t: f32| if t > 0.2 { [0.5, 0.0] } else { [0.0; 2] };
    let attitudes = told([0.0, 0.026], 1.05, draught, |_| 0.0);
    let swept = believed([0.0, 0.026], 1, &attitudes, &frames);
    assert!((swept.velocity[0] - 0.5 * 0.8).abs() < 0.03 && swept.velocity[1].abs() < 1e-3, "{swept:?}");
    // Whatever level the pilot goes by, what it takes for a tilt and what it is told of the air are the draught together.
    let read = attitudes.newest().unwrap().1.pitch;
    for level in [0.0, 0.026] {
        let air = believed([0.0, 0.026], 1, &attitudes, &Frames { level: [0.0, level], ..frames }).air;
        assert!((GRAVITY * (read - level) + air[0] - 0.5).abs() < 0.03, "{level}: {air:?}");
    }
}

#[test]
fn a_speed_that_was_reached_is_not_forgotten() {
    // Half a second of 0.8 m/s2, then 1.4 s of nothing: the controller takes a quarter of the speed for a tilt by then.
    let frames = Frames::default();
    let attitudes = told([0.0; 2], 2.05, |t| [if t < 0.5 { 0.8 } else { 0.0 }, 0.0], |_| 0.0);
    let swept = believed([0.0; 2], 2, &attitudes, &frames);
    assert!((swept.velocity[0] - 0.4).abs() < 0.025, "{swept:?}");
    assert!(swept.sigma < 0.1, "{swept:?}");
}

#[test]
fn an_accelerometer_that_sits_aslant_is_no_push_when_the_body_turns() {
    // Half a turn on the spot in 1.5 s, 1.5 degrees aslant: 0.5 m/s2 of nothing in the end.
    let frames = Frames::default();
    let turn = |t: f32| (2.1 * t).min(core::f32::consts::PI);
    let level = [-0.009, 0.026];
    let attitudes = told(level, 2.05, |_| [0.0; 2], turn);
    let swept = believed(level, 2, &attitudes, &frames);
    assert!(swept.velocity[0].hypot(swept.velocity[1]) < 0.03, "{swept:?}");
    // Who knows nothing of it is carried off by it.
    let misled = believed([0.0; 2], 2, &attitudes, &frames);
    assert!(misled.velocity[0].hypot(misled.velocity[1]) > 0.2, "{misled:?}");
}

#[test]
fn it_is_silent_when_nothing_is_measured() {
    let (attitudes, frames) = (level(), Frames::default());
    let mut velocity = Velocity::default();
    assert!(velocity.at(100 * MS, &attitudes, &frames).is_none());
    velocity.begin(100 * MS, [0.0; 2], [0.4, 0.0], [0.0; 2]);
    let v = velocity.at(110 * MS, &attitudes, &frames).unwrap().velocity;
    assert!((v[0] - 0.4).abs() < 0.02, "{v:?}");
    assert!(velocity.at(500 * MS, &attitudes, &frames).is_none());
}

#[test]
fn a_set_that_no_wall_holds_says_nothing_of_the_velocity() {
    // Along a corridor the particles go where this filter goes: their place agrees with it whatever is true.
    let (attitudes, frames) = (told([0.0; 2], 1.9, |_| [0.0; 2], |_| 0.0), Frames::default());
    let after = |spread: [f32; 2]| {
        let mut velocity = Velocity::default();
        velocity.begin(1000 * MS, [0.0; 2], [0.0; 2], [0.0; 2]);
        for i in 1..=30u64 {
            let place = velocity.place_now();
            velocity.place((1000 + 60 * i) * MS, place, spread, [0.0; 2], &attitudes, &frames);
        }
        velocity.velocity_variance().map(f32::sqrt)
    };
    let ([along, across], [blind, _]) = (after([0.3, 0.03]), after([50.0; 2]));
    assert!(along > 0.9 * blind, "{along} of {blind}: what it hears back is its own");
    assert!(across < 0.8 * along, "{across} of {along}: a wall holds it across");
}
