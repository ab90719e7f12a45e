//! Rehearsals: rounds that the simulator flies over a plan before the drone does, one rehearsal at a time.

use super::runner::{Child, Flight, fly};
use super::{disk, files};
use crate::app::random;
use crate::config::RehearsalConfig;
use crate::refusal::Refusal;
use crate::secret::hexadecimal;
use axum::http::StatusCode;
use serde::Serialize;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Flights of a rehearsal at most.
const MOST_FLIGHTS: u32 = 5;
/// Rehearsals that are remembered.
const REMEMBERED: usize = 8;

/// What is flown over: the plan and what the drone flies with.
#[derive(Debug)]
pub(crate) struct Material {
    /// PNG.
    pub(crate) plan: Vec<u8>,
    pub(crate) resolution_m: f64,
    pub(crate) origin_m: [f64; 2],
    /// The plan's side file; JSON is yaml.
    pub(crate) building: String,
    pub(crate) vehicle: String,
}

/// How far a rehearsal is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum State {
    Running,
    Done,
    Failed,
}

/// A rehearsal, as the page is told of it.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Rehearsal {
    pub(crate) id: String,
    #[serde(skip)]
    drone: String,
    /// Whose plan it is; `None` for the plan in use.
    draft: Option<String>,
    state: State,
    /// Why it failed.
    text: String,
    flights: u32,
    flown: Vec<Flight>,
}

#[derive(Debug, Default)]
struct Memory {
    ended: bool,
    kept: VecDeque<Rehearsal>,
    child: Option<Arc<Child>>,
}

/// All rehearsals of this console.
#[derive(Clone, Debug)]
pub(crate) struct Rehearsals {
    program: PathBuf,
    deploy: Option<PathBuf>,
    folder: PathBuf,
    memory: Arc<Mutex<Memory>>,
}

impl Rehearsals {
    pub(crate) fn new(config: &RehearsalConfig, data: &Path) -> Self {
        let beside = || std::env::current_exe().unwrap_or_default().with_file_name("sereno");
        Self {
            program: config.program.clone().unwrap_or_else(beside),
            deploy: config.deploy.clone(),
            folder: data.join("rehearsal"),
            memory: Arc::default(),
        }
    }

    fn memory(&self) -> MutexGuard<'_, Memory> {
        // Each change under this lock is whole after each statement.
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why nothing can be rehearsed here; `None` when it can.
    pub(crate) fn trouble(&self) -> Option<String> {
        (!self.program.is_file()).then(|| {
            format!(
                "this console cannot rehearse: there is no program {}; [rehearsal] program in console.toml says where it is",
                self.program.display()
            )
        })
    }

    /// Those of a drone, the newest first.
    pub(crate) fn list(&self, drone: &str) -> Vec<Rehearsal> {
        self.memory().kept.iter().rev().filter(|one| one.drone == drone).cloned().collect()
    }

    /// One of a drone.
    pub(crate) fn get(&self, drone: &str, id: &str) -> Option<Rehearsal> {
        self.memory().kept.iter().find(|one| one.drone == drone && one.id == id).cloned()
    }

    /// Begins one; flight k of it is drawn from seed k, so that the same plan is always rehearsed the same.
    pub(crate) fn begin(
        &self,
        drone: &str,
        draft: Option<String>,
        flights: u32,
        material: &Material,
    ) -> Result<Rehearsal, Refusal> {
        if !(1..=MOST_FLIGHTS).contains(&flights) {
            return Err(Refusal::bad(format!("`flights` is {flights}, allowed is 1 to {MOST_FLIGHTS}")));
        }
        if let Some(trouble) = self.trouble() {
            return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, trouble));
        }
        let rehearsal = Rehearsal {
            id: hexadecimal(&random::<8>()?),
            drone: drone.to_owned(),
            draft,
            state: State::Running,
            text: String::new(),
            flights,
            flown: Vec::new(),
        };
        let busy = |sentence| Refusal {
            retry_s: Some(10),
            ..Refusal::new(StatusCode::SERVICE_UNAVAILABLE, sentence)
        };
        {
            let mut memory = self.memory();
            if memory.ended {
                return Err(busy("the console is stopping"));
            }
            if memory.kept.iter().any(|one| one.state == State::Running) {
                return Err(busy("another rehearsal is being flown: wait until it has ended"));
            }
            if memory.kept.len() >= REMEMBERED {
                memory.kept.pop_front();
            }
            memory.kept.push_back(rehearsal.clone());
        }
        let failed = |error: &std::io::Error| {
            self.end_one(&rehearsal.id, State::Failed, error.to_string());
            disk(error)
        };
        let plan = self.write(material).map_err(|error| failed(&error))?;
        let (own, id, vehicle) = (self.clone(), rehearsal.id.clone(), material.vehicle.clone());
        std::thread::Builder::new()
            .name("rehearsal".to_owned())
            .spawn(move || own.run(&id, &plan, &vehicle, flights))
            .map_err(|error| failed(&error))?;
        Ok(rehearsal)
    }

    /// Puts the plan where the program reads it; only one rehearsal at a time does.
    fn write(&self, material: &Material) -> std::io::Result<PathBuf> {
        if self.folder.exists() {
            std::fs::remove_dir_all(&self.folder)?;
        }
        files::folder(&self.folder)?;
        let plan = self.folder.join("plan.yaml");
        let [x, y] = material.origin_m;
        let header = format!(
            "image: plan.png\nresolution: {}\norigin: [{x}, {y}, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
            material.resolution_m
        );
        files::write(&self.folder.join("plan.png"), &material.plan)?;
        files::write(&plan, header.as_bytes())?;
        files::write(&self.folder.join("plan.rooms.yaml"), material.building.as_bytes())?;
        Ok(plan)
    }

    fn run(&self, id: &str, plan: &Path, vehicle: &str, flights: u32) {
        for seed in 1..=flights {
            let began = {
                let mut memory = self.memory();
                if memory.ended {
                    return;
                }
                let child = Child::start(&self.program, self.deploy.as_deref(), plan, vehicle, seed);
                child.map(Arc::new).inspect(|child| memory.child = Some(child.clone()))
            };
            let flown = began.and_then(|child| fly(&child));
            self.memory().child = None;
            match flown {
                Ok(flight) => {
                    let mut memory = self.memory();
                    if let Some(one) = memory.kept.iter_mut().find(|one| one.id == id) {
                        one.flown.push(flight);
                    }
                }
                Err(sentence) => {
                    self.end_one(id, State::Failed, sentence);
                    return;
                }
            }
        }
        self.end_one(id, State::Done, String::new());
    }

    fn end_one(&self, id: &str, state: State, text: String) {
        if let Some(one) = self.memory().kept.iter_mut().find(|one| one.id == id) {
            (one.state, one.text) = (state, text);
        }
    }

    /// Ends what is being flown; nothing begins any more.
    pub(crate) fn end(&self) {
        let child = {
            let mut memory = self.memory();
            memory.ended = true;
            memory.child.take()
        };
        if let Some(child) = child {
            child.kill();
        }
    }
}
