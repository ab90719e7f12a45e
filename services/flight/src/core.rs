//! The whole of `flight` without ports: pilot's wishes, pings and bytes in; bytes and reports out.

use crate::arming::ArmSwitch;
use crate::beat::{Asked, Beat};
use crate::config::{Config, Profile};
use crate::felt::Felt;
use crate::frame::MAX_FRAME;
use crate::ladder::{Decision, Ladder};
use crate::link::Link;
use crate::outbox::Outbox;
use crate::plausible::Batteries;
use crate::stick::StickLaw;
use crate::wish::{AUX_ARM, HIGH_US, LOW_US, Wish, neutral};
use crate::words::write_blocks;
use core::fmt::{self, Write};
use ipc_types::{
    ARM_WITH_THE_RADIO, Attitude, Channels, FlightState, Ladder as Step, LinkState, Power, Text,
};

/// In the override profile the sticks are neutral for so long first: a switch that is already on must not put
/// the sticks to their stops (FACTS 1).
const NEUTRAL_FIRST_NS: u64 = 1_000_000_000;
/// An armed aircraft without pilot: the controller is asked for its throttle, for no longer than this.
const ORPHAN_NS: u64 = 100_000_000;
/// Bytes that make no frame before the port is called the wrong one.
const JUNK_BYTES: u32 = 64;

/// Everything but the ports.
#[derive(Debug, Clone)]
pub struct Core {
    config: Config,
    cells: u32,
    batteries: Batteries,
    link: Link,
    ladder: Ladder,
    switch: ArmSwitch,
    outbox: Outbox,
    open: bool,
    closed_because: Text<128>,
    wish: Option<Wish>,
    /// The wish has not been sent yet.
    fresh: bool,
    orphan_ns: Option<u64>,
    first_frame_ns: Option<u64>,
    beat: Beat,
    tilt_cos: f32,
    felt: Felt,
    refused: u64,
}

impl Core {
    /// With the port closed. `cells`: of the vehicle's battery.
    #[must_use]
    pub fn new(config: &Config, cells: u32) -> Self {
        Self {
            config: *config,
            cells,
            batteries: Batteries::default(),
            link: Link::new(0, config.msp_version),
            ladder: Ladder::new(config),
            switch: ArmSwitch::default(),
            outbox: Outbox::default(),
            open: false,
            closed_because: Text::new("not opened yet"),
            wish: None,
            fresh: false,
            orphan_ns: None,
            first_frame_ns: None,
            beat: Beat::default(),
            tilt_cos: 1.0,
            felt: Felt::default(),
            refused: 0,
        }
    }

    /// The port opened.
    pub fn opened(&mut self, now: u64) {
        self.open = true;
        self.link.reopened(now);
        // It may be another controller.
        self.felt = Felt::default();
        self.outbox.clear();
        self.first_frame_ns = None;
    }

    /// The port is gone, or could not be opened.
    pub fn closed(&mut self, reason: &str) {
        self.open = false;
        self.outbox.clear();
        self.closed_because.set(reason);
    }

    /// Whether the port is open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// A message of the pilot. One that makes no sense is counted and not followed.
    pub fn pilot(&mut self, now: u64, message: &Channels) {
        match Wish::read(message, now) {
            Some(mut wish) => {
                // What was to be sent at once and was not yet is still to be.
                wish.prompt |= self.fresh && self.wish.is_some_and(|waiting| waiting.prompt);
                self.wish = Some(wish);
                self.fresh = true;
            }
            None => self.refused += 1,
        }
    }

    /// A ping of the down sonar; `range_m` is `None` without an echo.
    pub fn down_sonar(&mut self, now: u64, ping_ns: u64, range_m: Option<f32>) {
        self.ladder.ping(now, ping_ns, range_m, self.tilt_cos, self.wish.as_ref());
    }

    /// Bytes from the port; empty when none have come.
    pub fn receive(&mut self, now: u64, bytes: &[u8]) {
        self.link.receive(now, bytes);
    }

