//! The conversation with the flight controller: bytes in, bytes out, time as an argument.

use crate::arming::Evidence;
use crate::asked::{Asked, Together};
use crate::frame::{FrameError, MAX_FRAME, fill};
use crate::framing::Framing;
use crate::ladder::View;
use crate::order::{ReceiverOrder, throttle_of};
use crate::plausible::Attitudes;
use crate::said::{AttitudeSample, Counts, Identity, Said, question_of, write};
use crate::schedule::{Question, Schedule};
use msp::messages::{
    Analog, ApiVersion, Arming, Attitude, AttitudeAndImu, BoxIds, FcVariant, FcVersion, Motor, Rc, RxMap,
    SetRawRc, Status,
};
use msp::{Decoder, Direction, Frame, Request, Version, encode_request, parse_reply};

/// Without any answer for so long the controller is silent.
const SILENT_NS: u64 = 1_000_000_000;
/// Least time between two commands: nearly one pass of the controller's task.
const SPACING_NS: u64 = 8_000_000;
/// From the reading of the attitude to now: an answer of 12 bytes at 115200 baud and half a tick of 5 ms; of 32 bytes
/// with the accelerometer.
const ON_THE_WAY_NS: u64 = 3_500_000;
const ON_THE_WAY_WITH_IMU_NS: u64 = 5_300_000;
/// A line that holds bytes up for so long, each way, cannot be flown by: in the simulator 30 ms are a hover, from 50 ms on the
/// pilot's height loop swings until it meets the floor.
const TOO_SLOW_NS: u64 = 40_000_000;
/// Half a frame and then nothing for so long: the rest will not come.
const QUIET_NS: u64 = 50_000_000;
/// The receiver's order is waited for this long before it is taken for AETR: two passes of the task and more.
const ORDER_WAIT_NS: u64 = 40_000_000;
/// A status older than this says nothing about arming.
const STATUS_OLD_NS: u64 = 500_000_000;
/// Longest answer that is waited for: more is a damaged length. INAV's list of boxes may be 60 bytes and its channels
/// are 68.
const LONGEST: usize = 128;

/// Permanent ids of modes and the bits that `flight/state` gives them.
const MODES: [(u8, u32); 4] = [(0, 1), (1, 2), (27, 4), (50, 8)];

/// The link, while the port is open.
#[derive(Debug, Clone)]
pub struct Link {
    framing: Framing,
    decoder: Decoder<LONGEST>,
    schedule: Schedule,
    asked: Asked,
    /// Which questions of [`Question::once`] are answered (or refused, which is an answer).
    settled: [bool; 10],
    opened_ns: u64,
    byte_ns: u64,
    answer_ns: Option<u64>,
    command_ns: Option<u64>,
    frame_ns: Option<u64>,
    unacknowledged: u32,
    asked_since_frame: bool,
    counts: Counts,
    /// Index of each of [`MODES`] in the controller's list; ARM is the first before the list is known.
    box_index: [Option<u8>; 4],
    order: Option<ReceiverOrder>,
    identity: Identity,
    together: Together,
    attitudes: Attitudes,
    /// What the controller said.
    pub said: Said,
}

impl Link {
    /// A link over a port that opened `now`.
    #[must_use]
    pub fn new(now: u64, msp_version: u8) -> Self {
        Self {
            framing: Framing::new(now, msp_version),
            decoder: Decoder::new(),
            schedule: Schedule::new(now),
            asked: Asked::default(),
            settled: [false; 10],
            opened_ns: now,
            byte_ns: now,
            answer_ns: None,
            command_ns: None,
            frame_ns: None,
            unacknowledged: 0,
            asked_since_frame: false,
            counts: Counts::default(),
            box_index: [Some(0), Some(1), None, None],
            order: None,
            identity: Identity::default(),
            together: Together::default(),
            attitudes: Attitudes::default(),
            said: Said::default(),
        }
    }

