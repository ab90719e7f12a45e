//! Recordings: begun, ended, shown, taken away, erased.

use crate::fleet::Drone;
use crate::gate::Asked;
use crate::recording::Recorder;
use crate::refusal::{Refusal, json};
use crate::store::{Kind, Recording};
use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, Response, StatusCode, header};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::sync::Arc;

/// Said where a recording would be kept and is not.
pub(super) const KEEPS_NONE: &str = "this console keeps no pictures";
/// Bytes that are read at a time.
const PIECE: u64 = 256 * 1024;

fn recorder(asked: &Asked) -> Result<Arc<Recorder>, Refusal> {
    asked.app.fleet.recorder().cloned().ok_or_else(|| Refusal::new(StatusCode::CONFLICT, KEEPS_NONE))
}

fn drone(asked: &Asked) -> Result<Arc<Drone>, Refusal> {
    let missing = || Refusal::missing(format!("nothing has been heard of {} yet", asked.drone));
    asked.app.fleet.drone(&asked.drone).ok_or_else(missing)
}

/// Whether this console keeps pictures, and why not.
pub(super) fn standing(asked: &Asked) -> serde_json::Value {
    match asked.app.fleet.recorder() {
        Some(recorder) => {
            serde_json::json!({ "keeps": true, "reason": "", "rolling_s": recorder.settings.rolling_s,
            "retention_h": recorder.settings.retention_h })
        }
        None => serde_json::json!({ "keeps": false, "reason": KEEPS_NONE }),
    }
}

/// All of a drone, and what is being recorded now.
pub(super) async fn list(asked: Asked) -> Result<Response<Body>, Refusal> {
    let recordings = asked.app.store.recordings(asked.drone.clone()).await?;
    let recorder = asked.app.fleet.recorder();
    let now = recorder.map(|recorder| recorder.now(&asked.drone)).unwrap_or_default();
    let losses = recorder.map(|recorder| (recorder.refused(), recorder.lost())).unwrap_or_default();
    let mut answer = standing(&asked);
    if let Some(fields) = answer.as_object_mut() {
        fields.insert("now".to_owned(), serde_json::json!(now));
        fields.insert("refused".to_owned(), losses.0.into());
        fields.insert("lost".to_owned(), losses.1.into());
        fields.insert("recordings".to_owned(), serde_json::json!(recordings));
    }
    Ok(json(StatusCode::OK, &answer))
}

async fn log(asked: &Asked, verb: &str, answer: String) -> Result<(), Refusal> {
    let mut entry = asked.app.entry(Kind::Recording, &asked.account()?.0, asked.address);
    entry.drone.clone_from(&asked.drone);
    entry.verb = verb.to_owned();
    entry.answer = answer;
    Ok(asked.app.store.log(entry).await?)
}

/// Begins.
pub(super) async fn start(asked: Asked) -> Result<Response<Body>, Refusal> {
    let recorder = recorder(&asked)?;
    let drone = drone(&asked)?;
    if !drone.is_alive() {
        return Err(Refusal::new(StatusCode::CONFLICT, format!("{} is not reached", asked.drone)));
    }
    let full = |sentence| Refusal::new(StatusCode::INSUFFICIENT_STORAGE, sentence);
    recorder.start(&drone.name, &asked.account()?.0.email).await.map_err(full)?;
    log(&asked, "start", String::new()).await?;
    Ok(json(StatusCode::CREATED, &recorder.now(&asked.drone)))
}

/// Ends.
pub(super) async fn stop(asked: Asked) -> Result<Response<Body>, Refusal> {
    let recorder = recorder(&asked)?;
    let gone = |sentence| Refusal::new(StatusCode::SERVICE_UNAVAILABLE, sentence);
    if recorder.stop(&drone(&asked)?.name).await.map_err(gone)? {
        log(&asked, "stop", String::new()).await?;
    }
    Ok(json(StatusCode::OK, &recorder.now(&asked.drone)))
}

/// The recording that is named, if it is of this drone.
async fn named(asked: &Asked) -> Result<Recording, Refusal> {
    let missing = || Refusal::missing("there is no such recording");
    let id: i64 = asked.path.get("id").and_then(|id| id.parse().ok()).ok_or_else(missing)?;
    let found = asked.app.store.recording(id).await?.filter(|one| one.drone == asked.drone);
    found.ok_or_else(missing)
}

/// Erases.
pub(super) async fn erase(asked: Asked) -> Result<Response<Body>, Refusal> {
    let recording = named(&asked).await?;
    let recorder = recorder(&asked)?;
    let refused = |sentence| Refusal::new(StatusCode::CONFLICT, sentence);
    if recorder.erase(recording.id, &asked.account()?.0.email).await.map_err(refused)? {
        log(&asked, "erase", format!("recording {}", recording.id)).await?;
    }
    Ok(json(StatusCode::OK, &serde_json::json!({})))
}

