//! The one way in: every request of every route passes here. What is allowed stands in [`crate::table`].

use crate::app::App;
use crate::refusal::Refusal;
use crate::role::is_drone_name;
use crate::secret::{Digest, digest_of};
use crate::server::Held;
use crate::table::{Action, Least, Method, Names, ROUTES, Route};
use crate::{Account, api, socket};
use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{FromRequestParts, RawPathParams, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Response, StatusCode, header, request::Parts};
use axum::routing::{MethodFilter, on};
use futures_util::StreamExt;
use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;

/// The cookie's name; the prefix makes browsers insist on Secure, Path=/ and no Domain.
pub(crate) const COOKIE: &str = "__Host-sereno";
/// A body has come within this time, and a picture within the other.
const BODY_TIME: Duration = Duration::from_secs(10);
const PICTURE_TIME: Duration = Duration::from_secs(90);
/// A message on a WebSocket is no longer than this.
pub(crate) const MESSAGE_BYTES: usize = 64 * 1024;
/// What may wait in a WebSocket's own buffer; the largest message from a drone fits.
const WRITE_BYTES: usize = 4 * 1024 * 1024;

/// The address that a connection comes from, put into each of its requests by the server.
#[derive(Clone, Copy, Debug)]
pub(crate) struct From(pub(crate) IpAddr);

/// A request that has passed the gate.
pub(crate) struct Asked {
    pub(crate) app: Arc<App>,
    pub(crate) address: IpAddr,
    /// Who asks; always there where the table wants an account.
    pub(crate) who: Option<(Account, Digest)>,
    /// Which drone, where the table says that one is named; otherwise empty.
    pub(crate) drone: String,
    pub(crate) path: HashMap<String, String>,
    pub(crate) query: HashMap<String, String>,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Bytes,
    /// The connection's place among those allowed.
    pub(crate) held: Option<Held>,
}

impl Asked {
    /// Who asks.
    pub(crate) fn account(&self) -> Result<&(Account, Digest), Refusal> {
        self.who.as_ref().ok_or_else(Refusal::log_in)
    }

    /// The body as JSON; unknown fields are refused.
    pub(crate) fn json<T: serde::de::DeserializeOwned>(&self) -> Result<T, Refusal> {
        serde_json::from_slice(&self.body)
            .map_err(|error| Refusal::bad(format!("the request is not understood: {error}")))
    }
}

/// The router, made from the table.
pub(crate) fn router(app: Arc<App>) -> Router {
    let mut router = Router::new();
    for row in ROUTES {
        let filter = match row.method {
            Method::Get => MethodFilter::GET,
            Method::Post => MethodFilter::POST,
            Method::Patch => MethodFilter::PATCH,
        };
        let handler = move |State(app): State<Arc<App>>, path: RawPathParams, request: Request| async move {
            let path = path.iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
            pass(app, row, path, request).await.unwrap_or_else(Refusal::response)
        };
        router = router.route(row.path, on(filter, handler));
    }
    router
        .fallback(|| async { Refusal::missing("there is nothing here").response() })
        .method_not_allowed_fallback(|| async {
            Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "this cannot be asked for in this way").response()
        })
        .layer(axum::middleware::map_response(guarded))
        .with_state(app)
}

/// What tells browsers to trust nothing but this page itself.
const HEADERS: [(HeaderName, &str); 7] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'self'; img-src 'self' blob: data:; media-src 'self' blob:; object-src 'none'; base-uri 'none'; \
         form-action 'self'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::STRICT_TRANSPORT_SECURITY, "max-age=31536000"),
    (header::REFERRER_POLICY, "no-referrer"),
    (
        HeaderName::from_static("permissions-policy"),
        "gamepad=(self), fullscreen=(self), autoplay=(self), camera=(), microphone=(), geolocation=(), payment=(), usb=()",
    ),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