    /// The port opened again: ask anew who is there, and keep the receiver's order until then, so that frames
    /// can go on at once.
    pub fn reopened(&mut self, now: u64) {
        let order = self.order;
        let throttle_us = self.said.throttle_us;
        let framing = self.framing.reopened(now);
        *self = Self::new(now, 2);
        self.framing = framing;
        self.order = order;
        self.said.throttle_us = throttle_us;
    }

    /// Who the controller is.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Counts since the port opened.
    #[must_use]
    pub fn counts(&self) -> Counts {
        let refused = self.decoder.refused();
        Counts {
            refused: self.counts.refused.wrapping_add(refused.checksum).wrapping_add(refused.oversize),
            junk: refused.bytes,
            ..self.counts
        }
    }

    /// Seconds since the last answer, or since the port opened.
    #[must_use]
    pub fn age_s(&self, now: u64) -> f32 {
        now.saturating_sub(self.answer_ns.unwrap_or(self.opened_ns)) as f32 * 1e-9
    }

    /// Nothing came back for a second.
    #[must_use]
    pub fn silent(&self, now: u64) -> bool {
        now.saturating_sub(self.answer_ns.unwrap_or(self.opened_ns)) >= SILENT_NS
    }

    /// What the controller tells of the tilt; before the first attitude as if one had come when the port opened.
    #[must_use]
    pub fn view(&self, now: u64) -> View {
        let age_ns = now.saturating_sub(self.attitudes.seen_ns().unwrap_or(self.opened_ns));
        if age_ns < SILENT_NS && self.asked.held_up_ns() >= TOO_SLOW_NS {
            View::Late
        } else {
            View::Seen(age_ns)
        }
    }

    /// Everything that is asked once is known.
    #[must_use]
    pub fn identified(&self) -> bool {
        Question::ALL.into_iter().all(|question| !question.once() || self.settled[question as usize])
    }

    /// The controller says so.
    #[must_use]
    pub fn armed(&self) -> Option<bool> {
        let (_, status) = self.said.status?;
        Some(self.box_index[0].is_some_and(|index| status.mode(index.into())))
    }

    /// Mode bits in the order of `flight/state`.
    #[must_use]
    pub fn modes(&self) -> u32 {
        let Some((_, status)) = self.said.status else { return 0 };
        MODES.iter().zip(self.box_index).fold(0, |modes, ((_, bit), index)| {
            if index.is_some_and(|index| status.mode(index.into())) { modes | bit } else { modes }
        })
    }

    /// What blocks arming, when the firmware tells.
    #[must_use]
    pub fn blocks(&self) -> Option<Arming> {
        self.said.status.and_then(|(_, status)| status.arming)
    }

    /// For the arm switch.
    #[must_use]
    pub fn evidence(&self, now: u64) -> Evidence {
        let recent = |at: u64| now.saturating_sub(at) < STATUS_OLD_NS;
        let clear = self.said.status.is_some_and(|(at, status)| {
            let blocks = status.arming.map_or(0, |arming| arming.flags & !arming.arm_switch().unwrap_or(0));
            recent(at) && blocks == 0
        });
        Evidence {
            armed: self.armed(),
            statuses: self.said.statuses,
            clear,
            ready: self.order.is_some() && self.frame_ns.is_some(),
        }
    }

    /// Whether a frame can be sent: the receiver's order is known, or was waited for.
    #[must_use]
    pub fn order_settled(&self, now: u64) -> bool {
        self.order.is_some() || now.saturating_sub(self.opened_ns) >= ORDER_WAIT_NS
    }

    /// When the last frame was sent.
    #[must_use]
    pub fn frame_ns(&self) -> Option<u64> {
        self.frame_ns
    }

