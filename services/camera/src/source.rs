//! Where frames come from.

use ipc_types::{Format, Picture};

/// A raw frame where it lies.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// When the light fell in, nanoseconds of the bus's clock.
    pub capture_ns: u64,
    /// Number of the frame.
    pub number: u64,
    /// Pixels, even.
    pub width: u32,
    /// Pixels, even.
    pub height: u32,
    /// Bytes from one line of luma to the next; half of it for colour.
    pub stride: u32,
    /// Luma, blue difference, red difference.
    pub planes: [&'a [u8]; 3],
}

impl<'a> Frame<'a> {
    /// The frame in a message; `None` when it makes no sense.
    #[must_use]
    pub fn of(picture: &'a Picture) -> Option<Self> {
        Some(Self {
            capture_ns: picture.capture_ns,
            number: picture.frame,
            width: picture.width,
            height: picture.height,
            stride: picture.stride,
            planes: picture.planes()?,
        })
    }
}

/// Gives frames while it is asked for them, and rests otherwise. Never waits.
pub trait Source {
    /// Called at every step: `wanted` is the size and pace that frames should have from now on, `None` that nobody wants
    /// any. The next frame, if one is there; it may be of another size than wanted, for a while or for good.
    fn frame(&mut self, now: u64, wanted: Option<&Format>) -> Option<Frame<'_>>;

    /// Frames that made no sense, since start.
    fn refused(&self) -> u64 {
        0
    }
}

/// Says when the next frame is due.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pace {
    due_ns: u64,
}

impl Pace {
    /// Whether a frame is due at `now`; keeps the raster, and begins a new one after a pause. `early_ns`: a tick that comes
    /// so much before the raster is taken for it, as the next one would be later by more.
    pub(crate) fn is_due(&mut self, now: u64, fps: u32, early_ns: u64) -> bool {
        let period = 1_000_000_000 / u64::from(fps.max(1));
        // Left from a slower pace.
        if self.due_ns > now + period + early_ns {
            self.due_ns = now;
        }
        if now + early_ns < self.due_ns {
            return false;
        }
        self.due_ns = if now > self.due_ns + period { now + period } else { self.due_ns + period };
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quicker_pace_does_not_wait_for_the_slower_one() {
        let mut pace = Pace::default();
        let begin = 5_000_000_000;
        assert!(pace.is_due(begin, 1, 0) && !pace.is_due(begin + 10_000_000, 1, 0));
        assert!(pace.is_due(begin + 20_000_000, 30, 0), "a second is not waited for");
        let passed =
            (1..=100).filter(|tick| pace.is_due(begin + 20_000_000 + tick * 10_000_000, 30, 0)).count();
        assert!((29..=31).contains(&passed), "{passed}");
        // Taken early: the next is still a period after the raster.
        let mut pace = Pace::default();
        let passed = (0..100).filter(|tick| pace.is_due(begin + tick * 67_000_000, 1, 200_000_000)).count();
        assert!((6..=8).contains(&passed), "{passed} in 6.7 s");
    }
}