async fn guarded(mut response: Response<Body>) -> Response<Body> {
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn pass(
    app: Arc<App>,
    row: &'static Route,
    path: HashMap<String, String>,
    request: Request,
) -> Result<Response<Body>, Refusal> {
    let (mut parts, body) = request.into_parts();
    let address = parts
        .extensions
        .get::<From>()
        .map(|from| from.0)
        .ok_or_else(|| Refusal::forbidden("where this request comes from is not known"))?;
    if row.needs_origin() && !is_ours(&parts) {
        return Err(Refusal::forbidden("this request comes from another page"));
    }
    let session = session_of(&parts.headers);
    let who = session.and_then(|session| app.who(&session).map(|account| (account, session)));
    let query = query_of(&parts);
    let drone = match row.names {
        Names::NoDrone => String::new(),
        Names::InPath => path.get("drone").cloned().unwrap_or_default(),
        Names::InQuery => query.get("drone").cloned().unwrap_or_default(),
    };
    allow(row, who.as_ref().map(|(account, _)| account), &drone)?;
    // A page looks by itself; what changes something, a human did.
    if let Some((_, session)) = &who
        && row.method != Method::Get
    {
        app.seen(session);
    }
    let upgrade = if row.is_socket() {
        let upgrade = WebSocketUpgrade::from_request_parts(&mut parts, &()).await;
        Some(upgrade.map_err(|error| Refusal::bad(format!("this is a WebSocket: {}", error.body_text())))?)
    } else {
        None
    };
    // Before the body: whoever may send pictures may not fill the memory with them.
    let _leave = if row.action == Action::AddDraft { Some(app.drafts.upload()?) } else { None };
    let body = if upgrade.is_some() { Bytes::new() } else { read(row, body).await? };
    let held = parts.extensions.remove::<Held>();
    let asked = Asked { app, address, who, drone, path, query, headers: parts.headers, body, held };
    match upgrade {
        Some(upgrade) => {
            let upgrade = upgrade
                .max_message_size(MESSAGE_BYTES)
                .max_frame_size(MESSAGE_BYTES)
                .write_buffer_size(0)
                .max_write_buffer_size(WRITE_BYTES);
            socket::open(row.action, asked, upgrade)
        }
        None => api::act(row.action, asked).await,
    }
}

/// The decision: default deny.
fn allow(row: &Route, account: Option<&Account>, drone: &str) -> Result<(), Refusal> {
    let Least::Account(least) = row.least else { return Ok(()) };
    let account = account.ok_or_else(Refusal::log_in)?;
    if account.role < least {
        return Err(Refusal::forbidden(format!(
            "this needs the role {}, and yours is {}",
            least.word(),
            account.role.word()
        )));
    }
    if row.names != Names::NoDrone {
        // The same words whether there is such a drone or not.
        if !is_drone_name(drone) || !account.may_see(drone) {
            return Err(Refusal::forbidden(if account.drones.is_empty() {
                "no drone assigned".to_owned()
            } else {
                "this drone is not assigned to you".to_owned()
            }));
        }
    }
    Ok(())
}

/// Whether the page that asks is the one that this server has served: its origin is the host that it asked.
fn is_ours(parts: &Parts) -> bool {
    let text = |name| parts.headers.get(name).and_then(|value| value.to_str().ok());
    let (Some(origin), Some(host)) = (text(header::ORIGIN), text(header::HOST)) else { return false };
    let plain = |host: &str| host.to_ascii_lowercase().trim_end_matches(":443").to_owned();
    parts.headers.get_all(header::ORIGIN).iter().count() == 1
        && origin.get(..8) == Some("https://")
        && origin.get(8..).is_some_and(|origin| plain(origin) == plain(host))
}

fn session_of(headers: &HeaderMap) -> Option<Digest> {
    headers
        .get_all(header::COOKIE)
        .iter()
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(';'))
        .filter_map(|pair| pair.trim().split_once('='))
        .find(|(name, _)| *name == COOKIE)
        .map(|(_, token)| digest_of(token.as_bytes()))
}

fn query_of(parts: &Parts) -> HashMap<String, String> {
    axum::extract::Query::<HashMap<String, String>>::try_from_uri(&parts.uri)
        .map(|query| query.0)
        .unwrap_or_default()
}

async fn read(row: &Route, body: Body) -> Result<Bytes, Refusal> {
    let time = if row.action == Action::AddDraft { PICTURE_TIME } else { BODY_TIME };
    let most = row.body_bytes();
    match tokio::time::timeout(time, whole(body, most)).await {
        Ok(Some(bytes)) => Ok(bytes),
        Ok(None) => Err(Refusal::new(
            StatusCode::PAYLOAD_TOO_LARGE,
            format!("the request is longer than {most} bytes, or broke off"),
        )),
        Err(_) => Err(Refusal::new(StatusCode::REQUEST_TIMEOUT, "the request took too long to come")),
    }
}

/// The body; `None` when it is longer or broke off. As much again is read and dropped: who is still sending does not read why he is
/// refused, he sees the connection break.
async fn whole(body: Body, most: usize) -> Option<Bytes> {
    let mut parts = body.into_data_stream();
    let (mut bytes, mut length) = (Vec::new(), 0_usize);
    while let Some(part) = parts.next().await {
        let part = part.ok()?;
        length = length.saturating_add(part.len());
        if length > most.saturating_mul(2) {
            return None;
        }
        if length > most {
            bytes = Vec::new();
        } else {
            bytes.extend_from_slice(&part);
        }
    }
    (length <= most).then(|| bytes.into())
}
