//! From `sonar/ranges` to the `pilot/channels` made from it, between real processes in flight.
//!
//! Starts the simulated system with `sereno up --sim`, flies a round and reads the step journals: which step of
//! whom took which message, and when it began. Where a message wakes its reader, what is left without the step is
//! what shared memory, the wake-up and the scheduler cost; the pilot is woken by nothing and waits for its tick.
//!
//! Needs the programs beside it: `cargo build --release --workspace --bins`, then
//! `cargo bench -p sereno-tests --bench sonar_to_channels`. `SERENO_BENCH_SECONDS` changes the length (60).
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "measurements")]

use cli::place::Place;
use ipc_types::{Channels, Health, Message, Phase, PilotState, SonarRanges, Trace};
use runtime::{Input, Tool, name_hash};
use sereno_tests::checkout;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// All is up, armed and climbing within this time.
const PATIENCE: Duration = Duration::from_secs(90);
/// Sixteen messages wait in an input: of the fastest journal (250 a second) those of 64 ms.
const GLANCE: Duration = Duration::from_millis(2);

/// The supervised system; stopped when this goes out of scope.
struct System {
    sereno: PathBuf,
    directory: tempfile::TempDir,
    up: Child,
}

impl System {
    fn command(sereno: &Path, directory: &Path) -> Command {
        let mut command = Command::new(sereno);
        command.arg("--deploy").arg(checkout().join("deploy")).arg("--run-dir").arg(directory.join("run"));
        command.stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    fn start(sereno: &Path) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let up = Self::command(sereno, directory.path()).args(["up", "--sim", "--quiet"]).spawn().unwrap();
        Self { sereno: sereno.to_owned(), directory, up }
    }

    fn order(&self, words: &[&str]) -> bool {
        Self::command(&self.sereno, self.directory.path()).args(words).status().unwrap().success()
    }

    fn join(&self) -> Result<Tool, String> {
        let place = Place { deploy: None, run_dir: Some(self.directory.path().join("run")) };
        let (manifest, _, run_dir) = place.running().map_err(|error| format!("{error:#}"))?;
        Tool::join("cli", manifest, &run_dir).map_err(|error| error.to_string())
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if !self.order(&["down", "--now"]) {
            let _ = self.up.kill();
        }
        let _ = self.up.wait();
    }
}

fn patiently<T>(mut attempt: impl FnMut() -> Result<T, String>) -> T {
    let began = Instant::now();
    loop {
        match attempt() {
            Ok(got) => return got,
            Err(reason) => assert!(began.elapsed() < PATIENCE, "in vain: {reason}"),
        }
        std::thread::sleep(Duration::from_millis(200));
    }
}

/// Stamps by sequence number.
type Stamps = BTreeMap<u64, u64>;

fn note_stamps<T: Message>(input: &mut Input<T>, stamps: &mut Stamps) {
    while let Some(message) = input.receive() {
        stamps.insert(message.header().sequence, message.header().stamp_ns);
    }
}

/// One reader of one topic: when the step began that took a message, by the message's sequence number.
struct Reader {
    trace: Input<Trace>,
    /// What stands for the topic in the journal.
    topic: u32,
    took: Stamps,
}

impl Reader {
    fn open<T: Message>(tool: &mut Tool, service: &str) -> Self {
        let trace = tool.ports.input_of(&format!("{}/{service}", Trace::TOPIC)).unwrap();
        Self { trace, topic: name_hash(T::TOPIC), took: Stamps::new() }
    }

    fn look(&mut self) {
        while let Some(trace) = self.trace.receive() {
            for run in trace.runs.as_slice().iter().filter(|run| run.topic == self.topic) {
                self.took.extend(run.sequences().map(|sequence| (sequence, trace.now_ns)));
            }
        }
    }

    /// Milliseconds from the stamp of each message to the step that took it.
    fn delays(&self, stamps: &Stamps) -> Vec<f64> {
        let pairs = stamps.iter().filter_map(|(sequence, stamp)| Some((*stamp, *self.took.get(sequence)?)));
        let delays: Vec<f64> = pairs.map(|(sent, took)| milliseconds(sent, took)).collect();
        let sound = delays.iter().filter(|delay| (0.0..200.0).contains(*delay)).count();
        assert!(
            10 * sound > 9 * stamps.len(),
            "only {sound} of {} messages were taken in time",
            stamps.len()
        );
        delays
    }
}

/// What a service says of its own steps.
struct Steps {
    name: &'static str,
    health: Input<Health>,
    step_ms: Vec<f64>,
    late_ms: Vec<f64>,
}

