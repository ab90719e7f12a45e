//! `flight` alone: the pilot is gone for good and the aircraft comes down on flight's own height loop, in the simulator's
//! physics with everything that each flight draws.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use cli::flight::{Flight, Setup};
use ipc_types::{Phase, Verb};
use sereno_tests::checkout;

/// Flights; each draws its own mass, motors, sonar errors and gusts. Lockstep: the same each time.
const FLIGHTS: u64 = 12;
/// What counts as a contact (DESIGN 5), metres a second.
const HARD_M_S: f32 = 0.7;
/// Lower than this it is about to touch, metres: the pad's edge is 2 cm high.
const TOUCHES_M: f32 = 0.03;

/// Hovers over the pad, loses its pilot and comes down; how fast it sank when it touched, metres a second.
fn impact(seed: u64) -> f32 {
    let setup = Setup::simulated(&checkout().join("deploy"), "watchman", "none".into(), 60.0).unwrap();
    let mut flight = Flight::start(&setup, seed).unwrap();
    flight.run_for(6.0);
    flight.order(Verb::TakeOff, f32::NAN, f32::NAN);
    while flight.witness.last_pilot.is_none_or(|pilot| pilot.phase != Phase::Hover.code()) {
        flight.run_for(0.1);
        assert!(flight.bus.now() < 40_000_000_000, "seed {seed}: it did not take off");
    }
    // Level, by the trim that the pilot has learned, is all that flight can fly alone: where it drifts to is not asked here.
    flight.run_for(12.0);
    flight.bus.kill("pilot");
    let (mut sinking, mut lowest) = (None, f32::INFINITY);
    for _ in 0..1_200 {
        flight.run_for(0.01);
        let truth = flight.witness.last_truth.unwrap();
        lowest = lowest.min(truth.z_m);
        if truth.z_m < TOUCHES_M {
            sinking.get_or_insert(-truth.velocity_z_m_s);
        }
    }
    assert!(lowest < TOUCHES_M, "seed {seed}: still at {lowest} m");
    let rests = flight.witness.last_truth.unwrap();
    assert!(rests.velocity_z_m_s.abs() < 0.05, "seed {seed}: {} m/s", rests.velocity_z_m_s);
    sinking.unwrap()
}

#[test]
fn flight_alone_comes_down_softly() {
    let impacts: Vec<f32> = (1..=FLIGHTS).map(impact).collect();
    println!("{impacts:.2?}");
    assert!(impacts.iter().all(|impact| *impact < HARD_M_S), "{impacts:.2?}");
}
