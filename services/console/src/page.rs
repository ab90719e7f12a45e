//! The page: files in the binary, or in a folder while it is being written.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, Response, StatusCode, header};
use std::borrow::Cow;
use std::path::PathBuf;

mod embedded {
    include!(concat!(env!("OUT_DIR"), "/web.rs"));
}

/// Where the page comes from.
#[derive(Clone, Debug)]
pub enum Page {
    /// The binary.
    Embedded,
    /// A folder, read at every request.
    Folder(PathBuf),
}

/// The media type of what a file's name ends with.
fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or("") {
        "html" => "text/html; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" | "map" => "application/json",
        "webmanifest" => "application/manifest+json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "jpg" | "jpeg" => "image/jpeg",
        "webp" => "image/webp",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "ogg" | "oga" => "audio/ogg",
        "wav" => "audio/wav",
        "mp3" => "audio/mpeg",
        "txt" | "md" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

impl Page {
    fn find(&self, name: &str) -> Option<Cow<'static, [u8]>> {
        match self {
            Self::Embedded => embedded::FILES
                .iter()
                .find(|(known, _)| *known == name)
                .map(|(_, bytes)| Cow::Borrowed(*bytes)),
            Self::Folder(folder) => {
                let plain = name.split('/').all(|part| !part.is_empty() && !part.starts_with('.'));
                if !plain || name.contains('\\') {
                    return None;
                }
                std::fs::read(folder.join(name)).ok().map(Cow::Owned)
            }
        }
    }

    /// A file; `None` when there is none of this name.
    #[must_use]
    pub fn answer(&self, name: &str, asked: &HeaderMap) -> Option<Response<Body>> {
        let bytes = self.find(name)?;
        Some(file(bytes, media_type(name), asked))
    }
}

/// Bytes with their tag; nothing but the tag when the browser has them already.
pub(crate) fn file(bytes: Cow<'static, [u8]>, media: &'static str, asked: &HeaderMap) -> Response<Body> {
    let tag = format!("\"{}\"", crate::secret::hexadecimal(&crate::secret::digest_of(&bytes)[..12]));
    let known = asked
        .get(header::IF_NONE_MATCH)
        .and_then(|value| value.to_str().ok())
        .is_some_and(|value| value.split(',').any(|one| one.trim().trim_start_matches("W/") == tag));
    let body = match (known, bytes) {
        (true, _) => Body::empty(),
        (false, Cow::Borrowed(bytes)) => Body::from(bytes),
        (false, Cow::Owned(bytes)) => Body::from(bytes),
    };
    let mut response = Response::new(body);
    if known {
        *response.status_mut() = StatusCode::NOT_MODIFIED;
    }
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(media));
    // Asked for again each time, sent again only when it has changed: a new version counts at once.
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        headers.insert(header::ETAG, tag);
    }
    response
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn nothing_outside_the_folder_is_served() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("web")).unwrap();
        std::fs::write(folder.path().join("web/index.html"), "<p>").unwrap();
        std::fs::write(folder.path().join("secret"), "x").unwrap();
        let page = Page::Folder(folder.path().join("web"));
        let headers = HeaderMap::new();
        assert!(page.answer("index.html", &headers).is_some());
        for name in
            ["../secret", "app/../../secret", "/etc/passwd", ".git/config", "", "app//x", "..\\secret"]
        {
            assert!(page.answer(name, &headers).is_none(), "{name}");
        }
    }

    #[test]
    fn what_the_browser_has_is_not_sent_again() {
        let first = file(Cow::Borrowed(b"abc"), "text/plain", &HeaderMap::new());
        let mut asked = HeaderMap::new();
        asked.insert(header::IF_NONE_MATCH, first.headers()[header::ETAG].clone());
        assert_eq!(file(Cow::Borrowed(b"abc"), "text/plain", &asked).status(), StatusCode::NOT_MODIFIED);
        assert_eq!(file(Cow::Borrowed(b"abd"), "text/plain", &asked).status(), StatusCode::OK);
    }
}
