//! Flights in the simulator over the plan in use, edited or not, or over a draft's plan.

use super::drones::drone;
use super::plans::{about, checked};
use crate::gate::Asked;
use crate::plans::Material;
use crate::refusal::{Refusal, json};
use crate::store::Kind;
use axum::body::Body;
use axum::http::{Response, StatusCode};
use floorplan::Sidecar;
use serde::Deserialize;
use serde_json::Value;

/// Those of a drone, and whether there can be more.
pub(super) fn list(asked: &Asked) -> Response<Body> {
    let rehearsals = &asked.app.rehearsals;
    let trouble = rehearsals.trouble();
    let value = serde_json::json!({
        "available": trouble.is_none(),
        "text": trouble.unwrap_or_default(),
        "rehearsals": rehearsals.list(&asked.drone),
    });
    json(StatusCode::OK, &value)
}

/// One of them.
pub(super) fn read(asked: &Asked) -> Result<Response<Body>, Refusal> {
    let id = asked.path.get("id").map_or("", String::as_str);
    let rehearsal = asked.app.rehearsals.get(&asked.drone, id);
    let rehearsal = rehearsal.ok_or_else(|| Refusal::missing("there is no such rehearsal"))?;
    Ok(json(StatusCode::OK, &rehearsal))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Wish {
    /// Absent or null: the plan in use.
    #[serde(default)]
    draft: Option<String>,
    /// Absent or null: as the drone, or the draft, has it.
    #[serde(default)]
    building: Option<Sidecar>,
    flights: u32,
}

/// Begins one.
pub(super) async fn begin(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Wish { draft, building, flights } = asked.json()?;
    let building = building.map(checked).transpose()?;
    let about = about(&asked).await?;
    let vehicle = about["vehicle"]["name"].as_str().unwrap_or_default();
    // It becomes a word on a command line and a file's name.
    if !vehicle.starts_with(|first: char| first.is_ascii_alphanumeric())
        || !vehicle.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_'))
    {
        return Err(Refusal::bad(format!("{} has not said what it flies with", asked.drone)));
    }
    let material = match &draft {
        Some(id) => drafted(&asked, id, building, vehicle).await?,
        None => in_use(&asked, &about, building, vehicle).await?,
    };
    let rehearsal = asked.app.rehearsals.begin(&asked.drone, draft, flights, &material)?;
    let (account, _) = asked.account()?;
    let mut entry = asked.app.entry(Kind::Plan, account, asked.address);
    entry.drone.clone_from(&asked.drone);
    "rehearse".clone_into(&mut entry.verb);
    asked.app.store.log(entry).await?;
    Ok(json(StatusCode::CREATED, &rehearsal))
}

fn written(building: &Sidecar) -> Result<String, Refusal> {
    serde_json::to_string(building)
        .map_err(|error| Refusal::bad(format!("the building cannot be written: {error}")))
}

async fn drafted(
    asked: &Asked,
    id: &str,
    building: Option<Sidecar>,
    vehicle: &str,
) -> Result<Material, Refusal> {
    let (_, made) = asked.app.drafts.get(&asked.drone, id).await?;
    let made = made.ok_or_else(|| Refusal::bad("this draft has no plan yet"))?;
    Ok(Material {
        plan: asked.app.drafts.plan(&asked.drone, id).await?,
        resolution_m: floorplan::DRAWN_CELL_M,
        origin_m: [f64::from(made.origin_x_m), f64::from(made.origin_y_m)],
        building: written(&building.unwrap_or(made.building))?,
        vehicle: vehicle.to_owned(),
    })
}

async fn in_use(
    asked: &Asked,
    about: &Value,
    building: Option<Sidecar>,
    vehicle: &str,
) -> Result<Material, Refusal> {
    let place = |field: &str| {
        about["plan"][field].as_f64().ok_or_else(|| {
            Refusal::bad(format!("{} has not said where its plan lies (`{field}`)", asked.drone))
        })
    };
    let building = match building {
        Some(building) => building,
        None => serde_json::from_value(about["building"].clone())
            .map_err(|_| Refusal::bad(format!("{} has not said what is in its building", asked.drone)))
            .and_then(checked)?,
    };
    let plan = asked.app.fleet.plan(&*drone(asked)?).await;
    let plan = plan.ok_or_else(|| Refusal::missing(format!("{} has sent no plan", asked.drone)))?;
    Ok(Material {
        plan: plan.to_vec(),
        resolution_m: place("resolution_m")?,
        origin_m: [place("origin_x_m")?, place("origin_y_m")?],
        building: written(&building)?,
        vehicle: vehicle.to_owned(),
    })
}
