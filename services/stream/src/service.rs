//! The service: signals and video between the bus and the viewers.

use crate::hub::{Hub, Who};
use crate::session::Unit;
use crate::{FromViewer, StreamConfig, ToViewer};
use bytes::Bytes;
use ipc_types::{Format, PilotState, SignalIn, SignalOut, Text, Video, Wish};
use runtime::{Input, Output, Ports, Service, Start, StartError};
use std::fmt::Write;

/// A wish is said anew so often, and is good for so long, nanoseconds.
const WISH_EVERY_NS: u64 = 100_000_000;
const WISH_GOOD_NS: u64 = 500_000_000;
/// Wishes of whoever flies go before a recorder's, which go before those of whoever merely watches.
const FLIES: u32 = 2;
const WATCHES: u32 = 0;

/// Sends the camera's video to viewers.
pub struct Stream {
    signals: Input<SignalIn>,
    replies: Output<SignalOut>,
    videos: Input<Video>,
    wishes: Output<Wish>,
    pilot: Input<PilotState>,
    hub: Hub,
    holder: Text<32>,
    wished: Option<Wish>,
    next_wish_ns: u64,
    refused: u64,
    sent: Format,
}

impl Service for Stream {
    const NAME: &'static str = "stream";
    type Config = StreamConfig;

    fn start(config: StreamConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let wake = ports.waker()?;
        // Numbers of streams must differ from those of the start before.
        let seed = runtime::mix_seed(start.seed, u64::from(start.incarnation) ^ runtime::monotonic_ns());
        let hub = Hub::new(config, seed, wake).map_err(StartError::invalid)?;
        Ok(Self {
            signals: ports.input()?,
            replies: ports.output()?,
            videos: ports.input()?,
            wishes: ports.output()?,
            pilot: ports.input()?,
            hub,
            holder: Text::default(),
            wished: None,
            next_wish_ns: 0,
            refused: 0,
            sent: Format::default(),
        })
    }

    fn step(&mut self, now: u64) {
        while let Some(video) = self.videos.receive() {
            let bytes = video.access_unit();
            if self.hub.viewers() > 0 && !bytes.is_empty() {
                self.sent = video.format;
                self.hub.show(Unit {
                    bytes: Bytes::copy_from_slice(bytes),
                    capture_ns: video.capture_ns,
                    key: video.key == 1,
                    format: video.format,
                });
            }
        }
        if let Some(state) = self.pilot.latest() {
            self.holder = state.holder;
        }
        while let Some(signal) = self.signals.receive() {
            let who = Who {
                certificate: signal.certificate.as_str().to_owned(),
                session: signal.session.as_str().to_owned(),
            };
            let heard = FromViewer::parse(signal.body.as_str())
                .and_then(|message| self.hub.hear(who.clone(), signal.account.as_str(), message));
            if let Err(why) = heard {
                self.refused += 1;
                self.reply(&who, &ToViewer::error(why));
            }
        }
        while let Some((who, message)) = self.hub.next_said() {
            self.reply(&who, &message);
        }
        self.wish(now);
    }

    fn status(&self, text: &mut Text<96>) {
        // What does not fit is cut off.
        let _ = match self.hub.viewers() {
            0 => write!(text, "nobody watches"),
            count => {
                write!(text, "{count} watch, {}x{} at {}/s", self.sent.width, self.sent.height, self.sent.fps)
            }
        };
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}

impl Stream {
    fn reply(&mut self, who: &Who, message: &ToViewer) {
        let Some(json) = message.to_json() else { return };
        if let Some(mut loan) = self.replies.loan() {
            loan.session.set(&who.session);
            loan.certificate.set(&who.certificate);
            loan.body.set(&json);
            loan.send();
        }
    }

    /// Says what is wanted of the camera, while somebody watches; at once when it changes.
    fn wish(&mut self, now: u64) {
        let Some((format, flies)) = self.hub.choose(self.holder.as_str()) else {
            self.wished = None;
            return;
        };
        let wish = Wish {
            expiry_ns: 0,
            format,
            priority: if flies { FLIES } else { WATCHES },
            key_requests: self.hub.key_requests(),
            ..Wish::default()
        };
        let same = |old: &Wish| {
            (bytes_of(old.format), old.priority, old.key_requests)
                == (bytes_of(wish.format), wish.priority, wish.key_requests)
        };
        if self.wished.as_ref().is_some_and(same) && now < self.next_wish_ns {
            return;
        }
        self.wished = Some(wish);
        self.next_wish_ns = now + WISH_EVERY_NS;
        self.wishes.publish(&Wish { expiry_ns: now + WISH_GOOD_NS, ..wish });
    }
}

fn bytes_of(format: Format) -> [u32; 4] {
    [format.width, format.height, format.fps, format.bitrate]
}
