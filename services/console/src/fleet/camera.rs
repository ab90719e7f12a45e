//! What this console wants of a drone's camera, and the newest still that came of it.
//!
//! A certificate has one key for wishes on a drone, and what is put there replaces what was put before: so all that this console
//! wants of one camera is one wish, made here.

use super::{Drone, Fleet};
use axum::body::Bytes;
use ipc_types::{Field, Message, STILL_BYTES, Still};
use std::mem::offset_of;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;
use tokio::sync::watch;
use tokio::time::{Instant, interval, timeout};
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;

/// A wish is said again so often; a drone forgets it after twice as long.
const SAY: Duration = Duration::from_secs(1);
/// Stills are wanted for so long after somebody has asked for one.
const WANTED: Duration = Duration::from_secs(3);
/// How long whoever asks first waits for the first still: the wish must reach the drone, and the camera wake up.
const FIRST: Duration = Duration::from_millis(2500);
/// A still that came so long ago is none any more.
const OLD: Duration = Duration::from_secs(5);

/// Video that is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct VideoWish {
    /// Pixels.
    pub(super) width: u32,
    /// Pixels.
    pub(super) height: u32,
    /// Frames a second.
    pub(super) fps: u32,
    /// Kept for a while only: decides over nobody's choice of the picture.
    pub(super) rolling: bool,
    /// Key frames that were asked for.
    pub(super) key_requests: u32,
}

/// One picture.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    pub(crate) jpeg: Bytes,
    /// When it was taken, nanoseconds of the drone's clock.
    pub(crate) capture_ns: u64,
    came: Instant,
}

/// A drone's camera as this console wants it.
#[derive(Debug)]
pub(super) struct Camera {
    wants: Mutex<Wants>,
    newest: watch::Sender<Option<Picture>>,
}

#[derive(Debug, Default)]
struct Wants {
    stills_until: Option<Instant>,
    video: Option<VideoWish>,
    /// Somebody says it again and again.
    said: bool,
}

impl Default for Camera {
    fn default() -> Self {
        Self { wants: Mutex::default(), newest: watch::Sender::new(None) }
    }
}

impl Camera {
    fn wants(&self) -> MutexGuard<'_, Wants> {
        // Each change under this lock is whole after each statement.
        self.wants.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The wish as it is to be said now; `None` when nothing is wanted any more, and nobody says it from then on.
    fn wish(&self, now: Instant) -> Option<String> {
        let mut wants = self.wants();
        let still = wants.stills_until.is_some_and(|until| now < until);
        wants.said = still || wants.video.is_some();
        if !wants.said {
            return None;
        }
        let video = wants
            .video
            .map(|of| serde_json::json!({ "width": of.width, "height": of.height, "fps": of.fps }));
        let mut wish = serde_json::json!({ "video": video, "still": still });
        if let (Some(fields), Some(of)) = (wish.as_object_mut(), wants.video) {
            fields.insert("rolling".to_owned(), of.rolling.into());
            fields.insert("key_requests".to_owned(), of.key_requests.into());
        }
        Some(wish.to_string())
    }

    fn heard(&self, sample: &Sample) {
        let encoding = format!("application/octet-stream;schema=sereno/Still/{:016x}", Still::LAYOUT);
        // A drone of another version may lay it out in another way.
        if sample.encoding().to_string() != encoding || sample.payload().len() > STILL_BYTES + 1024 {
            return;
        }
        let bytes = sample.payload().to_bytes();
        if let Some((capture_ns, jpeg)) = still_in(&bytes) {
            let jpeg = Bytes::copy_from_slice(jpeg);
            self.newest.send_replace(Some(Picture { jpeg, capture_ns, came: Instant::now() }));
        }
    }
}

/// Time of capture and JPEG file in the bytes of a message; `None` for what is none.
fn still_in(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let number = |at: usize| Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk::<8>()?));
    let length = u32::from_le_bytes(*bytes.get(offset_of!(Still, length)..)?.first_chunk::<4>()?);
    let jpeg = bytes.get(offset_of!(Still, bytes)..)?;
    let whole =
        jpeg.len() == length as usize && jpeg.starts_with(&[0xff, 0xd8]) && jpeg.ends_with(&[0xff, 0xd9]);
    whole.then_some((number(offset_of!(Still, capture_ns))?, jpeg))
}

