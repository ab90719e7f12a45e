//! The recorder's thread: what comes is put where it belongs, one thing after the other.

use super::retention::{Why, going};
use super::ring::{RING_BYTES, Ring};
use super::settings::RecordingConfig;
use super::take::{Desk, Take};
use super::unit::Unit;
use super::{Now, Shared, Wants, Work, lock};
use crate::store::{Entry, Kind};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// How often what is old is looked for, and whether there is room.
const LOOK: Duration = Duration::from_secs(1);
/// After an incident so much more is kept.
const AFTER: Duration = Duration::from_secs(10);
/// Incidents of one drone that are being kept at a time.
const MOST_CLIPS: usize = 4;
/// Drones whose last seconds are kept at a time: 384 MiB in all at most.
const MOST_RINGS: usize = 16;
/// A recording to which nothing has come for so long ends.
const SILENT: Duration = Duration::from_secs(600);

/// One drone.
struct Place {
    ring: Option<Ring>,
    recording: Option<(u64, Take)>,
    clips: Vec<(Instant, Take)>,
    /// Source and number of the newest picture.
    last: Option<((u32, u32), u64)>,
    /// One was lost: those up to the next key frame cannot be decoded.
    waits: bool,
    key_requests: u32,
    heard: Instant,
    trouble: String,
}

impl Place {
    fn new() -> Self {
        Self {
            ring: None,
            recording: None,
            clips: Vec::new(),
            last: None,
            waits: true,
            key_requests: 0,
            heard: Instant::now(),
            trouble: String::new(),
        }
    }

    /// Whether the picture can be decoded after those before it.
    fn follows(&mut self, unit: &Unit) -> bool {
        let next = self
            .last
            .is_some_and(|(source, sequence)| source == unit.source && unit.sequence == sequence + 1);
        self.last = Some((unit.source, unit.sequence));
        if unit.is_key() {
            self.waits = false;
        } else if !next && !self.waits {
            self.waits = true;
            self.key_requests = self.key_requests.wrapping_add(1);
        }
        !self.waits
    }
}

pub(super) struct Thread {
    settings: RecordingConfig,
    desk: Desk,
    shared: Arc<Mutex<Shared>>,
    changed: Arc<Notify>,
    places: BTreeMap<Arc<str>, Place>,
    /// Why nothing can be recorded now.
    no_room: Option<String>,
    looked: Option<Instant>,
}

impl Thread {
    pub(super) fn new(
        settings: RecordingConfig,
        desk: Desk,
        shared: Arc<Mutex<Shared>>,
        changed: Arc<Notify>,
    ) -> Self {
        Self { settings, desk, shared, changed, places: BTreeMap::new(), no_room: None, looked: None }
    }

    /// Works until it is told to end, or nobody is left who could.
    pub(super) fn run(mut self, waiting: &Receiver<Work>) {
        loop {
            if self.looked.is_none_or(|last| last.elapsed() >= LOOK) {
                self.look();
                self.looked = Some(Instant::now());
            }
            match waiting.recv_timeout(LOOK) {
                Ok(Work::End { done }) => {
                    self.end();
                    // Who waits for it may have given up.
                    let _ = done.send(());
                    return;
                }
                Ok(work) => self.work(work),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return self.end(),
            }
        }
    }

    fn end(&mut self) {
        for place in self.places.values_mut() {
            let clips = place.clips.drain(..).map(|(_, take)| take);
            for mut take in clips.chain(place.recording.take().map(|(_, take)| take)) {
                if let Err(trouble) = take.end(&self.desk) {
                    tracing::error!("{trouble}");
                }
            }
        }
    }

    fn work(&mut self, work: Work) {
        match work {
            Work::Picture { drone, unit } => self.picture(&drone, &Arc::new(*unit)),
            Work::Roll { drone, on } => self.roll(&drone, on),
            Work::Start { drone, account, answer } => {
                // Who asked may have gone, here and below.
                let _ = answer.send(self.start(&drone, account));
                self.tell(&drone);
            }
            Work::Stop { drone, answer } => {
                let take = self.places.get_mut(&drone).and_then(|place| place.recording.take());
                let was = take.is_some();
                if let Some((_, mut take)) = take
                    && let Err(trouble) = take.end(&self.desk)
                    && let Some(place) = self.places.get_mut(&drone)
                {
                    place.trouble = trouble;
                }
                let _ = answer.send(was);
                self.tell(&drone);
            }
            Work::Mark { drone, account, incident, answer } => {
                let _ = answer.send(self.mark(&drone, account, incident));
                self.tell(&drone);
            }
            Work::Erase { id, by, answer } => {
                let _ = answer.send(self.erase(id, by));
            }
            Work::End { .. } => {}
        }
    }

