//! The step journal is enough to run a service again: started as its journal says and given, step by step, the
//! messages that it names, a service says the same, byte for byte, its own journal included.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "tests")]

mod mixer;
mod recording;

use cli::flight::{Flight, Setup};
use ipc_types::{
    Attitude, Channels, Command, Echo, FlightState, FlowMotion, Grid, Particles, Patrol, PatrolState,
    PilotState, Ping, Polar, Pose, Power, Run, Setpoint, SonarRanges, Trace, Verb,
};
use recording::Recording;
use runtime::{Service, name_hash};
use sereno_tests::checkout;

/// Often enough that of no topic as many messages come as an input keeps: of particle sets, at 20 Hz, two.
const LOOK_S: f64 = 0.02;

fn record(flight: &mut Flight) -> Recording {
    let mut ports = flight.bus.tool("cli");
    let mut recording = Recording::default();
    for service in ["sonar", "localization", "navigation", "pilot"] {
        recording.add_trace(&mut ports, service);
    }
    recording.add::<Ping>(&mut ports);
    recording.add::<Echo>(&mut ports);
    recording.add::<SonarRanges>(&mut ports);
    recording.add::<FlowMotion>(&mut ports);
    recording.add::<Attitude>(&mut ports);
    recording.add::<FlightState>(&mut ports);
    recording.add::<Power>(&mut ports);
    recording.add::<Pose>(&mut ports);
    recording.add_clearing::<Particles>(&mut ports, |set| {
        let count = set.count as usize;
        for column in [
            &mut set.x_m,
            &mut set.y_m,
            &mut set.velocity_x_m_s,
            &mut set.velocity_y_m_s,
            &mut set.heading_offset_rad,
            &mut set.level_roll_rad,
            &mut set.level_pitch_rad,
            &mut set.weight,
        ] {
            column[count..].fill(0.0);
        }
    });
    recording.add::<Grid>(&mut ports);
    recording.add::<Polar>(&mut ports);
    recording.add::<Setpoint>(&mut ports);
    recording.add::<Patrol>(&mut ports);
    recording.add::<Channels>(&mut ports);
    recording.add::<PilotState>(&mut ports);
    recording.add::<Command>(&mut ports);
    recording
}

fn run_for(flight: &mut Flight, recording: &mut Recording, seconds: f64) {
    let until = flight.bus.now() + ipc_types::nanoseconds(seconds);
    while flight.bus.now() < until {
        flight.run_for(LOOK_S);
        recording.hear();
    }
}

/// Runs a service of the flight again and answers its journal; expects so many messages at least on each topic.
fn same_again<S: Service>(
    (setup, flight): (&Setup, &Flight),
    recording: &Recording,
    incarnation: u32,
    least: &[(&str, usize)],
) -> Vec<Trace> {
    let journal = recording.journal(S::NAME, incarnation);
    let config = flight.bus.config::<S>().unwrap();
    let equal =
        recording.same_again::<S>(&setup.manifest, &setup.root, setup.cache.clone(), config, &journal);
    let equal = equal.unwrap_or_else(|difference| panic!("{}, start {incarnation}: {difference}", S::NAME));
    println!("{}, start {incarnation}: {} steps, {equal:?}", S::NAME, journal.len() - 1);
    assert_eq!(equal[&format!("trace/{}", S::NAME)], journal.len());
    for (topic, least) in least {
        assert!(equal[*topic] >= *least, "{}: only {} of {topic}", S::NAME, equal[*topic]);
    }
    journal
}

/// A round is begun, and a few seconds into it the pilot and then the localization are killed and started again.
/// Everybody whose inputs are messages, not bytes from a device, is run again from the journals, each start for itself.
#[test]
fn services_of_a_flight_do_the_same_again() {
    let deploy = checkout().join("deploy");
    let setup = Setup::simulated(&deploy, "watchman", "full".to_owned(), 120.0).unwrap();
    let mut flight = Flight::start(&setup, 1).unwrap();
    let mut recording = record(&mut flight);
    run_for(&mut flight, &mut recording, 6.0);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    let patience = flight.bus.now() + 40_000_000_000;
    while flight.witness.round.state != Some(PatrolState::Flying) {
        run_for(&mut flight, &mut recording, 0.1);
        assert!(flight.bus.now() < patience, "in vain: {}", flight.witness.phase());
    }
    run_for(&mut flight, &mut recording, 4.0);
    flight.bus.kill("pilot");
    run_for(&mut flight, &mut recording, 0.06);
    flight.bus.add::<pilot::Pilot>().unwrap();
    run_for(&mut flight, &mut recording, 2.0);
    flight.bus.kill("localization");
    run_for(&mut flight, &mut recording, 0.06);
    flight.bus.add::<localization::Localization>().unwrap();
    run_for(&mut flight, &mut recording, 2.0);
    assert_eq!(flight.witness.contacts(), 0);

    let flown = (&setup, &flight);
    same_again::<sonar::Sonar>(flown, &recording, 0, &[("sonar/ranges", 200), ("sim/ping", 200)]);
    let navigation = [("navigation/setpoint", 150), ("navigation/grid", 150), ("navigation/patrol", 20)];
    same_again::<navigation::Navigation>(flown, &recording, 0, &navigation);
    let pilot = [("pilot/channels", 100), ("pilot/state", 10)];
    same_again::<pilot::Pilot>(flown, &recording, 0, &pilot);
    let second = same_again::<pilot::Pilot>(flown, &recording, 1, &pilot);
    gave_back(&second[0], &["pilot/state"]);
    let localization = [("localization/pose", 30), ("localization/particles", 30)];
    same_again::<localization::Localization>(flown, &recording, 0, &localization);
    let second = same_again::<localization::Localization>(flown, &recording, 1, &localization);
    gave_back(&second[0], &["localization/particles"]);
}

/// The entry of a second start names what the keeper gave, of the first.
fn gave_back(entry: &Trace, topics: &[&str]) {
    let kept = entry.runs.as_slice().iter().filter(|run| run.port == Run::KEEPER);
    let kept: Vec<_> = kept.map(|run| (run.topic, run.incarnation, run.count)).collect();
    let wanted: Vec<_> = topics.iter().map(|topic| (name_hash(topic), 0, 1)).collect();
    assert_eq!((entry.step, kept), (0, wanted));
}