    /// Decides, and queues what is due.
    pub fn step(&mut self, now: u64) {
        self.adopt_orphan(now);
        let armed = self.link.armed();
        let believed = match self.config.profile {
            Profile::Receiver if self.switch.flying() => Some(true),
            Profile::Receiver => armed,
            Profile::Override => None,
        };
        let decision = self.ladder.decide(now, self.wish.as_ref(), believed, self.link.view(now));
        // Before anything is known the arm switch has no position: a low one would drop an aircraft in the air. Beside a
        // radio it is the neutral throttle that would, and the controller goes on with the last sticks meanwhile.
        let known = match self.config.profile {
            Profile::Receiver => self.wish.is_some() || armed == Some(false),
            Profile::Override => armed.is_some(),
        };
        let raised = known
            && self.config.profile == Profile::Receiver
            && self.switch.step(now, decision.arm, &self.link.evidence(now));
        if !self.open {
            return;
        }
        let mut out = [0; MAX_FRAME];
        let (mut channels, count) = self.channels(now, &decision, raised, armed);
        StickLaw::of(self.link.identity()).translate(&mut channels);
        let asked = Asked {
            channels: &channels,
            count,
            followed: decision.step == Step::Following,
            fresh: self.fresh,
            prompt: self.wish.is_some_and(|wish| wish.prompt),
            source: self.wish.map_or(0, |wish| wish.source),
        };
        if known
            && self.link.order_settled(now)
            && self.beat.due(now, self.link.frame_ns(), &asked)
            && let Ok(length) = self.link.write_frame(now, &channels, count, &mut out)
        {
            self.outbox.push(&out[..length]);
            self.first_frame_ns.get_or_insert(now);
            self.beat.sent(&asked);
            self.fresh = false;
        }
        let eager = self.switch.eager();
        while let Some(length) = self.link.write_question(now, eager, self.wish.is_none(), &mut out) {
            self.outbox.push(&out[..length]);
        }
    }

    /// Bytes for the port.
    #[must_use]
    pub fn waiting(&self) -> &[u8] {
        self.outbox.waiting()
    }

    /// The port took so many.
    pub fn taken(&mut self, count: usize) {
        self.outbox.taken(count);
    }

    /// An armed aircraft that nobody flies gets a wish of its own, which is stale from the start.
    fn adopt_orphan(&mut self, now: u64) {
        if self.wish.is_some() || self.link.armed() != Some(true) {
            self.orphan_ns = None;
            return;
        }
        let since = *self.orphan_ns.get_or_insert(now);
        let default = self.config.default_hover_us as u16;
        let throttle = self.link.said.throttle_us;
        if throttle.is_some() || now.saturating_sub(since) >= ORPHAN_NS {
            self.wish = Some(Wish::orphan(now, throttle.unwrap_or(default)));
        }
    }

    fn channels(
        &self,
        now: u64,
        decision: &Decision,
        raised: bool,
        armed: Option<bool>,
    ) -> ([u16; 18], usize) {
        let mut channels = decision.channels_us;
        match self.config.profile {
            Profile::Receiver => {
                channels[AUX_ARM] = if raised { HIGH_US } else { LOW_US };
                (channels, decision.count.max(AUX_ARM + 2))
            }
            Profile::Override => {
                let first =
                    self.first_frame_ns.is_none_or(|first| now.saturating_sub(first) < NEUTRAL_FIRST_NS);
                (if first && armed != Some(true) { neutral() } else { channels }, 4)
            }
        }
    }

    /// The newest attitude, once, converted to REP-103.
    pub fn take_attitude(&mut self) -> Option<Attitude> {
        let sample = self.link.said.attitude.take()?;
        let roll = f32::from(sample.reply.roll_decidegrees) * 0.1;
        let pitch = f32::from(sample.reply.pitch_decidegrees) * 0.1;
        // Clockwise 0..360 becomes counter-clockwise -180..180.
        let clockwise = f32::from(sample.reply.yaw_degrees).rem_euclid(360.0);
        let yaw = if clockwise > 180.0 { 360.0 - clockwise } else { -clockwise };
        let force = sample.imu.and_then(|imu| self.felt.take(imu.accelerometer)).unwrap_or([f32::NAN; 3]);
        self.tilt_cos = (roll.to_radians().cos() * pitch.to_radians().cos()).max(0.0);
        Some(Attitude {
            sampled_ns: sample.sampled_ns,
            roll_rad: roll.to_radians(),
            pitch_rad: pitch.to_radians(),
            yaw_rad: yaw.to_radians(),
            force_x_m_s2: force[0],
            force_y_m_s2: force[1],
            force_z_m_s2: force[2],
            ..Attitude::default()
        })
    }

