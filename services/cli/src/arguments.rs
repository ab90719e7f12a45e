//! The command line.

use crate::operate::Order;
use airframe::controller::Firmware;
use anyhow::{Result, anyhow, bail};
use clap::{Args, Parser, Subcommand, ValueEnum};
use cli::flight::Begin;
use cli::place::Place;
use navigation::config::Method;
use std::path::PathBuf;

/// Sereno: a night watchman for the inside of a building.
#[derive(Debug, Parser)]
#[command(name = "sereno", version, about, propagate_version = true)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub place: Place,
    /// Speak to a drone over the network: the configuration that `sereno certs client NAME` wrote.
    #[arg(long, global = true, env = "SERENO_REMOTE")]
    pub remote: Option<PathBuf>,
    /// Which drone, when there are several on the network.
    #[arg(long, global = true)]
    pub drone: Option<String>,
    /// Print JSON for programs instead of text for people.
    #[arg(long, global = true)]
    pub json: bool,
    #[command(subcommand)]
    pub verb: Verb,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Start the supervised system; the first Ctrl-C in flight lands, then stops.
    Up(Up),
    /// Show the services of the running system.
    Ps,
    /// Start every service anew, to read plan and configurations again; on the ground only.
    Reload,
    /// Restart a service from its executable as it is now.
    Restart {
        service: String,
        /// Also flight, pilot or sonar while the drone flies.
        #[arg(long)]
        in_flight: bool,
    },
    /// Without a name: the drone stops and hovers. With one: end that service until it is released.
    Hold {
        service: Option<String>,
        /// Also flight, pilot or sonar while the drone flies.
        #[arg(long)]
        in_flight: bool,
    },
    /// Start a held service again.
    Release { service: String },
    /// Show what a service printed (`supervisor` for the supervisor's own log).
    Logs {
        service: String,
        /// How many lines.
        #[arg(short = 'n', long, default_value_t = 40)]
        lines: usize,
    },
    /// Land what flies, then stop the system.
    Down {
        /// Stop at once, without landing.
        #[arg(long)]
        now: bool,
    },
    /// Take off and hover.
    Takeoff,
    /// Land here.
    Land,
    /// Return to the pad and land.
    Home,
    /// Fly to a place on the plan, metres, and hover.
    Goto {
        #[arg(allow_negative_numbers = true)]
        x: f32,
        #[arg(allow_negative_numbers = true)]
        y: f32,
    },
    /// Start, pause or stop the round.
    Patrol { order: PatrolOrder },
    /// Brake and hover; the drone lands if nobody orders anything else for a while.
    Stop,
    /// Stop the motors at once: in the air the drone falls.
    Cut {
        /// Without this it is refused.
        #[arg(long)]
        yes_it_falls: bool,
    },
    /// Off: nothing automatic moves the drone but failsafes and the way home. On: it may again; nothing begins by itself.
    Automatic { switch: Switch },
    /// Look at what flows between the services.
    Topic {
        #[command(subcommand)]
        order: TopicOrder,
    },
    /// Show a drone in the Foxglove app on this machine (with --remote): pose, particles, plan, round, sonars, video, all topics.
    Foxglove(crate::live::Foxglove),
    /// Certificates of drones, programs and the page.
    Certs(crate::certs::Certs),
    /// Print the JSON schema of every topic.
    Schema,
    /// Draw the wiring that the manifest describes.
    Graph,
    /// Check manifest, configurations, vehicle and plan.
    Check,
    /// Fly the round in the simulator, many times faster than life, and measure it by the truth.
    ///
    /// Exits with 0 when all flights were flown and their figures written, whatever their outcome: contacts and
    /// failsafes are figures, not errors.
    // Many options: boxed, so that the other verbs do not carry their size.
    Rehearse(Box<Rehearse>),
    /// Start the simulated system, fly one round, draw it and report on it.
    Demo(Demo),
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum PatrolOrder {
    /// Take off if need be and fly the round; after a pause, go on.
    Start,
    /// Hover and keep the round.
    Pause,
    /// Give the round up and return to the pad.
    Stop,
}

