//! What a service prints: whole lines, a bounded ring in memory, a bounded pair of files on disk.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::PathBuf;

/// Lines kept in memory: a few minutes of a talkative service.
const RING: usize = 1000;
/// A longer line is cut into several.
const LINE: usize = 4096;
/// A file of this size becomes `NAME.log.1`, so that a service costs at most twice this on disk.
const FILE: u64 = 1 << 20;

/// The log of one service.
#[derive(Debug)]
pub(crate) struct Log {
    ring: VecDeque<String>,
    path: PathBuf,
    file: Option<File>,
    written: u64,
    /// Bytes of a line not yet ended, one for each stream.
    partial: [Vec<u8>; 2],
}

impl Log {
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { ring: VecDeque::new(), path, file: None, written: 0, partial: Default::default() }
    }

    /// Takes bytes of a stream; calls `line` with every line that they complete.
    pub(crate) fn feed(&mut self, stream: usize, bytes: &[u8], seconds: f64, mut line: impl FnMut(&str)) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let room = LINE - self.partial[stream].len();
            let end = rest.iter().take(room).position(|b| *b == b'\n');
            let taken = end.unwrap_or_else(|| rest.len().min(room));
            self.partial[stream].extend_from_slice(&rest[..taken]);
            rest = &rest[taken + usize::from(end.is_some())..];
            if end.is_some() || self.partial[stream].len() >= LINE {
                self.flush(stream, seconds, &mut line);
            }
        }
    }

    /// Ends a line that its writer will not end.
    pub(crate) fn flush(&mut self, stream: usize, seconds: f64, mut line: impl FnMut(&str)) {
        if self.partial[stream].is_empty() {
            return;
        }
        let text = String::from_utf8_lossy(&self.partial[stream]).trim_end().to_owned();
        self.partial[stream].clear();
        line(&text);
        self.push(&text, seconds);
    }

    /// Adds a line.
    pub(crate) fn push(&mut self, text: &str, seconds: f64) {
        let line = format!("{seconds:10.3} {text}");
        self.write(&line);
        if self.ring.len() == RING {
            self.ring.pop_front();
        }
        self.ring.push_back(line);
    }

    /// A full disk must not stop a flight: what cannot be written is only kept in memory.
    fn write(&mut self, line: &str) {
        if self.file.is_some() && self.written >= FILE {
            self.file = None;
            let _ = std::fs::rename(&self.path, self.path.with_extension("log.1"));
        }
        if self.file.is_none() {
            self.file = OpenOptions::new().create(true).append(true).open(&self.path).ok();
            self.written = self.file.as_ref().and_then(|f| f.metadata().ok()).map_or(0, |m| m.len());
        }
        if let Some(file) = &mut self.file
            && file.write_all(format!("{line}\n").as_bytes()).is_ok()
        {
            self.written += line.len() as u64 + 1;
        }
    }

    /// The newest lines, oldest first.
    pub(crate) fn tail(&self, lines: usize) -> Vec<String> {
        self.ring.iter().skip(self.ring.len().saturating_sub(lines)).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log() -> (tempfile::TempDir, Log) {
        let dir = tempfile::tempdir().unwrap();
        let log = Log::new(dir.path().join("a.log"));
        (dir, log)
    }

    #[test]
    fn lines_are_whole_whatever_the_pieces() {
        let (_dir, mut log) = log();
        let mut seen = Vec::new();
        for piece in ["on", "e\ntw", "o", "\n\nthr"] {
            log.feed(0, piece.as_bytes(), 1.0, |l| seen.push(l.to_owned()));
        }
        log.feed(1, b"other\n", 1.0, |l| seen.push(l.to_owned()));
        log.flush(0, 1.0, |l| seen.push(l.to_owned()));
        assert_eq!(seen, ["one", "two", "other", "thr"]);
        assert_eq!(log.tail(2), ["     1.000 other", "     1.000 thr"]);
    }

    #[test]
    fn memory_and_disk_are_bounded() {
        let (dir, mut log) = log();
        let endless = vec![b'x'; 3 << 20];
        log.feed(0, &endless, 0.0, |l| assert!(l.len() <= LINE));
        assert!(log.tail(usize::MAX).len() <= RING);
        for i in 0..5000 {
            log.push(&format!("{i}"), 0.0);
        }
        assert_eq!(log.tail(usize::MAX).len(), RING);
        let on_disk: u64 =
            std::fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().metadata().unwrap().len()).sum();
        assert!(on_disk <= 2 * (FILE + LINE as u64 + 16), "{on_disk}");
        assert!(on_disk > FILE / 2);
    }

    #[test]
    fn bytes_that_are_not_text_are_shown_as_such() {
        let (_dir, mut log) = log();
        log.feed(0, b"\xff\xfe ok\n", 0.0, |_| {});
        assert!(log.tail(1)[0].ends_with("\u{fffd}\u{fffd} ok"));
    }
}
