//! Drafts: pictures that were sent in, and the plans made of them. Kept in the data folder, a few for each drone.

use super::picture::Grey;
use super::{disk, files};
use crate::app::random;
use crate::refusal::Refusal;
use crate::secret::hexadecimal;
use axum::body::Bytes;
use axum::http::StatusCode;
use floorplan::{Drawing, Pad, Plan, Reading, Rooms, Sidecar, picture_of_plan, plan_of_drawing};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Drafts that are kept for a drone; the oldest go.
const MOST_DRAFTS: usize = 4;
/// The largest of the files, a picture of 40 million grey pixels that does not compress.
const MOST_BYTES: u64 = 48 * 1024 * 1024;

/// What the page needs to know of a draft.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Draft {
    pub(crate) id: String,
    /// Of the picture, pixels.
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) made_ms: u64,
}

/// The plan that was made of a draft.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Made {
    pub(crate) reading: Reading,
    pub(crate) building: Sidecar,
    /// Of the plan, cells.
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) resolution_m: f32,
    pub(crate) origin_x_m: f32,
    pub(crate) origin_y_m: f32,
    /// Floor that can be flown over, square metres.
    pub(crate) free_m2: f32,
}

/// All drafts of all drones.
#[derive(Clone, Debug)]
pub(crate) struct Drafts {
    folder: PathBuf,
    /// Pictures that come in at the same time.
    uploads: Arc<Semaphore>,
    /// And are worked on: each may take a few hundred megabytes for a moment.
    work: Arc<Semaphore>,
}

impl Drafts {
    pub(crate) fn new(data: &Path) -> Self {
        Self {
            folder: data.join("drafts"),
            uploads: Arc::new(Semaphore::new(1)),
            work: Arc::new(Semaphore::new(1)),
        }
    }

    /// Leave to send a picture.
    pub(crate) fn upload(&self) -> Result<OwnedSemaphorePermit, Refusal> {
        self.uploads.clone().try_acquire_owned().map_err(|_| Refusal {
            retry_s: Some(5),
            ..Refusal::new(
                StatusCode::SERVICE_UNAVAILABLE,
                "another picture is being taken in: try again in a moment",
            )
        })
    }

