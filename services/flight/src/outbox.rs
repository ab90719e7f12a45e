//! Bytes that the port has not taken yet.

/// Several frames: at 115200 baud a fiftieth of a second.
const ROOM: usize = 256;

/// What waits to be sent. When it is full, everything that waits is thrown away for what is new: old channels
/// are worth nothing, and the controller finds the next frame by its preamble.
#[derive(Debug, Clone)]
pub struct Outbox {
    bytes: [u8; ROOM],
    start: usize,
    end: usize,
    dropped: u32,
}

impl Default for Outbox {
    fn default() -> Self {
        Self { bytes: [0; ROOM], start: 0, end: 0, dropped: 0 }
    }
}

impl Outbox {
    /// Adds a frame.
    pub fn push(&mut self, frame: &[u8]) {
        if self.start > 0 {
            self.bytes.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if self.end + frame.len() > ROOM {
            self.end = 0;
            self.dropped = self.dropped.wrapping_add(1);
        }
        if let Some(slot) = self.bytes.get_mut(self.end..self.end + frame.len()) {
            slot.copy_from_slice(frame);
            self.end += frame.len();
        }
    }

    /// What is to be sent next.
    #[must_use]
    pub fn waiting(&self) -> &[u8] {
        &self.bytes[self.start..self.end]
    }

    /// The port took so many bytes.
    pub fn taken(&mut self, count: usize) {
        self.start = (self.start + count).min(self.end);
    }

    /// Forgets everything: the port is gone.
    pub fn clear(&mut self) {
        self.start = 0;
        self.end = 0;
    }

    /// How often what waited was thrown away.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}
