//! What is known of the drones beside what flows.

use crate::fleet::Drone;
use crate::gate::Asked;
use crate::page::file;
use crate::refusal::{Refusal, json, raw_json};
use crate::store::{Incident, Kind};
use axum::body::Body;
use axum::http::{HeaderName, HeaderValue, Response, StatusCode, header};
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

pub(super) fn drone(asked: &Asked) -> Result<Arc<Drone>, Refusal> {
    asked.app.fleet.drone(&asked.drone).ok_or_else(|| never(&asked.drone))
}

pub(super) fn never(drone: &str) -> Refusal {
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

/// How old a still is, milliseconds on the drone's clock; absent while that is not known.
const AGE: HeaderName = HeaderName::from_static("x-sereno-age-ms");

/// The newest still picture of its camera, which makes one a second while it is asked for.
pub(super) async fn still(asked: Asked) -> Result<Response<Body>, Refusal> {
    let drone = drone(&asked)?;
    let absent = |why: &str| Refusal {
        retry_s: Some(1),
        ..Refusal::new(StatusCode::SERVICE_UNAVAILABLE, format!("{} {why}", asked.drone))
    };
    if !drone.is_alive() {
        return Err(absent("is not reached"));
    }
    let picture = asked.app.fleet.still(&drone).await.ok_or_else(|| absent("sends no picture"))?;
    let mut response = Response::new(Body::from(picture.jpeg));
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("image/jpeg"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    if let Some(age) = drone.age(picture.capture_ns) {
        headers.insert(AGE, HeaderValue::from(u64::try_from(age.as_millis()).unwrap_or(u64::MAX)));
    }
    Ok(response)
}

/// Bytes in a text about an incident.
const TEXT_BYTES: usize = 2000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Mark {
    text: String,
    /// Whether the last seconds and what follows are to be kept with it.
    #[serde(default = "yes")]
    keep: bool,
}

fn yes() -> bool {
    true
}

/// Marks an incident where the drone is now.
pub(super) async fn mark(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Mark { text, keep } = asked.json()?;
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
    let mut answer = serde_json::json!(incident);
    if let (Some(recorder), true, Some(fields)) = (asked.app.fleet.recorder(), keep, answer.as_object_mut()) {
        // The incident is kept whether its pictures are or not.
        let kept = recorder.mark(&drone.name, &account.email, incident.id).await;
        fields.insert("pictures".to_owned(), kept.is_ok().into());
        fields.insert("trouble".to_owned(), kept.err().unwrap_or_default().into());
    }
    Ok(json(StatusCode::CREATED, &answer))
}

/// The newest incidents.
pub(super) async fn incidents(asked: Asked) -> Result<Response<Body>, Refusal> {
    Ok(json(StatusCode::OK, &asked.app.store.incidents(asked.drone.clone()).await?))
}
