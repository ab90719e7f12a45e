//! Orders: queries that name who gives them, answered in a sentence.

use super::{Drone, Fleet};
use crate::app::random;
use crate::role::Role;
use crate::secret::hexadecimal;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use zenoh::Wait;
use zenoh::handlers::FifoChannelHandler;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Reply;

/// After this nobody waits for the drone's answer any more: working out a route takes it ten seconds at most.
const PATIENCE: Duration = Duration::from_millis(10_500);
/// A drone that has just been found gives its first beacon within this time: they come 20 a second.
const FIRST_BEACON: Duration = Duration::from_millis(500);
/// Longest sentence that is taken from a drone, bytes.
const SENTENCE: usize = 500;

/// What comes back of a query.
type Replies = FifoChannelHandler<Reply>;

/// What a page asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Asking {
    /// The page's number for it.
    pub(crate) id: u64,
    pub(crate) verb: String,
    #[serde(default)]
    pub(crate) x_m: Option<f64>,
    #[serde(default)]
    pub(crate) y_m: Option<f64>,
    #[serde(default)]
    pub(crate) lease: Option<u64>,
}

/// Who gives it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Giver<'a> {
    pub(crate) account: &'a str,
    pub(crate) role: Role,
    pub(crate) socket: u64,
}

#[derive(Serialize)]
struct Payload<'a> {
    id: String,
    beacon_ns: u64,
    account: &'a str,
    role: &'a str,
    socket: u64,
    lease: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    x_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_m: Option<f64>,
}

/// What comes back.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
pub(crate) struct Answer {
    pub(crate) accepted: bool,
    #[serde(default)]
    pub(crate) text: String,
}

impl Answer {
    pub(crate) fn refused(text: impl Into<String>) -> Self {
        Self { accepted: false, text: text.into() }
    }
}

impl Fleet {
    /// Gives an order once and waits for its answer. Never again by itself: a human decides.
    pub(crate) async fn order(
        &self,
        drone: &Drone,
        verb: &'static str,
        asking: &Asking,
        giver: Giver<'_>,
    ) -> Answer {
        let place = (asking.x_m.filter(|x| x.is_finite()), asking.y_m.filter(|y| y.is_finite()));
        if (verb == "goto") != (place.0.is_some() && place.1.is_some()) {
            return Answer::refused("x_m and y_m belong to goto, both, and to nothing else");
        }
        let Some(beacon_ns) = drone.fresh_beacon().await else {
            return Answer::refused("the drone is not reached");
        };
        let Ok(id) = random::<8>() else { return Answer::refused("the system has no random numbers") };
        let payload = Payload {
            id: hexadecimal(&id),
            beacon_ns,
            account: giver.account,
            role: giver.role.word(),
            socket: giver.socket,
            lease: asking.lease.unwrap_or(0),
            x_m: place.0,
            y_m: place.1,
        };
        let Ok(payload) = serde_json::to_vec(&payload) else {
            return Answer::refused("the order cannot be written");
        };
        let key = format!("sereno/{}/command/{verb}/{}", drone.name, self.certificate);
        // Before all telemetry. A machine that is short of time may have no place in the queue for some milliseconds, and a stop
        // must not be dropped for that; where there is none for half a second, the link is cut (`zenoh_config`). The answer comes
        // back by the same rules.
        let session = self.session.clone();
        let ask = move || {
            session
                .get(key)
                .payload(payload)
                .encoding("application/json")
                .priority(Priority::RealTime)
                .congestion_control(CongestionControl::Block)
                .express(true)
                .timeout(PATIENCE)
                .wait()
        };
        let Ok(replies) = tokio::task::spawn_blocking(ask).await else {
            return Answer::refused("the order cannot be sent: the console is ending");
        };
        let replies = match replies {
            Ok(replies) => replies,
            Err(error) => return Answer::refused(format!("the order cannot be sent: {error}")),
        };
        answer_of(&replies, PATIENCE).await
    }
}

impl Drone {
    /// The newest beacon, waited for a moment when the drone has just been found; `None` when it is not reached.
    pub(super) async fn fresh_beacon(&self) -> Option<u64> {
        let mut beacons = self.beacon_ns.subscribe();
        let beacon = tokio::time::timeout(FIRST_BEACON, beacons.wait_for(|beacon_ns| *beacon_ns != 0));
        match beacon.await {
            Ok(Ok(beacon_ns)) if self.is_alive() => Some(*beacon_ns),
            _ => None,
        }
    }
}

/// The answer of the one drone that was asked.
pub(super) async fn answer_of(replies: &Replies, patience: Duration) -> Answer {
    let reply = tokio::time::timeout(patience, replies.recv_async()).await;
    let Ok(Ok(reply)) = reply else { return Answer::refused("the drone has not answered") };
    let bytes = match reply.result() {
        Ok(sample) => sample.payload().to_bytes(),
        Err(error) => error.payload().to_bytes(),
    };
    let mut answer = serde_json::from_slice(&bytes)
        .unwrap_or_else(|_| Answer::refused("the drone's answer is not understood"));
    crate::text::shorten(&mut answer.text, SENTENCE);
    answer
}
