//! WebSockets: what they have in common. Each has a task that reads and one that writes, so that a page that reads slowly
//! can still say stop.

mod flood;
mod signal;
mod sticks;
mod telemetry;

use crate::app::{App, random};
use crate::fleet::{Answer, Asking, Box, Drone, Giver};
use crate::gate::Asked;
use crate::refusal::Refusal;
use crate::round::Event;
use crate::secret::Digest;
use crate::server::Held;
use crate::store::Kind;
use crate::table::{Action, Message as Rule, order_rule};
use crate::{Account, Role};
use axum::body::Body;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, WebSocketUpgrade};
use axum::http::Response;
use flood::Bucket;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use std::net::IpAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, watch};
use tokio::time::Instant;

/// A page that takes no message for so long is hung up on.
const STALLED: Duration = Duration::from_secs(10);
/// A page is asked whether it is there this often, and hung up on after three times without a word.
const PING: Duration = Duration::from_secs(15);
/// Expiry is looked for this often; what an administrator changes counts at once.
const EXPIRY: Duration = Duration::from_secs(1);
/// Orders of one socket that wait for their answers.
const ORDERS: usize = 8;

/// Close codes of our own (RFC 6455 7.4.2: 4000 to 4999 are for applications).
const LOGGED_OUT: u16 = 4401;
const NOT_ALLOWED: u16 = 4403;
/// RFC 6455 7.4.1.
const NOT_UNDERSTOOD: u16 = 1008;

/// A socket that has been opened.
pub(crate) struct Open {
    app: Arc<App>,
    drone: Arc<Drone>,
    session: Digest,
    address: IpAddr,
    socket: Action,
    /// Its number: a lease belongs to one. Drawn at random, so that none comes again after a restart or on another console.
    number: u64,
    page: Box,
    orders: Arc<Semaphore>,
    /// Given back when the socket ends.
    _held: Option<Held>,
}

/// Why a socket is closed.
type End = (u16, &'static str);

/// Answers the handshake.
pub(crate) fn open(
    action: Action,
    asked: Asked,
    upgrade: WebSocketUpgrade,
) -> Result<Response<Body>, Refusal> {
    let (_, session) = *asked.account()?;
    let missing = || Refusal::missing(format!("nothing has been heard of {} yet", asked.drone));
    let open = Open {
        drone: asked.app.fleet.drone(&asked.drone).ok_or_else(missing)?,
        // 52 bits: a number of JavaScript.
        number: (u64::from_le_bytes(random::<8>()?) >> 12).max(1),
        app: asked.app,
        session,
        address: asked.address,
        socket: action,
        page: Box::default(),
        orders: Arc::new(Semaphore::new(ORDERS)),
        _held: asked.held,
    };
    Ok(upgrade.on_upgrade(move |socket| async move {
        match action {
            Action::Sticks => sticks::run(open, socket).await,
            Action::Signal => signal::run(open, socket).await,
            _ => telemetry::run(open, socket).await,
        }
    }))
}

impl Open {
    /// Who is on this socket and may still say this. Asked for every message.
    fn allowed(&self, least: Role) -> Result<Account, End> {
        let account = self.app.who(&self.session).ok_or((LOGGED_OUT, "log in again"))?;
        if account.role < least || !account.may_see(&self.drone.name) {
            return Err((NOT_ALLOWED, "this is no longer allowed to you"));
        }
        Ok(account)
    }

    /// A human did something.
    fn seen(&self) {
        self.app.seen(&self.session);
    }

    fn line(&self, value: &serde_json::Value) {
        self.page.line(Message::Text(Utf8Bytes::from(value.to_string())));
    }

    fn complain(&self, sentence: &str) {
        self.line(&serde_json::json!({ "error": sentence }));
    }

    fn answer(&self, id: u64, answer: &Answer) {
        self.line(&serde_json::json!({
            "answer": { "id": id, "accepted": answer.accepted, "text": answer.text }
        }));
    }

    /// Gives an order if the table allows it on this socket to this account. Its answer goes to the page, the log, the
    /// event log and the report; the log does not hold the order up.
    fn order(self: &Arc<Self>, asking: Asking) -> Result<(), End> {
        let Some((Rule { least, .. }, verb)) = order_rule(self.socket, &asking.verb) else {
            self.answer(asking.id, &Answer::refused("there is no such order here"));
            return Ok(());
        };
        // A role that never sufficed is told so; one that was taken away ends the socket at the next look.
        let account = self.app.who(&self.session).ok_or((LOGGED_OUT, "log in again"))?;
        if account.role < *least || !account.may_see(&self.drone.name) {
            let text = format!("this needs the role {}, and yours is {}", least.word(), account.role.word());
            let answer = Answer::refused(text);
            self.answer(asking.id, &answer);
            let open = self.clone();
            tokio::spawn(async move { open.write_down(&account, verb, &answer).await });
            return Ok(());
        }
        self.seen();
        let Ok(turn) = self.orders.clone().try_acquire_owned() else {
            self.answer(asking.id, &Answer::refused("too many orders at once"));
            return Ok(());
        };
        let open = self.clone();
        tokio::spawn(async move {
            let giver = Giver { account: &account.email, role: account.role, socket: open.number };
            let answer = open.app.fleet.order(&open.drone, verb, &asking, giver).await;
            open.answer(asking.id, &answer);
            drop(turn);
            let mut event = Event::new(open.app.clock.now_ms(), "order", answer.text.clone());
            event.account.clone_from(&account.email);
            event.verb = verb.to_owned();
            event.accepted = Some(answer.accepted);
            open.app.fleet.ordered(&open.drone, &event);
            open.write_down(&account, verb, &answer).await;
        });
        Ok(())
    }

    async fn write_down(&self, account: &Account, verb: &str, answer: &Answer) {
        let mut entry = self.app.entry(Kind::Order, account, self.address);
        entry.drone = self.drone.name.to_string();
        verb.clone_into(&mut entry.verb);
        entry.answer = format!("{}: {}", if answer.accepted { "accepted" } else { "refused" }, answer.text);
        if let Err(error) = self.app.store.log(entry).await {
            tracing::error!("an order was not written down: {error}");
        }
    }
}

/// What a page said.
enum Heard {
    Text(Utf8Bytes),
    Binary,
}

/// The reading half, with everything that ends a socket: silence, floods, what is taken away, what is too large.
struct Reader {
    stream: SplitStream<WebSocket>,
    changed: watch::Receiver<u64>,
    heard: Instant,
    bucket: Bucket,
    least: Role,
    began: Instant,
}

impl Reader {
    fn new(open: &Open, stream: SplitStream<WebSocket>, least: Role, per_second: f64) -> Self {
        let now = Instant::now();
        Self {
            stream,
            changed: open.app.watch(),
            heard: now,
            bucket: Bucket::new(per_second),
            least,
            began: now,
        }
    }

    /// The next message; `Err(None)` when the page is gone.
    async fn next(&mut self, open: &Open) -> Result<Heard, Option<End>> {
        loop {
            let message = tokio::select! {
                message = tokio::time::timeout(EXPIRY, self.stream.next()) => message,
                _ = self.changed.changed() => {
                    open.allowed(self.least).map_err(Some)?;
                    continue;
                }
            };
            let Ok(message) = message else {
                open.allowed(self.least).map_err(Some)?;
                if self.heard.elapsed() > 3 * PING {
                    return Err(None);
                }
                continue;
            };
            self.heard = Instant::now();
            if !self.bucket.take(self.began.elapsed()) {
                return Err(Some((NOT_UNDERSTOOD, "too many messages")));
            }
            match message {
                None | Some(Err(_) | Ok(Message::Close(_))) => return Err(None),
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Text(text))) => return Ok(Heard::Text(text)),
                Some(Ok(Message::Binary(_))) => return Ok(Heard::Binary),
            }
        }
    }
}