    async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Self) -> Result<T, Refusal> + Send + 'static,
    ) -> Result<T, Refusal> {
        let gone = || Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "the console is stopping");
        let turn = self.work.clone().acquire_owned().await.map_err(|_| gone())?;
        let drafts = self.clone();
        // The turn goes with the work: whoever asked may hang up, and the work goes on to its end.
        let work = move || {
            let _turn = turn;
            work(&drafts)
        };
        tokio::task::spawn_blocking(work).await.map_err(|error| {
            tracing::error!("a draft: {error}");
            gone()
        })?
    }

    fn of(&self, drone: &str) -> PathBuf {
        // Not the name alone: `..` may be one.
        self.folder.join(format!("of-{drone}"))
    }

    fn place(&self, drone: &str, id: &str) -> Result<PathBuf, Refusal> {
        let missing = || Refusal::missing("there is no such draft");
        if id.len() != 16 || !id.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(missing());
        }
        let place = self.of(drone).join(id);
        if place.is_dir() { Ok(place) } else { Err(missing()) }
    }

    fn read<T: serde::de::DeserializeOwned>(place: &Path, name: &str) -> Option<T> {
        serde_json::from_slice(&files::read(&place.join(name), MOST_BYTES).ok()?).ok()
    }

    fn kept(&self, drone: &str) -> Vec<Draft> {
        let Ok(entries) = std::fs::read_dir(self.of(drone)) else { return Vec::new() };
        let mut kept: Vec<Draft> =
            entries.flatten().filter_map(|entry| Self::read(&entry.path(), "draft.json")).collect();
        kept.sort_by(|a, b| (b.made_ms, &b.id).cmp(&(a.made_ms, &a.id)));
        kept
    }

    /// Those of a drone, the newest first.
    pub(crate) async fn list(&self, drone: &str) -> Result<Vec<Draft>, Refusal> {
        let drone = drone.to_owned();
        self.run(move |drafts| Ok(drafts.kept(&drone))).await
    }

    /// Takes in a picture.
    pub(crate) async fn add(&self, drone: &str, bytes: Bytes, made_ms: u64) -> Result<Draft, Refusal> {
        let drone = drone.to_owned();
        self.run(move |drafts| {
            let grey = Grey::read(&bytes)?;
            drop(bytes);
            let id = hexadecimal(&random::<8>()?);
            let draft = Draft { id, width: grey.width, height: grey.height, made_ms };
            let place = drafts.of(&drone).join(&draft.id);
            if let Err(refusal) = keep(&place, &grey, &draft) {
                // Half a draft is none, and nobody would find it again.
                let _ = std::fs::remove_dir_all(&place);
                return Err(refusal);
            }
            for old in drafts.kept(&drone).into_iter().skip(MOST_DRAFTS) {
                let place = drafts.of(&drone).join(&old.id);
                std::fs::remove_dir_all(place).map_err(|error| disk(&error))?;
            }
            Ok(draft)
        })
        .await
    }

    /// A draft and the plan that was made of it, if one was.
    pub(crate) async fn get(&self, drone: &str, id: &str) -> Result<(Draft, Option<Made>), Refusal> {
        let (drone, id) = (drone.to_owned(), id.to_owned());
        self.run(move |drafts| {
            let place = drafts.place(&drone, &id)?;
            let draft =
                Self::read(&place, "draft.json").ok_or_else(|| Refusal::missing("there is no such draft"))?;
            Ok((draft, Self::read(&place, "plan.json")))
        })
        .await
    }

    async fn file(&self, drone: &str, id: &str, name: &'static str) -> Result<Vec<u8>, Refusal> {
        let (drone, id) = (drone.to_owned(), id.to_owned());
        self.run(move |drafts| {
            files::read(&drafts.place(&drone, &id)?.join(name), MOST_BYTES)
                .map_err(|_| Refusal::missing("this draft has no plan yet"))
        })
        .await
    }

    /// The copy for the page, PNG.
    pub(crate) async fn preview(&self, drone: &str, id: &str) -> Result<Vec<u8>, Refusal> {
        self.file(drone, id, "preview.png").await
    }

    /// The plan, PNG.
    pub(crate) async fn plan(&self, drone: &str, id: &str) -> Result<Vec<u8>, Refusal> {
        self.file(drone, id, "plan.png").await
    }

    /// Makes the plan of a draft, in place of one that was made before.
    pub(crate) async fn make(
        &self,
        drone: &str,
        id: &str,
        reading: Reading,
        building: Sidecar,
        radius_m: f32,
    ) -> Result<Made, Refusal> {
        let (drone, id) = (drone.to_owned(), id.to_owned());
        self.run(move |drafts| {
            let place = drafts.place(&drone, &id)?;
            let pad = building.pad.ok_or_else(|| {
                Refusal::bad("building: `pad` is missing: where the drone starts and lands")
            })?;
            let bytes = files::read(&place.join("picture.png"), MOST_BYTES).map_err(|error| disk(&error))?;
            let plan = drawn(&Grey::read(&bytes)?, &reading, &pad, radius_m)?;
            // A room without a floor is told now, not by the drone.
            Rooms::of("building", &building, &plan)?;
            let made = Made {
                reading,
                building,
                width: plan.width(),
                height: plan.height(),
                resolution_m: plan.resolution(),
                origin_x_m: plan.origin().0,
                origin_y_m: plan.origin().1,
                free_m2: plan.free_area(),
            };
            files::write(&place.join("plan.png"), &picture_of_plan(&plan)?).map_err(|error| disk(&error))?;
            files::write(&place.join("plan.json"), &to_json(&made)?).map_err(|error| disk(&error))?;
            Ok(made)
        })
        .await
    }
}

fn keep(place: &Path, grey: &Grey, draft: &Draft) -> Result<(), Refusal> {
    files::folder(place).map_err(|error| disk(&error))?;
    let write =
        |name: &str, bytes: &[u8]| files::write(&place.join(name), bytes).map_err(|error| disk(&error));
    write("picture.png", &grey.png()?)?;
    write("preview.png", &grey.preview().png()?)?;
    write("draft.json", &to_json(draft)?)
}

fn drawn(grey: &Grey, reading: &Reading, pad: &Pad, radius_m: f32) -> Result<Plan, Refusal> {
    let drawing = Drawing::new(grey.width, grey.height, &grey.shades)?;
    Ok(plan_of_drawing(&drawing, reading, pad, radius_m)?)
}

fn to_json(value: &impl Serialize) -> Result<Vec<u8>, Refusal> {
    serde_json::to_vec(value).map_err(|error| Refusal::bad(format!("this cannot be kept: {error}")))
}
