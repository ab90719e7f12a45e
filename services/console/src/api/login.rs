//! Claiming, logging in and out.

use super::{email, plain};
use crate::app::{App, random};
use crate::gate::{Asked, COOKIE};
use crate::password::{self, PasswordError};
use crate::refusal::{Refusal, json};
use crate::role::EVERY_DRONE;
use crate::secret::{Digest, claim_digest, digest_of, hexadecimal};
use crate::store::{Entry, Kind, NewAccount};
use crate::{Account, Role, Session};
use axum::body::Body;
use axum::http::{HeaderValue, Response, StatusCode, header};
use serde::Deserialize;
use std::net::IpAddr;

/// Under this name the back-off counts claims: no e-mail address.
const CLAIMANT: &str = "claim";
/// One sentence for an unknown user, a wrong password and a disabled account.
const WRONG: &str = "e-mail address or password are wrong";

/// The state of the session, also for those who have none.
pub(super) fn session(asked: &Asked) -> Response<Body> {
    let mut state = state(&asked.app, asked.who.as_ref().map(|(account, _)| account));
    if let (Some(fields), Some(_)) = (state.as_object_mut(), &asked.who) {
        fields.insert("recording".to_owned(), super::recordings::standing(asked));
    }
    json(StatusCode::OK, &state)
}