impl From<PatrolOrder> for Order {
    fn from(order: PatrolOrder) -> Self {
        match order {
            PatrolOrder::Start => Self::PatrolStart,
            PatrolOrder::Pause => Self::PatrolPause,
            PatrolOrder::Stop => Self::PatrolStop,
        }
    }
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum Switch {
    On,
    Off,
}

impl From<Switch> for Order {
    fn from(switch: Switch) -> Self {
        match switch {
            Switch::On => Self::AutomaticOn,
            Switch::Off => Self::AutomaticOff,
        }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum TopicOrder {
    /// List topics with their publishers and subscribers: of the running system, or of the manifest when none runs.
    List {
        /// When none runs: as the simulator overlays it.
        #[arg(long)]
        sim: bool,
    },
    /// Print messages as they come, one JSON object a line.
    Echo {
        topic: String,
        /// Stop after this many.
        #[arg(short = 'n', long)]
        count: Option<u64>,
    },
    /// Measure how often messages come.
    Hz {
        topic: String,
        /// For how long, seconds.
        #[arg(long, default_value_t = 5.0)]
        seconds: f64,
    },
}

#[derive(Debug, Args)]
pub(crate) struct Up {
    /// Fly in the simulator; no real device can be opened.
    #[arg(long)]
    pub sim: bool,
    /// Seed of everything drawn at random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Do not repeat what the services print.
    #[arg(long)]
    pub quiet: bool,
    /// Keep log files here after the end.
    #[arg(long)]
    pub logs: Option<PathBuf>,
    /// A file laid over the manifest, as `sim.toml` is; may be repeated.
    #[arg(long = "overlay", value_name = "FILE")]
    pub overlays: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct Rehearse {
    /// Plan in ROS `map_server` form.
    #[arg(long)]
    pub plan: Option<PathBuf>,
    /// World file: furniture, doors, people; without one the plan's walls are the world.
    #[arg(long)]
    pub world: Option<PathBuf>,
    /// Where the drone starts and lands: x and y on the plan, metres, and the heading, degrees. What the plan's side
    /// file or the world file says when absent, and the widest free place of the plan where they say nothing.
    #[arg(long, value_name = "X,Y,DEG", value_parser = pad, allow_hyphen_values = true)]
    pub pad: Option<[f32; 3]>,
    /// What the plan does not show: none, light or full.
    #[arg(long, default_value = "full")]
    pub clutter: String,
    /// A name in `vehicles/`, or a file.
    #[arg(long, default_value = "watchman")]
    pub vehicle: String,
    /// How many flights.
    #[arg(long, default_value_t = 1)]
    pub flights: u64,
    /// Seed of the first flight; flight k is drawn from this and k alone.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// How obstacles are avoided: vfh, thesis or potential; what navigation's configuration says when absent.
    #[arg(long, value_name = "METHOD")]
    pub avoid: Option<String>,
    /// Where the drone stands at first, and what localization is told of it.
    #[arg(long, value_enum, default_value_t)]
    pub start: StartWord,
    /// Carry the drone off by so many metres (0 to 20) once in every flight, without anything on board feeling it.
    #[arg(long, default_value_t = 0.0)]
    pub displaced: f64,
    /// Which firmware the flight controller plays: betaflight-4.5, betaflight-2025.12, betaflight-2026.12, inav-9.1 or
    /// flip32; the simulator's configuration says when absent (betaflight-2025.12).
    #[arg(long, value_name = "NAME")]
    pub firmware: Option<String>,
    /// Fly a flight controller without magnetometer: its heading begins anywhere and drifts.
    #[arg(long)]
    pub no_magnetometer: bool,
    /// Which particle filter finds the drone: sereno, or thesis, the plain one of the thesis; what the configuration says
    /// when absent.
    #[arg(long)]
    pub filter: Option<localization::FilterKind>,
    /// Flights at the same time, 1 to 256; all cores when absent.
    #[arg(long)]
    pub threads: Option<usize>,
    /// Cruise speed, metres a second, instead of the vehicle's.
    #[arg(long)]
    pub speed: Option<f64>,
    /// Write a picture of every flight into this directory.
    #[arg(long)]
    pub pictures: Option<PathBuf>,
    /// With --json: write the JSON to this file, and the table for people to standard output as without.
    pub out: Option<PathBuf>,
}

/// Where a flight starts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum StartWord {
    /// On the pad, and localization knows it.
    #[default]
    Pad,
    /// Anywhere: localization is told the room.
    Room,
    /// Anywhere: localization is told nothing.
    Unknown,
}

impl From<StartWord> for Begin {
    fn from(word: StartWord) -> Self {
        match word {
            StartWord::Pad => Self::Pad,
            StartWord::Room => Self::Room,
            StartWord::Unknown => Self::Unknown,
        }
    }
}

/// A place and a heading, as `2.5,1.0,90`.
fn pad(text: &str) -> Result<[f32; 3], String> {
    let numbers: Vec<f32> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match (text.split(',').count(), numbers.as_slice()) {
        (3, &[x, y, degrees]) if x.abs() <= PAD_M && y.abs() <= PAD_M && degrees.abs() <= 360.0 => {
            Ok([x, y, degrees])
        }
        _ => Err(format!(
            "allowed is X,Y,DEG: -{PAD_M} to {PAD_M} m and -360 to 360 degrees, such as 2.5,1,90"
        )),
    }
}

/// Farthest coordinate of a pad, as in a plan's side file.
const PAD_M: f32 = 10_000.0;
/// More flights at once than any machine has cores for.
const MOST_THREADS: usize = 256;
/// More than a month of rehearsals.
const MOST_FLIGHTS: u64 = 100_000;

impl Rehearse {
    /// How obstacles are avoided, if it is said.
    pub(crate) fn method(&self) -> Result<Option<Method>> {
        let word = self.avoid.as_deref();
        word.map(|word| {
            word.parse().map_err(|known| anyhow!("--avoid {word} is not possible: possible is {known}"))
        })
        .transpose()
    }

    /// Refuses what cannot be flown, in one sentence.
    pub(crate) fn check(&self, json: bool) -> Result<()> {
        self.method()?;
        if let Some(name) = &self.firmware
            && Firmware::by_name(name).is_none()
        {
            bail!("--firmware {name} is not known: allowed are {}", Firmware::names());
        }
        if !(1..=MOST_FLIGHTS).contains(&self.flights) {
            bail!("--flights {} is out of range: allowed is 1..={MOST_FLIGHTS}", self.flights);
        }
        if self.seed.checked_add(self.flights - 1).is_none() {
            bail!(
                "--seed {} is out of range: allowed is 0..={} with {} flights",
                self.seed,
                u64::MAX - (self.flights - 1),
                self.flights
            );
        }
        if let Some(threads) = self.threads
            && !(1..=MOST_THREADS).contains(&threads)
        {
            bail!("--threads {threads} is out of range: allowed is 1..={MOST_THREADS}");
        }
        if let Some(out) = &self.out
            && !json
        {
            bail!("{}: a file is written with --json only: `rehearse ... --json {0}`", out.display());
        }
        Ok(())
    }
}

#[derive(Debug, Args)]
pub(crate) struct Demo {
    /// Exit non-zero unless the round ended on the pad without a contact.
    #[arg(long)]
    pub once: bool,
    /// Seed of everything drawn at random.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Where to draw the flight.
    #[arg(long, default_value = "flight.svg")]
    pub picture: PathBuf,
    /// Give up after this many seconds.
    #[arg(long, default_value_t = 1500)]
    pub patience: u64,
    /// Kill each of localization, navigation, sonar, pilot and flight so often (SIGKILL) at moments drawn from the seed;
    /// with --once this must lead to no more than a hover.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=100))]
    pub kills: u32,
    /// How many drones fly, each a supervised system of its own, all on one console.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=4))]
    pub drones: u8,
    /// Where certificates and the console's accounts are kept between two demos; in the user's state directory when absent.
    #[arg(long)]
    pub state: Option<PathBuf>,
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "tests")]
mod tests {
    use super::*;

