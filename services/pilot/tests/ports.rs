//! The service on the lockstep bus, wired by the manifest that flies.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc_types::{
    Answer, COMMAND_LIFE_NS, Channels, Command, FlightState, LinkState, Phase, PilotState, Verb,
};
use pilot::Pilot;
use runtime::{Cache, Lockstep, load_manifest};

const MS: u64 = 1_000_000;

fn system() -> Lockstep {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy/system.toml");
    let (manifest, root) = load_manifest(manifest).unwrap();
    Lockstep::new(manifest, &root, 7, Cache::default())
}

#[test]
fn silent_until_it_knows_whether_motors_run_then_neutral_at_50_hz() {
    let mut system = system();
    let mut flight = system.tool("flight");
    let mut states = flight.output::<FlightState>().unwrap();
    let mut channels = flight.input::<Channels>().unwrap();
    system.add::<Pilot>().unwrap();
    system.run_until(500 * MS);
    assert!(channels.latest().is_none());
    states.publish(&FlightState { link: LinkState::Up.code(), ..Default::default() });
    let mut heard = 0;
    for step in 1..=100 {
        system.run_until(500 * MS + step * 10 * MS);
        while let Some(message) = channels.receive() {
            heard += 1;
            assert_eq!((message.arm, message.count), (0, 6));
            assert_eq!(message.channels_us[..6], [1500, 1500, 1000, 1500, 1000, 2000]);
            let life = message.expiry_ns - message.header.stamp_ns;
            assert!((100 * MS..=150 * MS).contains(&life), "{life}");
        }
    }
    assert!((48..=51).contains(&heard), "{heard}");
}

#[test]
fn started_again_in_the_air_it_holds_the_drone_within_100_ms() {
    let mut system = system();
    let mut flight = system.tool("flight");
    let mut states = flight.output::<FlightState>().unwrap();
    let mut channels = flight.input::<Channels>().unwrap();
    system.add::<Pilot>().unwrap();
    system.run_until(300 * MS);
    system.kill("pilot");
    // What it would have said last, had it flown.
    let mut last = system.tool("pilot").output::<PilotState>().unwrap();
    last.publish(&PilotState {
        phase: Phase::Autonomous.code(),
        arm: 1,
        hover_throttle_us: 1520.0,
        level_roll_us: 1510.0,
        level_pitch_us: 1490.0,
        height_m: 1.2,
        hold_x_m: f32::NAN,
        hold_y_m: f32::NAN,
        hold_heading_rad: 0.3,
        command_sequence: 9,
        ..Default::default()
    });
    let armed = FlightState { link: LinkState::Up.code(), armed: 1, ..Default::default() };
    states.publish(&armed);
    system.run_until(400 * MS);
    while channels.receive().is_some() {}
    system.add::<Pilot>().unwrap();
    system.run_until(500 * MS);
    let first = channels.receive().unwrap();
    assert!(first.header.stamp_ns <= 500 * MS);
    assert_eq!(first.arm, 1);
    assert!((1480..=1560).contains(&first.channels_us[2]), "{}", first.channels_us[2]);
    assert_eq!(first.on_ground, 0);
    assert!((first.hover_throttle_us - 1520.0).abs() < 2.0);
}

#[test]
fn a_refusal_is_said_at_once_with_the_command_that_it_answers() {
    let mut system = system();
    let mut commands = system.tool("cli").output::<Command>().unwrap();
    let mut answers = system.tool("navigation").input::<PilotState>().unwrap();
    system.add::<Pilot>().unwrap();
    system.run_until(300 * MS);
    while answers.receive().is_some() {}
    let expiry_ns = commands.now_ns() + COMMAND_LIFE_NS;
    commands.publish(&Command {
        expiry_ns,
        verb: Verb::TakeOff.code().into(),
        command_sequence: 77,
        x_m: f32::NAN,
        y_m: f32::NAN,
        ..Default::default()
    });
    system.run_until(340 * MS);
    let mut answer = None;
    while let Some(state) = answers.receive() {
        answer = Some((state.command_sequence, state.answer, state.answer_text));
    }
    let (sequence, answer, text) = answer.unwrap();
    assert_eq!((sequence, answer), (77, u32::from(Answer::Refused.code())));
    assert!(text.as_str().starts_with("refused: the flight service is silent"), "{text}");
    assert_eq!(system.refused("pilot"), 0);
}