    /// The newest reading of the battery, once.
    pub fn take_power(&mut self) -> Option<Power> {
        let analog = self.link.said.analog.take().filter(|analog| self.batteries.judge(analog))?;
        // A controller without a voltage meter says zero.
        let volts = Some(analog.volts()).filter(|volts| *volts > 0.5).unwrap_or(f32::NAN);
        Some(Power {
            volts,
            amps: f32::from(analog.centiamps) * 0.01,
            drawn_mah: f32::from(analog.drawn_mah),
            rssi: (f32::from(analog.rssi) / 1023.0).min(1.0),
            cells: self.cells,
            ..Power::default()
        })
    }

    /// State of the link.
    #[must_use]
    pub fn link_state(&self, now: u64) -> LinkState {
        if !self.open {
            LinkState::Closed
        } else if self.link.silent(now) {
            LinkState::Silent
        } else if self.link.identified() {
            LinkState::Up
        } else {
            LinkState::Identifying
        }
    }

    /// Link state, ladder and armed, as `flight/state` carries them: a change is worth a report at once.
    #[must_use]
    pub fn shape(&self, now: u64) -> (u8, u8, u8) {
        let armed = u8::from(self.link.armed() == Some(true));
        (self.link_state(now).code(), self.ladder.current().code(), armed)
    }

    /// Everything about the controller and the link.
    #[must_use]
    pub fn state(&self, now: u64) -> FlightState {
        let counts = self.link.counts();
        let (link, ladder, armed) = self.shape(now);
        let mut state = FlightState {
            modes: self.link.modes(),
            arming_blocks: self.link.blocks().map_or(0, |arming| arming.flags),
            link_age_s: self.link.age_s(now),
            frames_sent: counts.frames,
            answers: counts.answers,
            refused: counts.refused,
            variant: self.link.identity().variant,
            version: self.link.identity().version,
            channels_us: self.beat.channels(),
            motors_us: self.link.said.motors_us,
            armed,
            link,
            ladder,
            profile: self.config.profile.code(),
            ..FlightState::default()
        };
        // What does not fit is cut: the first reasons matter most.
        let _ = self.write_reason(now, &mut state.reason);
        state
    }

    /// What is wrong, in words; nothing when all is well.
    ///
    /// # Errors
    /// Only what `out` reports, when it is full.
    pub fn write_reason(&self, now: u64, out: &mut impl Write) -> fmt::Result {
        let counts = self.link.counts();
        match self.link_state(now) {
            LinkState::Closed => return write!(out, "port closed: {}", self.closed_because),
            LinkState::Silent if counts.junk >= JUNK_BYTES => {
                return out.write_str("what comes from the port is not MSP: wrong port or speed?");
            }
            LinkState::Silent => {
                return write!(out, "no answer from the flight controller for {:.0} s", self.link.age_s(now));
            }
            LinkState::Identifying | LinkState::Up => {}
        }
        if self.link.said.order_broken {
            return out.write_str("the controller's channel order makes no sense (map)");
        }
        if self.link.said.channels_refused {
            return out.write_str("the controller refuses channels: its receiver is not set to MSP");
        }
        if self.ladder.latched() {
            return out.write_str("landed without the pilot; motors stay off until it asks for none");
        }
        let armed = self.link.armed() == Some(true);
        let wanted = self.wish.is_some_and(|wish| wish.arm);
        match self.link.blocks() {
            // The arm switch alone is no reason: it is how the controller waits for the switch to go low.
            Some(blocks) if !armed && blocks.flags & !blocks.arm_switch().unwrap_or(0) != 0 => {
                out.write_str("will not arm: ")?;
                write_blocks(&blocks, out)
            }
            Some(blocks) if !armed && wanted && blocks.flags != 0 => {
                out.write_str("not armed yet: ")?;
                write_blocks(&blocks, out)
            }
            _ if self.config.profile == Profile::Override && wanted && !armed => {
                write!(out, "{ARM_WITH_THE_RADIO}: in this set-up only its pilot can")
            }
            _ => match self.ladder.current() {
                Step::Level | Step::Descend if self.ladder.unseen() => {
                    out.write_str("the controller answers too late or not at all: coming down level")
                }
                Step::Level | Step::Descend => out.write_str("the pilot is silent: coming down level"),
                Step::Following | Step::TouchDown | Step::Neutral => Ok(()),
            },
        }
    }

    /// Messages of the pilot that made no sense.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }
}
