//! The step journal says exactly what was taken, whichever the bus.

use crate::buses::{Bus, Shared, manifest, on_both};
use ipc_types::{Command, Header, MAX_RUNS, Message, PilotState, Pose, Run, Trace};
use runtime::{Cache, Input, Journal, Output, Start, Tool, name_hash};

const SEED: u64 = 0x5eed;
const CONFIG: u64 = 0xc0;

fn start() -> Start {
    let vehicles = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../deploy/vehicles"));
    let mut system = manifest().system;
    system.vehicle = "watchman.toml".to_owned();
    Start::new(system, vehicles, SEED, 0, true, Cache::default()).unwrap()
}

/// A service that keeps a journal, and somebody who reads it.
struct Journaled {
    poses: Input<Pose>,
    orders: Input<Command>,
    journal: Journal,
    trace: Input<Trace>,
}

impl Journaled {
    fn open(bus: &mut dyn Bus, service: &str) -> Self {
        let trace = bus.ports("listener").input_of::<Trace>(&format!("trace/{service}")).unwrap();
        let ports = bus.ports(service);
        let mut journal = Journal::open(ports).unwrap();
        let (poses, orders) = (ports.input().unwrap(), ports.input().unwrap());
        journal.begin(ports, &start(), CONFIG);
        let mut open = Self { poses, orders, journal, trace };
        let first = open.entry(bus);
        assert_eq!((first.step, first.seed, first.config, first.ports), (0, SEED, CONFIG, 2));
        assert_eq!((runs_of(&first), first.truncated), (vec![], 0));
        open
    }

    fn entry(&mut self, bus: &mut dyn Bus) -> Trace {
        bus.settle();
        let entry = *self.trace.receive().unwrap();
        assert!(self.trace.receive().is_none(), "one entry a step");
        entry
    }

    /// Ends the step and reads what the journal says of it.
    fn step(&mut self, bus: &mut dyn Bus) -> Trace {
        self.journal.step();
        self.entry(bus)
    }
}

fn header_of<T: Message>(input: &mut Input<T>) -> Header {
    *input.receive().unwrap().header()
}

/// Publishes and lets arrive.
fn say(bus: &mut dyn Bus, output: &mut Output<Pose>, times: usize) {
    for _ in 0..times {
        assert!(output.publish(&Pose::default()));
    }
    bus.settle();
}

fn order(bus: &mut dyn Bus, output: &mut Output<Command>) {
    assert!(output.publish(&Command::default()));
    bus.settle();
}

type Told = (u16, u32, u32, u32, u64, u16);

fn told(run: &Run) -> Told {
    (run.port, run.topic, run.publisher, run.incarnation, run.first, run.count)
}

fn runs_of(trace: &Trace) -> Vec<Told> {
    trace.runs.as_slice().iter().map(told).collect()
}

/// A run of poses, on the first port.
fn poses(incarnation: u32, first: u64, count: u16) -> Told {
    (0, name_hash("localization/pose"), name_hash("writer"), incarnation, first, count)
}

/// A run of orders, on the second port.
fn orders(who: &str, incarnation: u32, first: u64, count: u16) -> Told {
    (1, name_hash("operator/command"), name_hash(who), incarnation, first, count)
}

#[test]
fn each_step_has_an_entry_and_nothing_taken_gives_no_runs() {
    on_both(|bus| {
        let mut reader = Journaled::open(bus, "reader");
        let mut writer = bus.ports("writer").output::<Pose>().unwrap();
        let mut last = 0;
        for step in 1..=3 {
            assert!(reader.poses.receive().is_none() && reader.orders.latest().is_none());
            let entry = reader.step(bus);
            assert_eq!((entry.step, entry.truncated, entry.ports), (step, 0, 2));
            assert_eq!((entry.seed, entry.config), (SEED, CONFIG));
            assert_eq!(runs_of(&entry), []);
            assert_eq!(entry.now_ns, entry.header.stamp_ns);
            assert!(entry.now_ns >= last);
            last = entry.now_ns;
        }
        // What comes and is not taken is not told.
        say(bus, &mut writer, 2);
        assert_eq!(runs_of(&reader.step(bus)), []);
        reader.poses.receive().unwrap();
        let incarnation = reader.poses.receive().unwrap().header.incarnation;
        assert_eq!(runs_of(&reader.step(bus)), [poses(incarnation, 1, 2)]);
        assert_eq!(runs_of(&reader.step(bus)), []);
    });
}

