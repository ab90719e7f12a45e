//! Build tasks: `cargo xtask demo`, `cargo xtask test`, `cargo xtask scenarios`, `cargo xtask streams`, `cargo xtask fuzz` and `cargo xtask figures`.
#![allow(clippy::print_stdout, reason = "build tasks say what they do")]

mod fuzz;

use anyhow::{Context, Result, bail};
use clap::{Parser, Subcommand};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

#[derive(Debug, Parser)]
#[command(name = "cargo xtask", about = "Build tasks of Sereno")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Build everything, fly one round of the demo building in the simulator, draw it and report on it.
    Demo {
        /// Exit non-zero unless the round ended on the pad without a contact.
        #[arg(long)]
        once: bool,
        /// Seed of everything drawn at random.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Where to draw the flight.
        #[arg(long, default_value = "flight.svg")]
        picture: PathBuf,
        /// Kill each flight-critical service so often (SIGKILL) at random moments.
        #[arg(long, default_value_t = 0)]
        kills: u32,
        /// How many drones fly on one console, 1 to 4.
        #[arg(long, default_value_t = 1)]
        drones: u8,
    },
    /// Run every test.
    Test,
    /// Look for inputs that break what the decoders and loaders promise; every target when none is named.
    Fuzz {
        /// How long each target runs, seconds.
        #[arg(long, default_value_t = 30)]
        seconds: u64,
        /// Files of `tests/fuzz/fuzz_targets` without their ending.
        targets: Vec<String>,
    },
    /// Fly faults as files: the scenarios of `tests/scenarios`.
    Scenarios {
        /// Names of scenarios, or their beginnings (all without any), and options: `--help` after `--` says which.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        order: Vec<String>,
    },
    /// Fly random command streams against the shield.
    Streams {
        /// Options: `--help` after `--` says which.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        order: Vec<String>,
    },
    /// Draw the thesis's figures of chapter 3.1 again, into `docs/figures`.
    Figures,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done = match arguments.task {
        Task::Demo { once, seed, picture, kills, drones } => demo(once, seed, &picture, kills, drones),
        Task::Test => test(),
        Task::Fuzz { seconds, targets } => {
            checkout().and_then(|root| fuzz::fuzz(&root, seconds, &targets)).map(|()| ExitCode::SUCCESS)
        }
        Task::Scenarios { order } => example("scenarios", &[], &order),
        Task::Streams { order } => example("streams", &["--release"], &order),
        Task::Figures => figures(),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("cargo xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// The checkout that this task was built from.
fn checkout() -> Result<PathBuf> {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = manifest.ancestors().nth(2).context("deploy/xtask is not inside a checkout")?;
    Ok(root.to_owned())
}

fn cargo(root: &Path, arguments: &[&str]) -> Result<()> {
    println!("$ cargo {}", arguments.join(" "));
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let began = Instant::now();
    let status =
        Command::new(cargo).args(arguments).current_dir(root).status().context("cannot run cargo")?;
    println!("  {:.0} s", began.elapsed().as_secs_f64());
    if !status.success() {
        bail!("cargo {} failed", arguments.join(" "));
    }
    Ok(())
}

/// Executables that a flight needs: the command line, the supervisor and one a service.
const PROGRAMS: [&str; 10] = [
    "sereno",
    "sereno-supervisor",
    "sereno-sonar",
    "sereno-flow",
    "sereno-flight",
    "sereno-localization",
    "sereno-navigation",
    "sereno-pilot",
    "sereno-simulator",
    "sereno-bridge",
];
/// Those that only show it.
const WATCHERS: [&str; 4] = ["sereno-console", "sereno-camera", "sereno-scenery", "sereno-stream"];

fn build_arguments(programs: &[&'static str]) -> Vec<&'static str> {
    // With the features that the whole workspace wants: whatever is chosen, no crate is built twice.
    let mut arguments = vec!["build", "--release", "--workspace"];
    for program in programs {
        arguments.extend(["--bin", program]);
    }
    arguments
}

fn build_programs(root: &Path) -> Result<PathBuf> {
    println!("Building the services, the supervisor and the command line (a few minutes the first time):");
    cargo(root, &build_arguments(&PROGRAMS))?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    Ok(root.join(target).join("release"))
}

fn demo(once: bool, seed: u64, picture: &Path, kills: u32, drones: u8) -> Result<ExitCode> {
    let root = checkout()?;
    let programs = build_programs(&root)?;
    println!("Flying the demo building, seed {seed}; the page follows as soon as it is built:");
    let mut command = Command::new(programs.join("sereno"));
    command.arg("--deploy").arg(root.join("deploy")).args(["demo", "--seed", &seed.to_string()]);
    command.arg("--picture").arg(picture).args(["--kills", &kills.to_string()]);
    command.args(["--drones", &drones.to_string()]);
    if once {
        command.arg("--once");
    }
    let mut flying = command.spawn().context("cannot run sereno")?;
    // The drone need not wait for who watches it.
    let built = if once { Ok(()) } else { cargo(&root, &build_arguments(&WATCHERS)) };
    if let Err(error) = built {
        eprintln!("no page: {error:#}");
    }
    let status = flying.wait().context("cannot wait for sereno")?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn test() -> Result<ExitCode> {
    let root = checkout()?;
    println!("Running every test: libraries, services, then the whole system as processes.");
    // The system tests run the services as they are flown.
    build_programs(&root)?;
    cargo(&root, &build_arguments(&WATCHERS))?;
    cargo(&root, &["test", "--workspace", "--no-fail-fast"])?;
    Ok(ExitCode::SUCCESS)
}

/// Runs a program of the system's tests. Scenarios are flown in the profile of the tests, which checks every overflow, and
/// streams, of which there are many, as the system is flown. Progress and report are the program's own.
fn example(name: &str, profile: &[&str], order: &[String]) -> Result<ExitCode> {
    let root = checkout()?;
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args(["run", "--quiet"])
        .args(profile)
        .args(["--package", "sereno-tests", "--example", name, "--"])
        .args(order)
        .current_dir(&root)
        .status()
        .context("cannot run cargo")?;
    Ok(if status.success() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn figures() -> Result<ExitCode> {
    let root = checkout()?;
    cargo(&root, &["run", "--quiet", "--package", "avoid", "--example", "figures", "--", "docs/figures"])?;
    Ok(ExitCode::SUCCESS)
}
