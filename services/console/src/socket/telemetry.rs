//! `/ws/telemetry`: what the drone says, orders and their answers, lines of the event log.

use super::{End, Heard, Listener, NOT_UNDERSTOOD, Open, both};
use crate::fleet::{Asking, is_topic};
use crate::mailbox::SLOTS;
use crate::table::{Says, message_rule};
use axum::extract::ws::WebSocket;
use serde::Deserialize;
use std::sync::Arc;

/// Messages of a page a second, on average: clicks, and a change of view now and then.
const MESSAGES: f64 = 20.0;
/// Topics that a page may look at.
const TOPICS: usize = SLOTS;

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum Said {
    Subscribe(Vec<String>),
    Order(Asking),
}

pub(super) async fn run(open: Open, socket: WebSocket) {
    let open = Arc::new(open);
    let Some(rule) = message_rule(open.socket, Says::Subscribe) else { return };
    open.drone.watch(&open.page);
    both(open, socket, rule.least, MESSAGES, &mut Viewer).await;
}

/// A page that looks.
struct Viewer;

impl Listener for Viewer {
    async fn heard(&mut self, open: &Arc<Open>, heard: Heard) -> Result<(), End> {
        let Heard::Text(text) = heard else {
            return Err((NOT_UNDERSTOOD, "this socket takes JSON, not bytes"));
        };
        match serde_json::from_str::<Said>(&text) {
            Ok(Said::Order(asking)) => open.order(asking),
            Ok(Said::Subscribe(topics)) => {
                if topics.len() > TOPICS {
                    open.complain(&format!("{} topics: up to {TOPICS} may be subscribed", topics.len()));
                } else if let Some(wrong) = topics.iter().find(|topic| !is_topic(topic)) {
                    open.complain(&format!("{wrong:?} is no topic"));
                } else {
                    open.app.fleet.want(&open.drone, &open.page, &topics).await;
                }
                Ok(())
            }
            Err(error) => {
                open.complain(&format!("this is not understood: {error}"));
                Ok(())
            }
        }
    }
}