#[test]
fn publishers_and_incarnations_in_one_step_are_told_apart() {
    on_both(|bus| {
        let mut reader = Journaled::open(bus, "shallow");
        let mut one = bus.ports("operator").output::<Command>().unwrap();
        let mut other = bus.ports("other-operator").output::<Command>().unwrap();
        let mut first = bus.ports("writer").output::<Pose>().unwrap();
        say(bus, &mut first, 2);
        let incarnation = header_of(&mut reader.poses).incarnation;
        header_of(&mut reader.poses);
        drop(first);
        bus.die("writer");
        let ports = bus.ports("writer");
        ports.set_incarnation(incarnation + 1);
        let mut second = ports.output::<Pose>().unwrap();
        // Two of these four find room: the sequence goes on as if nobody had been started again.
        say(bus, &mut second, 4);
        for _ in 0..2 {
            header_of(&mut reader.poses);
        }
        for (output, times) in [(&mut one, 2), (&mut other, 1)] {
            for _ in 0..times {
                order(bus, output);
                header_of(&mut reader.orders);
            }
        }
        order(bus, &mut one);
        let order_incarnation = header_of(&mut reader.orders).incarnation;
        let entry = reader.step(bus);
        let wanted = [
            poses(incarnation, 1, 2),
            poses(incarnation + 1, 3, 2),
            orders("operator", order_incarnation, 1, 2),
            orders("other-operator", order_incarnation, 1, 1),
            orders("operator", order_incarnation, 3, 1),
        ];
        assert_eq!(runs_of(&entry), wanted);
        assert_eq!(entry.truncated, 0);
    });
}

#[test]
fn an_overflow_is_a_gap_within_one_step_and_between_two() {
    on_both(|bus| {
        let mut reader = Journaled::open(bus, "shallow");
        let mut writer = bus.ports("writer").output::<Pose>().unwrap();
        say(bus, &mut writer, 1);
        let incarnation = header_of(&mut reader.poses).incarnation;
        // Two of these five find room.
        say(bus, &mut writer, 5);
        header_of(&mut reader.poses);
        header_of(&mut reader.poses);
        let entry = reader.step(bus);
        assert_eq!(runs_of(&entry), [poses(incarnation, 1, 1), poses(incarnation, 5, 2)]);
        say(bus, &mut writer, 4);
        header_of(&mut reader.poses);
        header_of(&mut reader.poses);
        assert_eq!(runs_of(&reader.step(bus)), [poses(incarnation, 9, 2)]);
        assert_eq!(reader.poses.lost(), 5);
    });
}

#[test]
fn the_order_within_an_input_is_kept_while_others_are_read_in_turn() {
    on_both(|bus| {
        let mut reader = Journaled::open(bus, "reader");
        let mut writer = bus.ports("writer").output::<Pose>().unwrap();
        let mut operators =
            ["operator", "other-operator"].map(|who| bus.ports(who).output::<Command>().unwrap());
        let (mut poses, mut orders) = (Vec::new(), Vec::new());
        for turn in [0, 0, 1, 0, 1, 1, 0] {
            say(bus, &mut writer, 1);
            order(bus, &mut operators[turn]);
            poses.push(header_of(&mut reader.poses));
            orders.push(header_of(&mut reader.orders));
        }
        let entry = reader.step(bus);
        let runs = entry.runs.as_slice();
        let unrolled = |port| {
            let of_port = runs.iter().filter(move |run| run.port == port);
            let each = of_port.flat_map(|run| run.sequences().map(|at| (run.publisher, run.incarnation, at)));
            each.collect::<Vec<_>>()
        };
        let known = |headers: &[Header]| {
            headers.iter().map(|h| (h.publisher, h.incarnation, h.sequence)).collect::<Vec<_>>()
        };
        assert_eq!(unrolled(0), known(&poses));
        assert_eq!(unrolled(1), known(&orders));
        // One run of poses, although orders came between them; and five of orders: 0 0, 1, 0, 1 1, 0.
        assert_eq!(runs.len(), 6);
    });
}

