//! Who wants video, and which: one encoder serves all.

use ipc_types::{Format, Wish};

/// Publishers of wishes that are remembered: more than shared memory has places for.
const PUBLISHERS: usize = 8;

/// The newest wish of each publisher.
#[derive(Debug, Default)]
pub struct Wishes {
    newest: [Option<Wish>; PUBLISHERS],
    key_wanted: bool,
    refused: u64,
}

impl Wishes {
    /// Takes a wish. One that makes no sense or came too late is counted and forgotten.
    pub fn take(&mut self, wish: &Wish, now: u64) {
        if !wish.counts(now) {
            // One that expired on its way is no fault.
            self.refused += u64::from(!wish.is_valid());
            return;
        }
        let publisher = |known: &Wish| (known.header.publisher, known.header.incarnation);
        let same =
            self.newest.iter().position(|known| known.as_ref().map(publisher) == Some(publisher(wish)));
        let free =
            || self.newest.iter().position(|known| known.as_ref().is_none_or(|known| !known.counts(now)));
        let Some(place) = same.or_else(free).and_then(|index| self.newest.get_mut(index)) else {
            self.refused += 1;
            return;
        };
        // Who is new to the video has no frame before it.
        self.key_wanted |= wish.wants_video()
            && match place {
                Some(known) if same.is_some() && known.wants_video() => {
                    known.key_requests != wish.key_requests
                }
                _ => true,
            };
        *place = Some(*wish);
    }

    /// The format of the wish for video that goes before the others ([`Wish::beats`]) at `now`; `None` when nobody wants
    /// video.
    #[must_use]
    pub fn wanted(&self, now: u64) -> Option<Format> {
        let valid = self.newest.iter().flatten().filter(|wish| wish.counts(now) && wish.wants_video());
        let first = valid.reduce(|best, wish| if wish.beats(best) { wish } else { best })?;
        Some(first.format)
    }

    /// Whether somebody wants stills at `now`.
    #[must_use]
    pub fn wants_still(&self, now: u64) -> bool {
        self.newest.iter().flatten().any(|wish| wish.counts(now) && wish.wants_still())
    }

    /// Whether somebody has asked for a key frame since the last call that gave one.
    #[must_use]
    pub fn wants_key(&self) -> bool {
        self.key_wanted
    }

    /// A key frame was sent.
    pub fn key_sent(&mut self) {
        self.key_wanted = false;
    }

    /// Wishes that made no sense, since start.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: u64 = 10_000_000_000;

    fn wish(publisher: u32, width: u32, priority: u32, key_requests: u32, at: u64) -> Wish {
        let format = Format { width, height: 480, fps: 30, bitrate: 1_000_000 };
        let mut wish =
            Wish { format, priority, key_requests, expiry_ns: at + 500_000_000, ..Wish::default() };
        (wish.header.publisher, wish.header.stamp_ns) = (publisher, at);
        wish
    }

    #[test]
    fn the_first_wins_until_it_expires_and_new_ones_get_a_key_frame() {
        let mut wishes = Wishes::default();
        let width = |wishes: &Wishes, at| wishes.wanted(at).map(|format| format.width);
        assert_eq!(width(&wishes, BEGIN), None);
        wishes.take(&wish(1, 640, 0, 5, BEGIN), BEGIN);
        assert!(wishes.wants_key());
        wishes.key_sent();
        wishes.take(&wish(1, 640, 0, 5, BEGIN + 1), BEGIN + 1);
        assert!(!wishes.wants_key(), "the same request is not a new one");
        wishes.take(&wish(1, 640, 0, 6, BEGIN + 2), BEGIN + 2);
        assert!(wishes.wants_key());
        wishes.key_sent();
        wishes.take(&wish(2, 1280, 0, 0, BEGIN + 3), BEGIN + 3);
        assert_eq!((width(&wishes, BEGIN + 3), wishes.wants_key()), (Some(1280), true));
        wishes.take(&wish(3, 320, 1, 0, BEGIN + 4), BEGIN + 4);
        assert_eq!(width(&wishes, BEGIN + 4), Some(320));
        assert_eq!(width(&wishes, BEGIN + 500_000_003), Some(320));
        assert_eq!(width(&wishes, BEGIN + 500_000_004), None, "all have expired");
        wishes.take(&wish(4, 641, 0, 0, BEGIN), BEGIN);
        assert_eq!(wishes.refused(), 1);
    }

    #[test]
    fn a_wish_for_stills_alone_asks_for_no_video_and_hides_none() {
        let mut wishes = Wishes::default();
        let still = Wish { still: 1, format: Format::default(), ..wish(1, 640, 2, 0, BEGIN) };
        wishes.take(&still, BEGIN);
        assert_eq!((wishes.wanted(BEGIN).is_none(), wishes.wants_key(), wishes.refused()), (true, false, 0));
        assert!(wishes.wants_still(BEGIN) && !wishes.wants_still(BEGIN + 500_000_000), "until it expires");
        wishes.take(&wish(2, 640, 0, 0, BEGIN), BEGIN);
        assert_eq!(wishes.wanted(BEGIN).map(|format| format.width), Some(640));
        wishes.key_sent();
        wishes.take(&Wish { still: 1, ..wish(1, 320, 0, 0, BEGIN) }, BEGIN);
        assert!(wishes.wants_key(), "the same publisher, new to the video");
    }

    #[test]
    fn places_of_those_who_are_gone_are_used_again() {
        let mut wishes = Wishes::default();
        for publisher in 0..100 {
            let at = BEGIN + u64::from(publisher) * 600_000_000;
            wishes.take(&wish(publisher, 640, 0, 0, at), at);
            assert!(wishes.wanted(at).is_some(), "{publisher}");
        }
        for publisher in 0..20 {
            wishes.take(&wish(publisher, 640, 0, 0, 2 * BEGIN * 10), 2 * BEGIN * 10);
        }
        assert_eq!(wishes.refused(), 20 - PUBLISHERS as u64, "no more at a time than there is room for");
    }
}
