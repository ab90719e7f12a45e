//! What went over the topics between a hand and the serial line, with the times at which it was published.

use crate::rig::Rig;
use crate::tap::now_ms;
use ipc_types::{ChannelSource, Channels, Sticks};
use runtime::{Tool, monotonic_ns};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Most messages that are kept, the newest: two minutes of either.
const MOST: usize = 12_000;

/// An input of the sticks as the bridge gave it on.
#[derive(Clone, Copy)]
pub(crate) struct Stick {
    /// Milliseconds since 1970.
    pub(crate) at_ms: f64,
    pub(crate) turn: f32,
}

/// Channels as the pilot gave them on.
#[derive(Clone, Copy)]
pub(crate) struct Wanted {
    /// Milliseconds since 1970.
    pub(crate) at_ms: f64,
    pub(crate) source: Option<ChannelSource>,
    /// Motors are to run.
    pub(crate) arm: bool,
    /// Roll, pitch, throttle, yaw, microseconds.
    pub(crate) us: [u16; 4],
}

#[derive(Default)]
struct Heard {
    sticks: Vec<Stick>,
    wanted: Vec<Wanted>,
}

/// Listens on a thread of its own for as long as the program runs.
#[derive(Clone, Default)]
pub(crate) struct Topics(Arc<Mutex<Heard>>);

impl Topics {
    /// Begins to listen to a running system.
    pub(crate) fn begin(rig: &Rig) -> Self {
        let (manifest, run_dir) = rig.manifest();
        let topics = Self::default();
        let heard = topics.clone();
        std::thread::spawn(move || {
            let mut tool = Tool::join("cli", manifest, &run_dir).unwrap();
            let (mut sticks, mut channels) =
                (tool.ports.input::<Sticks>().unwrap(), tool.ports.input::<Channels>().unwrap());
            loop {
                tool.tick();
                let ahead_ms = now_ms() - monotonic_ns() as f64 * 1e-6;
                let at_ms = |stamp_ns: u64| stamp_ns as f64 * 1e-6 + ahead_ms;
                let mut heard = heard.lock();
                while let Some(message) = sticks.receive() {
                    heard.sticks.push(Stick { at_ms: at_ms(message.header.stamp_ns), turn: message.turn });
                }
                while let Some(message) = channels.receive() {
                    let [roll, pitch, throttle, yaw, ..] = message.channels_us;
                    heard.wanted.push(Wanted {
                        at_ms: at_ms(message.header.stamp_ns),
                        source: ChannelSource::from_code(message.source),
                        arm: message.arm == 1,
                        us: [roll, pitch, throttle, yaw],
                    });
                }
                let (old_sticks, old_wanted) =
                    (heard.sticks.len().saturating_sub(MOST), heard.wanted.len().saturating_sub(MOST));
                heard.sticks.drain(..old_sticks);
                heard.wanted.drain(..old_wanted);
                drop(heard);
                std::thread::sleep(Duration::from_millis(10));
            }
        });
        topics
    }

    fn lock(&self) -> MutexGuard<'_, Heard> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The first input since `since_ms` for which `is` holds.
    pub(crate) fn stick(&self, since_ms: f64, is: impl Fn(&Stick) -> bool) -> Option<Stick> {
        self.lock().sticks.iter().find(|stick| stick.at_ms >= since_ms && is(stick)).copied()
    }

    /// Channels since `since_ms`.
    pub(crate) fn wanted(&self, since_ms: f64) -> Vec<Wanted> {
        self.lock().wanted.iter().filter(|wanted| wanted.at_ms >= since_ms).copied().collect()
    }

    /// The last channels before `before_ms`.
    pub(crate) fn before(&self, before_ms: f64) -> Option<Wanted> {
        self.lock().wanted.iter().rev().find(|wanted| wanted.at_ms < before_ms).copied()
    }
}
