//! What is known of the drones beside what flows.

use crate::fleet::Drone;
use crate::gate::Asked;
use crate::page::file;
use crate::refusal::{Refusal, json, raw_json};
use crate::store::{Incident, Kind};
use axum::body::Body;
use axum::http::{Response, StatusCode};
use serde::Deserialize;
use std::borrow::Cow;
use std::sync::Arc;

/// The drones of who asks.
pub(super) fn list(asked: &Asked) -> Result<Response<Body>, Refusal> {
    let (account, _) = asked.account()?;
    let fleet = &asked.app.fleet;
    let drones: Vec<_> = fleet
        .names_for(account)
        .into_iter()
        .map(|name| {
            let drone = fleet.drone(&name);
            serde_json::json!({
                "name": name,
                "alive": drone.as_ref().is_some_and(|drone| drone.is_alive()),
                "simulated": drone.as_ref().and_then(|drone| drone.simulated()),
            })
        })
        .collect();
    Ok(json(StatusCode::OK, &drones))
}

fn drone(asked: &Asked) -> Result<Arc<Drone>, Refusal> {
    asked.app.fleet.drone(&asked.drone).ok_or_else(|| never(&asked.drone))
}

fn never(drone: &str) -> Refusal {
    Refusal::missing(format!("nothing has been heard of {drone} yet"))
}

/// What the drone says of itself; what it last said, when it is silent.
pub(super) async fn about(asked: Asked) -> Result<Response<Body>, Refusal> {
    let about = asked.app.fleet.about(&*drone(&asked)?).await;
    about.map(|about| raw_json(StatusCode::OK, about.as_bytes().to_vec())).ok_or_else(|| never(&asked.drone))
}

/// Its plan.
pub(super) async fn plan(asked: Asked) -> Result<Response<Body>, Refusal> {
    let plan = asked.app.fleet.plan(&*drone(&asked)?).await;
    let plan = plan.ok_or_else(|| never(&asked.drone))?;
    Ok(file(Cow::Owned(plan.to_vec()), "image/png", &asked.headers))
}

/// Bytes in a text about an incident.
const TEXT_BYTES: usize = 2000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Mark {
    text: String,
}

/// Marks an incident where the drone is now.
pub(super) async fn mark(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Mark { text } = asked.json()?;
    let text = text.trim().to_owned();
    if text.len() > TEXT_BYTES {
        return Err(Refusal::bad(format!("text: up to {TEXT_BYTES} bytes")));
    }
    let (account, _) = asked.account()?;
    let drone = drone(&asked)?;
    let place = drone.place();
    let mut incident = Incident {
        id: 0,
        time_ms: asked.app.clock.now_ms(),
        drone: asked.drone.clone(),
        account: account.email.clone(),
        text,
        x_m: place.map(|place| place.x_m),
        y_m: place.map(|place| place.y_m),
        heading_rad: place.map(|place| place.heading_rad),
        holder: drone.holder(),
    };
    incident.id = asked.app.store.keep_incident(incident.clone()).await?;
    let mut entry = asked.app.entry(Kind::Incident, account, asked.address);
    entry.drone.clone_from(&asked.drone);
    entry.answer.clone_from(&incident.text);
    asked.app.store.log(entry).await?;
    asked.app.fleet.incident(&drone, &incident);
    Ok(json(StatusCode::CREATED, &incident))
}

/// The newest incidents.
pub(super) async fn incidents(asked: Asked) -> Result<Response<Body>, Refusal> {
    Ok(json(StatusCode::OK, &asked.app.store.incidents(asked.drone.clone()).await?))
}
