//! One viewer: from its call to its end.

use crate::message::{Offer, Status};
use crate::peer::{Event, Peer, key_requested};
use crate::rate::Report;
use crate::viewer::{LineState, Viewer};
use crate::{Call, FromViewer, StreamConfig, ToViewer};
use bytes::Bytes;
use ipc_types::Format;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::{Instant, interval, timeout};
use webrtc::peer_connection::RTCPeerConnectionState as State;

/// Frames that wait for a viewer: more would only be older when they come.
pub(crate) const QUEUE: usize = 3;
/// A viewer that is not connected by then is given up, and one that was lost as soon.
const CONNECT: Duration = Duration::from_secs(20);
const LOST: Duration = Duration::from_secs(8);
/// A frame that cannot leave by then is left where it is.
const SEND: Duration = Duration::from_millis(200);
/// A viewer that has told nothing of its line for so long is gone, whatever its connection says: one over TCP that has stopped
/// reading looks connected for a quarter of an hour.
const GONE: Duration = Duration::from_secs(30);
/// The library may be waiting for a line that is full.
const PATIENCE: Duration = Duration::from_secs(1);
/// Candidates that one session may name.
const CANDIDATES: usize = 64;

/// An encoded frame on its way to viewers.
#[derive(Clone, Debug)]
pub(crate) struct Unit {
    pub bytes: Bytes,
    pub capture_ns: u64,
    pub key: bool,
    pub format: Format,
}

/// What all viewers are told of the choice.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Told {
    pub chosen_by: String,
    /// Number of the session of whoever holds the sticks; 0 for nobody.
    pub pilot: u64,
}

/// The ends that a session holds.
pub(crate) struct Ends {
    pub config: Arc<StreamConfig>,
    pub number: u64,
    /// Counts sessions.
    pub since: u64,
    /// From the viewer.
    pub inbox: mpsc::Receiver<FromViewer>,
    /// To the viewer.
    pub say: mpsc::Sender<ToViewer>,
    pub frames: mpsc::Receiver<Arc<Unit>>,
    pub told: watch::Receiver<Told>,
    /// Counts requests for key frames of all viewers.
    pub key_requests: Arc<AtomicU64>,
    /// Frames that found this viewer's queue full.
    pub dropped: Arc<AtomicU64>,
    pub line: Arc<LineState>,
}

/// Runs a session to its end; the sentence says why it ended.
pub(crate) async fn run(call: Call, mut ends: Ends) -> String {
    let (events, mut heard) = mpsc::channel(64);
    let (tell, mut reports) = watch::channel(None);
    let mut peer = match Peer::new(&ends.config, call.mode, ends.number, events, tell).await {
        Ok(peer) => peer,
        Err(error) => return format!("no connection can be set up: {error}"),
    };
    let mut viewer = Viewer::new(&call, &ends);
    let why = talk(&mut peer, &mut ends, &mut heard, &mut reports, &mut viewer).await;
    // What cannot be closed in time is waiting for a line that is full, and ends with it.
    let _ = timeout(PATIENCE, peer.close()).await;
    why
}

async fn talk(
    peer: &mut Peer,
    ends: &mut Ends,
    heard: &mut mpsc::Receiver<Event>,
    reports: &mut watch::Receiver<Option<Report>>,
    viewer: &mut Viewer,
) -> String {
    match peer.offer().await {
        Ok(sdp) => {
            let offer = Offer { sdp, servers: ends.config.servers.clone() };
            if ends.say.send(ToViewer::Offer(offer)).await.is_err() {
                return "the drone stops".to_owned();
            }
        }
        Err(error) => return format!("no offer can be made: {error}"),
    }
    let track = peer.track();
    let mut second = interval(Duration::from_secs(1));
    let mut deadline = Some(Instant::now() + CONNECT);
    let (mut candidates, mut answered, mut listening) = (0, false, true);
    let mut early = Vec::new();
    let mut last = None::<Arc<Unit>>;
    loop {
        let overdue = async {
            match deadline {
                Some(at) => tokio::time::sleep_until(at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = overdue => return "the connection was lost, or never came about".to_owned(),
            message = ends.inbox.recv() => match message {
                None => return "the drone stops".to_owned(),
                Some(FromViewer::HangUp(reason)) => return reason.reason,
                Some(FromViewer::Call(call)) => {
                    peer.set_mode(call.mode);
                    viewer.wants(&call, ends);
                }
                Some(FromViewer::Answer(answer)) => {
                    if answered {
                        let _ = ends.say.try_send(ToViewer::error("this session has had its answer"));
                        continue;
                    }
                    if let Err(error) = peer.answer(answer.sdp).await {
                        return format!("the answer cannot be used: {error}");
                    }
                    answered = true;
                    for candidate in early.drain(..) {
                        let _ = peer.candidate(candidate).await;
                    }
                }
                Some(FromViewer::Candidate(candidate)) => {
                    candidates += 1;
                    if candidates > CANDIDATES {
                        return format!("more than {CANDIDATES} candidates");
                    }
                    if !answered {
                        early.push(candidate);
                    } else if let Err(error) = peer.candidate(candidate).await {
                        let _ = ends.say.try_send(ToViewer::error(format!("a candidate cannot be used: {error}")));
                    }
                }
            },
            event = heard.recv() => match event {
                None => return "the connection has ended".to_owned(),
                Some(Event::Candidate(candidate)) => {
                    let _ = ends.say.send(ToViewer::Candidate(candidate)).await;
                }
                Some(Event::State(State::Connected)) => {
                    (deadline, listening) = (None, true);
                    viewer.connected(ends);
                }
                Some(Event::State(State::Failed | State::Closed)) => return "the connection has ended".to_owned(),
                Some(Event::State(State::Disconnected)) => deadline = Some(Instant::now() + LOST),
                Some(Event::State(_)) => {}
            },
            more = key_requested(&track), if viewer.is_connected() && listening => {
                // A track that is not bound hears nothing; the connection's own state says when it has ended.
                listening = more;
                if more {
                    viewer.ask_for_key(ends);
                }
            },
            Ok(()) = reports.changed() => {
                let report = *reports.borrow_and_update();
                if let Some(report) = report {
                    viewer.reported(&report, ends);
                }
            },
            unit = ends.frames.recv() => {
                let Some(unit) = unit else { return "the drone stops".to_owned() };
                if !viewer.gets(&unit, ends) {
                    continue;
                }
                // A line that is full: what is late is left out, and the viewer goes on with the next key frame.
                if !matches!(timeout(SEND, peer.send(&unit.bytes, unit.capture_ns)).await, Ok(Ok(()))) {
                    ends.dropped.fetch_add(1, Ordering::Relaxed);
                }
                last = Some(unit);
            },
            _ = second.tick() => {
                if viewer.silence(ends) > GONE {
                    return "nothing was heard of the viewer's line".to_owned();
                }
                if let Some(unit) = &last {
                    let status = Status {
                        width: unit.format.width,
                        height: unit.format.height,
                        fps: unit.format.fps,
                        bitrate: unit.format.bitrate,
                        path: timeout(PATIENCE, peer.path()).await.unwrap_or_default(),
                        chosen_by: ends.told.borrow().chosen_by.clone(),
                        age_ms: (runtime::monotonic_ns().saturating_sub(unit.capture_ns) / 1_000_000) as u32,
                        dropped: ends.dropped.load(Ordering::Relaxed),
                    };
                    let _ = ends.say.try_send(ToViewer::Status(status));
                }
            },
        }
    }
}
