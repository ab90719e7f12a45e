//! On shared memory a loaned sample is the working memory: nothing of it is copied on its way, so that fifty
//! thousand particles cost what five hundred do.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use ipc_types::{MAX_PARTICLES, Message, Particles, Pose};
use manifest::Manifest;
use runtime::shm::{Holder, RunDir};
use runtime::{Input, Output, Ports, Tool};
use sereno_tests::counting::{Noting, noted, watch};
use std::collections::HashMap;
use std::time::Instant;

#[global_allocator]
static ALLOCATOR: Noting = Noting;

const MANIFEST: &str = r#"
[system]
name = "no-copy"
plan = "plan.yaml"
vehicle = "vehicle.toml"
simulated = true
[service.writer]
run = "writer"
tick_hz = 20
publishes.'localization/pose' = { hz = 20 }
publishes.'localization/particles' = { hz = 20 }
[service.reader]
run = "reader"
tick_hz = 20
subscribes.'localization/pose' = { depth = 1 }
subscribes.'localization/particles' = { depth = 1 }
"#;

/// A shared-memory bus of this test's own.
struct Bus {
    run_dir: RunDir,
    holder: Option<Holder>,
    _directory: tempfile::TempDir,
}

impl Bus {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let run_dir = RunDir::new(directory.path());
        run_dir.wipe();
        let holder = Some(Holder::create(&Self::manifest(), &run_dir).unwrap());
        Self { run_dir, holder, _directory: directory }
    }

    fn manifest() -> Manifest {
        Manifest::parse("no_copy.toml", MANIFEST).unwrap()
    }

    fn ports(&self, service: &str) -> Ports {
        Tool::join(service, Self::manifest(), &self.run_dir).unwrap().ports
    }

    fn line<T: Message>(&self) -> (Output<T>, Input<T>) {
        (self.ports("writer").output().unwrap(), self.ports("reader").input().unwrap())
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        self.holder = None;
        self.run_dir.wipe();
    }
}

/// Where a value lies: the file behind the memory and the place in it. One place has as many addresses as it is
/// mapped times.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Spot {
    file: String,
    offset: usize,
}

fn spot<T>(value: &T) -> Spot {
    let number = |text: &str| usize::from_str_radix(text, 16).unwrap();
    let first = std::ptr::from_ref(value).addr();
    let inside = |line: &str| {
        // 7f2c5a000000-7f2c5a400000 rw-s 00000000 00:19 1234    /dev/shm/name
        let words: Vec<_> = line.split_whitespace().collect();
        let (from, to) = words[0].split_once('-').map(|(from, to)| (number(from), number(to))).unwrap();
        let file = words.get(5).copied().unwrap_or("memory of this process").to_owned();
        (from <= first && first + size_of::<T>() <= to)
            .then(|| Spot { file, offset: first - from + number(words[2]) })
    };
    std::fs::read_to_string("/proc/self/maps").unwrap().lines().find_map(inside).unwrap()
}

/// Writes what every set has and the first few entries of each column.
fn write_little(set: &mut Particles, count: usize, value: f32) {
    set.count = count as u32;
    for column in columns_mut(set) {
        column[..4].fill(value);
    }
}

fn columns_mut(set: &mut Particles) -> [&mut [f32; MAX_PARTICLES]; 8] {
    [
        &mut set.x_m,
        &mut set.y_m,
        &mut set.velocity_x_m_s,
        &mut set.velocity_y_m_s,
        &mut set.heading_offset_rad,
        &mut set.level_roll_rad,
        &mut set.level_pitch_rad,
        &mut set.weight,
    ]
}

fn columns(set: &Particles) -> [&[f32; MAX_PARTICLES]; 8] {
    [
        &set.x_m,
        &set.y_m,
        &set.velocity_x_m_s,
        &set.velocity_y_m_s,
        &set.heading_offset_rad,
        &set.level_roll_rad,
        &set.level_pitch_rad,
        &set.weight,
    ]
}