    fn room(&self) -> Result<(), String> {
        self.no_room.clone().map_or(Ok(()), Err)
    }

    fn start(&mut self, drone: &Arc<str>, account: String) -> Result<(), String> {
        let room = self.room();
        let now_ms = self.desk.clock.now_ms();
        let place = self.places.entry(drone.clone()).or_insert_with(Place::new);
        if place.recording.is_some() {
            return Ok(());
        }
        place.trouble = room.clone().err().unwrap_or_default();
        room?;
        // A recording begins with a key frame: one is asked for.
        place.key_requests = place.key_requests.wrapping_add(1);
        place.heard = Instant::now();
        place.recording = Some((now_ms, Take::new(drone, account, None)));
        Ok(())
    }

    fn mark(&mut self, drone: &Arc<str>, account: String, incident: i64) -> Result<(), String> {
        self.room()?;
        let now_ms = self.desk.clock.now_ms();
        let place = self.places.entry(drone.clone()).or_insert_with(Place::new);
        if place.clips.len() >= MOST_CLIPS {
            return Err(format!("{MOST_CLIPS} incidents are being kept already"));
        }
        let mut take = Take::new(drone, account, Some(incident));
        if let Some(ring) = &place.ring {
            let newest_ns = ring.units().last().map_or(0, |unit| unit.capture_ns);
            for unit in ring.units() {
                let age_ms = newest_ns.saturating_sub(unit.capture_ns) / 1_000_000;
                take.push(&self.desk, unit, now_ms.saturating_sub(age_ms))?;
            }
        }
        place.clips.push((Instant::now() + AFTER, take));
        Ok(())
    }

    fn roll(&mut self, drone: &Arc<str>, on: bool) {
        let rings = self.places.values().filter(|place| place.ring.is_some()).count();
        let span_ns = self.settings.rolling_ns();
        if !on && !self.places.contains_key(drone) {
            return;
        }
        let place = self.places.entry(drone.clone()).or_insert_with(Place::new);
        match (&place.ring, on) {
            (None, true) if rings < MOST_RINGS && span_ns > 0 => {
                place.ring = Some(Ring::new(span_ns, RING_BYTES));
            }
            (Some(_), false) => place.ring = None,
            _ => {}
        }
    }

    fn picture(&mut self, drone: &Arc<str>, unit: &Arc<Unit>) {
        let now_ms = self.desk.clock.now_ms();
        let Some(place) = self.places.get_mut(drone) else { return };
        place.heard = Instant::now();
        let asked = place.key_requests;
        if place.follows(unit) {
            if let Some(ring) = &mut place.ring {
                ring.push(unit);
            }
            let mut trouble = None;
            if let Some((_, take)) = &mut place.recording
                && let Err(why) = take.push(&self.desk, unit, now_ms)
            {
                trouble = Some(why);
                place.recording = None;
            }
            let desk = &self.desk;
            place.clips.retain_mut(|(_, take)| {
                let kept = take.push(desk, unit, now_ms);
                kept.inspect_err(|why| trouble = Some(why.clone())).is_ok()
            });
            if let Some(why) = trouble {
                tracing::error!("{drone}: {why}");
                place.trouble = why;
                self.tell(drone);
            }
        }
        let Some(place) = self.places.get(drone) else { return };
        let mut shared = lock(&self.shared);
        for take in
            place.recording.iter().map(|(_, take)| take).chain(place.clips.iter().map(|(_, take)| take))
        {
            if let Some((id, bytes)) = take.open() {
                shared.open.insert(id, bytes);
            }
        }
        if place.key_requests != asked {
            shared.wants.entry(drone.clone()).or_default().key_requests = place.key_requests;
        }
    }

    fn erase(&mut self, id: i64, by: String) -> Result<bool, String> {
        let takes = self.places.values().flat_map(|place| {
            place.recording.iter().map(|(_, take)| take).chain(place.clips.iter().map(|(_, take)| take))
        });
        if takes.filter_map(Take::open).any(|(open, _)| open == id) {
            return Err("it is still being written: stop it first".to_owned());
        }
        let erased = self.desk.store.erase_recording(id, by, self.desk.clock.now_ms());
        let was = self.desk.runtime.block_on(erased).map_err(|error| error.to_string())?;
        // The row first: a file that is left then goes at the next start.
        self.desk.files.remove(id).map_err(|error| format!("the recording cannot be erased: {error}"))?;
        Ok(was)
    }

