//! `cargo xtask fuzz`: looks for bytes that break what the loaders promise (`tests/fuzz`).

use crate::cargo;
use anyhow::{Context, Result, bail};
use std::path::Path;
use std::process::{Command, Stdio};

/// Longest input, bytes: the shipped files are shorter, and what is wrong with a long one is wrong with a short one.
const LONGEST: &str = "-max_len=8192";
/// One input that takes longer than this is a find, seconds: the largest plan is read in a few, instrumented.
const SLOWEST: &str = "-timeout=20";
const SLOWEST_REPORT: &str = "-report_slow_units=20";

/// The targets that need every service, and the feature that brings them.
const SERVICES: ([&str; 3], &str) = (["config", "network", "signal"], "services");

/// Builds the targets and runs each for so long; all of them when none is named.
///
/// The libraries forbid `unsafe`, so that the address sanitizer has nothing to look for in them; without it the
/// targets need no nightly Rust and run faster, and they count their memory themselves.
pub(crate) fn fuzz(root: &Path, seconds: u64, chosen: &[String]) -> Result<()> {
    let known = targets(root)?;
    if let Some(name) = chosen.iter().find(|name| !known.contains(name)) {
        bail!("{name} is no target; known are {}", known.join(", "));
    }
    let chosen = if chosen.is_empty() { &known[..] } else { chosen };
    install(root)?;
    // Instrumented, hence apart from everything else that is built.
    let built = root.join("target/fuzz");
    let built = built.to_string_lossy();
    let mut run =
        vec!["fuzz", "run", "--fuzz-dir", "tests/fuzz", "--sanitizer", "none", "--target-dir", &built];
    if chosen.iter().any(|target| SERVICES.0.contains(&target.as_str())) {
        run.extend(["--features", SERVICES.1]);
    }
    let time = format!("-max_total_time={seconds}");
    let mut broken = Vec::new();
    for target in chosen {
        // The corpus stays from run to run.
        let corpus = format!("target/fuzz-corpus/{target}");
        let crashes = format!("tests/fuzz/crashes/{target}");
        for folder in [&corpus, &crashes] {
            std::fs::create_dir_all(root.join(folder)).with_context(|| folder.clone())?;
        }
        let seeds = format!("tests/fuzz/seeds/{target}");
        let found = format!("-artifact_prefix={crashes}/");
        let words = format!("-dict=tests/fuzz/dictionaries/{target}.dict");
        let mut arguments = run.clone();
        arguments.extend([target, &corpus, &seeds, &crashes, "--", &time, &found, &words]);
        arguments.extend([LONGEST, SLOWEST, SLOWEST_REPORT, "-print_final_stats=1"]);
        if cargo(root, &arguments).is_err() {
            broken.push(crashes);
        }
    }
    if !broken.is_empty() {
        bail!(
            "found in {}; `cargo test --package sereno-tests --test fuzz_seeds` says what",
            broken.join(", ")
        );
    }
    Ok(())
}

/// One source file each.
fn targets(root: &Path) -> Result<Vec<String>> {
    let folder = root.join("tests/fuzz/fuzz_targets");
    let entries = std::fs::read_dir(&folder).with_context(|| folder.display().to_string())?;
    let mut targets = Vec::new();
    for entry in entries {
        let path = entry?.path();
        targets.extend(path.file_stem().map(|stem| stem.to_string_lossy().into_owned()));
    }
    targets.sort();
    Ok(targets)
}

fn install(root: &Path) -> Result<()> {
    let there = Command::new("cargo")
        .args(["fuzz", "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    if there {
        return Ok(());
    }
    cargo(root, &["install", "--locked", "cargo-fuzz", "--version", "^0.13", "--quiet"])
}
