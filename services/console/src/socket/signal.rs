//! `/ws/signal`: WebRTC's messages both ways, one session a socket. What they mean is between page and drone.

use super::{End, Heard, Listener, NOT_UNDERSTOOD, Open, both};
use crate::Role;
use crate::app::random;
use crate::fleet::Signal;
use crate::secret::hexadecimal;
use crate::table::{Says, message_rule};
use axum::extract::ws::WebSocket;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Messages of a page a second, on average: an answer and some candidates.
const MESSAGES: f64 = 20.0;

pub(super) async fn run(open: Open, socket: WebSocket) {
    let open = Arc::new(open);
    let Some(rule) = message_rule(open.socket, Says::Signal) else { return };
    let least = rule.least;
    let Ok(session) = random::<8>().map(|bytes| hexadecimal(&bytes)) else { return };
    let signal = match open.app.fleet.signal(&open.drone, &session, &open.page).await {
        Ok(signal) => signal,
        Err(error) => {
            tracing::warn!("no signalling with {}: {error}", open.drone.name);
            return;
        }
    };
    let mut caller = Caller { least, signal, calls: false };
    both(open.clone(), socket, least, MESSAGES, &mut caller).await;
    if caller.calls {
        // The page is gone without a word: the drone need not wait for it.
        let hang_up = serde_json::json!({ "hang_up": { "reason": "the page is gone" } });
        if let Err(error) = open.app.fleet.say(&caller.signal, hang_up.to_string()).await {
            tracing::debug!("{} was not told that a page is gone: {error}", open.drone.name);
        }
    }
}

/// A page that wants video.
struct Caller {
    least: Role,
    signal: Signal,
    /// It has said something, and not that it hangs up.
    calls: bool,
}

impl Listener for Caller {
    async fn heard(&mut self, open: &Arc<Open>, heard: Heard) -> Result<(), End> {
        let Heard::Text(text) = heard else {
            return Err((NOT_UNDERSTOOD, "this socket takes JSON, not bytes"));
        };
        open.allowed(self.least)?;
        // The drone gets nothing that is no JSON object.
        match serde_json::from_str::<BTreeMap<String, serde::de::IgnoredAny>>(&text) {
            Ok(said) => {
                self.calls = !said.contains_key("hang_up");
                if let Err(error) = open.app.fleet.say(&self.signal, text.to_string()).await {
                    open.complain(&format!("the drone is not reached: {error}"));
                }
            }
            Err(error) => open.complain(&format!("this is not understood: {error}")),
        }
        Ok(())
    }
}
