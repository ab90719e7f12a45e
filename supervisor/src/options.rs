//! How a system is to be run.

use crate::SupervisorError;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::time::Duration;

/// What becomes of the lines that services and supervisor print, besides being logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Echo {
    /// Nothing.
    Silent,
    /// `[service] line` on standard error, for people.
    Text,
    /// `{"service":...,"line":...}` a line on standard output, for programs.
    Json,
}

/// How a system is to be run.
#[derive(Debug, Clone)]
pub struct Options {
    /// The manifest, then its overlays.
    pub manifests: Vec<PathBuf>,
    /// A further overlay as text, for what the command line changes; empty for none.
    pub changes: String,
    /// Private directory of the running system; [`default_run_dir`] when absent.
    pub run_dir: Option<PathBuf>,
    /// Directory of the services' executables; that of this executable when absent.
    pub programs: Option<PathBuf>,
    /// Directory for log files that outlive the system; inside the run directory, and removed with it, when
    /// absent.
    pub logs: Option<PathBuf>,
    /// Seed from which services derive theirs.
    pub seed: u64,
    /// Whether and how to repeat what services print.
    pub echo: Echo,
    /// How long a landing may take before the services are stopped all the same.
    pub land_limit: Duration,
    /// How long a service may take to end before it is killed.
    pub stop_limit: Duration,
    /// How long a service may take to report that it is ready.
    pub start_limit: Duration,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            manifests: Vec::new(),
            changes: String::new(),
            run_dir: None,
            programs: None,
            logs: None,
            seed: 1,
            echo: Echo::Silent,
            // From 2.5 m (a ceiling) at the slowest allowed descent of 0.1 m/s, and a margin to settle.
            land_limit: Duration::from_secs(45),
            stop_limit: Duration::from_secs(2),
            // A large plan's tables take seconds on a Pi.
            start_limit: Duration::from_secs(60),
        }
    }
}

/// What systemd makes for an installed system's user (`deploy/systemd/sereno.service`).
const INSTALLED: &str = "/run/sereno";

/// Where a system called `name` lives unless told otherwise: below `/run/sereno` for root and for the user of an installed
/// system, to whom that belongs; below `$XDG_RUNTIME_DIR`; else in a directory of the user's own below the temporary
/// directory.
#[must_use]
pub fn default_run_dir(name: &str) -> PathBuf {
    let user = rustix::process::geteuid();
    if std::fs::metadata(INSTALLED).is_ok_and(|place| place.is_dir() && place.uid() == user.as_raw()) {
        return PathBuf::from(INSTALLED).join(name);
    }
    match std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from) {
        Some(dir) if dir.is_absolute() && dir.is_dir() => dir.join("sereno").join(name),
        _ if user.is_root() => PathBuf::from(INSTALLED).join(name),
        _ => std::env::temp_dir().join(format!("sereno-{}", user.as_raw())).join(name),
    }
}

/// Reads the arguments of `sereno-supervisor`:
/// `[--run-dir DIR] [--programs DIR] [--logs DIR] [--seed N] [--quiet] MANIFEST [OVERLAY...]`.
///
/// # Errors
/// [`SupervisorError::Usage`] with the usage line.
pub fn parse_arguments(arguments: impl Iterator<Item = String>) -> Result<Options, SupervisorError> {
    const USAGE: &str = "usage: sereno-supervisor [--run-dir DIR] [--programs DIR] [--logs DIR] [--seed N] [--quiet] MANIFEST [OVERLAY...]";
    let wrong = |what: String| SupervisorError::Usage(format!("{what}; {USAGE}"));
    let mut options = Options { echo: Echo::Text, ..Options::default() };
    let mut arguments = arguments;
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or_else(|| wrong(format!("{argument} needs a value")));
        match argument.as_str() {
            "--run-dir" => options.run_dir = Some(value()?.into()),
            "--programs" => options.programs = Some(value()?.into()),
            "--logs" => options.logs = Some(value()?.into()),
            "--seed" => {
                let text = value()?;
                options.seed =
                    text.parse().map_err(|_| wrong(format!("--seed {text} is not a whole number")))?;
            }
            "--quiet" => options.echo = Echo::Silent,
            other if other.starts_with('-') => return Err(wrong(format!("unknown option {other}"))),
            path => options.manifests.push(path.into()),
        }
    }
    if options.manifests.is_empty() {
        return Err(wrong("no manifest given".to_owned()));
    }
    Ok(options)
}
