//! Where the system's files are.

use anyhow::{Context, Result, bail};
use clap::Args;
use manifest::Manifest;
use std::path::{Path, PathBuf};

/// Which system a command is about.
#[derive(Debug, Clone, Args, Default)]
pub struct Place {
    /// Directory of system.toml; found beside the executable or the working directory when absent.
    #[arg(long, global = true, env = "SERENO_DEPLOY")]
    pub deploy: Option<PathBuf>,
    /// Run directory of the system; a private one of the user's when absent.
    #[arg(long, global = true, env = "SERENO_RUN_DIR")]
    pub run_dir: Option<PathBuf>,
}

impl Place {
    /// The directory of system.toml.
    ///
    /// # Errors
    /// When there is none.
    pub fn deploy(&self) -> Result<PathBuf> {
        if let Some(given) = &self.deploy {
            if given.join("system.toml").is_file() {
                return Ok(given.clone());
            }
            bail!("{} has no system.toml", given.display());
        }
        let mut candidates = vec![PathBuf::from("deploy")];
        if let Ok(program) = std::env::current_exe() {
            candidates.extend(program.ancestors().skip(1).map(|above| above.join("deploy")));
        }
        candidates.push(PathBuf::from("/etc/sereno"));
        for candidate in &candidates {
            if candidate.join("system.toml").is_file() {
                return Ok(std::path::absolute(candidate)?);
            }
        }
        bail!("no system.toml found in ./deploy, beside the executable or in /etc/sereno: use --deploy");
    }

    /// The manifest files: the system's, and with `sim` the simulator's overlay.
    ///
    /// # Errors
    /// When there is no deploy directory.
    pub fn manifest_files(&self, sim: bool) -> Result<Vec<PathBuf>> {
        let deploy = self.deploy()?;
        let mut files = vec![deploy.join("system.toml")];
        if sim {
            files.push(deploy.join("sim.toml"));
        }
        Ok(files)
    }

    /// The manifest, with `sim` as the simulator overlays it, checked.
    ///
    /// # Errors
    /// When a file is missing or wrong.
    pub fn manifest(&self, sim: bool) -> Result<(Manifest, PathBuf)> {
        let files = self.manifest_files(sim)?;
        let paths = files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>().join(":");
        Ok(runtime::load_manifest(&paths)?)
    }

    /// The run directory.
    ///
    /// # Errors
    /// When it must be derived from a manifest that cannot be read.
    pub fn run_dir(&self) -> Result<PathBuf> {
        if let Some(given) = &self.run_dir {
            return Ok(given.clone());
        }
        let (manifest, _) = self.manifest(false)?;
        Ok(supervisor::default_run_dir(&manifest.system.name))
    }

    /// The manifest of the system that runs in the run directory, as its supervisor read it.
    ///
    /// # Errors
    /// When none runs.
    pub fn running(&self) -> Result<(Manifest, PathBuf, runtime::shm::RunDir)> {
        let run_dir = self.run_dir()?;
        let mut client = supervisor::Client::connect(&run_dir)?;
        let answer = client.ask(&supervisor::protocol::Request::Ping)?;
        let supervisor::protocol::Response::Pong { manifests, run_dir, .. } = answer else {
            bail!("the supervisor answers something else than asked");
        };
        let (manifest, root) = runtime::load_manifest(&manifests.join(":"))?;
        // As the supervisor calls it: what is in shared memory is named after that, and links lead to the same place
        // under other names.
        Ok((manifest, root, runtime::shm::RunDir::new(run_dir)))
    }
}

/// A vehicle by its name in `vehicles/` or by its file, as the manifest names it.
///
/// # Errors
/// When there is neither.
pub fn vehicle_file(deploy: &Path, name: &str) -> Result<String> {
    let file = Path::new(name);
    if file.is_file() {
        return Ok(std::path::absolute(file)?.display().to_string());
    }
    let relative = format!("vehicles/{name}.toml");
    if deploy.join(&relative).is_file() {
        return Ok(relative);
    }
    let known = std::fs::read_dir(deploy.join("vehicles")).with_context(|| "no vehicles/ directory")?;
    let names: Vec<String> =
        known.flatten().filter_map(|entry| Some(entry.path().file_stem()?.to_str()?.to_owned())).collect();
    bail!("no vehicle {name}: known are {}, or give a file", names.join(", "));
}
