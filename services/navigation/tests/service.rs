//! The service on the lockstep bus, in the building that is shipped: through its ports, over a kill.
#![allow(clippy::unwrap_used, reason = "tests")]

use ipc_types::{
    Answer, COMMAND_LIFE_NS, Command, Grid, LocalizationState, Patrol, PatrolState, Phase, PilotState, Polar,
    Pose, Setpoint, SetpointKind, SonarRanges, SonarReading, SonarStatus, Verb,
};
use manifest::Manifest;
use navigation::Navigation;
use runtime::{Cache, Input, Lockstep, Output};
use std::path::Path;

/// As the shipped manifest has it, with one tool that plays all the others.
const MANIFEST: &str = r#"
[system]
name = "navigation-test"
plan = "plans/demo.yaml"
vehicle = "vehicles/watchman.toml"
[service.navigation]
run = "sereno-navigation"
config = "config/navigation.toml"
criticality = "mission"
tick_hz = 20
publishes.'navigation/grid' = { hz = 20 }
publishes.'navigation/polar' = { hz = 20 }
publishes.'navigation/setpoint' = { hz = 20 }
publishes.'navigation/patrol' = { hz = 2, retained = true }
subscribes.'localization/pose' = { depth = 8 }
subscribes.'sonar/ranges' = { depth = 8 }
subscribes.'pilot/state' = { depth = 4 }
subscribes.'operator/command' = { depth = 8 }
subscribes.'navigation/grid' = { depth = 1 }
[tool.others]
publishes = ["localization/pose", "sonar/ranges", "pilot/state", "operator/command"]
"#;

/// The pad of the demo building.
const PAD: (f32, f32) = (2.4, 2.2);

struct Bench {
    system: Lockstep,
    pose: Output<Pose>,
    ranges: Output<SonarRanges>,
    pilot: Output<PilotState>,
    command: Output<Command>,
    setpoint: Input<Setpoint>,
    polar: Input<Polar>,
    grid: Input<Grid>,
    patrol: Input<Patrol>,
    place: (f32, f32),
    heading: f32,
}

impl Bench {
    fn new() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
        let manifest = Manifest::parse("test.toml", MANIFEST).unwrap();
        let mut system = Lockstep::new(manifest, &root, 3, Cache::default());
        let mut ports = system.tool("others");
        let mut bench = Self {
            pose: ports.output().unwrap(),
            ranges: ports.output().unwrap(),
            pilot: ports.output().unwrap(),
            command: ports.output().unwrap(),
            setpoint: ports.input().unwrap(),
            polar: ports.input().unwrap(),
            grid: ports.input().unwrap(),
            patrol: ports.input().unwrap(),
            place: PAD,
            heading: 1.57,
            system,
        };
        bench.system.add::<Navigation>().unwrap();
        bench
    }

    /// 50 ms in which the drone flies what was wished.
    fn step(&mut self) -> Option<Setpoint> {
        let now = self.system.now() + 50_000_000;
        let (x_m, y_m) = self.place;
        self.pose.publish(&Pose {
            estimated_ns: now,
            x_m,
            y_m,
            heading_rad: self.heading,
            variance_x_m2: 0.001,
            variance_y_m2: 0.001,
            state: u32::from(LocalizationState::Tracking.code()),
            ..Pose::default()
        });
        let mut ranges = SonarRanges { count: 8, ..SonarRanges::default() };
        for (i, reading) in ranges.readings.iter_mut().take(8).enumerate() {
            *reading = SonarReading {
                ping_ns: now,
                range_m: f32::NAN,
                bearing_rad: avoid::wrap(i as f32 * std::f32::consts::FRAC_PI_4),
                sensor: i as u8,
                status: SonarStatus::NoEcho.code(),
                ..SonarReading::default()
            };
        }
        self.ranges.publish(&ranges);
        self.pilot.publish(&PilotState {
            phase: Phase::Autonomous.code(),
            automatic: 1,
            ..PilotState::default()
        });
        self.system.run_until(now);
        let setpoint = self.setpoint.latest().map(|setpoint| *setpoint);
        if let Some(setpoint) = setpoint {
            self.place.0 += 0.05 * setpoint.velocity_x_m_s;
            self.place.1 += 0.05 * setpoint.velocity_y_m_s;
            if setpoint.heading_rad.is_finite() {
                self.heading = setpoint.heading_rad;
            }
        }
        setpoint
    }

    fn order(&mut self, verb: Verb, number: u32) {
        self.command.publish(&Command {
            expiry_ns: self.command.now_ns() + COMMAND_LIFE_NS,
            verb: u32::from(verb.code()),
            command_sequence: number,
            x_m: f32::NAN,
            y_m: f32::NAN,
            ..Command::default()
        });
    }
}

