//! How a device comes to trust the page's authority.

use crate::authority::{Authority, code};
use crate::gate::Asked;
use crate::page::file;
use crate::refusal::{Refusal, json};
use axum::body::Body;
use axum::http::{Response, StatusCode, header};
use std::borrow::Cow;

fn authority(asked: &Asked) -> Result<&Authority, Refusal> {
    let missing = || Refusal::missing("this console offers no authority to be trusted");
    asked.app.authority.as_ref().ok_or_else(missing)
}

/// The page that tells how.
pub(super) fn page(asked: &Asked) -> Result<Response<Body>, Refusal> {
    let page = authority(asked)?.page().into_bytes();
    Ok(file(Cow::Owned(page), "text/html; charset=utf-8", &asked.headers))
}

/// The certificate, which devices take for one to be installed by its media type.
pub(super) fn certificate(asked: &Asked) -> Result<Response<Body>, Refusal> {
    let certificate = authority(asked)?.certificate.clone();
    Ok(file(Cow::Owned(certificate), "application/x-x509-ca-cert", &asked.headers))
}

/// Whether there is anything to be trusted, and its fingerprint.
pub(super) fn see(asked: &Asked) -> Response<Body> {
    let fingerprint = asked.app.authority.as_ref().map(|authority| &authority.fingerprint);
    json(StatusCode::OK, &serde_json::json!({ "offered": fingerprint.is_some(), "fingerprint": fingerprint }))
}

/// The page's address, as whoever asks has reached this console, for a camera.
pub(super) fn qr(asked: &Asked) -> Result<Response<Body>, Refusal> {
    authority(asked)?;
    let host = asked.headers.get(header::HOST).and_then(|host| host.to_str().ok()).unwrap_or("");
    let picture = code(host).ok_or_else(|| Refusal::bad("Host: not a name or address with its port"))?;
    Ok(file(Cow::Owned(picture.into_bytes()), "image/svg+xml", &asked.headers))
}
