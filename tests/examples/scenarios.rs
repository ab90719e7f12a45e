//! Flies the scenarios of `tests/scenarios`: `cargo xtask scenarios [NAME...]`.
#![allow(clippy::print_stdout, reason = "a program that says what it found")]

use anyhow::{Result, bail};
use clap::Parser;
use sereno_tests::checkout;
use sereno_tests::scenarios::{Outcome, Report, Settings, Verdict, load_all, load_known, run};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};

#[derive(Debug, Parser)]
#[command(name = "cargo xtask scenarios", about = "Fly faults as files")]
struct Arguments {
    /// Which: names of files, or their beginnings; all without any.
    names: Vec<String>,
    /// One JSON object on standard output instead of a table.
    #[arg(long)]
    json: bool,
    /// Flights at once; the number of cores without it.
    #[arg(long)]
    threads: Option<usize>,
    /// Where the pictures of what failed go.
    #[arg(long, default_value = "target/scenarios")]
    pictures: PathBuf,
    /// Draw what passed too.
    #[arg(long)]
    draw_all: bool,
    /// Say what there is, and fly nothing.
    #[arg(long)]
    list: bool,
}

fn main() -> ExitCode {
    match fly(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("cargo xtask scenarios: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn fly(arguments: &Arguments) -> Result<bool> {
    let directory = checkout().join("tests/scenarios");
    let mut scenarios = load_all(&directory)?;
    let known = load_known(&directory, &scenarios)?;
    for name in &arguments.names {
        if !scenarios.iter().any(|scenario| scenario.name.starts_with(name)) {
            bail!("there is no scenario {name}; --list says what there is");
        }
    }
    if !arguments.names.is_empty() {
        scenarios.retain(|scenario| arguments.names.iter().any(|name| scenario.name.starts_with(name)));
    }
    if arguments.list {
        scenarios.iter().for_each(|scenario| println!("{:<34} {}", scenario.name, scenario.about));
        return Ok(true);
    }
    let settings = Settings {
        threads: arguments
            .threads
            .unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get)),
        pictures: arguments.pictures.clone(),
        draw_all: arguments.draw_all,
    };
    let (done, all) = (AtomicUsize::new(0), scenarios.len());
    let report = run(&scenarios, &known, &settings, |outcome| {
        let number = done.fetch_add(1, Ordering::Relaxed) + 1;
        if !arguments.json {
            println!("{number:>3}/{all} {}", line(outcome));
        }
    })?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print(&report);
    }
    Ok(report.is_good())
}

fn line(outcome: &Outcome) -> String {
    let word = match outcome.verdict {
        Verdict::Passed => "ok",
        Verdict::Failed => "FAILED",
        Verdict::KnownShortfall => "known",
        Verdict::NoLongerAShortfall => "PASSES",
    };
    let figures = outcome.seen.as_ref().map_or_else(String::new, |seen| {
        let failsafes: Vec<&str> = seen.failsafes.iter().map(|failsafe| failsafe.text.as_str()).collect();
        format!(
            "{} contacts, {:.2} m clear, {}; {}",
            seen.contacts,
            seen.clearance_m,
            seen.phase,
            failsafes.join(", ")
        )
    });
    format!(
        "{word:<7}{:<34}{:>5.0} s in {:>5.1} s  {figures}",
        outcome.name, outcome.simulated_s, outcome.wall_s
    )
}

fn print(report: &Report) {
    println!();
    for outcome in report.scenarios.iter().filter(|outcome| outcome.verdict != Verdict::Passed) {
        println!("{}: {}", outcome.name, outcome.about);
        for failure in &outcome.failures {
            println!("  {failure}");
        }
        match (&outcome.known, outcome.verdict) {
            (Some(_), Verdict::NoLongerAShortfall) => {
                println!("  it passes: take it out of tests/scenarios/known.toml");
            }
            (Some(known), _) => println!("  known: {known}"),
            (None, _) => {}
        }
        if let Some(picture) = &outcome.picture {
            println!("  picture: {}", picture.display());
        }
    }
    println!(
        "{} scenarios in {:.0} s: {} passed, {} failed, {} known shortfalls, {} of them no longer",
        report.scenarios.len(),
        report.wall_s,
        report.count(Verdict::Passed),
        report.count(Verdict::Failed),
        report.count(Verdict::KnownShortfall),
        report.count(Verdict::NoLongerAShortfall)
    );
}
