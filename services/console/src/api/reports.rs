//! Reports of rounds, of the drones of who asks.

use crate::gate::Asked;
use crate::refusal::{Refusal, json, raw_json};
use axum::body::Body;
use axum::http::{Response, StatusCode};

pub(super) async fn list(asked: Asked) -> Result<Response<Body>, Refusal> {
    let (account, _) = asked.account()?;
    let mut reports = asked.app.store.reports(asked.query.get("drone").cloned()).await?;
    reports.retain(|report| account.may_see(&report.drone));
    Ok(json(StatusCode::OK, &reports))
}

pub(super) async fn read(asked: Asked) -> Result<Response<Body>, Refusal> {
    let (account, _) = asked.account()?;
    let missing = || Refusal::missing("there is no such report");
    let id: i64 = asked.path.get("id").and_then(|id| id.parse().ok()).ok_or_else(missing)?;
    // The same answer whether there is none or it is another drone's.
    let (line, report) = asked.app.store.report(id).await?.ok_or_else(missing)?;
    if !account.may_see(&line.drone) {
        return Err(missing());
    }
    let mut value: serde_json::Value = serde_json::from_str(&report).unwrap_or_default();
    if let Some(fields) = value.as_object_mut() {
        fields.insert("id".to_owned(), line.id.into());
    }
    Ok(raw_json(StatusCode::OK, value.to_string()))
}
