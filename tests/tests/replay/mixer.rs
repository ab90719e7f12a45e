//! A small service that forgets nothing: whatever it takes, in whichever order and when, shows in all that it says
//! from then on.

use crate::recording::Recording;
use ipc_types::{Channels, Command, Message, PilotState, Pose, Run, Trace};
use manifest::Manifest;
use runtime::shm::{Holder, RunDir};
use runtime::{Cache, Input, Instance, Lockstep, Output, Ports, Service, Start, StartError, Tool, mix_seed};
use sereno_tests::checkout;
use std::collections::HashMap;
use std::sync::mpsc;

const MANIFEST: &str = r#"
[system]
name = "mixing"
plan = "plan.yaml"
vehicle = "vehicles/watchman.toml"
simulated = true
[service.odometer]
run = "odometer"
tick_hz = 100
publishes.'localization/pose' = { hz = 100 }
[service.mixer]
run = "mixer"
tick_hz = 100
publishes.'pilot/channels' = { hz = 100 }
publishes.'pilot/state' = { hz = 100, retained = true }
subscribes.'localization/pose' = { depth = 4, wake = true }
subscribes.'operator/command' = { depth = 4 }
[tool.cli]
[tool.operator]
publishes = ["operator/command"]
[tool."other-operator"]
publishes = ["operator/command"]
"#;

fn manifest() -> Manifest {
    Manifest::parse("mixing.toml", MANIFEST).unwrap()
}

fn root() -> std::path::PathBuf {
    checkout().join("deploy")
}

struct Mixer {
    poses: Input<Pose>,
    orders: Input<Command>,
    channels: Output<Channels>,
    state: Output<PilotState>,
    mixed: u64,
}

/// Mixes a message in with all of its header.
fn mix<T: Message>(mixed: u64, message: &T) -> u64 {
    let mut mixed = mixed;
    for bytes in bytemuck::bytes_of(message).chunks(8) {
        mixed = bytes.iter().fold(mixed, |mixed, byte| mix_seed(mixed, u64::from(*byte)));
    }
    mixed
}

impl Mixer {
    fn listen(&mut self) {
        while let Some(pose) = self.poses.receive() {
            self.mixed = mix(self.mixed, &*pose);
        }
        while let Some(order) = self.orders.receive() {
            self.mixed = mix(self.mixed, &*order);
        }
    }
}

impl Service for Mixer {
    const NAME: &'static str = "mixer";
    type Config = ();

    fn start((): (), ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let kept = ports.retained::<PilotState>()?;
        let mixed = kept.map_or(start.seed, |state| mix(state.command_ns, &*state));
        let mut mixer = Self {
            poses: ports.input()?,
            orders: ports.input()?,
            channels: ports.output()?,
            state: ports.output()?,
            mixed,
        };
        // What a start takes counts too.
        mixer.listen();
        Ok(mixer)
    }

    fn step(&mut self, now: u64) {
        self.mixed = mix_seed(self.mixed, now);
        self.listen();
        self.mixed = mix_seed(self.mixed, self.channels.now_ns());
        // A second look finds nothing that the first did not, and so mixes the same again.
        self.listen();
        self.channels.publish(&Channels { expiry_ns: self.mixed, ..Channels::default() });
        self.state.publish(&PilotState { command_ns: self.mixed, ..PilotState::default() });
    }
}

fn record(ports: &mut Ports) -> Recording {
    let mut recording = Recording::default();
    recording.add_trace(ports, "mixer");
    recording.add::<Pose>(ports);
    recording.add::<Command>(ports);
    recording.add::<Channels>(ports);
    recording.add::<PilotState>(ports);
    recording
}

/// Runs the mixer again from its journal and expects what it has said; then from journals that are wrong by little, and
/// expects that it does not say the same.
fn check(recording: &Recording, journal: &[Trace]) {
    let again = |journal: &[Trace]| {
        recording.same_again::<Mixer>(&manifest(), &root(), Cache::default(), (), journal)
    };
    let equal = again(journal).unwrap();
    assert_eq!(equal.len(), 3, "{equal:?}");
    assert_eq!(equal["trace/mixer"], journal.len());
    assert_eq!(equal["pilot/channels"], journal.len() - 1);

    let with = |change: &dyn Fn(&mut Vec<Run>, &mut Trace) -> bool| {
        let mut wrong = journal.to_vec();
        let changed = wrong.iter_mut().skip(1).any(|trace| {
            let mut runs = trace.runs.as_slice().to_vec();
            let changed = change(&mut runs, trace);
            trace.runs.set(&runs);
            changed
        });
        assert!(changed, "nothing in this journal can be changed so");
        again(&wrong)
    };
    let less = with(&|runs, _| match runs.first_mut() {
        Some(run) if run.count > 1 => {
            run.count -= 1;
            true
        }
        _ => false,
    });
    let other_order = with(&|runs, _| {
        let one_port = |pair: &[Run]| pair[0].port == pair[1].port;
        runs.windows(2).position(one_port).map(|at| runs.swap(at, at + 1)).is_some()
    });
    let other_time = with(&|runs, trace| {
        trace.now_ns += 1;
        runs.is_empty()
    });
    for wrong in [less, other_order, other_time] {
        assert!(wrong.is_err(), "{wrong:?}");
    }
}