    /// The command line of DESIGN 5, with every option it names.
    const CONTRACT: &str = "sereno rehearse --plan plan.yaml --world world.toml --clutter full --vehicle watchman \
                            --flights 20 --seed 1 --avoid vfh --start pad --json OUT";

    fn rehearsal(line: &str) -> (Box<Rehearse>, bool) {
        let arguments = Arguments::try_parse_from(line.split_whitespace()).unwrap();
        let Verb::Rehearse(rehearse) = arguments.verb else { panic!("{line}") };
        (rehearse, arguments.json)
    }

    fn refusal(from: &str, to: &str) -> String {
        assert!(CONTRACT.contains(from));
        let (rehearse, json) = rehearsal(&CONTRACT.replace(from, to));
        let said = rehearse.check(json).unwrap_err().to_string();
        assert_eq!(said.lines().count(), 1, "{said}");
        said
    }

    #[test]
    fn the_command_line_is_the_contracts() {
        let (rehearse, json) = rehearsal(CONTRACT);
        rehearse.check(json).unwrap();
        assert!(json);
        assert_eq!(rehearse.out, Some(PathBuf::from("OUT")));
        assert_eq!(rehearse.plan, Some(PathBuf::from("plan.yaml")));
        assert_eq!(rehearse.world, Some(PathBuf::from("world.toml")));
        assert_eq!((rehearse.flights, rehearse.seed), (20, 1));
        let (bare, json) = rehearsal("sereno rehearse");
        bare.check(json).unwrap();
        assert_eq!((bare.out, json), (None, false));
        for line in ["sereno rehearse --json", "sereno --json rehearse"] {
            let (rehearse, json) = rehearsal(line);
            rehearse.check(json).unwrap();
            assert_eq!((rehearse.out, json), (None, true), "{line}");
        }
    }

