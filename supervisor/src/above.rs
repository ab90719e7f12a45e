//! Whoever started the supervisor: systemd, or another that speaks `sd_notify`. Nobody, when it was started by hand.

use std::time::{Duration, Instant};

/// What is said upwards, and how often.
#[derive(Debug)]
pub(crate) struct Above {
    /// Half of the silence that is allowed; `None` when nobody listens for a beat.
    beat: Option<Duration>,
    next: Instant,
}

impl Above {
    /// The run directory is held, the warden stands, and services are being started: ready.
    pub(crate) fn ready(now: Instant) -> Self {
        say(&[sd_notify::NotifyState::Ready]);
        Self { beat: sd_notify::watchdog_enabled().map(|limit| limit / 2), next: now }
    }

    /// The loop still turns.
    pub(crate) fn beat(&mut self, now: Instant) {
        if let Some(beat) = self.beat
            && now >= self.next
        {
            self.next = now + beat;
            say(&[sd_notify::NotifyState::Watchdog]);
        }
    }

    /// A sentence for `systemctl status`.
    pub(crate) fn status(text: &str) {
        say(&[sd_notify::NotifyState::Status(text)]);
    }

    /// The end has begun; `text` says how.
    pub(crate) fn stopping(text: &str) {
        say(&[sd_notify::NotifyState::Stopping, sd_notify::NotifyState::Status(text)]);
    }
}

fn say(states: &[sd_notify::NotifyState<'_>]) {
    // Who does not hear it notices by itself.
    let _ = sd_notify::notify(states);
}