    /// Says what others may know of a drone.
    fn tell(&mut self, drone: &Arc<str>) {
        let place = self.places.get(drone);
        let recording = place.and_then(|place| place.recording.as_ref());
        let now = Now {
            since_ms: recording.map(|(since_ms, _)| *since_ms),
            account: recording.map(|(_, take)| take.account().to_owned()).unwrap_or_default(),
            trouble: place.map(|place| place.trouble.clone()).unwrap_or_default(),
        };
        let wants = Wants {
            records: place.is_some_and(|place| place.recording.is_some() || !place.clips.is_empty()),
            key_requests: place.map_or(0, |place| place.key_requests),
        };
        let open: BTreeMap<i64, u64> = self
            .places
            .values()
            .flat_map(|place| {
                place.recording.iter().map(|(_, take)| take).chain(place.clips.iter().map(|(_, take)| take))
            })
            .filter_map(Take::open)
            .collect();
        let mut shared = lock(&self.shared);
        shared.now.insert(drone.clone(), now);
        shared.wants.insert(drone.clone(), wants);
        shared.open = open;
        shared.news.insert(drone.clone());
        drop(shared);
        self.changed.notify_one();
    }

    /// What time brings: clips end, silent recordings end, old recordings go, and a disk fills.
    fn look(&mut self) {
        let mut changed = Vec::new();
        for (drone, place) in &mut self.places {
            let before = (place.clips.len(), place.recording.is_some());
            let desk = &self.desk;
            place.clips.retain_mut(|(until, take)| {
                let goes_on = Instant::now() < *until;
                if !goes_on && let Err(trouble) = take.end(desk) {
                    tracing::error!("{trouble}");
                }
                goes_on
            });
            if place.heard.elapsed() >= SILENT
                && let Some((_, mut take)) = place.recording.take()
            {
                place.trouble =
                    take.end(desk).err().unwrap_or_else(|| "no picture has come for ten minutes".to_owned());
            }
            if (place.clips.len(), place.recording.is_some()) != before {
                changed.push(drone.clone());
            }
        }
        let was = self.no_room.take();
        self.no_room = self.make_room().err();
        if let Some(why) = self.no_room.clone() {
            if was.is_none() {
                tracing::error!("{why}");
            }
            for (drone, place) in &mut self.places {
                let Some((_, mut take)) = place.recording.take() else { continue };
                place.trouble = take.end(&self.desk).err().unwrap_or_else(|| why.clone());
                changed.push(drone.clone());
            }
        }
        for drone in changed {
            self.tell(&drone);
        }
    }

    /// Erases what must go. An error when there is no room all the same.
    fn make_room(&mut self) -> Result<(), String> {
        let kept = self
            .desk
            .runtime
            .block_on(self.desk.store.every_recording())
            .map_err(|error| error.to_string())?;
        let most = self.settings.most_bytes();
        let being_written: u64 = lock(&self.shared).open.values().sum();
        let now_ms = self.desk.clock.now_ms();
        let mut bytes: u64 = kept.iter().map(|one| one.bytes).sum::<u64>() + being_written;
        for (id, why) in
            going(&kept, now_ms, self.settings.retention_ms(), most.saturating_sub(being_written))
        {
            let Some(one) = kept.iter().find(|one| one.id == id) else { continue };
            let said = match why {
                Why::Old => format!("recording {id}: it is older than {} h", self.settings.retention_h),
                Why::Room => format!("recording {id}: newer ones need the room"),
            };
            if self.erase(id, "console".to_owned())? {
                bytes = bytes.saturating_sub(one.bytes);
                let entry = Entry {
                    time_ms: now_ms,
                    kind: Kind::Recording,
                    account: String::new(),
                    role: "",
                    address: String::new(),
                    drone: one.drone.clone(),
                    verb: "erase".to_owned(),
                    answer: said,
                };
                self.desk.runtime.block_on(self.desk.store.log(entry)).map_err(|error| error.to_string())?;
            }
        }
        if bytes > most {
            return Err(format!(
                "recordings fill the {} GiB that they may: erase some",
                self.settings.most_gib
            ));
        }
        let free = self.desk.files.free().map_err(|error| format!("the disk of the recordings: {error}"))?;
        if free < self.settings.free_bytes() {
            return Err(format!(
                "nothing is recorded: the disk has {:.1} GiB free, less than the {} GiB to be left free",
                free as f64 / f64::from(1 << 30),
                self.settings.free_gib
            ));
        }
        Ok(())
    }
}