    /// Takes bytes from the port.
    pub fn receive(&mut self, now: u64, bytes: &[u8]) {
        if !bytes.is_empty() {
            self.byte_ns = now;
        }
        // Taken out for the time of the call: a frame borrows the decoder while it is looked at.
        let mut decoder = core::mem::take(&mut self.decoder);
        if bytes.is_empty() && decoder.in_frame() && now.saturating_sub(self.byte_ns) >= QUIET_NS {
            decoder.abandon();
            while let Some(frame) = decoder.pending() {
                self.frame(now, &frame);
            }
        }
        decoder.feed(bytes, |frame| self.frame(now, &frame));
        self.decoder = decoder;
    }

    fn frame(&mut self, now: u64, frame: &Frame<'_>) {
        if self.silent(now) {
            // Whoever answers after a silence may have restarted, or be another one.
            self.settled = [false; 10];
            self.together = Together::default();
        }
        let answered = match frame.direction {
            Direction::Request => false,
            _ if frame.code == SetRawRc::CODE => self.acknowledged(frame.direction),
            direction => match question_of(frame.code) {
                Some(question) => {
                    if frame.code == AttitudeAndImu::CODE {
                        self.together.answered(direction != Direction::Refusal);
                    }
                    self.answer(now, question, direction, frame)
                }
                None => false,
            },
        };
        if answered {
            self.framing.answered(now, frame.version);
            self.answer_ns = Some(now);
            self.counts.answers = self.counts.answers.wrapping_add(1);
        } else {
            self.counts.refused = self.counts.refused.wrapping_add(1);
        }
    }

    fn acknowledged(&mut self, direction: Direction) -> bool {
        self.said.channels_refused = direction == Direction::Refusal;
        let expected = self.unacknowledged > 0;
        self.unacknowledged = self.unacknowledged.saturating_sub(1);
        expected
    }

    fn answer(&mut self, now: u64, question: Question, direction: Direction, frame: &Frame<'_>) -> bool {
        if !self.asked.answered(now, question) {
            return false;
        }
        let understood = direction == Direction::Refusal
            || self.understand(now, question, frame).is_ok_and(|believed| believed);
        if understood && question.once() {
            self.settled[question as usize] = true;
        }
        understood
    }

    /// Takes what an answer says; false when it cannot be true.
    fn understand(&mut self, now: u64, question: Question, frame: &Frame<'_>) -> Result<bool, msp::TooShort> {
        let payload = frame.payload;
        match question {
            Question::Status => {
                self.said.status = Some((now, parse_reply(&Status, payload)?));
                self.said.statuses = self.said.statuses.wrapping_add(1);
            }
            Question::Map => {
                let order = ReceiverOrder::read(&parse_reply(&RxMap, payload)?);
                self.said.order_broken = order.is_none();
                self.order = order;
            }
            Question::Rc => self.said.throttle_us = throttle_of(&parse_reply(&Rc, payload)?),
            Question::Attitude => {
                let (reply, imu, way_ns) = if frame.code == AttitudeAndImu::CODE {
                    let both = parse_reply(&AttitudeAndImu, payload)?;
                    (both.attitude, both.imu, ON_THE_WAY_WITH_IMU_NS)
                } else {
                    (parse_reply(&Attitude, payload)?, None, ON_THE_WAY_NS)
                };
                let read_ns = now.saturating_sub(way_ns + self.asked.held_up_ns());
                let Some(sampled_ns) = self.attitudes.date(now, read_ns, reply) else { return Ok(false) };
                self.said.attitude = Some(AttitudeSample { sampled_ns, reply, imu });
            }
            Question::Api => {
                let reply = parse_reply(&ApiVersion, payload)?;
                self.identity.api = Some((reply.major, reply.minor));
            }
            Question::Variant => self.identity.variant = parse_reply(&FcVariant, payload)?.letters,
            Question::Version => {
                let reply = parse_reply(&FcVersion, payload)?;
                self.identity.version = [reply.major, reply.minor, reply.patch, 0];
            }
            Question::Boxes => {
                let ids = parse_reply(&BoxIds, payload)?.ids;
                for (slot, (id, _)) in self.box_index.iter_mut().zip(MODES) {
                    let index = ids.iter().position(|listed| *listed == id);
                    *slot = index.and_then(|index| u8::try_from(index).ok());
                }
            }
            Question::Analog => self.said.analog = Some(parse_reply(&Analog, payload)?),
            Question::Motor => self.said.motors_us = parse_reply(&Motor, payload)?.motors_us,
        }
        Ok(true)
    }

