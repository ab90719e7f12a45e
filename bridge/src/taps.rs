//! Topics on their way out: each at most so often as configured, the newest message wins.

use crate::form::{Form, encode, encoding};
use crate::network::{Network, Pace};
use ipc_types::{Message, TopicVisitor, Video, visit_topic};
use runtime::{Guard, Input, Ports, StartError};
use std::sync::Arc;
use zenoh::bytes::Encoding;

/// When the next message of a topic may leave. Pure: time is an argument.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pacer {
    period_ns: Option<u64>,
    next_ns: u64,
}

impl Pacer {
    /// One that lets a message pass each period; none at all without one.
    #[must_use]
    pub(crate) fn new(period_ns: Option<u64>) -> Self {
        Self { period_ns, next_ns: 0 }
    }

    /// Whether any message may leave, at whatever pace.
    pub(crate) fn allows(&self) -> bool {
        self.period_ns.is_some()
    }

    /// Whether a message may leave at `now`.
    pub(crate) fn pass(&mut self, now: u64) -> bool {
        let Some(period) = self.period_ns else { return false };
        if now < self.next_ns {
            return false;
        }
        // The raster is kept while messages come as often as they may, so that the rate is not rounded down to the rhythm
        // of the steps; after a pause it begins anew.
        self.next_ns = if now - self.next_ns > period { now + period } else { self.next_ns + period };
        true
    }
}

/// A topic of one type, its newest message held where it lies in shared memory.
pub(crate) struct Tap<T: Message> {
    input: Input<T>,
    newest: Option<Guard<T>>,
    fresh: bool,
    pacer: Pacer,
    key: Arc<str>,
    encoding: Encoding,
}

impl<T: Message> Tap<T> {
    pub(crate) fn open(
        ports: &mut Ports,
        topic: &str,
        key: &str,
        period_ns: Option<u64>,
    ) -> Result<Self, StartError> {
        Ok(Self {
            input: ports.input_of(topic)?,
            newest: None,
            fresh: false,
            pacer: Pacer::new(period_ns),
            key: key.into(),
            encoding: encoding::<T>().into(),
        })
    }

    /// Takes what has come, `each` of it, and sends the newest if it is time.
    pub(crate) fn pass(&mut self, now: u64, network: &Network, mut each: impl FnMut(&T)) {
        // One is held while the next is taken: no more than two at a time.
        while let Some(next) = self.input.receive() {
            each(&next);
            // A frame of video is told by what has changed since the one before: without that it is spoilt, and so are those
            // after it. The camera's pace is the limit.
            if T::TOPIC == Video::TOPIC && self.pacer.allows() {
                network.put(&self.key, &self.encoding, encode(&*next), Pace::Large);
                self.fresh = false;
            } else {
                self.fresh = true;
            }
            self.newest = Some(next);
        }
        if let Some(newest) = self.newest.as_ref().filter(|_| self.fresh)
            && self.pacer.pass(now)
        {
            self.fresh = false;
            let pace = if Form::of::<T>().is_json() { Pace::Small } else { Pace::Large };
            network.put(&self.key, &self.encoding, encode(&**newest), pace);
        }
    }

    pub(crate) fn newest(&self) -> Option<(Encoding, Vec<u8>)> {
        self.newest.as_ref().map(|newest| (self.encoding.clone(), encode(&**newest)))
    }
}

/// A topic of any type.
pub(crate) trait AnyTap {
    /// Takes what has come and sends the newest if it is time.
    fn pass(&mut self, now: u64, network: &Network);
    /// The newest message, as it would leave.
    fn newest(&self) -> Option<(Encoding, Vec<u8>)>;
}

impl<T: Message> AnyTap for Tap<T> {
    fn pass(&mut self, now: u64, network: &Network) {
        Self::pass(self, now, network, |_| {});
    }

    fn newest(&self) -> Option<(Encoding, Vec<u8>)> {
        Self::newest(self)
    }
}

/// Opens a tap on a topic that is known by its name only.
pub(crate) fn open(
    ports: &mut Ports,
    topic: &str,
    key: &str,
    period_ns: Option<u64>,
) -> Result<Box<dyn AnyTap>, StartError> {
    struct Opener<'a>(&'a mut Ports, &'a str, &'a str, Option<u64>);
    impl TopicVisitor for Opener<'_> {
        type Output = Result<Box<dyn AnyTap>, StartError>;
        fn visit<T: Message>(&mut self) -> Self::Output {
            Ok(Box::new(Tap::<T>::open(self.0, self.1, self.2, self.3)?))
        }
    }
    visit_topic(topic, &mut Opener(ports, topic, key, period_ns))
        .unwrap_or_else(|| Err(StartError::Invalid(format!("there is no topic {topic}"))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pacer_keeps_the_rate_whatever_the_rhythm() {
        const MS: u64 = 1_000_000;
        // (period of the steps, allowed period, expected in 10 s)
        for (step_ms, period_ms, expected) in [(20, 50, 200), (20, 100, 100), (50, 50, 200), (7, 200, 50)] {
            let mut pacer = Pacer::new(Some(period_ms * MS));
            let passed =
                (0..10_000 / step_ms).filter(|step| pacer.pass(1000 * MS + step * step_ms * MS)).count();
            let off = (passed as i64 - expected).abs();
            assert!(off <= 1, "{passed} of {expected} with steps of {step_ms} ms");
        }
        let mut pacer = Pacer::new(Some(50 * MS));
        assert!(
            pacer.pass(0) && pacer.pass(10_000 * MS) && !pacer.pass(10_001 * MS),
            "no burst after a pause"
        );
        assert!(!Pacer::new(None).pass(u64::MAX));
    }
}