impl Fleet {
    /// Video that is wanted of a drone from now on; `None`: no more.
    pub(super) fn want_video(self: &Arc<Self>, drone: &Arc<Drone>, video: Option<VideoWish>) {
        let begins = {
            let mut wants = drone.camera.wants();
            wants.video = video;
            video.is_some() && !std::mem::replace(&mut wants.said, true)
        };
        if begins {
            tokio::spawn(say(Arc::downgrade(self), Arc::downgrade(drone)));
        }
    }

    /// The newest still of a drone, asked of its camera for the next seconds; `None` when none comes.
    pub(crate) async fn still(self: &Arc<Self>, drone: &Arc<Drone>) -> Option<Picture> {
        let mut newest = drone.camera.newest.subscribe();
        let begins = {
            let mut wants = drone.camera.wants();
            wants.stills_until = Some(Instant::now() + WANTED);
            !std::mem::replace(&mut wants.said, true)
        };
        if begins {
            tokio::spawn(say(Arc::downgrade(self), Arc::downgrade(drone)));
        }
        let good = |picture: &Option<Picture>| picture.as_ref().is_some_and(|one| one.came.elapsed() < OLD);
        let found = timeout(FIRST, newest.wait_for(good)).await.ok()?.ok()?;
        found.clone()
    }
}

/// Says what is wanted until nothing is.
async fn say(fleet: Weak<Fleet>, drone: Weak<Drone>) {
    let to = drone.clone();
    let mut subscriber = None;
    let mut turn = interval(SAY);
    loop {
        turn.tick().await;
        let (Some(fleet), Some(drone)) = (fleet.upgrade(), drone.upgrade()) else { return };
        let Some(wish) = drone.camera.wish(Instant::now()) else { return };
        if subscriber.is_none() {
            let (key, to) = (format!("sereno/{}/telemetry/{}", drone.name, Still::TOPIC), to.clone());
            let heard = move |sample| {
                if let Some(drone) = to.upgrade() {
                    drone.camera.heard(&sample);
                }
            };
            subscriber = fleet.session.declare_subscriber(key).callback(heard).await.ok();
        }
        let key = format!("sereno/{}/wish/{}", drone.name, fleet.certificate);
        let said = fleet.session.put(key, wish).encoding("application/json");
        if let Err(error) = said.congestion_control(CongestionControl::Drop).await {
            tracing::debug!("a wish was not sent: {error}");
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn only_whole_pictures_are_taken_out_of_a_message() {
        let jpeg = [0xff, 0xd8, 7, 0xff, 0xd9];
        let mut message = vec![0; offset_of!(Still, bytes)];
        message[offset_of!(Still, capture_ns)..][..8].copy_from_slice(&77_u64.to_le_bytes());
        message[offset_of!(Still, length)..][..4].copy_from_slice(&5_u32.to_le_bytes());
        message.extend(jpeg);
        assert_eq!(still_in(&message), Some((77, &jpeg[..])));
        for length in 0..message.len() {
            assert_eq!(still_in(&message[..length]), None, "{length}");
        }
        let last = message.len() - 1;
        message[last] = 0;
        assert_eq!(still_in(&message), None, "no end of a JPEG");
        message.push(0);
        assert_eq!(still_in(&message), None, "longer than it says");
    }

    #[test]
    fn a_wish_is_said_until_nobody_has_asked_for_a_while() {
        let camera = Camera::default();
        let now = Instant::now();
        assert_eq!(camera.wish(now), None);
        camera.wants().stills_until = Some(now + WANTED);
        assert_eq!(camera.wish(now).unwrap(), r#"{"still":true,"video":null}"#);
        assert!(camera.wants().said);
        assert_eq!(camera.wish(now + WANTED), None);
        assert!(!camera.wants().said);
    }
}