    #[test]
    fn every_method_of_avoidance_can_be_asked_for() {
        for method in Method::ALL {
            let line = CONTRACT.replace("--avoid vfh", &format!("--avoid {method}"));
            let (rehearse, json) = rehearsal(&line);
            rehearse.check(json).unwrap();
            assert_eq!(rehearse.method().unwrap(), Some(method));
        }
        assert_eq!(rehearsal("sereno rehearse").0.method().unwrap(), None, "the configuration says");
    }

    #[test]
    fn a_pad_is_three_numbers() {
        let (rehearse, _) = rehearsal("sereno rehearse --pad -9.5,2,90 --flights 1");
        assert_eq!(rehearse.pad, Some([-9.5, 2.0, 90.0]));
        for wrong in ["1,2", "1,2,3,4", "1,b,3", "nan,1,2", "1,2,400", ""] {
            let error = Arguments::try_parse_from(["sereno", "rehearse", "--pad", wrong]).unwrap_err();
            assert!(error.to_string().contains("X,Y,DEG"), "{wrong}: {error}");
        }
    }

    #[test]
    fn a_filter_is_one_that_there_is() {
        use localization::FilterKind;
        assert_eq!(rehearsal("sereno rehearse").0.filter, None);
        for (word, kind) in [("sereno", FilterKind::Sereno), ("thesis", FilterKind::Thesis)] {
            assert_eq!(rehearsal(&format!("sereno rehearse --filter {word}")).0.filter, Some(kind));
        }
        let error = Arguments::try_parse_from(["sereno", "rehearse", "--filter", "kalman"]).unwrap_err();
        assert!(error.to_string().contains("allowed is sereno or thesis"), "{error}");
    }

    #[test]
    fn what_nothing_implements_is_refused_with_what_is_possible() {
        let said = refusal("--avoid vfh", "--avoid magnets");
        assert!(said.contains("magnets") && said.contains("possible is vfh, thesis, potential"), "{said}");
        let roof = CONTRACT.replace("--start pad", "--start roof");
        let said = Arguments::try_parse_from(roof.split_whitespace()).unwrap_err().to_string();
        assert!(said.contains("roof") && said.contains("pad, room, unknown"), "{said}");
        for (word, begin) in [("room", Begin::Room), ("unknown", Begin::Unknown)] {
            let (order, json) = rehearsal(&CONTRACT.replace("--start pad", &format!("--start {word}")));
            order.check(json).unwrap();
            assert_eq!(Begin::from(order.start), begin);
        }
    }

    #[test]
    fn a_firmware_goes_by_its_name() {
        for firmware in Firmware::ALL {
            let (rehearse, _) = rehearsal(&format!("sereno rehearse --firmware {}", firmware.name()));
            rehearse.check(false).unwrap();
        }
        let said = refusal("--seed 1", "--seed 1 --firmware ardupilot");
        assert!(Firmware::ALL.iter().all(|firmware| said.contains(firmware.name())), "{said}");
        let (bare, _) = rehearsal("sereno rehearse");
        assert!(bare.firmware.is_none() && !bare.no_magnetometer);
        assert!(rehearsal("sereno rehearse --no-magnetometer").0.no_magnetometer);
        // What the help says is what there is.
        let mut command = <Arguments as clap::CommandFactory>::command();
        let rehearse = command.find_subcommand_mut("rehearse").unwrap();
        let help = rehearse.render_long_help().to_string().replace(['\n', ' '], "");
        assert!(Firmware::ALL.iter().all(|firmware| help.contains(firmware.name())), "{help}");
    }

    #[test]
    fn numbers_out_of_range_are_refused_with_the_range() {
        assert!(refusal("--flights 20", "--flights 0").contains("1..=100000"));
        let said = refusal("--seed 1", "--seed 18446744073709551600");
        assert!(said.contains("0..=18446744073709551596"), "{said}");
        let last = rehearsal(&CONTRACT.replace("--seed 1", "--seed 18446744073709551596")).0;
        last.check(true).unwrap();
        for threads in ["0", "257", "18446744073709551615"] {
            let said = refusal("--seed 1", &format!("--seed 1 --threads {threads}"));
            assert!(said.contains(threads) && said.contains("1..=256"), "{said}");
        }
        assert!(refusal("--json OUT", "OUT").contains("with --json only"));
    }
}
