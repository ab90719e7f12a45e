//! `/ws/signal`: WebRTC's messages both ways, one session a socket. What they mean is between page and drone.

use super::{End, Heard, Listener, NOT_UNDERSTOOD, Open, both};
use crate::Role;
use crate::app::random;
use crate::fleet::Signal;
use crate::secret::hexadecimal;
use crate::table::{Says, message_rule};
use axum::extract::ws::WebSocket;
use serde_json::{Map, Value};
use std::sync::Arc;

/// Messages of a page a second, on average: an answer and some candidates.
const MESSAGES: f64 = 20.0;

/// So much of an account's name the drone keeps of whoever holds the sticks.
const ACCOUNT_BYTES: usize = 32;

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

/// Says who calls: whose choice of the picture counts is known by the account, which is not for the page to say.
fn sign(said: &mut Map<String, Value>, account: &str) {
    if let Some(Value::Object(call)) = said.get_mut("call") {
        let mut end = account.len().min(ACCOUNT_BYTES);
        while !account.is_char_boundary(end) {
            end -= 1;
        }
        call.insert("account".to_owned(), account[..end].into());
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
        let account = open.allowed(self.least)?;
        // The drone gets nothing that is no JSON object.
        match serde_json::from_str::<Map<String, Value>>(&text) {
            Ok(mut said) => {
                self.calls = !said.contains_key("hang_up");
                sign(&mut said, &account.email);
                if let Err(error) = open.app.fleet.say(&self.signal, Value::Object(said).to_string()).await {
                    open.complain(&format!("the drone is not reached: {error}"));
                }
            }
            Err(error) => open.complain(&format!("this is not understood: {error}")),
        }
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;

    #[test]
    fn a_page_does_not_say_whose_call_it_is() {
        for text in [r#"{"call":{"width":640}}"#, r#"{"call":{"width":640,"account":"boss@example.org"}}"#] {
            let mut said: Map<String, Value> = serde_json::from_str(text).unwrap();
            sign(&mut said, "ana@example.org");
            assert_eq!(said["call"]["account"], "ana@example.org");
            assert_eq!(said["call"]["width"], 640);
        }
        let mut said: Map<String, Value> = serde_json::from_str(r#"{"call":{}}"#).unwrap();
        sign(&mut said, &"é".repeat(40));
        assert_eq!(said["call"]["account"], "é".repeat(16));
        let mut said: Map<String, Value> = serde_json::from_str(r#"{"answer":{"sdp":"v=0"}}"#).unwrap();
        sign(&mut said, "ana@example.org");
        assert_eq!(Value::Object(said).to_string(), r#"{"answer":{"sdp":"v=0"}}"#);
    }
}
