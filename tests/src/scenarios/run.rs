//! Many scenarios at once, and the report.

use super::{Scenario, Seen, failures, fly};
use anyhow::Result;
use runtime::Cache;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// How they are run.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Flights at once.
    pub threads: usize,
    /// Where the pictures of what fails go.
    pub pictures: PathBuf,
    /// Draw those that pass too.
    pub draw_all: bool,
}

/// What is said of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// All expectations were met.
    Passed,
    /// One was not.
    Failed,
    /// One was not, and `known.toml` says so.
    KnownShortfall,
    /// All were met, and `known.toml` says that they are not: the entry has to go.
    NoLongerAShortfall,
}

/// What came of one scenario.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// Its name.
    pub name: String,
    /// What it is about.
    pub about: String,
    /// Whether that is as it should be.
    pub verdict: Verdict,
    /// Expectations that were not met, a sentence each.
    pub failures: Vec<String>,
    /// What `known.toml` says.
    pub known: Option<String>,
    /// The picture of what failed.
    pub picture: Option<PathBuf>,
    /// What was seen; `null` when the flight could not begin.
    pub seen: Option<Seen>,
    /// Simulated seconds.
    pub simulated_s: f64,
    /// Seconds that it took.
    pub wall_s: f64,
}

/// What came of all.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// One each, by name.
    pub scenarios: Vec<Outcome>,
    /// Seconds in all.
    pub wall_s: f64,
}

impl Report {
    /// How many have a verdict.
    #[must_use]
    pub fn count(&self, verdict: Verdict) -> usize {
        self.scenarios.iter().filter(|outcome| outcome.verdict == verdict).count()
    }

    /// Whether all are as they should be.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.scenarios.iter().all(|o| matches!(o.verdict, Verdict::Passed | Verdict::KnownShortfall))
    }
}

/// Flies scenarios in parallel; `tell` hears of each as it is done.
///
/// # Errors
/// When a picture cannot be written. A flight that cannot begin is a failure of its scenario.
pub fn run(
    scenarios: &[Scenario],
    known: &BTreeMap<String, String>,
    settings: &Settings,
    tell: impl Fn(&Outcome) + Sync,
) -> Result<Report> {
    let began = Instant::now();
    let cache = Cache::default();
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<Result<Outcome>>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..settings.threads.max(1) {
            scope.spawn(|| {
                while let Some(scenario) = scenarios.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = one(scenario, known.get(&scenario.name), settings, &cache);
                    if let Ok(outcome) = &outcome {
                        tell(outcome);
                    }
                    done.lock().unwrap_or_else(PoisonError::into_inner).push(outcome);
                }
            });
        }
    });
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut scenarios = done.into_iter().collect::<Result<Vec<_>>>()?;
    scenarios.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(Report { scenarios, wall_s: began.elapsed().as_secs_f64() })
}

fn one(scenario: &Scenario, known: Option<&String>, settings: &Settings, cache: &Cache) -> Result<Outcome> {
    let began = Instant::now();
    // A panic of a service is what a scenario must find, not what ends the run.
    let flown = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| fly(scenario, cache)));
    let mut outcome = Outcome {
        name: scenario.name.clone(),
        about: scenario.about.clone(),
        verdict: Verdict::Failed,
        failures: Vec::new(),
        known: known.cloned(),
        picture: None,
        seen: None,
        simulated_s: 0.0,
        wall_s: 0.0,
    };
    match flown {
        Err(panic) => {
            let words = panic.downcast_ref::<String>().map(String::as_str);
            let words = words.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no words");
            outcome.failures.push(format!("expected a flight, saw a panic: {words}"));
        }
        Ok(Err(error)) => outcome.failures.push(format!("expected a flight, but it cannot begin: {error:#}")),
        Ok(Ok(flown)) => {
            outcome.failures = failures(scenario, &flown.seen);
            outcome.simulated_s = flown.simulated_s;
            outcome.seen = Some(flown.seen.clone());
            outcome.verdict = match (outcome.failures.is_empty(), known) {
                (true, None) => Verdict::Passed,
                (true, Some(_)) => Verdict::NoLongerAShortfall,
                (false, None) => Verdict::Failed,
                (false, Some(_)) => Verdict::KnownShortfall,
            };
            if !outcome.failures.is_empty() || settings.draw_all {
                let path = settings.pictures.join(format!("{}.svg", scenario.name));
                std::fs::create_dir_all(&settings.pictures)?;
                std::fs::write(&path, flown.picture(&format!("Scenario {}", scenario.name))?)?;
                outcome.picture = Some(path);
            }
        }
    }
    outcome.wall_s = began.elapsed().as_secs_f64();
    Ok(outcome)
}
