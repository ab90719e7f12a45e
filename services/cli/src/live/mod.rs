//! `sereno foxglove`: what a drone says over zenoh, for the Foxglove app on this machine.
//!
//! Foxglove's WebSocket knows neither certificates nor passwords. So it listens on this machine alone unless somebody says
//! in so many words that everybody may watch, and nothing comes in by it: no order, no parameter, no service.

mod channels;
mod clock;
mod scene;
mod schema;

use anyhow::{Context, Result, bail};
use bridge::remote::{Following, Heard, Remote};
use channels::Channels;
use clap::Args;
use cli::interrupt::Interrupt;
use foxglove::websocket::{ChannelView, Client, ServerListener};
use serde_json::json;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Between two looks whether somebody pressed Ctrl-C, or watches something else.
const GLANCE: Duration = Duration::from_millis(100);
/// A wish for pictures holds for two seconds.
const WISH: Duration = Duration::from_secs(1);
/// Messages of a drone that wait to be passed on, and messages that wait for one app; more are dropped.
const WAITING: usize = 256;
/// Without these nothing can be put where it is.
const ALWAYS: [&str; 2] = ["localization/pose", "sonar/ranges"];

/// Where the app finds this program.
#[derive(Debug, Clone, Args)]
pub(crate) struct Foxglove {
    /// Port that the Foxglove app connects to; 0: any that is free.
    #[arg(long, default_value_t = 8765)]
    pub(crate) port: u16,
    /// Address to listen on.
    #[arg(long, default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    pub(crate) address: IpAddr,
    /// Listen on an address that others reach: whoever does sees everything, pictures too, without certificate or password.
    #[arg(long)]
    pub(crate) everybody_may_watch: bool,
}

impl Foxglove {
    fn check(&self) -> Result<SocketAddr> {
        if !self.address.is_loopback() && !self.everybody_may_watch {
            bail!(
                "--address {}: allowed is this machine alone (127.0.0.1, ::1), as Foxglove's WebSocket asks nobody for a \
                 certificate or password; with --everybody-may-watch, any",
                self.address
            );
        }
        Ok(SocketAddr::new(self.address, self.port))
    }
}

/// Notes which channels somebody has begun to watch.
#[derive(Debug, Default)]
struct Begun {
    topics: Mutex<Vec<String>>,
    count: AtomicU64,
}

impl Begun {
    /// What was begun since the last look.
    fn take(&self) -> Vec<String> {
        std::mem::take(&mut *self.topics.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl ServerListener for Begun {
    fn on_subscribe(&self, _: Client, channel: ChannelView) {
        self.count.fetch_add(1, Ordering::Relaxed);
        let mut topics = self.topics.lock().unwrap_or_else(PoisonError::into_inner);
        // Bounded by the number of channels, however often somebody comes and goes between two looks.
        if !topics.iter().any(|topic| topic == channel.topic()) {
            topics.push(channel.topic().to_owned());
        }
    }
}

/// Subscriptions to what is watched now.
struct Watched<'a> {
    remote: &'a Remote,
    following: BTreeMap<String, Following>,
    to: SyncSender<(String, Heard)>,
    wished: Option<Instant>,
}

impl Watched<'_> {
    /// Follows what `channels` has viewers for, and nothing else: a drone's link is narrow.
    fn adjust(&mut self, topics: &[String], channels: &Channels) -> Result<()> {
        for topic in topics {
            let wanted = ALWAYS.contains(&topic.as_str()) || channels.is_watched(topic);
            if !wanted {
                self.following.remove(topic);
            } else if !self.following.contains_key(topic) {
                let following =
                    self.remote.follow_into(topic, self.to.clone()).map_err(anyhow::Error::msg)?;
                self.following.insert(topic.clone(), following);
            }
        }
        Ok(())
    }

    /// Keeps the camera awake while its pictures are watched; another number asks for a key frame, where a decoder can begin.
    fn wish(&mut self, key_requests: u64) -> Result<()> {
        if self.wished.is_some_and(|wished| wished.elapsed() < WISH) {
            return Ok(());
        }
        self.wished = Some(Instant::now());
        let wish = json!({ "video": { "width": 640, "height": 480, "fps": 15 }, "still": false, "rolling": true,
            "key_requests": key_requests });
        self.remote.wish(&wish.to_string()).map_err(anyhow::Error::msg)
    }
}

/// Passes on what the drone says until Ctrl-C.
pub(crate) fn run(remote: &Remote, order: &Foxglove, json: bool) -> Result<ExitCode> {
    let address = order.check()?;
    let stop = Interrupt::catch()?;
    let about = remote.about().map_err(anyhow::Error::msg)?;
    let plan = remote.plan().map_err(anyhow::Error::msg)?;
    let context = foxglove::Context::new();
    let mut channels = Channels::open(&context, &about, &plan)?;
    let topics = channels.topics();
    let begun = Arc::new(Begun::default());
    let host = match address.ip() {
        IpAddr::V4(four) => four.to_string(),
        IpAddr::V6(six) => format!("[{six}]"),
    };
    let server = context
        .websocket_server()
        .name(format!("Sereno: {}", remote.drone()))
        .bind(host.clone(), address.port())
        .message_backlog_size(WAITING)
        .listener(begun.clone())
        .start_blocking()
        .with_context(|| format!("cannot listen on {address}"))?;
    let url = format!("ws://{host}:{}", server.port());
    if json {
        println!("{}", json!({ "drone": remote.drone(), "url": url }));
    } else {
        println!(
            "{}: {url} (in Foxglove: open connection, Foxglove WebSocket; Ctrl-C ends it)",
            remote.drone()
        );
    }
    let (to, heard) = sync_channel(WAITING);
    let mut watched = Watched { remote, following: BTreeMap::new(), to, wished: None };
    let mut looked = None::<Instant>;
    while !stop.came() {
        match heard.recv_timeout(GLANCE) {
            Ok((topic, heard)) => channels.take(&topic, &heard),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => bail!("the connection has ended"),
        }
        if looked.is_some_and(|looked| looked.elapsed() < GLANCE) {
            continue;
        }
        looked = Some(Instant::now());
        let fresh = begun.take();
        watched.adjust(&topics, &channels)?;
        channels.show_again(&fresh);
        if channels.shows_video() {
            watched.wish(begun.count.load(Ordering::Relaxed))?;
        }
    }
    drop(server.stop());
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_machine_unless_somebody_says_otherwise() {
        let order = |address: &str, everybody_may_watch| Foxglove {
            port: 8765,
            address: address.parse().unwrap_or(IpAddr::V4(Ipv4Addr::BROADCAST)),
            everybody_may_watch,
        };
        for own in ["127.0.0.1", "::1", "127.3.2.1"] {
            assert!(order(own, false).check().is_ok(), "{own}");
        }
        for other in ["0.0.0.0", "::", "192.168.4.20", "fe80::1"] {
            let error = order(other, false).check().map_err(|error| error.to_string());
            assert!(
                error.is_err_and(|error| error.contains(other) && error.contains("127.0.0.1")),
                "{other}"
            );
            assert!(order(other, true).check().is_ok(), "{other}");
        }
    }
}