#[test]
fn a_round_begins_survives_a_kill_and_goes_on() {
    let mut bench = Bench::new();
    bench.order(Verb::PatrolStart, 5);
    let mut flying = None;
    for step in 0..600 {
        let setpoint = bench.step();
        // One setpoint a step from the second on, however much is being planned.
        assert!(setpoint.is_some() || step < 2, "step {step}");
        if setpoint.is_some_and(|s| s.kind == u32::from(SetpointKind::Velocity.code())) {
            flying = Some(step);
            break;
        }
    }
    let first = flying.unwrap();
    assert!(first < 300, "planned in {first} slices");
    for _ in 0..200 {
        bench.step();
    }
    let before = bench.patrol.latest().unwrap();
    assert_eq!(before.state, u32::from(PatrolState::Flying.code()), "{}", before.text);
    let accepted = u32::from(Answer::Accepted.code());
    assert_eq!((before.command_sequence, before.answer), (5, accepted), "{}", before.answer_text);
    assert!(before.rooms_used == 9 && before.waypoints_used > 20, "{}", before.waypoints_used);
    assert!(before.coverage > 0.01 && before.coverage < 0.5, "{}", before.coverage);
    assert!((bench.place.0 - PAD.0).hypot(bench.place.1 - PAD.1) > 1.0);
    let seen: u32 = before.seen.iter().map(|word| word.count_ones()).sum();

    bench.system.kill("navigation");
    bench.step();
    bench.system.add::<Navigation>().unwrap();
    // The command that it obeyed before the kill is still there to be read: it is not obeyed again.
    bench.order(Verb::PatrolStart, 5);
    let mut again = false;
    for _ in 0..300 {
        let setpoint = bench.step();
        again |= setpoint.is_some_and(|s| s.kind == u32::from(SetpointKind::Velocity.code()));
    }
    let after = bench.patrol.latest().unwrap();
    assert!(again, "{}", after.text);
    let seen_after: u32 = after.seen.iter().map(|word| word.count_ones()).sum();
    assert!(seen_after >= seen);
    assert_eq!((after.command_sequence, after.started_ns), (5, before.started_ns));
    assert_eq!(bench.system.refused("navigation"), 0);
    assert!(bench.polar.latest().is_some() && bench.grid.latest().is_some());
}

#[test]
fn messages_that_make_no_sense_are_counted_and_change_nothing() {
    let mut bench = Bench::new();
    for _ in 0..10 {
        bench.step();
    }
    bench.pose.publish(&Pose { x_m: f32::NAN, estimated_ns: 1, state: 2, ..Pose::default() });
    bench.ranges.publish(&SonarRanges { count: 4000, ..SonarRanges::default() });
    bench.pilot.publish(&PilotState { phase: 77, automatic: 1, ..PilotState::default() });
    bench.command.publish(&Command { verb: 0, command_sequence: 9, ..Command::default() });
    bench.step();
    let setpoint = bench.step().unwrap();
    assert_eq!(bench.system.refused("navigation"), 4);
    // What makes sense and cannot be done is answered at once, with its number.
    bench.order(Verb::PatrolPause, 12);
    bench.step();
    bench.step();
    let patrol = bench.patrol.latest().unwrap();
    assert_eq!((patrol.command_sequence, patrol.answer), (12, u32::from(Answer::Refused.code())));
    assert_eq!(patrol.answer_text.as_str(), "refused: there is no round to pause");
    assert_eq!(setpoint.kind, u32::from(SetpointKind::Hover.code()));
    assert_eq!(bench.system.status("navigation"), "idle: waiting for a command");
}
