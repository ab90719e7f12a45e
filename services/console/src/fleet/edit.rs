//! Edits of the building: a query that carries the plan's side file, and the plan itself when it is another one.

use super::{Answer, Drone, Fleet};
use crate::app::random;
use crate::role::Role;
use crate::secret::hexadecimal;
use axum::body::Bytes;
use floorplan::Sidecar;
use serde::Serialize;
use std::time::Duration;

/// A drone checks, writes and answers within this time.
const PATIENCE: Duration = Duration::from_secs(20);
/// Largest edit without its picture, and the picture.
const MOST_BYTES: usize = 256 * 1024;
const MOST_PICTURE: usize = 1024 * 1024;

/// Where another plan lies.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct PlanPlace {
    pub(crate) resolution_m: f32,
    pub(crate) origin_x_m: f32,
    pub(crate) origin_y_m: f32,
}

/// What is to be, and of which building it was made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change<'a> {
    /// The side file as it is to be.
    pub(crate) building: &'a Sidecar,
    /// `revision` of what the drone said of itself when the change was begun.
    pub(crate) made_from: &'a str,
}

#[derive(Serialize)]
struct Payload<'a> {
    id: String,
    beacon_ns: u64,
    account: &'a str,
    role: &'a str,
    made_from: &'a str,
    building: &'a Sidecar,
    plan: Option<PlanPlace>,
}

impl Fleet {
    /// Gives an edit once and waits for its answer; `plan` is another plan and its picture, PNG.
    pub(crate) async fn edit(
        &self,
        drone: &Drone,
        change: Change<'_>,
        plan: Option<(PlanPlace, Bytes)>,
        account: &str,
        role: Role,
    ) -> Answer {
        let Some(beacon_ns) = drone.fresh_beacon().await else {
            return Answer::refused("the drone is not reached");
        };
        let Ok(id) = random::<8>() else { return Answer::refused("the system has no random numbers") };
        let payload = Payload {
            id: hexadecimal(&id),
            beacon_ns,
            account,
            role: role.word(),
            made_from: change.made_from,
            building: change.building,
            plan: plan.as_ref().map(|(place, _)| *place),
        };
        let payload = match serde_json::to_vec(&payload) {
            Ok(payload) if payload.len() <= MOST_BYTES => payload,
            Ok(payload) => {
                return Answer::refused(format!(
                    "the building takes {} bytes, allowed is up to {MOST_BYTES}: fewer corners make it smaller",
                    payload.len()
                ));
            }
            Err(error) => return Answer::refused(format!("the edit cannot be written: {error}")),
        };
        let mut query = self
            .session
            .get(format!("sereno/{}/edit/{}", drone.name, self.certificate))
            .payload(payload)
            .encoding("application/json")
            .timeout(PATIENCE);
        if let Some((_, picture)) = plan {
            if picture.len() > MOST_PICTURE {
                return Answer::refused(format!(
                    "the plan's picture takes {} bytes, allowed is up to {MOST_PICTURE}",
                    picture.len()
                ));
            }
            query = query.attachment(Vec::from(picture));
        }
        match query.await {
            Ok(replies) => super::order::answer_of(&replies, PATIENCE).await,
            Err(error) => Answer::refused(format!("the edit cannot be sent: {error}")),
        }
    }
}
