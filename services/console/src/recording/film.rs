//! One file of H.264 as fragmented MP4 (ISO/IEC 14496-12, 14496-15): each second is whole on the disk once it is written, and
//! browsers play it. The boxes are made by `shiguredo_mp4`.

use super::unit::{Parameters, Unit};
use shiguredo_mp4::boxes::{Avc1Box, AvccBox, MoofBox, SampleEntry, VisualSampleEntryFields};
use shiguredo_mp4::mux::{Fmp4SegmentMuxer, Sample};
use shiguredo_mp4::{Decode, TrackKind, Uint};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::num::NonZeroU32;
use std::sync::Arc;

/// Ticks a second of the track.
const TIMESCALE: u32 = 90_000;
/// A fragment is written when it is so long, ticks, or so large, bytes.
const FRAGMENT_TICKS: u64 = TIMESCALE as u64;
const FRAGMENT_BYTES: usize = 4 * 1024 * 1024;
/// How long a picture is shown when none came after it by which to know: that of the thesis's camera.
const LAST_TICKS: u32 = TIMESCALE / 15;
/// What stands before the first fragment is shorter.
const MOST_HEADER: u64 = 64 * 1024;
/// Nor are the tables of a fragment longer.
const MOST_TABLES: u64 = 4 * 1024 * 1024;

/// What came of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Done {
    /// Its length, bytes.
    pub(super) bytes: u64,
    /// And in time, milliseconds.
    pub(super) length_ms: u64,
}

/// A file that is being written.
pub(super) struct Film {
    file: File,
    muxer: Fmp4SegmentMuxer,
    entry: SampleEntry,
    parameters: Parameters,
    size: (u16, u16),
    first_ns: u64,
    /// The newest, of which nobody knows yet how long it is shown.
    held: Arc<Unit>,
    samples: Vec<Sample>,
    payload: Vec<u8>,
    waiting_ticks: u64,
    written_ticks: u64,
    last_ticks: u32,
    bytes: u64,
}

fn failed(error: impl std::fmt::Display) -> io::Error {
    io::Error::other(error.to_string())
}

/// What a decoder is told before the first picture.
fn entry(unit: &Unit, parameters: &Parameters) -> io::Result<SampleEntry> {
    let &[_, profile, compatibility, level, ..] = parameters.sps.as_slice() else {
        return Err(failed("the parameters are too short"));
    };
    // Only the high profiles say more.
    let extended = matches!(profile, 100 | 110 | 122 | 144);
    Ok(SampleEntry::Avc1(Avc1Box {
        visual: VisualSampleEntryFields {
            data_reference_index: VisualSampleEntryFields::DEFAULT_DATA_REFERENCE_INDEX,
            width: unit.width,
            height: unit.height,
            horizresolution: VisualSampleEntryFields::DEFAULT_HORIZRESOLUTION,
            vertresolution: VisualSampleEntryFields::DEFAULT_VERTRESOLUTION,
            frame_count: VisualSampleEntryFields::DEFAULT_FRAME_COUNT,
            compressorname: [0; 32],
            depth: VisualSampleEntryFields::DEFAULT_DEPTH,
        },
        avcc_box: AvccBox {
            avc_profile_indication: profile,
            profile_compatibility: compatibility,
            avc_level_indication: level,
            length_size_minus_one: Uint::new(3),
            sps_list: vec![parameters.sps.clone()],
            pps_list: vec![parameters.pps.clone()],
            chroma_format: extended.then(|| Uint::new(1)),
            bit_depth_luma_minus8: extended.then(|| Uint::new(0)),
            bit_depth_chroma_minus8: extended.then(|| Uint::new(0)),
            sps_ext_list: Vec::new(),
        },
        unknown_boxes: Vec::new(),
    }))
}

impl Film {
    /// Begins with a key frame, in an empty file.
    ///
    /// # Errors
    /// When it is none.
    pub(super) fn begin(file: File, unit: &Arc<Unit>) -> io::Result<Self> {
        let parameters = unit.parameters.clone().ok_or_else(|| failed("a film begins with a key frame"))?;
        Ok(Self {
            file,
            muxer: Fmp4SegmentMuxer::new().map_err(failed)?,
            entry: entry(unit, &parameters)?,
            parameters,
            size: (unit.width, unit.height),
            first_ns: unit.capture_ns,
            held: unit.clone(),
            samples: Vec::new(),
            payload: Vec::new(),
            waiting_ticks: 0,
            written_ticks: 0,
            last_ticks: LAST_TICKS,
            bytes: 0,
        })
    }

    /// Whether a picture can follow in the same file: of the same clock and later, and with what the decoder has been told.
    pub(super) fn takes(&self, unit: &Unit, longest_gap_ns: u64) -> bool {
        let same = unit.parameters.as_ref().is_none_or(|parameters| *parameters == self.parameters);
        same && (unit.width, unit.height) == self.size
            && unit.source == self.held.source
            && unit.capture_ns > self.held.capture_ns
            && unit.capture_ns - self.held.capture_ns <= longest_gap_ns
    }

