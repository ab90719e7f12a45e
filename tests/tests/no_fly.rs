//! A no-fly zone in a real flight: the round leaves it out, nobody is sent there, and the drone never enters.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "tests")]

use cli::flight::{Flight, Setup};
use ipc_types::{Answer, Patrol, PatrolState, Verb};
use sereno_tests::deploy_with;

/// The right third of the hall (8.15 m wide, pad at 1.65 1.65).
const ZONE: [f32; 4] = [5.5, 0.0, 8.3, 6.3];

#[test]
fn nobody_flies_into_a_no_fly_zone() {
    let directory = tempfile::tempdir().expect("a directory");
    let deploy = deploy_with(directory.path(), "hall").expect("a copy of deploy");
    let file = deploy.join("plans/hall.rooms.yaml");
    let text = std::fs::read_to_string(&file).expect("the side file");
    std::fs::write(&file, format!("{text}no_fly:\n  - {{name: Exhibits, rectangle: {ZONE:?}}}\n"))
        .expect("written");
    let setup = Setup::simulated(&deploy, "watchman", "none".to_owned(), 400.0).expect("a set-up");
    let mut flight = Flight::start(&setup, 5).expect("it starts");
    let mut patrol = flight.bus.tool("cli").input::<Patrol>().expect("a port");

    let mut farthest = f32::NEG_INFINITY;
    let mut fly = |flight: &mut Flight, seconds: f64| {
        for _ in 0..(seconds / 0.1) as u32 {
            flight.run_for(0.1);
            farthest = farthest.max(flight.witness.last_truth.expect("a truth").x_m);
        }
    };
    fly(&mut flight, 6.0);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    fly(&mut flight, 20.0);
    assert!(flight.witness.flown(), "it flies");
    // Into the zone: refused, in words.
    flight.order(Verb::GoTo, 7.0, 3.0);
    fly(&mut flight, 6.0);
    let said = patrol.latest().expect("navigation speaks");
    assert_eq!(said.answer, u32::from(Answer::Refused.code()), "{}", said.answer_text);
    // As near as it may.
    flight.order(Verb::GoTo, 4.8, 3.0);
    fly(&mut flight, 25.0);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    for _ in 0..300 {
        fly(&mut flight, 1.0);
        if flight.witness.landed() {
            break;
        }
    }
    assert_eq!(flight.witness.round.state, Some(PatrolState::Done));
    assert_eq!(flight.witness.contacts(), 0);
    // The place errs by a few centimetres, the edge of the airframe is 0.225 m farther.
    assert!(farthest + 0.225 < ZONE[0] + 0.03 && farthest > 4.0, "the middle came to x = {farthest}");
}
