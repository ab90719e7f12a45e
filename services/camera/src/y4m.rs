//! Uncompressed video in a file (YUV4MPEG2, 4:2:0), shown again and again at its own size and the wanted pace.

use crate::source::{Frame, Pace, Source};
use ipc_types::{Format, MAX_PICTURE_HEIGHT, MAX_PICTURE_WIDTH};

/// Largest file: a minute of 640x480 at 15 frames a second is 395 MiB.
const MOST_BYTES: usize = 512 << 20;

/// What is wrong with a file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Y4mError {
    /// Not this format at all.
    #[error("{0} is no Y4M file: it must begin with YUV4MPEG2")]
    NotY4m(String),
    /// A field of the header.
    #[error("{file}: {field} is {value}: allowed is {allowed}")]
    Field {
        /// The file.
        file: String,
        /// Of the header.
        field: &'static str,
        /// What it says.
        value: String,
        /// What it may say.
        allowed: String,
    },
    /// Cut off, or not followed by frames.
    #[error("{file}: no whole frame follows byte {at}")]
    Frame {
        /// The file.
        file: String,
        /// Where.
        at: usize,
    },
}

/// A file's frames.
#[derive(Debug)]
pub struct Y4m {
    bytes: Vec<u8>,
    /// Where each frame's planes begin.
    frames: Vec<usize>,
    width: u32,
    height: u32,
    pace: Pace,
    number: u64,
}

impl Y4m {
    /// Reads a file's bytes; `file` is its name for people.
    ///
    /// # Errors
    /// What is not 4:2:0, too large, of odd size or cut off.
    pub fn parse(file: &str, bytes: Vec<u8>) -> Result<Self, Y4mError> {
        let field = |field, value: &str, allowed: String| Y4mError::Field {
            file: file.to_owned(),
            field,
            value: value.escape_default().to_string(),
            allowed,
        };
        if bytes.len() > MOST_BYTES {
            return Err(field("its size", &bytes.len().to_string(), format!("at most {MOST_BYTES} bytes")));
        }
        let end = bytes.iter().take(256).position(|byte| *byte == b'\n');
        let header = end.and_then(|end| bytes.get(..end)).and_then(|line| std::str::from_utf8(line).ok());
        let header = header
            .filter(|line| line.starts_with("YUV4MPEG2 "))
            .ok_or_else(|| Y4mError::NotY4m(file.to_owned()))?;
        let (mut width, mut height, mut colour) = (0, 0, "420");
        for word in header.split(' ').skip(1).filter(|word| word.is_ascii()) {
            let value = word.get(1..).unwrap_or("");
            match word.as_bytes().first() {
                Some(b'W') => width = value.parse().unwrap_or(0),
                Some(b'H') => height = value.parse().unwrap_or(0),
                Some(b'C') => colour = value,
                _ => {}
            }
        }
        let even = |n: u32, most: u32| (16..=most).contains(&n) && n.is_multiple_of(2);
        if !even(width, MAX_PICTURE_WIDTH) {
            let allowed = format!("an even number, 16 to {MAX_PICTURE_WIDTH}");
            return Err(field("width (W)", &width.to_string(), allowed));
        }
        if !even(height, MAX_PICTURE_HEIGHT) {
            let allowed = format!("an even number, 16 to {MAX_PICTURE_HEIGHT}");
            return Err(field("height (H)", &height.to_string(), allowed));
        }
        if !["420", "420jpeg", "420mpeg2", "420paldv"].contains(&colour) {
            return Err(field("colour space (C)", colour, "420, 420jpeg, 420mpeg2, 420paldv".to_owned()));
        }
        let size = width as usize * height as usize * 3 / 2;
        let mut frames = Vec::new();
        let mut at = header.len() + 1;
        while at < bytes.len() {
            let broken = || Y4mError::Frame { file: file.to_owned(), at };
            let rest = bytes.get(at..).filter(|rest| rest.starts_with(b"FRAME")).ok_or_else(broken)?;
            let line = rest.iter().take(256).position(|byte| *byte == b'\n').ok_or_else(broken)?;
            let begin = at + line + 1;
            if bytes.len() - begin < size {
                return Err(broken());
            }
            frames.push(begin);
            at = begin + size;
        }
        if frames.is_empty() {
            return Err(Y4mError::Frame { file: file.to_owned(), at });
        }
        Ok(Self { bytes, frames, width, height, pace: Pace::default(), number: 0 })
    }
}

impl Source for Y4m {
    fn frame(&mut self, now: u64, wanted: Option<&Format>) -> Option<Frame<'_>> {
        if !self.pace.is_due(now, wanted?.fps, 1_000_000) {
            return None;
        }
        let begin = self.frames.get(self.number as usize % self.frames.len())?;
        self.number += 1;
        let luma = self.width as usize * self.height as usize;
        let (y, rest) = self.bytes.get(*begin..)?.split_at_checked(luma)?;
        let (u, rest) = rest.split_at_checked(luma / 4)?;
        Some(Frame {
            capture_ns: now,
            number: self.number,
            width: self.width,
            height: self.height,
            stride: self.width,
            planes: [y, u, rest.get(..luma / 4)?],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, frames: usize) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        for k in 0..frames {
            bytes.extend(b"FRAME\n");
            bytes.extend(std::iter::repeat_n(k as u8, 16 * 16 * 3 / 2));
        }
        bytes
    }

    #[test]
    fn frames_come_round_and_broken_files_are_refused() {
        let mut source = Y4m::parse("a.y4m", file("YUV4MPEG2 W16 H16 F15:1 C420jpeg\n", 2)).unwrap();
        let format = Format { width: 640, height: 480, fps: 10, bitrate: 100_000 };
        let mut seen = Vec::new();
        for tick in 0..40 {
            if let Some(frame) = source.frame(1_000_000_000 + tick * 10_000_000, Some(&format)) {
                seen.push((frame.number, frame.planes[0][0], frame.planes[2].len()));
            }
        }
        assert_eq!(seen, [(1, 0, 64), (2, 1, 64), (3, 0, 64), (4, 1, 64)]);
        assert!(source.frame(9_000_000_000, None).is_none());
        for (bytes, word) in [
            (b"RIFF".to_vec(), "no Y4M"),
            (file("YUV4MPEG2 W15 H16\n", 1), "width (W) is 15"),
            (file("YUV4MPEG2 W16 H9999999999\n", 1), "height (H) is 0"),
            (file("YUV4MPEG2 W16 H16 C444\n", 1), "colour space"),
            (file("YUV4MPEG2 W16 H16\n", 0), "no whole frame"),
            (file("YUV4MPEG2 W16 H16\n", 1)[..200].to_vec(), "no whole frame"),
        ] {
            let error = Y4m::parse("a.y4m", bytes).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("a.y4m"), "{error}");
        }
    }
}