    /// How long it is up to its newest picture, nanoseconds.
    pub(super) fn length_ns(&self) -> u64 {
        self.held.capture_ns.saturating_sub(self.first_ns)
    }

    /// Bytes on the disk.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Adds a picture that it takes.
    ///
    /// # Errors
    /// The disk's. What was written before stays whole.
    pub(super) fn push(&mut self, unit: &Arc<Unit>) -> io::Result<()> {
        // By the beginning, not by the picture before, so that roundings do not add up.
        let ticks = |ns: u64| {
            u64::try_from(
                u128::from(ns.saturating_sub(self.first_ns)) * u128::from(TIMESCALE) / 1_000_000_000,
            )
            .unwrap_or(u64::MAX)
        };
        let shown = ticks(unit.capture_ns).saturating_sub(ticks(self.held.capture_ns));
        let shown = u32::try_from(shown).map_err(failed)?.max(1);
        let held = std::mem::replace(&mut self.held, unit.clone());
        self.append(&held, shown);
        if self.waiting_ticks >= FRAGMENT_TICKS || self.payload.len() >= FRAGMENT_BYTES {
            self.flush()?;
        }
        Ok(())
    }

    fn append(&mut self, unit: &Unit, ticks: u32) {
        self.samples.push(Sample {
            track_kind: TrackKind::Video,
            sample_entry: Some(self.entry.clone()),
            keyframe: unit.is_key(),
            timescale: NonZeroU32::MIN.saturating_add(TIMESCALE - 1),
            duration: ticks,
            composition_time_offset: None,
            data_offset: self.payload.len() as u64,
            data_size: unit.sample.len(),
        });
        self.payload.extend_from_slice(&unit.sample);
        self.waiting_ticks += u64::from(ticks);
        self.last_ticks = ticks;
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.samples.is_empty() {
            return Ok(());
        }
        let tables = self.muxer.create_media_segment_metadata(&self.samples).map_err(failed)?;
        let mut out =
            if self.bytes == 0 { self.muxer.init_segment_bytes().map_err(failed)? } else { Vec::new() };
        out.extend_from_slice(&tables);
        out.append(&mut self.payload);
        self.samples.clear();
        self.written_ticks += std::mem::take(&mut self.waiting_ticks);
        self.file.write_all(&out)?;
        self.bytes += out.len() as u64;
        Ok(())
    }

    /// Writes what waits, and how long it all is, so that a browser can show and seek.
    ///
    /// # Errors
    /// The disk's.
    pub(super) fn finish(mut self) -> io::Result<Done> {
        let held = self.held.clone();
        // After a pause the last one is not shown as long as that.
        let ticks = self.last_ticks.min(TIMESCALE);
        self.append(&held, ticks);
        self.flush()?;
        let done = close(&mut self.file, self.written_ticks, self.bytes)?;
        Ok(done)
    }
}

/// Writes the length into the header of a file of so many bytes.
fn close(file: &mut File, ticks: u64, bytes: u64) -> io::Result<Done> {
    let length_ms = ticks / u64::from(TIMESCALE / 1000);
    file.seek(SeekFrom::Start(0))?;
    let mut header = Vec::new();
    Read::by_ref(file).take(MOST_HEADER.min(bytes)).read_to_end(&mut header)?;
    // `mehd` stands once before the first `moof`: its type, version and flags, then the length in milliseconds.
    let end = header.windows(4).position(|four| four == b"moof").unwrap_or(header.len());
    let place = header.get(..end).and_then(|header| header.windows(4).rposition(|four| four == b"mehd"));
    let place = place.ok_or_else(|| failed("a file without a header"))? as u64;
    file.seek(SeekFrom::Start(place + 8))?;
    file.write_all(&u32::try_from(length_ms).unwrap_or(u32::MAX).to_be_bytes())?;
    file.sync_all()?;
    Ok(Done { bytes, length_ms })
}

/// Finishes a file whose writer died: cut after its last whole fragment. `None` when it has none.
///
/// # Errors
/// The disk's.
pub(super) fn repair(mut file: File) -> io::Result<Option<Done>> {
    let end = file.metadata()?.len();
    let (mut at, mut good, mut ticks, mut tables) = (0_u64, 0_u64, 0_u64, None);
    while at.saturating_add(8) <= end {
        file.seek(SeekFrom::Start(at))?;
        let mut head = [0; 8];
        file.read_exact(&mut head)?;
        let [a, b, c, d, kind @ ..] = head;
        let size = u64::from(u32::from_be_bytes([a, b, c, d]));
        let next = at.saturating_add(size);
        if size < 8 || next > end {
            break;
        }
        match &kind {
            b"moof" if size <= MOST_TABLES => {
                let mut bytes = vec![0; size as usize];
                file.seek(SeekFrom::Start(at))?;
                file.read_exact(&mut bytes)?;
                tables = MoofBox::decode(&bytes).ok().map(|(moof, _)| length_of(&moof));
            }
            b"mdat" => {
                let Some(length) = tables.take() else { break };
                ticks = ticks.saturating_add(length);
                good = next;
            }
            b"ftyp" | b"moov" if good == 0 => {}
            _ => break,
        }
        at = next;
    }
    if good == 0 {
        return Ok(None);
    }
    file.set_len(good)?;
    close(&mut file, ticks, good).map(Some)
}

