//! Keeping the accounts, and reading the log.

use super::login::{end_sessions, hash};
use super::{email, language as language_of, plain};
use crate::gate::Asked;
use crate::refusal::{Refusal, json};
use crate::role::{EVERY_DRONE, is_drone_name};
use crate::store::{Kind, NewAccount};
use crate::{Account, Role};
use axum::body::Body;
use axum::http::{Response, StatusCode};
use serde::Deserialize;
use std::collections::BTreeSet;

/// Drones in one account's list.
const MOST_DRONES: usize = 256;
/// Lines of the log in one answer.
const MOST_LINES: u32 = 500;

fn drones_of(names: BTreeSet<String>) -> Result<BTreeSet<String>, Refusal> {
    if names.len() > MOST_DRONES || names.iter().any(|name| name != EVERY_DRONE && !is_drone_name(name)) {
        return Err(Refusal::bad(format!("drones: up to {MOST_DRONES} names of drones, or \"*\" for all")));
    }
    Ok(names)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Language {
    language: String,
}

/// The language of who asks.
pub(super) async fn language(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Language { language } = asked.json()?;
    let mut account = asked.account()?.0.clone();
    account.language = language_of(&language)?;
    asked.app.store.change_account(account.clone(), None).await?;
    asked.app.directory_mut().put(account);
    Ok(json(StatusCode::OK, &serde_json::json!({})))
}

/// All accounts.
pub(super) fn list(asked: &Asked) -> Response<Body> {
    let accounts: Vec<Account> = asked.app.directory().accounts().cloned().collect();
    json(StatusCode::OK, &accounts)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct New {
    name: String,
    surname: String,
    email: String,
    password: String,
    role: Role,
    #[serde(default)]
    drones: BTreeSet<String>,
    #[serde(default)]
    language: Option<String>,
}

/// A new account.
pub(super) async fn add(asked: Asked) -> Result<Response<Body>, Refusal> {
    let new: New = asked.json()?;
    let app = &asked.app;
    let account = Account {
        id: 0,
        name: plain("name", &new.name)?,
        surname: plain("surname", &new.surname)?,
        email: email(&new.email)?,
        role: new.role,
        language: language_of(new.language.as_deref().unwrap_or("es"))?,
        drones: drones_of(new.drones)?,
        disabled: false,
    };
    let password = hash(app, new.password).await?;
    let account = app.store.add_account(NewAccount { account, password }, app.clock.now_ms()).await?;
    app.directory_mut().put(account.clone());
    let mut entry = app.entry(Kind::Accounts, &asked.account()?.0, asked.address);
    entry.verb = "add".to_owned();
    entry.answer = format!("{} as {}", account.email, account.role.word());
    app.store.log(entry).await?;
    Ok(json(StatusCode::CREATED, &account))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    name: Option<String>,
    surname: Option<String>,
    role: Option<Role>,
    drones: Option<BTreeSet<String>>,
    disabled: Option<bool>,
    password: Option<String>,
    language: Option<String>,
}

/// Changes an account. What it may no longer do ends at once, on open sockets too.
pub(super) async fn change(asked: Asked) -> Result<Response<Body>, Refusal> {
    let change: Change = asked.json()?;
    let app = &asked.app;
    let id: Option<i64> = asked.path.get("id").and_then(|id| id.parse().ok());
    let old = id.and_then(|id| app.directory().account(id).cloned());
    let old = old.ok_or_else(|| Refusal::missing("there is no such account"))?;
    let mut account = old.clone();
    if let Some(name) = change.name {
        account.name = plain("name", &name)?;
    }
    if let Some(surname) = change.surname {
        account.surname = plain("surname", &surname)?;
    }
    if let Some(language) = change.language {
        account.language = language_of(&language)?;
    }
    if let Some(drones) = change.drones {
        account.drones = drones_of(drones)?;
    }
    account.role = change.role.unwrap_or(account.role);
    account.disabled = change.disabled.unwrap_or(account.disabled);
    let leaves = account.disabled || account.role != Role::Administrator;
    if leaves && app.directory().is_last_administrator(account.id) {
        return Err(Refusal::new(StatusCode::CONFLICT, "somebody must remain who keeps the accounts"));
    }
    let password = match change.password {
        Some(password) => Some(hash(app, password).await?),
        None => None,
    };
    let said = said(&old, &account, password.is_some());
    let anew = password.is_some() || account.disabled;
    app.store.change_account(account.clone(), password).await?;
    app.directory_mut().put(account.clone());
    app.announce();
    if anew {
        let (_, own) = asked.account()?;
        end_sessions(app, account.id, Some(own)).await?;
    }
    let mut entry = app.entry(Kind::Accounts, &asked.account()?.0, asked.address);
    entry.verb = "change".to_owned();
    entry.answer = said;
    app.store.log(entry).await?;
    Ok(json(StatusCode::OK, &account))
}

/// What of an account has changed, for the log.
fn said(old: &Account, new: &Account, password: bool) -> String {
    let mut said = vec![new.email.clone()];
    if old.role != new.role {
        said.push(format!("role {}", new.role.word()));
    }
    if old.drones != new.drones {
        said.push(format!("drones {}", new.drones.iter().cloned().collect::<Vec<_>>().join(" ")));
    }
    if old.disabled != new.disabled {
        said.push(if new.disabled { "disabled" } else { "enabled" }.to_owned());
    }
    if password {
        said.push("new password".to_owned());
    }
    if (&old.name, &old.surname) != (&new.name, &new.surname) {
        said.push("new name".to_owned());
    }
    said.join(", ")
}

/// The log, the newest first.
pub(super) async fn log(asked: Asked) -> Result<Response<Body>, Refusal> {
    fn number<T: std::str::FromStr>(asked: &Asked, key: &str, default: T) -> Result<T, Refusal> {
        asked.query.get(key).map_or(Ok(default), |text| {
            text.parse().map_err(|_| Refusal::bad(format!("{key} = {text:?} is no number")))
        })
    }
    let before = number(&asked, "before", i64::MAX)?;
    let limit = number(&asked, "limit", 100_u32)?;
    if !(1..=MOST_LINES).contains(&limit) {
        return Err(Refusal::bad(format!("limit = {limit} is out of range: allowed is 1..={MOST_LINES}")));
    }
    Ok(json(StatusCode::OK, &asked.app.store.read_log(before, limit).await?))
}
