//! One flight in the simulator: `sereno rehearse` as a child process.

use super::files;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A flight takes seconds on a desk and minutes on a small computer; a battery lasts no longer.
const PATIENCE: Duration = Duration::from_secs(600);
/// How often it is looked whether the child has ended.
const LOOK: Duration = Duration::from_millis(50);
/// Longest report.
const MOST_BYTES: u64 = 4 * 1024 * 1024;
/// Longest sentence that is taken from the program.
const SENTENCE: usize = 500;

/// What the simulator's truth says of a flight; the keys are those of `sereno rehearse --json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Flight {
    seed: u64,
    outcome: String,
    contacts: u32,
    min_clearance_m: f64,
    time_s: f64,
    distance_m: f64,
    coverage: f64,
    failsafes: Vec<String>,
    skipped: Vec<String>,
}

#[derive(Deserialize)]
struct Report {
    flights: Vec<Flight>,
}

/// The program while it flies.
#[derive(Debug)]
pub(super) struct Child {
    process: Mutex<std::process::Child>,
    report: PathBuf,
    complaints: PathBuf,
}

impl Child {
    /// Starts it: niced, and killed by the kernel should this process die without a word.
    ///
    /// # Errors
    /// A sentence.
    pub(super) fn start(
        program: &Path,
        deploy: Option<&Path>,
        plan: &Path,
        vehicle: &str,
        seed: u32,
    ) -> Result<Self, String> {
        let (report, complaints) = (plan.with_file_name("report.json"), plan.with_file_name("complaints"));
        let _ = std::fs::remove_file(&report);
        let failed = |error: std::io::Error| format!("the rehearsal cannot be started: {error}");
        files::write(&complaints, b"").map_err(failed)?;
        let said = std::fs::OpenOptions::new().append(true).open(&complaints).map_err(failed)?;
        let mut command = Command::new("setpriv");
        command.args(["--pdeathsig", "KILL", "--", "nice", "-n", "10"]).arg(program);
        if let Some(deploy) = deploy {
            command.arg("--deploy").arg(deploy);
        }
        command
            .arg("rehearse")
            .arg("--plan")
            .arg(plan)
            .arg(format!("--vehicle={vehicle}"))
            .args(["--flights", "1", "--threads", "1", "--seed", &seed.to_string(), "--json"])
            .arg(&report)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(said);
        let process = Mutex::new(command.spawn().map_err(failed)?);
        Ok(Self { process, report, complaints })
    }

    pub(super) fn kill(&self) {
        let mut process = self.process.lock().unwrap_or_else(PoisonError::into_inner);
        // It may have ended by itself.
        let _ = process.kill();
        let _ = process.wait();
    }

    fn ended(&self) -> std::io::Result<Option<std::process::ExitStatus>> {
        self.process.lock().unwrap_or_else(PoisonError::into_inner).try_wait()
    }

    /// The last line that it complained in.
    fn complaint(&self) -> String {
        let text = files::read(&self.complaints, MOST_BYTES).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it said nothing");
        let mut plain: String = last.chars().filter(|c| !c.is_control()).collect();
        crate::text::shorten(&mut plain, SENTENCE);
        plain
    }
}

/// Waits until the child has landed.
///
/// # Errors
/// A sentence: what the program complained of, or that it took too long.
pub(super) fn fly(child: &Child) -> Result<Flight, String> {
    let began = Instant::now();
    let status = loop {
        match child.ended() {
            Ok(Some(status)) => break status,
            Ok(None) if began.elapsed() > PATIENCE => {
                child.kill();
                return Err(format!("the rehearsal was ended after {} s", PATIENCE.as_secs()));
            }
            Ok(None) => std::thread::sleep(LOOK),
            Err(error) => return Err(format!("the rehearsal is lost: {error}")),
        }
    };
    if !status.success() {
        return Err(child.complaint());
    }
    let bytes = files::read(&child.report, MOST_BYTES)
        .map_err(|error| format!("no report of the rehearsal: {error}"))?;
    let report: Report = serde_json::from_slice(&bytes)
        .map_err(|error| format!("the report of the rehearsal is not understood: {error}"))?;
    report.flights.into_iter().next().ok_or_else(|| "the report of the rehearsal has no flight".to_owned())
}