/// Ticks in a fragment.
fn length_of(moof: &MoofBox) -> u64 {
    let samples = moof.traf_boxes.iter().flat_map(|track| &track.trun_boxes).flat_map(|run| &run.samples);
    samples.map(|sample| u64::from(sample.duration.unwrap_or(0))).fold(0, u64::saturating_add)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::super::unit::tests::{DELTA, KEY, message};
    use super::*;
    use shiguredo_mp4::demux::{Fmp4FileDemuxer, Input};

    fn unit(frame: u64) -> Arc<Unit> {
        let picture = if frame.is_multiple_of(30) { KEY } else { DELTA };
        Arc::new(Unit::read(&message(frame, 5_000_000_000 + frame * 66_666_667, 640, picture)).unwrap())
    }

    fn write(path: &std::path::Path, frames: u64) -> Film {
        let file = File::options().read(true).write(true).create_new(true).open(path).unwrap();
        let mut film = Film::begin(file, &unit(0)).unwrap();
        for frame in 1..frames {
            assert!(film.takes(&unit(frame), 1_000_000_000));
            film.push(&unit(frame)).unwrap();
        }
        film
    }

    /// Frames, key frames and ticks in a file, read by the library.
    fn read(path: &std::path::Path) -> (u64, u64, u64) {
        let bytes = std::fs::read(path).unwrap();
        let mut demuxer = Fmp4FileDemuxer::new();
        let (mut frames, mut keys, mut ticks) = (0, 0, 0);
        loop {
            while let Some(wanted) = demuxer.required_input() {
                let from = bytes.len().min(wanted.position as usize);
                let to = wanted.size.map_or(bytes.len(), |size| bytes.len().min(from + size));
                demuxer.handle_input(Input { position: wanted.position, data: &bytes[from..to] });
            }
            let Some(sample) = demuxer.next_sample().unwrap() else { break };
            frames += 1;
            keys += u64::from(sample.keyframe);
            ticks += u64::from(sample.duration);
            let data = &bytes[sample.data_offset as usize..][..sample.data_size];
            assert_eq!(data[4] & 0x1f, if sample.keyframe { 5 } else { 1 });
        }
        (frames, keys, ticks)
    }

    #[test]
    fn a_film_has_every_picture_at_its_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.mp4");
        let done = write(&path, 150).finish().unwrap();
        assert_eq!(done.bytes, std::fs::metadata(&path).unwrap().len());
        assert!((9_990..=10_010).contains(&done.length_ms), "{done:?}");
        let (frames, keys, ticks) = read(&path);
        assert_eq!((frames, keys), (150, 5));
        assert!(ticks.abs_diff(900_000) < 100, "{ticks}");
    }

    #[test]
    fn wherever_its_writer_dies_a_film_can_be_finished() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("film.mp4");
        let film = write(&path, 100);
        let whole = std::fs::read(&path).unwrap();
        assert_eq!(film.bytes(), whole.len() as u64);
        drop(film);
        let mut seen = std::collections::BTreeSet::new();
        for cut in (0..=whole.len()).step_by(7).chain([whole.len()]) {
            let broken = folder.path().join("broken.mp4");
            std::fs::write(&broken, &whole[..cut]).unwrap();
            let file = File::options().read(true).write(true).open(&broken).unwrap();
            let Some(done) = repair(file).unwrap() else { continue };
            let (frames, keys, ticks) = read(&broken);
            assert!(keys >= 1 && frames >= 15 && done.length_ms == ticks / 90, "{cut}: {done:?}");
            assert_eq!(std::fs::metadata(&broken).unwrap().len(), done.bytes);
            seen.insert(frames);
        }
        assert!(seen.len() >= 5, "{seen:?}");
        std::fs::write(&path, b"\x00\x00\x00\x09nothing at all").unwrap();
        let file = File::options().read(true).write(true).open(&path).unwrap();
        assert_eq!(repair(file).unwrap(), None);
    }

    #[test]
    fn what_the_decoder_was_not_told_goes_into_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let film = write(&folder.path().join("film.mp4"), 40);
        let gap = 1_000_000_000;
        let next = Unit::clone(&unit(40));
        assert!(film.takes(&next, gap));
        assert!(!film.takes(&Unit { width: 1280, ..next.clone() }, gap));
        assert!(!film.takes(&Unit { source: (1, 1), ..next.clone() }, gap));
        assert!(!film.takes(&Unit { capture_ns: next.capture_ns - 66_666_667, ..next.clone() }, gap));
        assert!(!film.takes(&Unit { capture_ns: next.capture_ns + gap, ..next.clone() }, gap));
        let parameters = Some(Parameters { sps: vec![0x67, 0x42, 0xc0, 0x20], pps: vec![0x68] });
        assert!(!film.takes(&Unit { parameters, ..next }, gap));
    }
}