/// First and last byte of the one range that is asked for in a file of so many; `None` for all of it. An error when nothing of
/// the file is in it.
fn range(asked: Option<&str>, length: u64) -> Result<Option<(u64, u64)>, ()> {
    // Several ranges, and units that nobody knows, may be passed over (RFC 9110, 14.2).
    let Some((first, last)) =
        asked.and_then(|text| text.strip_prefix("bytes=")).and_then(|one| one.split_once('-'))
    else {
        return Ok(None);
    };
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let (first, last) = match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last => (first, last),
        (Some(first), None) if last.trim().is_empty() => (first, u64::MAX),
        (None, Some(count)) if first.trim().is_empty() => {
            (length.saturating_sub(count), if count == 0 { 0 } else { u64::MAX })
        }
        _ => return Ok(None),
    };
    if first >= length || last < first {
        return Err(());
    }
    Ok(Some((first, last.min(length - 1))))
}

/// The file, or a range of it.
pub(super) async fn film(asked: Asked) -> Result<Response<Body>, Refusal> {
    let recording = named(&asked).await?;
    let recorder = recorder(&asked)?;
    let (path, open) = recorder.file(recording.id);
    let failed = |_| Refusal::missing("the file of this recording is not there");
    let file = tokio::task::spawn_blocking(move || {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok::<_, std::io::Error>((Arc::new(file), length))
    });
    let (file, length) = file.await.map_err(|error| Refusal::missing(error.to_string()))?.map_err(failed)?;
    // Of one that is being written, what is whole.
    let length = if recording.ended_ms.is_none() { open.unwrap_or(0).min(length) } else { length };
    let wanted = asked.headers.get(header::RANGE).and_then(|value| value.to_str().ok());
    let part = range(wanted, length);
    let takes = asked.query.contains_key("download");
    if let Ok(part) = part
        && part.is_none_or(|(first, _)| first == 0)
        && (takes
            || asked.app.fleet.shows_anew(&asked.account()?.0.email, recording.id, asked.app.clock.now_ms()))
    {
        log(&asked, if takes { "download" } else { "play" }, format!("recording {}", recording.id)).await?;
    }
    let mut response = match part {
        Err(()) => {
            let mut response = Response::new(Body::empty());
            *response.status_mut() = StatusCode::RANGE_NOT_SATISFIABLE;
            set(&mut response, header::CONTENT_RANGE, &format!("bytes */{length}"));
            return Ok(response);
        }
        Ok(None) => sent(file, 0, length),
        Ok(Some((first, last))) => {
            let mut response = sent(file, first, last + 1);
            *response.status_mut() = StatusCode::PARTIAL_CONTENT;
            set(&mut response, header::CONTENT_RANGE, &format!("bytes {first}-{last}/{length}"));
            response
        }
    };
    set(&mut response, header::CONTENT_TYPE, "video/mp4");
    set(&mut response, header::ACCEPT_RANGES, "bytes");
    set(&mut response, header::CACHE_CONTROL, "no-store");
    if takes {
        let name = format!("attachment; filename=\"recording-{}.mp4\"", recording.id);
        set(&mut response, header::CONTENT_DISPOSITION, &name);
    }
    Ok(response)
}

fn set(response: &mut Response<Body>, name: header::HeaderName, value: &str) {
    if let Ok(value) = HeaderValue::from_str(value) {
        response.headers_mut().insert(name, value);
    }
}

/// Sends the bytes from `first` up to `end`, piece by piece as the browser takes them.
fn sent(file: Arc<File>, first: u64, end: u64) -> Response<Body> {
    let pieces = futures_util::stream::try_unfold(first, move |at| {
        let file = file.clone();
        async move {
            if at >= end {
                return Ok(None);
            }
            let read = tokio::task::spawn_blocking(move || {
                let mut piece = vec![0; PIECE.min(end - at) as usize];
                file.read_exact_at(&mut piece, at)?;
                Ok::<_, std::io::Error>(piece)
            });
            let piece = read.await.map_err(std::io::Error::other)??;
            let next = at + piece.len() as u64;
            Ok::<_, std::io::Error>(Some((Bytes::from(piece), next)))
        }
    });
    let mut response = Response::new(Body::from_stream(pieces));
    set(&mut response, header::CONTENT_LENGTH, &(end - first).to_string());
    response
}

#[cfg(test)]
mod tests {
    use super::range;

    #[test]
    fn one_range_is_understood_and_what_is_outside_is_refused() {
        for (asked, answer) in [
            (None, Ok(None)),
            (Some("bytes=0-"), Ok(Some((0, 99)))),
            (Some("bytes=10-19"), Ok(Some((10, 19)))),
            (Some("bytes=10-1000"), Ok(Some((10, 99)))),
            (Some("bytes=-30"), Ok(Some((70, 99)))),
            (Some("bytes=-300"), Ok(Some((0, 99)))),
            (Some("bytes=99-99"), Ok(Some((99, 99)))),
            (Some("bytes=100-"), Err(())),
            (Some("bytes=-0"), Err(())),
            (Some("bytes=20-10"), Ok(None)),
            (Some("bytes=0-1,5-6"), Ok(None)),
            (Some("bytes=a-b"), Ok(None)),
            (Some("bytes=-"), Ok(None)),
            (Some("lines=1-2"), Ok(None)),
            (Some("bytes=99999999999999999999-"), Ok(None)),
        ] {
            assert_eq!(range(asked, 100), answer, "{asked:?}");
        }
        assert_eq!(range(Some("bytes=0-"), 0), Err(()));
    }
}