#[test]
fn what_finds_no_place_is_counted() {
    on_both(|bus| {
        let mut reader = Journaled::open(bus, "reader");
        let mut writer = bus.ports("writer").output::<Pose>().unwrap();
        let mut operators =
            ["operator", "other-operator"].map(|who| bus.ports(who).output::<Command>().unwrap());
        say(bus, &mut writer, 1);
        let incarnation = header_of(&mut reader.poses).incarnation;
        for turn in 0..MAX_RUNS + 4 {
            order(bus, &mut operators[turn % 2]);
            header_of(&mut reader.orders);
        }
        // The next of a run that has its place is told; the next of one that found none is not.
        say(bus, &mut writer, 1);
        header_of(&mut reader.poses);
        order(bus, &mut operators[(MAX_RUNS + 3) % 2]);
        header_of(&mut reader.orders);
        let entry = reader.step(bus);
        assert_eq!(entry.runs.as_slice().len(), MAX_RUNS);
        assert_eq!(runs_of(&entry)[0], poses(incarnation, 1, 2));
        assert_eq!(entry.truncated, 6);
        // The next step has all places again.
        order(bus, &mut operators[0]);
        header_of(&mut reader.orders);
        let entry = reader.step(bus);
        assert_eq!((entry.runs.as_slice().len(), entry.truncated), (1, 0));
    });
}

/// In lockstep nothing comes while a step runs; what comes in shared memory waits for the next. Otherwise the second
/// look of a service would take what its second look in a replay finds taken by the first.
#[test]
fn an_input_found_empty_stays_so_to_the_end_of_the_step() {
    on_both(|bus| {
        let mut reader = Journaled::open(bus, "reader");
        let mut writer = bus.ports("writer").output::<Pose>().unwrap();
        assert!(reader.poses.receive().is_none());
        say(bus, &mut writer, 2);
        assert!(reader.poses.latest().is_none());
        assert_eq!(runs_of(&reader.step(bus)), []);
        let incarnation = reader.poses.latest().unwrap().header.incarnation;
        assert_eq!(runs_of(&reader.step(bus)), [poses(incarnation, 1, 2)]);
    });
}

#[test]
fn the_entry_of_the_start_names_what_the_keeper_gave() {
    let mut bus = Shared::new();
    let mut state = bus.ports("writer").output::<PilotState>().unwrap();
    for _ in 0..3 {
        assert!(state.publish(&PilotState::default()));
    }
    let Some(holder) = &mut bus.holder else { unreachable!() };
    holder.keep();
    drop(state);
    bus.die("writer");
    let mut trace = bus.ports("listener").input_of::<Trace>("trace/writer").unwrap();
    let run_dir = bus.run_dir.clone();
    let Some(holder) = &mut bus.holder else { unreachable!() };
    let topics = holder.restore("writer");
    let (read, until_read) = std::sync::mpsc::channel::<()>();
    let next = std::thread::spawn(move || {
        let mut tool = Tool::restarted("writer", manifest(), &run_dir, topics).unwrap();
        let mut journal = Journal::open(&mut tool.ports).unwrap();
        assert!(tool.ports.retained::<PilotState>().unwrap().is_some());
        journal.begin(&tool.ports, &start(), CONFIG);
        // It lives until the entry is read; the other end is dropped then.
        let _ = until_read.recv();
    });
    let entry = loop {
        if let Some(entry) = trace.receive() {
            break *entry;
        }
        assert!(!next.is_finished(), "it died without an entry");
        holder.keep();
        std::thread::yield_now();
    };
    drop(read);
    next.join().unwrap();
    let wanted = (Run::KEEPER, name_hash("pilot/state"), name_hash("writer"), std::process::id(), 3, 1);
    assert_eq!((entry.step, runs_of(&entry)), (0, vec![wanted]));
}
