//! What a session knows of its viewer: how its line is, and which frames it gets.

use crate::Call;
use crate::line::Line;
use crate::rate::{Bounds, Report};
use crate::session::{Ends, Unit};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;
use tokio::time::Instant;

/// Key frames are asked for once in so long by one viewer.
const KEY_PAUSE: Duration = Duration::from_millis(300);

/// Without a frame for so long there are none: the camera is away.
const NO_PICTURES: Duration = Duration::from_millis(1500);

/// What the hub reads of a line.
#[derive(Debug, Default)]
pub(crate) struct LineState {
    /// 0 while it is not connected.
    bits: AtomicU32,
    pub left_out: AtomicBool,
}

impl LineState {
    /// Bits a second that it carries; `None` while it is not connected.
    pub(crate) fn bits(&self) -> Option<u32> {
        Some(self.bits.load(Ordering::Relaxed)).filter(|bits| *bits > 0)
    }

    fn set(&self, line: &Line) {
        self.bits.store(line.bits(), Ordering::Relaxed);
        self.left_out.store(line.is_left_out(), Ordering::Relaxed);
    }
}

/// A viewer.
pub(crate) struct Viewer {
    began: Instant,
    bounds: Bounds,
    /// `None` before it is connected.
    line: Option<Line>,
    /// What came since then cannot be decoded without a key frame.
    needs_key: bool,
    asked: Option<Instant>,
    /// When there was last a frame for it.
    offered: Duration,
    /// Frames lost so far, of those that were looked at.
    lost: u64,
}

impl Viewer {
    pub(crate) fn new(call: &Call, ends: &Ends) -> Self {
        let bounds = bounds(call, ends);
        Self {
            began: Instant::now(),
            bounds,
            line: None,
            needs_key: true,
            asked: None,
            offered: Duration::ZERO,
            lost: 0,
        }
    }

    pub(crate) fn is_connected(&self) -> bool {
        self.line.is_some()
    }

    /// It calls again, for another picture.
    pub(crate) fn wants(&mut self, call: &Call, ends: &Ends) {
        self.bounds = bounds(call, ends);
        if let Some(line) = &mut self.line {
            line.set_most(self.bounds.most);
        }
        self.show(ends);
    }

    /// The connection stands, or stands again.
    pub(crate) fn connected(&mut self, ends: &Ends) {
        let now = self.began.elapsed();
        self.line.get_or_insert_with(|| Line::new(self.bounds, now));
        self.needs_key = true;
        self.asked = None;
        self.show(ends);
        self.ask_for_key(ends);
    }

    /// It has told of its line.
    pub(crate) fn reported(&mut self, report: &Report, ends: &Ends) {
        let (now, before) = (self.began.elapsed(), self.is_left_out(ends));
        if let Some(line) = &mut self.line {
            line.report(now, report);
        }
        self.show(ends);
        if before && !self.is_left_out(ends) {
            self.needs_key = true;
            self.ask_for_key(ends);
        }
    }

    /// How long its line has told nothing; a second has passed since this was last asked.
    pub(crate) fn silence(&mut self, ends: &Ends) -> Duration {
        let now = self.began.elapsed();
        let Some(line) = &mut self.line else { return Duration::ZERO };
        if now.saturating_sub(self.offered) > NO_PICTURES {
            line.idle(now);
        }
        line.tick(now);
        let silence = line.silence(now);
        self.show(ends);
        silence
    }

    /// It needs a key frame. One that is left out waits for those that others ask for.
    pub(crate) fn ask_for_key(&mut self, ends: &Ends) {
        let rested = self.asked.is_none_or(|at| at.elapsed() >= KEY_PAUSE);
        if rested && !self.is_left_out(ends) {
            self.asked = Some(Instant::now());
            ends.key_requests.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Whether this frame is sent to it.
    pub(crate) fn gets(&mut self, unit: &Unit, ends: &Ends) -> bool {
        let before = std::mem::replace(&mut self.lost, ends.dropped.load(Ordering::Relaxed));
        let now = self.began.elapsed();
        self.offered = now;
        if self.lost != before {
            if let Some(line) = &mut self.line {
                line.jam(now);
            }
            self.show(ends);
            self.needs_key = true;
            self.ask_for_key(ends);
        }
        if self.line.is_none() || ((self.needs_key || self.is_left_out(ends)) && !unit.key) {
            return false;
        }
        self.needs_key = false;
        true
    }

    /// Whoever flies is never left out: all depends on what it sees, and nobody else on its line.
    fn is_left_out(&self, ends: &Ends) -> bool {
        let flies = ends.told.borrow().pilot == ends.since;
        !flies && self.line.as_ref().is_some_and(Line::is_left_out)
    }

    fn show(&self, ends: &Ends) {
        if let Some(line) = &self.line {
            ends.line.set(line);
        }
    }
}

fn bounds(call: &Call, ends: &Ends) -> Bounds {
    let least = ends.config.bitrate_least;
    Bounds { least, most: call.format().bitrate.min(ends.config.bitrate_most).max(least) }
}
