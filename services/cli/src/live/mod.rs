//! `sereno foxglove`: what a drone says over zenoh, for the Foxglove app on this machine.
//!
//! Foxglove's WebSocket knows neither certificates nor passwords. So it is for this machine alone and for no page of
//! strangers ([`door`]), and nothing comes in by it: no order, no parameter, no service.

mod channels;
mod clock;
mod door;
mod link;
mod scene;
mod schema;
mod tally;
mod watch;

use anyhow::{Context as _, Result, bail};
use bridge::remote::{Heard, Remote};
use channels::Channels;
use clap::Args;
use cli::interrupt::Interrupt;
use door::Door;
use foxglove::WebSocketServerHandle;
use foxglove::websocket::{Status, StatusLevel};
use link::{Change, Link};
use serde_json::json;
use std::net::SocketAddr;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};
use tally::Tally;
use watch::{Begun, Watched};

/// Between two looks whether somebody pressed Ctrl-C, or watches something else.
const GLANCE: Duration = Duration::from_millis(100);
/// Messages of a drone that wait to be passed on, and messages that wait for one app; older ones are dropped.
const WAITING: usize = 256;
/// The app's name for what it shows while the drone is silent.
const SILENT: &str = "silent";

/// Where the app finds this program, and which pages may.
#[derive(Debug, Clone, Args)]
pub(crate) struct Foxglove {
    /// Port of this machine (127.0.0.1) that the Foxglove app connects to; 0: any that is free.
    #[arg(long, default_value_t = 8765)]
    pub(crate) port: u16,
    /// Let pages of this origin watch too, such as http://localhost:8080: Foxglove's own need not be named. May be said again.
    #[arg(long, value_parser = door::origin)]
    pub(crate) origin: Vec<String>,
}

/// What the drone says of itself, and its plan's picture.
fn ask(remote: &Remote) -> Result<(serde_json::Value, Vec<u8>)> {
    let about = remote.about().map_err(anyhow::Error::msg)?;
    Ok((about, remote.plan().map_err(anyhow::Error::msg)?))
}

/// Passes on what the drone says until Ctrl-C.
pub(crate) fn run(remote: &Remote, order: &Foxglove, json: bool) -> Result<ExitCode> {
    let stop = Interrupt::catch()?;
    let door = Door::take(order.port).with_context(|| {
        format!("cannot listen on port {} of this machine: choose another with --port", order.port)
    })?;
    let (about, picture) = ask(remote)?;
    let context = foxglove::Context::new();
    let mut channels = Channels::open(&context, &about, &picture)?;
    let begun = Arc::new(Begun::default());
    let hidden = door::hidden_address()?;
    let server = context
        .websocket_server()
        .name(format!("Sereno: {}", remote.drone()))
        .bind(hidden.to_string(), 0)
        .capabilities([])
        .message_backlog_size(WAITING)
        .listener(begun.clone())
        .start_blocking()
        .context("cannot start Foxglove's server on this machine")?;
    let mut origins: Vec<_> = door::FOXGLOVE.map(str::to_owned).to_vec();
    origins.extend(order.origin.iter().cloned());
    let url = format!("ws://{}", door.address());
    let pages = origins.join(", ");
    door.open(SocketAddr::from((hidden, server.port())), origins.clone())?;
    if json {
        println!("{}", json!({ "drone": remote.drone(), "url": url, "origins": origins }));
    } else {
        println!(
            "{}: {url} (in Foxglove: open connection, Foxglove WebSocket; Ctrl-C ends it). Any program on this machine may \
             watch, pictures too; of pages in a browser those of {pages} alone",
            remote.drone()
        );
    }
    let (to, heard) = sync_channel(WAITING);
    let mut watched = Watched::new(remote, to);
    let tally = pass_on(remote, &server, &mut channels, &mut watched, &heard, &begun, &stop)?;
    drop(server.stop());
    let (passed, not_understood, lost) = (tally.passed(), tally.not_understood(), watched.lost());
    if json {
        println!("{}", json!({ "passed": passed, "not_understood": not_understood, "lost": lost }));
    } else {
        println!(
            "{passed} messages passed on, {not_understood} not understood, {lost} lost by coming too fast"
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn pass_on(
    remote: &Remote,
    server: &WebSocketServerHandle,
    channels: &mut Channels,
    watched: &mut Watched<'_>,
    heard: &Receiver<(String, Heard)>,
    begun: &Begun,
    stop: &Interrupt,
) -> Result<Tally> {
    let mut tally = Tally::default();
    let mut link = Link::new(Instant::now());
    let mut looked = None::<Instant>;
    while !stop.came() {
        match heard.recv_timeout(GLANCE) {
            Ok((topic, heard)) => {
                if let Some(said) = tally.note(&topic, channels.take(&topic, &heard)) {
                    eprintln!("{said}");
                }
                tell(remote.drone(), server, link.hear(Instant::now()));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => bail!("the connection has ended"),
        }
        let now = Instant::now();
        if looked.is_some_and(|looked| now.saturating_duration_since(looked) < GLANCE) {
            continue;
        }
        looked = Some(now);
        let fresh = begun.take();
        watched.adjust(channels)?;
        channels.show_again(&fresh);
        if channels.shows_video() {
            watched.wish(begun.count())?;
        }
        tell(remote.drone(), server, link.look(now));
        link.start(channels.start(), now);
        if link.asks(now) {
            match ask(remote).and_then(|(about, picture)| channels.renew(&about, &picture)) {
                Ok(()) => link.answered(),
                Err(error) => eprintln!("{error:#}; asked again in a moment"),
            }
        }
    }
    Ok(tally)
}

/// Says here and in the app what has become of the drone.
fn tell(drone: &str, server: &WebSocketServerHandle, change: Option<Change>) {
    match change {
        Some(Change::Silent) => {
            let text = format!("{drone} is silent: what is shown is old");
            eprintln!("{text}");
            server.publish_status(Status::new(StatusLevel::Warning, text).with_id(SILENT));
        }
        Some(Change::Back) => {
            eprintln!("{drone} is heard again");
            server.remove_status(vec![SILENT.to_owned()]);
        }
        None => {}
    }
}
