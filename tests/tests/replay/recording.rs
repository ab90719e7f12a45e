//! Everything that was said, and running one service again from it.

use ipc_types::{Message, Run, Trace};
use manifest::Manifest;
use runtime::{Cache, Input, Ports, Replay, Service, name_hash};
use std::collections::HashMap;
use std::path::Path;

const PAGE: usize = 4096;

/// The bytes of a message without the pages that are zero: most of a particle set is.
#[derive(PartialEq, Eq)]
struct Pages(Vec<Option<Box<[u8]>>>);

impl Pages {
    fn of<T: Message>(message: &T) -> Self {
        let pages = bytemuck::bytes_of(message).chunks(PAGE);
        Self(pages.map(|page| page.iter().any(|byte| *byte != 0).then(|| page.into())).collect())
    }

    fn message<T: Message>(&self) -> Box<T> {
        let mut message = bytemuck::allocation::zeroed_box::<T>();
        for (place, page) in bytemuck::bytes_of_mut(&mut *message).chunks_mut(PAGE).zip(&self.0) {
            if let Some(page) = page {
                place.copy_from_slice(page);
            }
        }
        message
    }
}

/// Publisher, incarnation, sequence.
type Key = (u32, u32, u64);

struct Heard<T: Message> {
    topic: String,
    input: Input<T>,
    /// Clears what means nothing: what a loan held before, beyond what was written.
    clear: fn(&mut T),
    messages: HashMap<Key, Pages>,
    /// In the order in which they came, with their stamps.
    order: Vec<(Key, u64)>,
}

/// One topic of a recording, its type forgotten.
trait Channel {
    fn topic(&self) -> &str;
    fn hear(&mut self);
    /// Hands the messages of a run to a service that runs again.
    fn give(&self, run: &Run, replay: &Replay);
    /// A recording of the same topic in a replay.
    fn again(&self, ports: &mut Ports) -> Box<dyn Channel>;
    /// What `publisher` said up to a time, with the bytes of each message.
    fn said(&self, publisher: (u32, u32), until_ns: u64) -> Vec<(u64, &Pages)>;
    fn traces(&self) -> Vec<Trace>;
}

impl<T: Message> Channel for Heard<T> {
    fn topic(&self) -> &str {
        &self.topic
    }

    fn hear(&mut self) {
        while let Some(guard) = self.input.receive() {
            let mut message = Pages::of(&*guard).message::<T>();
            (self.clear)(&mut message);
            let header = guard.header();
            let key = (header.publisher, header.incarnation, header.sequence);
            self.order.push((key, header.stamp_ns));
            self.messages.insert(key, Pages::of(&*message));
        }
        assert_eq!(self.input.lost(), 0, "{} was not recorded whole", self.topic);
    }

    fn give(&self, run: &Run, replay: &Replay) {
        for sequence in run.sequences() {
            let pages = self.messages.get(&(run.publisher, run.incarnation, sequence));
            let pages = pages.unwrap_or_else(|| panic!("{}: no message {sequence} of {run:?}", self.topic));
            assert!(replay.give(run, &*pages.message::<T>()), "{} is not what {run:?} says", self.topic);
        }
    }

    fn again(&self, ports: &mut Ports) -> Box<dyn Channel> {
        channel(ports, &self.topic, self.clear)
    }

    fn said(&self, (publisher, incarnation): (u32, u32), until_ns: u64) -> Vec<(u64, &Pages)> {
        let own = |((who, which, _), stamp): &&(Key, u64)| {
            (*who, *which) == (publisher, incarnation) && *stamp <= until_ns
        };
        self.order.iter().filter(own).map(|(key, _)| (key.2, &self.messages[key])).collect()
    }

    fn traces(&self) -> Vec<Trace> {
        let whole = |pages: &Pages| {
            let message = pages.message::<T>();
            *bytemuck::from_bytes::<Trace>(bytemuck::bytes_of(&*message))
        };
        assert_eq!(T::TOPIC, Trace::TOPIC);
        self.order.iter().map(|(key, _)| whole(&self.messages[key])).collect()
    }
}

