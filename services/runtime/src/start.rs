//! What a service is given when it starts.

use crate::{StartError, fnv};
use floorplan::{Pad, Plan, Sidecar};
use manifest::{System, Vehicle};
use std::any::Any;
use std::cell::Cell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Heavy read-only things shared between the flights of one rehearsal: the plan, its range tables.
#[derive(Clone, Default)]
pub struct Cache(Arc<Mutex<HashMap<String, Arc<dyn Any + Send + Sync>>>>);

impl std::fmt::Debug for Cache {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Cache")
    }
}

impl Cache {
    /// The thing called `key`, built by `build` the first time. `build` may not ask the cache for anything: it would wait
    /// for itself.
    ///
    /// # Errors
    /// Whatever `build` reports; nothing is kept then.
    pub fn get_or_build<T, E>(&self, key: &str, build: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E>
    where
        T: Send + Sync + 'static,
    {
        let key = format!("{}:{key}", std::any::type_name::<T>());
        let mut map = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = map.get(&key).and_then(|any| Arc::clone(any).downcast::<T>().ok()) {
            return Ok(found);
        }
        let built = Arc::new(build()?);
        map.insert(key, Arc::clone(&built) as Arc<dyn Any + Send + Sync>);
        Ok(built)
    }
}

/// Everything that a service may know about the system when it starts.
#[derive(Debug)]
pub struct Start {
    /// Seed of this service: derived from the system's seed and the service's name.
    pub seed: u64,
    /// Which start of this service; 0 is the first.
    pub incarnation: u32,
    /// Whether the world is simulated: then no real device may be opened.
    pub simulated: bool,
    /// Name, plan, vehicle and world of the system.
    pub system: System,
    /// The vehicle, parsed and checked.
    pub vehicle: Vehicle,
    /// Directory that relative paths start from: where the manifest is.
    pub root: PathBuf,
    /// Shared between lockstep flights.
    pub cache: Cache,
    pub(crate) plan_hash: Cell<u64>,
}

impl Start {
    /// Puts a start together; `root` is the directory of the manifest.
    ///
    /// # Errors
    /// When the vehicle file is missing or wrong.
    pub fn new(
        system: System,
        root: &Path,
        seed: u64,
        incarnation: u32,
        simulated: bool,
        cache: Cache,
    ) -> Result<Self, StartError> {
        let path = resolve(root, &system.vehicle);
        let text = std::fs::read_to_string(&path)
            .map_err(|reason| StartError::Read { path: path.display().to_string(), reason })?;
        let vehicle = Vehicle::parse(&system.vehicle, &text).map_err(StartError::invalid)?;
        Ok(Self {
            seed,
            incarnation,
            simulated,
            system,
            vehicle,
            root: root.to_owned(),
            cache,
            plan_hash: Cell::new(0),
        })
    }

    /// A file; relative paths start at the manifest's directory. Only to be called at start.
    ///
    /// # Errors
    /// [`StartError::Read`] naming the file.
    pub fn read(&self, path: &str) -> Result<Vec<u8>, StartError> {
        let path = resolve(&self.root, path);
        std::fs::read(&path).map_err(|reason| StartError::Read { path: path.display().to_string(), reason })
    }

    /// Whether a file is there.
    #[must_use]
    pub fn exists(&self, path: &str) -> bool {
        resolve(&self.root, path).is_file()
    }

    /// The plan of the system, loaded once.
    ///
    /// # Errors
    /// When its files are missing or it is no plan.
    pub fn plan(&self) -> Result<Arc<Plan>, StartError> {
        let name = &self.system.plan;
        let plan = self.cache.get_or_build(name, || {
            let header =
                floorplan::PlanHeader::parse(name, &self.read(name)?).map_err(StartError::invalid)?;
            let image = Path::new(name).parent().unwrap_or(Path::new("")).join(&header.image);
            let image = self.read(&image.to_string_lossy())?;
            Plan::load(name, &header, &image).map_err(StartError::invalid)
        })?;
        self.plan_hash.set(plan.hash());
        Ok(plan)
    }

    /// Name of the plan's side file, which names pad, rooms and doors: `demo.yaml` has `demo.rooms.yaml`.
    #[must_use]
    pub fn sidecar_name(&self) -> String {
        let plan = &self.system.plan;
        let stem = plan.strip_suffix(".yaml").or_else(|| plan.strip_suffix(".yml")).unwrap_or(plan);
        format!("{stem}.rooms.yaml")
    }

    /// The plan's side file; nothing is named without one.
    ///
    /// # Errors
    /// When it is there and wrong.
    pub fn sidecar(&self) -> Result<Sidecar, StartError> {
        let name = self.sidecar_name();
        if !self.exists(&name) {
            return Ok(Sidecar::default());
        }
        Sidecar::parse(&name, &self.read(&name)?).map_err(StartError::invalid)
    }

    /// Where the drone starts and lands: what the manifest says before what the plan's side file says; `None` when
    /// neither says it. Simulator, localization and navigation all ask here, so that they cannot differ.
    ///
    /// # Errors
    /// When the side file is there and wrong.
    pub fn pad(&self) -> Result<Option<Pad>, StartError> {
        if let Some([x, y, heading_deg]) = self.system.pad {
            return Ok(Some(Pad { x, y, heading_deg }));
        }
        Ok(self.sidecar()?.pad)
    }

    /// Something heavy and read-only, built once and shared between the flights of a rehearsal.
    ///
    /// # Errors
    /// Whatever `build` reports.
    pub fn shared<T: Send + Sync + 'static>(
        &self,
        key: &str,
        build: impl FnOnce() -> Result<T, StartError>,
    ) -> Result<Arc<T>, StartError> {
        self.cache.get_or_build(key, build)
    }

    /// Seed of the service called `name` in a system with seed `system_seed`.
    #[must_use]
    pub fn service_seed(system_seed: u64, name: &str) -> u64 {
        crate::mix_seed(system_seed, fnv(name.as_bytes()))
    }
}

fn resolve(root: &Path, path: &str) -> PathBuf {
    let path = Path::new(path);
    if path.is_absolute() { path.to_owned() } else { root.join(path) }
}
