//! When the next frame of channels is due: by the beat of 50 a second, or before it for a hand that moves, a stop, and motors
//! that are to be cut.

use crate::wish::{AUX_ARM, HIGH_US};

/// Time between two frames when nobody gives the beat: 50 a second.
const FRAME_NS: u64 = 20_000_000;
/// The pilot gives the beat at 50 a second; its next message is waited for this long.
const PATIENT_NS: u64 = 24_000_000;
/// Least time between two frames, however fast the pilot publishes.
const FAST_NS: u64 = 18_000_000;
/// Least time between two frames when a hand has moved, or somebody else moves the drone: what the first takes on the
/// line, 46 bytes at 115200 baud. The controller looks each 10 ms (FACTS 1) and finds both.
const EARLY_NS: u64 = 4_000_000;
/// So often a frame may be early, for each takes the place of a question: four times a second, twice in a row.
const SPARE_EVERY_NS: u64 = 250_000_000;
const SPARE_MOST_NS: u64 = 2 * SPARE_EVERY_NS;

/// What is to be sent now, and who gives the beat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Asked<'a> {
    /// As they go out.
    pub(crate) channels: &'a [u16; 18],
    /// Of them.
    pub(crate) count: usize,
    /// The pilot is followed: its next message is waited for.
    pub(crate) followed: bool,
    /// The pilot's newest message has not been sent yet.
    pub(crate) fresh: bool,
    /// A hand has moved or let go.
    pub(crate) prompt: bool,
    /// Who moves the drone, an `ipc_types::ChannelSource` code.
    pub(crate) source: u8,
}

/// What was sent last, and how many frames may still be early.
#[derive(Debug, Clone)]
pub(crate) struct Beat {
    sent_us: [u16; 18],
    sent_source: u8,
    spare_ns: u64,
    asked_ns: u64,
}

impl Default for Beat {
    fn default() -> Self {
        Self { sent_us: [0; 18], sent_source: 0, spare_ns: SPARE_MOST_NS, asked_ns: 0 }
    }
}

impl Beat {
    /// Whether they are to be sent now. `last_ns`: when the last frame was.
    pub(crate) fn due(&mut self, now: u64, last_ns: Option<u64>, asked: &Asked<'_>) -> bool {
        let passed = now.saturating_sub(self.asked_ns);
        self.asked_ns = now;
        self.spare_ns = self.spare_ns.saturating_add(passed).min(SPARE_MOST_NS);
        let Some(last) = last_ns else { return true };
        let since = now.saturating_sub(last);
        let patient = if asked.followed { PATIENT_NS } else { FRAME_NS };
        if since >= patient || asked.fresh && since >= FAST_NS {
            return true;
        }
        // Motors that are to stop stop: the switch is thrown once, so nothing is displaced by it.
        let sent_us = &self.sent_us;
        if asked.count > AUX_ARM && sent_us[AUX_ARM] == HIGH_US && asked.channels[AUX_ARM] < HIGH_US {
            return true;
        }
        let early = asked.followed
            && asked.fresh
            && (asked.prompt || asked.source != self.sent_source)
            && since >= EARLY_NS
            && self.spare_ns >= SPARE_EVERY_NS;
        if early {
            self.spare_ns -= SPARE_EVERY_NS;
        }
        early
    }

    /// These were sent.
    pub(crate) fn sent(&mut self, asked: &Asked<'_>) {
        self.sent_us = [0; 18];
        self.sent_us[..asked.count].copy_from_slice(&asked.channels[..asked.count]);
        self.sent_source = asked.source;
    }

    /// The channels that were sent last; 0 where none was.
    pub(crate) fn channels(&self) -> [u16; 18] {
        self.sent_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wish::{LOW_US, neutral};
    use ipc_types::ChannelSource;

    const MS: u64 = 1_000_000;

    fn asked(channels: &[u16; 18], source: ChannelSource, fresh: bool) -> Asked<'_> {
        Asked { channels, count: 6, followed: true, fresh, prompt: false, source: source.code() }
    }

    fn flying(source: ChannelSource) -> ([u16; 18], Beat) {
        let mut channels = neutral();
        channels[AUX_ARM] = HIGH_US;
        let mut beat = Beat::default();
        beat.sent(&asked(&channels, source, true));
        (channels, beat)
    }

    fn due(beat: &mut Beat, after_ms: u64, asked: &Asked<'_>) -> bool {
        beat.due(1000 * MS + after_ms * MS, Some(1000 * MS), asked)
    }

    #[test]
    fn the_pilot_gives_the_beat_and_is_waited_for() {
        let (channels, mut beat) = flying(ChannelSource::Navigation);
        let fresh = asked(&channels, ChannelSource::Navigation, true);
        assert!(!due(&mut beat, 17, &fresh));
        assert!(due(&mut beat, 18, &fresh));
        let awaited = Asked { fresh: false, ..fresh };
        assert!(!due(&mut beat, 23, &awaited));
        assert!(due(&mut beat, 24, &awaited));
        let alone = Asked { followed: false, ..awaited };
        assert!(!due(&mut beat, 19, &alone));
        assert!(due(&mut beat, 20, &alone));
        assert!(beat.due(0, None, &awaited), "the first");
    }

    #[test]
    fn a_hand_that_moves_does_not_wait_for_the_beat_but_for_the_line() {
        let (channels, mut beat) = flying(ChannelSource::Manual);
        let rests = asked(&channels, ChannelSource::Manual, true);
        let moves = Asked { prompt: true, ..rests };
        assert!(!due(&mut beat, 12, &rests));
        assert!(!due(&mut beat, 3, &moves));
        assert!(!due(&mut beat, 12, &Asked { fresh: false, ..moves }), "nothing new");
        assert!(due(&mut beat, 4, &moves));
    }

    #[test]
    fn what_flies_itself_keeps_the_beat_until_somebody_else_moves_the_drone() {
        let (channels, mut beat) = flying(ChannelSource::Navigation);
        assert!(!due(&mut beat, 12, &asked(&channels, ChannelSource::Navigation, true)));
        assert!(due(&mut beat, 4, &asked(&channels, ChannelSource::Pilot, true)), "a stop");
    }

    #[test]
    fn a_hand_that_never_rests_leaves_the_questions_their_share() {
        let (channels, mut beat) = flying(ChannelSource::Manual);
        let (mut last, mut frames) = (0, 0);
        for now in (0..10_000).map(|ms| ms * MS) {
            // A message each 5 ms, each of a hand that has moved.
            let asked =
                Asked { prompt: true, ..asked(&channels, ChannelSource::Manual, now % (5 * MS) == 0) };
            if beat.due(now, Some(last), &asked) {
                beat.sent(&asked);
                (last, frames) = (now, frames + 1);
            }
        }
        // 50 a second by the beat of 20 ms; 42 early ones in 10 s bring each the next by at most 16 ms forward.
        assert!((500..=535).contains(&frames), "{frames} frames in 10 s");
    }

    #[test]
    fn motors_that_are_to_stop_are_told_at_once_and_once() {
        let (mut channels, mut beat) = flying(ChannelSource::Pilot);
        channels[AUX_ARM] = LOW_US;
        let stop = asked(&channels, ChannelSource::Pilot, false);
        assert!(due(&mut beat, 1, &stop));
        beat.sent(&stop);
        assert!(!due(&mut beat, 2, &stop));
        channels[AUX_ARM] = HIGH_US;
        assert!(!due(&mut beat, 3, &asked(&channels, ChannelSource::Pilot, false)), "not to start");
    }
}