/// Publishers of all that the mixer reads.
struct World {
    poses: Output<Pose>,
    operators: [Output<Command>; 2],
}

impl World {
    /// Says something, sometimes more than the mixer has room for.
    fn speak(&mut self, turn: u64) {
        let draw = mix_seed(1, turn);
        for _ in 0..[0, 1, 2, 3, 7][(draw % 5) as usize] {
            self.poses.publish(&Pose { x_m: draw as f32, ..Pose::default() });
        }
        for place in 0..(draw >> 8) % 4 {
            let who = &mut self.operators[((draw >> (16 + place)) % 2) as usize];
            who.publish(&Command { lease: draw, ..Command::default() });
        }
    }
}

fn has_gap(journal: &[Trace]) -> bool {
    let mut next = HashMap::new();
    journal.iter().flat_map(|trace| trace.runs.as_slice()).any(|run| {
        let next = next.insert((run.port, run.publisher, run.incarnation), run.sequences().end);
        next.is_some_and(|next| next != run.first)
    })
}

#[test]
fn a_service_killed_in_lockstep_does_the_same_again_twice() {
    let mut system = Lockstep::new(manifest(), &root(), 5, Cache::default());
    let mut recording = record(&mut system.tool("cli"));
    let mut world = World {
        poses: system.tool("odometer").output().unwrap(),
        operators: ["operator", "other-operator"].map(|who| system.tool(who).output().unwrap()),
    };
    system.add::<Mixer>().unwrap();
    for turn in 0..400 {
        world.speak(turn);
        system.run_until((turn + 1) * 7_000_000);
        recording.hear();
        if turn == 200 {
            system.kill("mixer");
            system.add::<Mixer>().unwrap();
        }
    }
    let journals = [0, 1].map(|incarnation| recording.journal("mixer", incarnation));
    let [first, second] = &journals;
    assert!(first[0].runs.as_slice().is_empty());
    // The second has the first one's memory, as the entry of its start says.
    let [kept, ..] = second[0].runs.as_slice() else { panic!("{:?}", second[0].runs) };
    assert_eq!((kept.port, kept.incarnation, kept.count), (Run::KEEPER, 0, 1));
    assert_eq!(kept.topic, runtime::name_hash("pilot/state"));
    assert_eq!(kept.first, first.len() as u64 - 1);
    for journal in journals {
        assert!(journal.len() > 150 && has_gap(&journal));
        check(&recording, &journal);
    }
}

/// Published by a thread of its own, so that messages come while a step runs.
fn speak_on(run_dir: &RunDir, turns: &mpsc::Receiver<u64>) {
    let join = |who| Tool::join(who, manifest(), run_dir).unwrap();
    let (mut odometer, mut one, mut other) = (join("odometer"), join("operator"), join("other-operator"));
    let mut world = World {
        poses: odometer.ports.output().unwrap(),
        operators: [one.ports.output().unwrap(), other.ports.output().unwrap()],
    };
    while let Ok(turn) = turns.recv() {
        for tool in [&odometer, &one, &other] {
            tool.tick();
        }
        world.speak(turn);
    }
}

#[test]
fn what_ran_on_shared_memory_does_the_same_again_in_lockstep() {
    let directory = tempfile::tempdir().unwrap();
    let run_dir = RunDir::new(directory.path());
    run_dir.wipe();
    let holder = Holder::create(&manifest(), &run_dir).unwrap();
    {
        let mut listener = Tool::join("cli", manifest(), &run_dir).unwrap();
        let mut recording = record(&mut listener.ports);
        let (turn, turns) = mpsc::sync_channel(0);
        let speaker = std::thread::spawn({
            let run_dir = run_dir.clone();
            move || speak_on(&run_dir, &turns)
        });
        let ports = Tool::join("mixer", manifest(), &run_dir).unwrap().ports;
        let start =
            Start::new(manifest().system, &root(), 11, std::process::id(), true, Cache::default()).unwrap();
        let mut mixer = Instance::<Mixer>::start((), 0, ports, &start).unwrap();
        for number in 0..400 {
            // It is taken when the turn before is over. A turn is at most seven poses, and the listener has room for
            // sixteen.
            turn.send(number).unwrap();
            // At times it misses a turn, and what has no room.
            for _ in 0..if number % 10 == 0 { 0 } else { 3 } {
                mixer.step(runtime::monotonic_ns());
                recording.hear();
            }
            recording.hear();
        }
        drop(turn);
        speaker.join().unwrap();
        mixer.step(runtime::monotonic_ns());
        recording.hear();
        let journal = recording.journal("mixer", std::process::id());
        assert!(journal.len() == 1082 && has_gap(&journal));
        check(&recording, &journal);
    }
    drop(holder);
    run_dir.wipe();
}