fn channel<T: Message>(ports: &mut Ports, topic: &str, clear: fn(&mut T)) -> Box<dyn Channel> {
    Box::new(Heard {
        topic: topic.to_owned(),
        input: ports.input_of(topic).unwrap(),
        clear,
        messages: HashMap::new(),
        order: Vec::new(),
    })
}

/// Everything that was said on some topics.
#[derive(Default)]
pub(crate) struct Recording(Vec<Box<dyn Channel>>);

impl Recording {
    pub(crate) fn add<T: Message>(&mut self, ports: &mut Ports) {
        self.add_clearing::<T>(ports, |_| {});
    }

    pub(crate) fn add_clearing<T: Message>(&mut self, ports: &mut Ports, clear: fn(&mut T)) {
        self.0.push(channel(ports, T::TOPIC, clear));
    }

    pub(crate) fn add_trace(&mut self, ports: &mut Ports, service: &str) {
        self.0.push(channel::<Trace>(ports, &format!("trace/{service}"), |_| {}));
    }

    pub(crate) fn hear(&mut self) {
        self.0.iter_mut().for_each(|channel| channel.hear());
    }

    /// The journal of one incarnation of a service, checked: it starts with the start and leaves nothing out.
    pub(crate) fn journal(&self, service: &str, incarnation: u32) -> Vec<Trace> {
        let topic = format!("trace/{service}");
        let channel = self.0.iter().find(|channel| channel.topic() == topic).unwrap();
        let mut traces = channel.traces();
        traces.retain(|trace| trace.header.incarnation == incarnation);
        for (step, trace) in traces.iter().enumerate() {
            assert_eq!((trace.step, trace.truncated), (step as u64, 0), "{service}");
        }
        traces
    }

    fn give(&self, runs: &[Run], replay: &Replay) {
        for run in runs {
            let channel = self.0.iter().find(|channel| name_hash(channel.topic()) == run.topic);
            channel.unwrap_or_else(|| panic!("no topic recorded for {run:?}")).give(run, replay);
        }
    }

    /// Runs a service again from a journal; compares all that it says, byte for byte. Answers how many messages of
    /// each recorded topic of its own were equal, or in which topic it first said something else.
    pub(crate) fn same_again<S: Service>(
        &self,
        manifest: &Manifest,
        root: &Path,
        cache: Cache,
        config: S::Config,
        journal: &[Trace],
    ) -> Result<HashMap<String, usize>, String> {
        let replay = Replay::new(manifest.clone(), S::NAME);
        let entry = &manifest.services[S::NAME];
        let mut ports = replay.tool("cli");
        let mut again: Vec<_> = self
            .0
            .iter()
            .filter(|channel| entry.may_publish(channel.topic()))
            .map(|channel| channel.again(&mut ports))
            .collect();
        let (first, steps) = journal.split_first().unwrap();
        self.give(first.runs.as_slice(), &replay);
        let mut instance = replay.start::<S>(config, root, cache, first).unwrap();
        for trace in steps {
            self.give(trace.runs.as_slice(), &replay);
            instance.step(trace.now_ns);
            again.iter_mut().for_each(|channel| channel.hear());
        }
        let publisher = (first.header.publisher, first.header.incarnation);
        let until_ns = journal.last().unwrap().now_ns;
        let mut equal = HashMap::new();
        for channel in &again {
            let before = self.0.iter().find(|before| before.topic() == channel.topic()).unwrap();
            let (before, after) = (before.said(publisher, until_ns), channel.said(publisher, until_ns));
            if let Some(at) = before.iter().zip(&after).position(|(before, after)| before != after) {
                return Err(format!("{}: message {} differs", channel.topic(), before[at].0));
            }
            if before.len() != after.len() {
                return Err(format!("{}: {} messages, now {}", channel.topic(), before.len(), after.len()));
            }
            equal.insert(channel.topic().to_owned(), after.len());
        }
        Ok(equal)
    }
}