    /// Writes a frame of channels (roll, pitch, throttle, yaw, AUX1...) and returns its length.
    ///
    /// # Errors
    /// A channel out of range, or none; nothing is written then.
    pub fn write_frame(
        &mut self,
        now: u64,
        channels_us: &[u16; 18],
        count: usize,
        out: &mut [u8; MAX_FRAME],
    ) -> Result<usize, FrameError> {
        let order = self.order.unwrap_or(ReceiverOrder::AETR);
        let (arranged, count) = order.arrange(channels_us, count.min(18));
        let request = SetRawRc::new(arranged.get(..count).unwrap_or(&[])).map_err(FrameError::Channels)?;
        let length = encode_request(out, self.framing.version(), &request).map_err(FrameError::Encode)?;
        let length = fill(out, length);
        self.schedule.spend(now);
        self.frame_ns = Some(now);
        self.command_ns = Some(now);
        self.asked_since_frame = false;
        // One second of frames: what is older is never acknowledged any more.
        self.unacknowledged = (self.unacknowledged + 1).min(50);
        self.counts.frames = self.counts.frames.wrapping_add(1);
        Ok(length)
    }

    /// Writes the next question, when one is due and there is room for it; returns its length.
    ///
    /// `eager`: the status is about to change. `orphan`: nobody has said yet which throttle is flown.
    pub fn write_question(
        &mut self,
        now: u64,
        eager: bool,
        orphan: bool,
        out: &mut [u8; MAX_FRAME],
    ) -> Option<usize> {
        self.asked.expire(now);
        if self.framing.turn(now, self.silent(now)) {
            // Whatever is on its way was not understood.
            self.asked.forget();
            self.together.forget();
            self.schedule.hurry(Question::Status, now);
            self.schedule.hurry(Question::Map, now);
        }
        let since = |at: Option<u64>| at.map_or(u64::MAX, |at| now.saturating_sub(at));
        let spaced = if self.frame_ns.is_none() && since(self.answer_ns) == u64::MAX {
            // Nothing is known yet and an aircraft may be in the air: the first questions go out together.
            true
        } else {
            // One between two frames, in the middle.
            since(self.command_ns) >= SPACING_NS
                && (!self.asked_since_frame || since(self.frame_ns) > 40_000_000)
        };
        if !spaced {
            return None;
        }
        if eager || orphan {
            self.schedule.hurry(
                if orphan && self.armed() == Some(true) { Question::Rc } else { Question::Status },
                now,
            );
        }
        let silent = self.silent(now);
        let (asked, settled) = (&self.asked, &self.settled);
        let question = self.schedule.next(now, |question| {
            let index = question as usize;
            let wanted = if question.once() { !settled[index] } else { true };
            wanted && asked.free(question) && (!silent || question == Question::Status)
        })?;
        // One that comes again and is not urgent: no harm where it is not understood.
        let probe = question == Question::Analog && self.identified() && self.framing.probe(now);
        let version = if probe { Version::V2 } else { self.framing.version() };
        let imu = self.together.wanted(now) && !self.attitudes.overdue(now);
        let length = write(question, version, imu, out).ok()?;
        let length = fill(out, length);
        self.framing.asked();
        self.schedule.asked(question, now, eager);
        self.schedule.spend(now);
        self.asked.sent(now, question);
        if question == Question::Attitude {
            self.together.asked(now);
        }
        self.command_ns = Some(now);
        self.asked_since_frame = true;
        Some(length)
    }
}
