//! WebRTC's messages between a page and a drone.

use super::footage::Viewer;
use super::{Box, Drone, Fleet};
use axum::extract::ws::{Message, Utf8Bytes};
use std::sync::Arc;
use zenoh::Wait;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};

/// A video session of one page.
pub(crate) struct Signal {
    key: String,
    /// Undeclared with it.
    _out: Subscriber<()>,
    _viewer: Viewer,
}

impl Fleet {
    /// Begins to listen to what the drone says in this session.
    pub(crate) async fn signal(
        &self,
        drone: &Arc<Drone>,
        session: &str,
        page: &Box,
    ) -> Result<Signal, String> {
        let key = format!("sereno/{}/signal/{}/{session}", drone.name, self.certificate);
        let to = Arc::downgrade(page);
        let out = self
            .session
            .declare_subscriber(format!("{key}/out"))
            .callback(move |sample| {
                if sample.payload().len() > crate::gate::MESSAGE_BYTES {
                    return;
                }
                if let (Some(page), Ok(text)) = (to.upgrade(), sample.payload().try_to_string()) {
                    // A queue: none of them replaces another. Too many and the oldest is lost, which ends the session.
                    page.line(Message::Text(Utf8Bytes::from(text.into_owned())));
                }
            })
            .await
            .map_err(|error| error.to_string())?;
        Ok(Signal { key: format!("{key}/in"), _out: out, _viewer: Viewer::of(drone) })
    }

    /// Says something to the drone in a session. None is lost while the link lives; a thread of its own waits for room.
    pub(crate) async fn say(&self, signal: &Signal, text: String) -> Result<(), String> {
        let (session, key) = (self.session.clone(), signal.key.clone());
        let said = tokio::task::spawn_blocking(move || {
            session
                .put(key, text)
                .encoding("application/json")
                .priority(Priority::InteractiveHigh)
                .congestion_control(CongestionControl::Block)
                .express(true)
                .wait()
        });
        said.await.map_err(|error| error.to_string())?.map_err(|error| error.to_string())
    }
}