/// Writes what waits for the page until `end` says why it is over.
async fn write(
    page: Box,
    mut sink: SplitSink<WebSocket, Message>,
    end: tokio::sync::oneshot::Receiver<Option<End>>,
) {
    let mut ping = tokio::time::interval_at(Instant::now() + PING, PING);
    tokio::pin!(end);
    let reason = loop {
        let message = tokio::select! {
            reason = &mut end => break reason.ok().flatten(),
            message = page.next() => message,
            _ = ping.tick() => Message::Ping(axum::body::Bytes::new()),
        };
        let sent = tokio::select! {
            sent = tokio::time::timeout(STALLED, sink.send(message)) => sent,
            reason = &mut end => break reason.ok().flatten(),
        };
        if !matches!(sent, Ok(Ok(()))) {
            return;
        }
    };
    let close = reason.map(|(code, text)| CloseFrame { code, reason: Utf8Bytes::from_static(text) });
    // A page that takes nothing does not take this either.
    let _ = tokio::time::timeout(Duration::from_secs(1), sink.send(Message::Close(close))).await;
}

/// What a kind of socket does with what a page says.
trait Listener: Send {
    /// Takes one message, or ends the socket.
    fn heard(&mut self, open: &Arc<Open>, heard: Heard) -> impl Future<Output = Result<(), End>> + Send;
}

/// Runs both halves until one ends.
async fn both(
    open: Arc<Open>,
    socket: WebSocket,
    least: Role,
    per_second: f64,
    listener: &mut impl Listener,
) {
    let (sink, stream) = socket.split();
    let mut reader = Reader::new(&open, stream, least, per_second);
    let (end, ended) = tokio::sync::oneshot::channel();
    let mut writer = tokio::spawn(write(open.page.clone(), sink, ended));
    let reason = loop {
        let heard = tokio::select! {
            heard = reader.next(&open) => heard,
            _ = &mut writer => break None,
        };
        match heard {
            Ok(heard) => {
                if let Err(end) = listener.heard(&open, heard).await {
                    break Some(end);
                }
            }
            Err(reason) => break reason,
        }
    };
    open.app.fleet.close(&open.drone, &open.page);
    let _ = end.send(reason);
    if !writer.is_finished() {
        let _ = writer.await;
    }
}
