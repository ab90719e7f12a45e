//! The building: its side file as the drone has it, and plans that are made of pictures.

use super::drones::{drone, never};
use crate::fleet::{Answer, Change, PlanPlace};
use crate::gate::Asked;
use crate::page::file;
use crate::plans::Made;
use crate::refusal::{Refusal, json};
use crate::store::Kind;
use axum::body::{Body, Bytes};
use axum::http::{Response, StatusCode};
use floorplan::{Reading, Sidecar};
use serde::Deserialize;
use serde_json::Value;

/// The airframe of a drone that has not said how large it is, metres.
const USUAL_RADIUS_M: f64 = 0.25;

/// A building that the page sends, checked: the sentence comes at once then.
pub(super) fn checked(building: Sidecar) -> Result<Sidecar, Refusal> {
    Ok(building.checked("building")?)
}

/// What the drone last said of itself.
pub(super) async fn about(asked: &Asked) -> Result<Value, Refusal> {
    let about = asked.app.fleet.about(&*drone(asked)?).await.ok_or_else(|| never(&asked.drone))?;
    Ok(serde_json::from_str(&about).unwrap_or_default())
}

fn id(asked: &Asked) -> &str {
    asked.path.get("id").map_or("", String::as_str)
}

/// Gives an edit to the drone, and keeps that and its answer in the log.
async fn give(
    asked: &Asked,
    change: Change<'_>,
    plan: Option<(PlanPlace, Bytes)>,
) -> Result<Response<Body>, Refusal> {
    let (account, _) = asked.account()?;
    let verb = if plan.is_some() { "new plan" } else { "edit" };
    let Answer { accepted, text } =
        asked.app.fleet.edit(&*drone(asked)?, change, plan, &account.email, account.role).await;
    let mut entry = asked.app.entry(Kind::Plan, account, asked.address);
    entry.drone.clone_from(&asked.drone);
    verb.clone_into(&mut entry.verb);
    entry.answer = format!("{}: {text}", if accepted { "accepted" } else { "refused" });
    asked.app.store.log(entry).await?;
    Ok(json(StatusCode::OK, &serde_json::json!({ "accepted": accepted, "text": text })))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Edit {
    building: Sidecar,
    made_from: String,
}

/// `revision` as a drone says it of itself.
fn revision(made_from: &str) -> Result<&str, Refusal> {
    if made_from.len() == 16 && made_from.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Ok(made_from);
    }
    Err(Refusal::bad("`made_from` must be the 16 hexadecimal digits of `revision` in about"))
}

/// Round, points, zones, rooms, doors and pad of the plan in use.
pub(super) async fn edit(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Edit { building, made_from } = asked.json()?;
    let building = checked(building)?;
    give(&asked, Change { building: &building, made_from: revision(&made_from)? }, None).await
}

/// The drafts of a drone.
pub(super) async fn list(asked: Asked) -> Result<Response<Body>, Refusal> {
    Ok(json(StatusCode::OK, &asked.app.drafts.list(&asked.drone).await?))
}

/// Takes in a picture: the body is its bytes.
pub(super) async fn add(asked: Asked) -> Result<Response<Body>, Refusal> {
    // Only drones that were heard of have drafts: their number is bounded.
    drone(&asked)?;
    let now_ms = asked.app.clock.now_ms();
    let draft = asked.app.drafts.add(&asked.drone, asked.body.clone(), now_ms).await?;
    Ok(json(StatusCode::CREATED, &draft))
}

/// A draft, and how its plan was made.
pub(super) async fn read(asked: Asked) -> Result<Response<Body>, Refusal> {
    let (draft, made) = asked.app.drafts.get(&asked.drone, id(&asked)).await?;
    Ok(json(StatusCode::OK, &serde_json::json!({ "draft": draft, "plan": made })))
}

/// The smaller copy of a draft's picture.
pub(super) async fn picture(asked: Asked) -> Result<Response<Body>, Refusal> {
    let picture = asked.app.drafts.preview(&asked.drone, id(&asked)).await?;
    Ok(file(picture.into(), "image/png", &asked.headers))
}

/// The plan of a draft.
pub(super) async fn plan(asked: Asked) -> Result<Response<Body>, Refusal> {
    let plan = asked.app.drafts.plan(&asked.drone, id(&asked)).await?;
    Ok(file(plan.into(), "image/png", &asked.headers))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Making {
    metres_per_pixel: f64,
    #[serde(default)]
    origin: [f64; 2],
    dark_below: u8,
    #[serde(default)]
    walls: Vec<[f64; 4]>,
    #[serde(default)]
    wiped: Vec<[f64; 4]>,
    building: Sidecar,
}

/// Makes the plan of a draft.
pub(super) async fn make(asked: Asked) -> Result<Response<Body>, Refusal> {
    // Whether there is such a draft comes first.
    asked.app.drafts.get(&asked.drone, id(&asked)).await?;
    let Making { metres_per_pixel, origin, dark_below, walls, wiped, building } = asked.json()?;
    let building = checked(building)?;
    let reading = Reading { metres_per_pixel, origin, dark_below, walls, wiped };
    let radius_m = about(&asked).await?["vehicle"]["radius_m"].as_f64().unwrap_or(USUAL_RADIUS_M);
    let made: Made =
        asked.app.drafts.make(&asked.drone, id(&asked), reading, building, radius_m as f32).await?;
    Ok(json(StatusCode::OK, &made))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Install {
    made_from: String,
}

/// Gives the plan of a draft to the drone.
pub(super) async fn install(asked: Asked) -> Result<Response<Body>, Refusal> {
    let (_, made) = asked.app.drafts.get(&asked.drone, id(&asked)).await?;
    let made = made.ok_or_else(|| Refusal::bad("this draft has no plan yet"))?;
    let Install { made_from } = asked.json()?;
    let picture = asked.app.drafts.plan(&asked.drone, id(&asked)).await?;
    let place = PlanPlace {
        resolution_m: made.resolution_m,
        origin_x_m: made.origin_x_m,
        origin_y_m: made.origin_y_m,
    };
    let change = Change { building: &made.building, made_from: revision(&made_from)? };
    give(&asked, change, Some((place, Bytes::from(picture)))).await
}
