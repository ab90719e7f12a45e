//! Flies random command streams against the shield: `cargo xtask streams`.
#![allow(clippy::print_stdout, reason = "a program that says what it found")]

use anyhow::Result;
use clap::Parser;
use sereno_tests::streams::{Report, Settings, Touch, run};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Debug, Parser)]
#[command(name = "cargo xtask streams", about = "Fly random command streams against the shield")]
struct Arguments {
    /// Streams of ten seconds each.
    #[arg(long, default_value_t = 10_000)]
    streams: u64,
    /// Seed of the first flight of ten streams.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Plan and world of `deploy`.
    #[arg(long, default_value = "demo")]
    world: String,
    /// Vehicle of `deploy`.
    #[arg(long, default_value = "watchman")]
    vehicle: String,
    /// What the plan does not show: none, light or full (with people).
    #[arg(long, default_value = "light")]
    clutter: String,
    /// The last seconds before every contact, too.
    #[arg(long)]
    trace: bool,
    /// Flights at once; the number of cores without it.
    #[arg(long)]
    threads: Option<usize>,
    /// One JSON object on standard output instead of lines.
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    match fly(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("cargo xtask streams: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn fly(arguments: &Arguments) -> Result<bool> {
    let settings = Settings {
        threads: arguments
            .threads
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get)),
        streams: arguments.streams,
        seed: arguments.seed,
        world: arguments.world.clone(),
        vehicle: arguments.vehicle.clone(),
        clutter: arguments.clutter.clone(),
    };
    let (flown, told) = (AtomicU64::new(0), AtomicU64::new(0));
    let report = run(&settings, |_, course| {
        let so_far = flown.fetch_add(course.streams, Ordering::Relaxed) + course.streams;
        if arguments.json {
            return;
        }
        if let Some(touch) = &course.touch {
            println!("{}", line(touch));
            if arguments.trace {
                touch.trace.iter().for_each(|line| println!("    {line}"));
            }
        }
        if so_far / 500 > told.swap(so_far / 500, Ordering::Relaxed) {
            println!("{so_far} of {} streams", settings.streams);
        }
    })?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print(&report);
    }
    Ok(report.contacts.is_empty())
}

fn line(touch: &Touch) -> String {
    let [x, y, z] = touch.place_m;
    let kind = touch.kind.map_or_else(|| "between streams".to_owned(), |kind| format!("{kind:?}"));
    format!(
        "CONTACT with {} at {:.0} deg, seed {} stream {}: after {:.1} s at {x:.2} {y:.2} {z:.2}, {:.2} m/s, {}; {kind}; broken: {}; place off by {:.2} m, said {:.2} m",
        touch.what,
        touch.bearing_deg,
        touch.seed,
        touch.stream.map_or_else(|| "-".to_owned(), |stream| stream.to_string()),
        touch.at_s,
        touch.speed_m_s,
        touch.phase,
        if touch.broken.is_empty() { "nothing" } else { &touch.broken },
        touch.off_m,
        touch.sigma_m,
    )
}

fn print(report: &Report) {
    println!(
        "{} streams in {} flights, {:.0} m flown: {} contacts; {:.0} s simulated in {:.0} s",
        report.streams,
        report.flights,
        report.distance_m,
        report.contacts.len(),
        report.simulated_s,
        report.wall_s
    );
}
