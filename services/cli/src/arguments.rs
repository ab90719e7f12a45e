//! The command line.

use crate::operate::Order;
use clap::{Args, Parser, Subcommand, ValueEnum};
use cli::place::Place;
use std::path::PathBuf;

/// Sereno: a night watchman for the inside of a building.
#[derive(Debug, Parser)]
#[command(name = "sereno", version, about, propagate_version = true)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub place: Place,
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
    /// Look at what flows between the services.
    Topic {
        #[command(subcommand)]
        order: TopicOrder,
    },
    /// Draw the wiring that the manifest describes.
    Graph,
    /// Check manifest, configurations, vehicle and plan.
    Check,
    /// Fly the round in the simulator, many times faster than life, and measure it by the truth.
    Rehearse(Rehearse),
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
}

#[derive(Debug, Args)]
pub(crate) struct Rehearse {
    /// Plan in ROS `map_server` form.
    #[arg(long)]
    pub plan: Option<PathBuf>,
    /// World file: furniture, doors, people; without one the plan's walls are the world.
    #[arg(long)]
    pub world: Option<PathBuf>,
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
    /// Flights at the same time; all cores when absent.
    #[arg(long)]
    pub threads: Option<usize>,
    /// Cruise speed, metres a second, instead of the vehicle's.
    #[arg(long)]
    pub speed: Option<f64>,
    /// Write the figures as JSON to this file (`-` for standard output).
    #[arg(long = "out")]
    pub out: Option<PathBuf>,
    /// Write a picture of every flight into this directory.
    #[arg(long)]
    pub pictures: Option<PathBuf>,
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
}