#[test]
fn writer_and_readers_have_one_place_in_shared_memory() {
    let bus = Bus::new();
    let (mut output, mut one) = bus.line::<Particles>();
    let mut other = bus.ports("reader").input::<Particles>().unwrap();
    for count in [500, MAX_PARTICLES] {
        let mut loan = output.loan().unwrap();
        write_little(&mut loan, count, 1.0);
        let written = spot(&*loan);
        assert!(written.file.starts_with(&format!("/dev/shm/{}", bus.run_dir.prefix())), "{written:?}");
        loan.send();
        assert_eq!(spot(&*one.receive().unwrap()), written);
        assert_eq!(spot(&*other.receive().unwrap()), written);
    }
}

#[test]
fn what_the_writer_leaves_alone_stays_as_it_was() {
    let bus = Bus::new();
    let (mut output, mut input) = bus.line::<Particles>();
    // Every place of the segment gets a value of its own from end to end.
    let mut marks = HashMap::new();
    for mark in 1..=40 {
        let mut loan = output.loan().unwrap();
        for column in columns_mut(&mut loan) {
            column.fill(mark as f32);
        }
        marks.insert(spot(&*loan), mark as f32);
        loan.send();
        drop(input.receive().unwrap());
    }
    for count in [500, MAX_PARTICLES, 500, MAX_PARTICLES] {
        let mut loan = output.loan().unwrap();
        let mark = marks[&spot(&*loan)];
        write_little(&mut loan, count, -1.0);
        loan.send();
        let received = input.receive().unwrap();
        assert_eq!(received.count as usize, count);
        for column in columns(&received) {
            assert_eq!(column[..4], [-1.0; 4]);
            assert!(column[4..].iter().all(|value| *value == mark), "not {mark} but {}", column[4]);
        }
    }
}

/// iceoryx2 0.10 keeps the handle of a loan on the heap: 48 bytes, whatever the message
/// (`chunk_mut_shared_state.rs`). A copied set would be 1.6 MB.
#[test]
fn a_message_allocates_its_handle_and_no_more() {
    let bus = Bus::new();
    let (mut output, mut input) = bus.line::<Particles>();
    let mut pass = |count| {
        let mut loan = output.loan().unwrap();
        write_little(&mut loan, count, 1.0);
        loan.send();
        assert_eq!(input.receive().unwrap().count as usize, count);
    };
    // The first message makes the connection.
    pass(1);
    watch(Some("bus"));
    for _ in 0..50 {
        pass(500);
        pass(MAX_PARTICLES);
    }
    watch(None);
    let noted = noted("bus");
    let largest = noted.iter().map(|allocation| allocation.bytes).max();
    assert!(noted.len() <= 100, "{} allocations in 100 messages", noted.len());
    assert!(largest <= Some(64), "{largest:?} bytes");
}

/// Rounds of the race below.
const ROUNDS: usize = 2001;
/// Most that one median may be of another. A set that is copied, or only zeroed, takes forty times a pose.
const WITHIN: f64 = 4.0;

fn timed<T: Message>(line: &mut (Output<T>, Input<T>), write: impl Fn(&mut T)) -> f64 {
    let began = Instant::now();
    let mut loan = line.0.loan().unwrap();
    write(&mut loan);
    loan.send();
    drop(line.1.receive().unwrap());
    began.elapsed().as_nanos() as f64
}

/// The three take turns, so that whatever else the machine does meets all of them; a median of 2001 does not see
/// what happens to fewer than half of the rounds; and the bound lies far from either side.
#[test]
fn fifty_thousand_cost_what_five_hundred_and_a_pose_do() {
    let bus = Bus::new();
    let (mut poses, mut sets) = (bus.line::<Pose>(), bus.line::<Particles>());
    let mut took = [const { Vec::<f64>::new() }; 3];
    for _ in 0..ROUNDS {
        took[0].push(timed(&mut poses, |pose| pose.x_m = 1.0));
        took[1].push(timed(&mut sets, |set| write_little(set, 500, 1.0)));
        took[2].push(timed(&mut sets, |set| write_little(set, MAX_PARTICLES, 1.0)));
    }
    let [pose, few, many] = took.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    });
    println!("medians: a pose {pose} ns, 500 particles {few} ns, 50 000 particles {many} ns");
    assert!(many < WITHIN * few && few < WITHIN * many, "{few} ns for 500, {many} ns for 50 000 particles");
    assert!(many < WITHIN * pose, "{pose} ns for a pose, {many} ns for 50 000 particles");
}