fn state(app: &App, account: Option<&Account>) -> serde_json::Value {
    let drones = account.map(|account| app.fleet.names_for(account)).unwrap_or_default();
    let message = account.filter(|account| account.drones.is_empty()).map(|_| "no drone assigned");
    serde_json::json!({
        "claimed": app.directory().is_claimed(),
        "account": account.map(|account| serde_json::json!({
            "id": account.id, "name": account.name, "surname": account.surname, "email": account.email,
            "role": account.role, "language": account.language,
        })),
        "drones": drones,
        "version": env!("CARGO_PKG_VERSION"),
        "message": message,
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Claim {
    code: String,
    name: String,
    surname: String,
    email: String,
    password: String,
}

/// The first administrator.
pub(super) async fn claim(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Claim { code, name, surname, email: address, password } = asked.json()?;
    let app = &asked.app;
    if app.directory().is_claimed() {
        return Err(crate::StoreError::Claimed.into());
    }
    let account = Account {
        id: 0,
        name: plain("name", &name)?,
        surname: plain("surname", &surname)?,
        email: email(&address)?,
        role: Role::Administrator,
        language: "es".to_owned(),
        drones: [EVERY_DRONE.to_owned()].into(),
        disabled: false,
    };
    password::check(&password).map_err(|error| Refusal::bad(error.to_string()))?;
    wait_your_turn(app, CLAIMANT, asked.address)?;
    let new = NewAccount { account, password: hash(app, password).await? };
    let email = new.account.email.clone();
    let Some(account) = app.store.claim(claim_digest(&code), new, app.clock.now_ms()).await? else {
        failed(app, CLAIMANT, email, "claim", asked.address).await?;
        return Err(Refusal::forbidden("the claim code is wrong"));
    };
    app.backoff().succeeded(CLAIMANT, asked.address);
    app.directory_mut().put(account.clone());
    app.store.log(app.entry(Kind::Claimed, &account, asked.address)).await?;
    begin(app, &account, asked.address).await
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LogIn {
    email: String,
    password: String,
}

/// Begins a session.
pub(super) async fn log_in(asked: Asked) -> Result<Response<Body>, Refusal> {
    let LogIn { email, password } = asked.json()?;
    let app = &asked.app;
    let user = email.trim().to_lowercase();
    if user.len() > 4 * super::NAME_BYTES {
        return Err(Refusal::new(StatusCode::UNAUTHORIZED, WRONG));
    }
    wait_your_turn(app, &user, asked.address)?;
    let known = app.store.password_of(&user).await?;
    let (id, kept) = known.map_or((None, app.decoy.clone()), |(id, kept)| (Some(id), kept));
    let right = is_right(app, password, kept).await?;
    let account = id.and_then(|id| app.directory().account(id).cloned());
    match account.filter(|account| right && !account.disabled) {
        Some(account) => {
            app.backoff().succeeded(&user, asked.address);
            begin(app, &account, asked.address).await
        }
        None => {
            failed(app, &user, user.clone(), "log-in", asked.address).await?;
            Err(Refusal::new(StatusCode::UNAUTHORIZED, WRONG))
        }
    }
}

async fn begin(app: &App, account: &Account, address: IpAddr) -> Result<Response<Body>, Refusal> {
    let token = hexadecimal(&random::<32>()?);
    let digest = digest_of(token.as_bytes());
    let now_ms = app.clock.now_ms();
    let gone = app.directory_mut().begin(digest, account.id, now_ms);
    let session = Session { account: account.id, began_ms: now_ms, seen_ms: now_ms };
    let kept = async {
        app.store.keep_session(digest, session, gone).await?;
        app.store.log(app.entry(Kind::LogIn, account, address)).await
    };
    if let Err(error) = kept.await {
        // Nobody comes in unwritten.
        app.directory_mut().end(&digest);
        return Err(error.into());
    }
    let mut response = json(StatusCode::OK, &state(app, Some(account)));
    // No Max-Age: it goes with the browser, and the server knows when it ends.
    set_cookie(&mut response, &format!("{COOKIE}={token}; Path=/; Secure; HttpOnly; SameSite=Strict"));
    Ok(response)
}

fn set_cookie(response: &mut Response<Body>, cookie: &str) {
    if let Ok(cookie) = HeaderValue::from_str(cookie) {
        response.headers_mut().insert(header::SET_COOKIE, cookie);
    }
}

/// Ends the session on the server; the cookie is worth nothing afterwards.
pub(super) async fn log_out(asked: Asked) -> Result<Response<Body>, Refusal> {
    let (account, session) = asked.account()?;
    let app = &asked.app;
    app.directory_mut().end(session);
    app.announce();
    app.store.forget_sessions(vec![*session]).await?;
    app.store.log(app.entry(Kind::LogOut, account, asked.address)).await?;
    let mut response = json(StatusCode::OK, &state(app, None));
    set_cookie(&mut response, &format!("{COOKIE}=; Path=/; Secure; HttpOnly; SameSite=Strict; Max-Age=0"));
    Ok(response)
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Passwords {
    old: String,
    new: String,
}

/// A new password; the account's other sessions end.
pub(super) async fn change_password(asked: Asked) -> Result<Response<Body>, Refusal> {
    let Passwords { old, new } = asked.json()?;
    let (account, session) = asked.account()?;
    let app = &asked.app;
    password::check(&new).map_err(|error| Refusal::bad(error.to_string()))?;
    let user = account.email.to_lowercase();
    wait_your_turn(app, &user, asked.address)?;
    let kept = app.store.password_of(&user).await?.map_or_else(|| app.decoy.clone(), |(_, kept)| kept);
    if !is_right(app, old, kept).await? {
        failed(app, &user, account.email.clone(), "password", asked.address).await?;
        return Err(Refusal::forbidden("the old password is wrong"));
    }
    app.backoff().succeeded(&user, asked.address);
    let hash = hash(app, new).await?;
    app.store.change_account(account.clone(), Some(hash)).await?;
    end_sessions(app, account.id, Some(session)).await?;
    let mut entry = app.entry(Kind::Accounts, account, asked.address);
    entry.verb = "password".to_owned();
    app.store.log(entry).await?;
    Ok(json(StatusCode::OK, &serde_json::json!({})))
}

/// Ends an account's sessions but one, also those of open sockets.
pub(super) async fn end_sessions(app: &App, account: i64, but: Option<&Digest>) -> Result<(), Refusal> {
    let gone = app.directory_mut().end_all(account, but);
    app.announce();
    app.store.forget_sessions(gone).await?;
    Ok(())
}

fn wait_your_turn(app: &App, user: &str, address: IpAddr) -> Result<(), Refusal> {
    app.backoff().ask(user, address, app.clock.now_ms()).map_err(|wait_ms| {
        let seconds = wait_ms.div_ceil(1000);
        Refusal {
            status: StatusCode::TOO_MANY_REQUESTS,
            sentence: format!("too many failed attempts: try again in {seconds} s"),
            retry_s: Some(seconds),
        }
    })
}

/// Counts and writes down what failed. Attempts that were told to wait are not written: the log must not be filled by them.
async fn failed(app: &App, user: &str, account: String, verb: &str, address: IpAddr) -> Result<(), Refusal> {
    let now_ms = app.clock.now_ms();
    app.backoff().failed(user, address, now_ms);
    let entry = Entry {
        time_ms: now_ms,
        kind: Kind::Failed,
        account,
        role: "",
        address: address.to_string(),
        drone: String::new(),
        verb: verb.to_owned(),
        answer: String::new(),
    };
    app.store.log(entry).await?;
    Ok(())
}

/// Hashes a password beside the others that are being hashed.
pub(super) async fn hash(app: &App, password: String) -> Result<String, Refusal> {
    let salt = random::<16>()?;
    let _turn = app.hashes.acquire().await;
    let hashed = tokio::task::spawn_blocking(move || password::hash(&password, salt)).await;
    hashed.map_err(|_| stopping())?.map_err(|error| match error {
        PasswordError::Length(_) => Refusal::bad(error.to_string()),
        PasswordError::Hash(_) => Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string()),
    })
}

async fn is_right(app: &App, password: String, kept: String) -> Result<bool, Refusal> {
    let _turn = app.hashes.acquire().await;
    tokio::task::spawn_blocking(move || password::is_right(&password, &kept)).await.map_err(|_| stopping())
}

fn stopping() -> Refusal {
    Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "the console is stopping")
}