impl Steps {
    fn open(tool: &mut Tool, name: &'static str) -> Self {
        let health = tool.ports.input_of(&format!("{}/{name}", Health::TOPIC)).unwrap();
        Self { name, health, step_ms: Vec::new(), late_ms: Vec::new() }
    }

    fn look(&mut self) {
        while let Some(health) = self.health.receive() {
            self.step_ms.push(health.mean_step_ns as f64 * 1e-6);
            self.late_ms.push(health.lateness_ns as f64 * 1e-6);
        }
    }

    fn mean_ms(&self) -> f64 {
        self.step_ms.iter().sum::<f64>() / self.step_ms.len().max(1) as f64
    }
}

fn milliseconds(earlier_ns: u64, later_ns: u64) -> f64 {
    ipc_types::seconds_between(earlier_ns, later_ns) * 1e3
}

/// The median and the 99th percentile, as they are and without what the steps on the way last in the mean.
fn say(what: &str, mut times: Vec<f64>, steps: f64) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    let (p50, p99) = (at(0.5), at(0.99));
    print!("{what:<68} {p50:>7.3} {p99:>7.3}   ");
    println!("{:>7.3} {:>7.3}   {:>5}", p50 - steps, p99 - steps, times.len());
}

fn main() {
    let programs = std::env::current_exe().unwrap().ancestors().nth(2).map(Path::to_owned).unwrap();
    let sereno = programs.join("sereno");
    if !["sereno", "sereno-pilot", "sereno-simulator"].iter().all(|name| programs.join(name).is_file()) {
        println!("no programs in {}: cargo build --release --workspace --bins", programs.display());
        return;
    }
    let length = std::env::var("SERENO_BENCH_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(60);
    let system = System::start(&sereno);
    let mut tool = patiently(|| system.join());
    let mut state = tool.ports.input::<PilotState>().unwrap();
    patiently(|| {
        let phase = state.latest().and_then(|state| Phase::from_code(state.phase));
        if phase == Some(Phase::Grounded) {
            // Refused until the flight controller has settled.
            system.order(&["patrol", "start"]);
        }
        if phase == Some(Phase::Autonomous) { Ok(()) } else { Err(format!("phase {phase:?}")) }
    });

    let mut ranges = tool.ports.input::<SonarRanges>().unwrap();
    let mut channels = tool.ports.input::<Channels>().unwrap();
    let (mut ranges_sent, mut channels_sent) = (Stamps::new(), Stamps::new());
    let mut pilot = Reader::open::<SonarRanges>(&mut tool, "pilot");
    let mut localization = Reader::open::<SonarRanges>(&mut tool, "localization");
    let mut flight = Reader::open::<Channels>(&mut tool, "flight");
    let mut steps = ["sonar", "pilot", "flight"].map(|service| Steps::open(&mut tool, service));
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(length) {
        tool.tick();
        note_stamps(&mut ranges, &mut ranges_sent);
        note_stamps(&mut channels, &mut channels_sent);
        for reader in [&mut pilot, &mut localization, &mut flight] {
            reader.look();
        }
        steps.iter_mut().for_each(Steps::look);
        std::thread::sleep(GLANCE);
    }

    // What a step publishes carries the time at which it began.
    let made: BTreeMap<u64, u64> =
        channels_sent.iter().map(|(sequence, stamp)| (*stamp, *sequence)).collect();
    let flown = |ranges: &u64| flight.took.get(made.get(pilot.took.get(ranges)?)?);
    let whole: Vec<f64> = ranges_sent
        .iter()
        .filter_map(|(sequence, sent)| Some(milliseconds(*sent, *flown(sequence)?)))
        .collect();
    let [sonar, pilot_step, _] = steps.each_ref().map(Steps::mean_ms);
    println!("{:<68} {:>7} {:>7}   {:>15}   {:>5}", "milliseconds", "p50", "p99", "less the steps", "of");
    say("sonar/ranges to localization, which it wakes", localization.delays(&ranges_sent), sonar);
    say("sonar/ranges to the pilot, whose tick comes every 20 ms", pilot.delays(&ranges_sent), sonar);
    say("pilot/channels to flight, which it wakes", flight.delays(&channels_sent), pilot_step);
    say("sonar/ranges to the pilot/channels made from it, at flight", whole, sonar + pilot_step);
    for service in steps {
        say(&format!("mean step of {}, a report", service.name), service.step_ms, 0.0);
        say(&format!("latest tick of {}, a report", service.name), service.late_ms, 0.0);
    }
    let lost = ranges.lost() + channels.lost();
    println!("{lost} messages escaped this bench; with many of them the machine was too busy to measure");
}
