//! A scripted flight controller, byte by byte and without the codec that is tested, an aircraft that goes up
//! and down, a down sonar and a pilot, on simulated time.
#![allow(dead_code, clippy::unwrap_used, reason = "tests; each file uses a part")]

use flight::{Config, Core, Profile};
use ipc_types::{Channels, FlightState, Header};
use std::collections::VecDeque;

pub(crate) const MS: u64 = 1_000_000;
/// The first instant of every test: no clock starts at zero.
pub(crate) const T0: u64 = 10_000 * MS;

/// One command that arrived whole at the controller.
#[derive(Clone, Debug)]
pub(crate) struct Command {
    pub(crate) at: u64,
    pub(crate) code: u16,
    pub(crate) payload: Vec<u8>,
}

/// Behaves like the firmware of FACTS 1.
pub(crate) struct Controller {
    pub(crate) map: Vec<u8>,
    pub(crate) variant: [u8; 4],
    pub(crate) flag_count: u8,
    pub(crate) extra_blocks: u32,
    pub(crate) boxes: Vec<u8>,
    /// Answers nothing at all.
    pub(crate) mute: bool,
    /// Roll and pitch in 0.1 degree, yaw in degrees clockwise.
    pub(crate) attitude: [i16; 3],
    /// What the accelerometer reads, if the firmware answers several questions in one; `None` refuses it.
    pub(crate) accelerometer: Option<[i16; 3]>,
    /// Refusals are lost.
    pub(crate) sullen: bool,
    pub(crate) armed: bool,
    pub(crate) booted: u64,
    pub(crate) log: Vec<Command>,
    /// Channels as the controller understands them: roll, pitch, yaw, throttle, AUX1, AUX2.
    pub(crate) rc: [u16; 6],
    last_frame: Option<u64>,
    first_frame: Option<u64>,
    switch_latched: bool,
    low_since: Option<u64>,
    received: Vec<u8>,
    queue: VecDeque<(u16, bool, Vec<u8>)>,
    /// Bytes on their way back and when they arrive.
    answers: VecDeque<(u64, u8)>,
    pub(crate) seen_out_of_range: bool,
    pub(crate) frame_codes_in_frame: usize,
}

impl Controller {
    pub(crate) fn new() -> Self {
        Self {
            map: vec![0, 1, 3, 2, 4, 5, 6, 7],
            variant: *b"BTFL",
            flag_count: 29,
            extra_blocks: 0,
            boxes: vec![0, 1, 27],
            mute: false,
            attitude: [0; 3],
            accelerometer: Some([0, 0, 512]),
            sullen: false,
            armed: false,
            booted: T0 - 10_000 * MS,
            log: Vec::new(),
            rc: [1500, 1500, 1500, 885, 1000, 1000],
            last_frame: None,
            first_frame: None,
            switch_latched: false,
            low_since: None,
            received: Vec::new(),
            queue: VecDeque::new(),
            answers: VecDeque::new(),
            seen_out_of_range: false,
            frame_codes_in_frame: 0,
        }
    }

    /// Already flying with these throttle and frames when the test begins.
    pub(crate) fn in_flight(throttle: u16) -> Self {
        let mut controller = Self::new();
        controller.armed = true;
        controller.rc = [1500, 1500, 1500, throttle, 2000, 2000];
        controller.last_frame = Some(T0);
        controller.first_frame = Some(T0 - 9_000 * MS);
        controller
    }

    pub(crate) fn frames(&self) -> impl Iterator<Item = &Command> {
        self.log.iter().filter(|command| command.code == 200)
    }

    pub(crate) fn throttle(&self) -> u16 {
        self.rc[3]
    }

    fn blocks(&self, now: u64) -> u32 {
        let switch = 1 << (self.flag_count - 1);
        let mut blocks = self.extra_blocks;
        if self.lost(now) || self.first_frame.is_none_or(|first| now - first < 550 * MS) {
            blocks |= 1 << 2;
        }
        if now - self.booted < 5_000 * MS {
            blocks |= 1 << 9;
        }
        if self.throttle() > 1050 {
            blocks |= 1 << 7;
        }
        if self.switch_latched || blocks != 0 && self.rc[4] > 1700 {
            blocks |= switch;
        }
        blocks
    }

    fn lost(&self, now: u64) -> bool {
        self.last_frame.is_none_or(|last| now - last > 170 * MS)
    }

    /// Bytes from `flight` arrive.
    pub(crate) fn receive(&mut self, now: u64, bytes: &[u8]) {
        self.received.extend_from_slice(bytes);
        while let Some(start) = self.received.windows(3).position(|w| w == b"$M<" || w == b"$X<") {
            self.received.drain(..start);
            let second = self.received[1] == b'X';
            let head = if second { 8 } else { 5 };
            if self.received.len() < head {
                return;
            }
            let (code, length) = if second {
                let word = |i: usize| u16::from_le_bytes([self.received[i], self.received[i + 1]]);
                (word(4), usize::from(word(6)))
            } else {
                (u16::from(self.received[4]), usize::from(self.received[3]))
            };
            if self.received.len() < head + length + 1 {
                return;
            }
            let sum = check(second, &self.received[3..head + length]);
            assert_eq!(sum, self.received[head + length], "flight sent a wrong check byte");
            let payload = self.received[head..head + length].to_vec();
            self.received.drain(..head + length + 1);
            self.log.push(Command { at: now, code, payload: payload.clone() });
            // The 192-byte buffer.
            if self.queue.iter().map(|(_, _, p)| p.len() + 9).sum::<usize>() < 192 {
                self.queue.push_back((code, second, payload));
            }
        }
    }

    /// One pass of the 100 Hz task: one command.
    pub(crate) fn pass(&mut self, now: u64) {
        if let Some((code, second, payload)) = self.queue.pop_front() {
            let answer = self.answer(now, code, &payload);
            if !self.mute && (answer.is_some() || !self.sullen) {
                self.send(now, second, code, answer.as_deref());
            }
        }
        self.fly(now);
    }

    fn send(&mut self, now: u64, second: bool, code: u16, answer: Option<&[u8]>) {
        let direction = if answer.is_some() { b'>' } else { b'!' };
        let payload = answer.unwrap_or(&[]);
        let mut bytes = if second {
            let mut bytes = vec![b'$', b'X', direction, 0];
            bytes.extend(code.to_le_bytes());
            bytes.extend((payload.len() as u16).to_le_bytes());
            bytes
        } else {
            vec![b'$', b'M', direction, payload.len() as u8, code as u8]
        };
        bytes.extend_from_slice(payload);
        bytes.push(check(second, &bytes[3..]));
        let mut at = self.answers.back().map_or(now, |(at, _)| (*at).max(now));
        for byte in bytes {
            at += 86_806;
            self.answers.push_back((at, byte));
        }
    }

    /// Bytes that have come back by now.
    pub(crate) fn transmit(&mut self, now: u64) -> Vec<u8> {
        let count = self.answers.iter().take_while(|(at, _)| *at <= now).count();
        self.answers.drain(..count).map(|(_, byte)| byte).collect()
    }

    fn answer(&mut self, now: u64, code: u16, payload: &[u8]) -> Option<Vec<u8>> {
        let words = |values: &[u16]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        Some(match code {
            1 => vec![0, 1, 47],
            2 => self.variant.to_vec(),
            3 => vec![25, 12, 6, 9, b'2', b'0', b'2', b'5', b'.', b'1', b'2', b'.', b'6'],
            64 => self.map.clone(),
            119 => self.boxes.clone(),
            101 => {
                let arm_index = self.boxes.iter().position(|id| *id == 0).unwrap();
                let modes = u32::from(self.armed) << arm_index;
                let mut status = words(&[125, 0, 33]);
                status.extend(modes.to_le_bytes());
                status.extend([0, 12, 0, 3, 0, 0, self.flag_count]);
                status.extend(if self.armed { 0 } else { self.blocks(now) }.to_le_bytes());
                status.extend([0, 30, 0, 0]);
                status
            }
            104 => words(&[1060, 1061, 1062, 1063, 0, 0, 0, 0]),
            105 => words(&self.rc),
            108 => words(&self.attitude.map(i16::cast_unsigned)),
            230 => {
                let accelerometer = self.accelerometer?;
                let mut both = vec![6];
                both.extend(words(&self.attitude.map(i16::cast_unsigned)));
                both.push(18);
                both.extend(words(&accelerometer.map(i16::cast_unsigned)));
                both.extend([0; 12]);
                both
            }
            110 => vec![148, 10, 0, 255, 3, 0xd2, 4, 0xcb, 5],
            200 => {
                self.take_channels(now, payload);
                Vec::new()
            }
            _ => return None,
        })
    }

    fn take_channels(&mut self, now: u64, payload: &[u8]) {
        let raw: Vec<u16> = payload.chunks(2).map(|c| u16::from_le_bytes([c[0], c[1]])).collect();
        self.seen_out_of_range |= raw.iter().any(|us| !(1000..=2000).contains(us));
        self.last_frame = Some(now);
        self.first_frame.get_or_insert(now);
        for logical in 0..6 {
            let position = self.map.get(logical).map_or(logical, |at| usize::from(*at));
            if let Some(us) = raw.get(position) {
                self.rc[logical] = *us;
            }
        }
    }

    fn fly(&mut self, now: u64) {
        if let Some(last) = self.last_frame {
            if now - last > 320 * MS {
                self.rc[3] = 885;
            }
            if now - last > 1500 * MS {
                self.armed = false;
            }
        }
        if self.rc[4] < 1700 {
            self.armed = false;
            self.switch_latched = false;
            self.low_since.get_or_insert(now);
        } else if !self.armed {
            let others = self.blocks(now) & !(1 << (self.flag_count - 1));
            if others != 0 {
                self.switch_latched = true;
            } else if !self.switch_latched && self.low_since.is_some_and(|low| now - low >= 100 * MS) {
                self.armed = true;
            }
        } else {
            self.low_since = None;
        }
    }
}

fn check(second: bool, bytes: &[u8]) -> u8 {
    let mut sum = 0u8;
    for byte in bytes {
        sum ^= byte;
        if second {
            for _ in 0..8 {
                sum = if sum & 0x80 == 0 { sum << 1 } else { (sum << 1) ^ 0xd5 };
            }
        }
    }
    sum
}

/// What the pilot says, fifty times a second.
#[derive(Clone, Copy)]
pub(crate) struct Pilot {
    pub(crate) arm: bool,
    pub(crate) throttle: u16,
    pub(crate) roll: u16,
    pub(crate) hover: f32,
    pub(crate) on_ground: bool,
    pub(crate) climb: f32,
    pub(crate) level_roll: f32,
}

impl Pilot {
    pub(crate) const IDLE: Self = Self {
        arm: false,
        throttle: 1000,
        roll: 1500,
        hover: f32::NAN,
        on_ground: true,
        climb: 0.0,
        level_roll: 1504.0,
    };
    pub(crate) const HOVER: Self =
        Self { arm: true, throttle: 1450, roll: 1530, hover: 1450.0, on_ground: false, ..Self::IDLE };

    pub(crate) fn message(&self, now: u64) -> Channels {
        let mut channels_us = [1000; 18];
        channels_us[..6].copy_from_slice(&[self.roll, 1500, self.throttle, 1500, 1000, 2000]);
        channels_us[4] = if self.arm { 2000 } else { 1000 };
        Channels {
            header: Header { stamp_ns: now, ..Header::default() },
            expiry_ns: now + 100 * MS,
            channels_us,
            count: 6,
            arm: u8::from(self.arm),
            level_roll_us: self.level_roll,
            level_pitch_us: 1500.0,
            hover_throttle_us: self.hover,
            height_m: f32::NAN,
            climb_m_s: self.climb,
            on_ground: u16::from(self.on_ground),
            ..Channels::default()
        }
    }
}

/// Everything around `flight`, and `flight`.
pub(crate) struct World {
    pub(crate) now: u64,
    pub(crate) core: Core,
    pub(crate) controller: Controller,
    pub(crate) pilot: Option<Pilot>,
    pub(crate) connected: bool,
    /// Height of the skids above the ground, velocity.
    pub(crate) z: f32,
    pub(crate) vz: f32,
    /// The throttle at which it really hovers.
    pub(crate) true_hover: f32,
    /// Height of what is under it.
    pub(crate) ground: f32,
    pub(crate) sonar: bool,
    /// Downward speed at the last contact.
    pub(crate) impact: Option<f32>,
    pub(crate) states: Vec<(u64, FlightState)>,
    pub(crate) attitudes: Vec<ipc_types::Attitude>,
    pub(crate) powers: usize,
    ping: u64,
}

/// Distance of the down sonar's face from the ground when standing.
pub(crate) const STANDING: f32 = 0.07;

impl World {
    pub(crate) fn new(controller: Controller) -> Self {
        Self::with(controller, &Config::default())
    }

    pub(crate) fn with(controller: Controller, config: &Config) -> Self {
        let mut world = Self {
            now: T0,
            core: Core::new(config, 4),
            controller,
            pilot: None,
            connected: true,
            z: 0.0,
            vz: 0.0,
            true_hover: 1450.0,
            ground: 0.0,
            sonar: true,
            impact: None,
            states: Vec::new(),
            attitudes: Vec::new(),
            powers: 0,
            ping: 0,
        };
        world.core.opened(T0);
        world
    }

    pub(crate) fn override_profile(controller: Controller) -> Self {
        Self::with(controller, &Config { profile: Profile::Override, ..Config::default() })
    }

    /// Runs for so many milliseconds: physics each, `flight` every fifth, the controller's task every tenth.
    pub(crate) fn run(&mut self, milliseconds: u64) {
        for _ in 0..milliseconds {
            self.now += MS;
            let ms = (self.now - T0) / MS;
            self.physics();
            if ms.is_multiple_of(10) {
                self.controller.pass(self.now);
            }
            if let Some(pilot) = self.pilot.filter(|_| ms.is_multiple_of(20)) {
                let message = pilot.message(self.now);
                self.core.pilot(self.now, &message);
                self.step();
            }
            if ms.is_multiple_of(60) {
                self.echo();
            }
            if ms % 5 == 2 {
                self.step();
            }
        }
    }

    fn physics(&mut self) {
        let dt = 1e-3;
        let throttle = f32::from(self.controller.throttle());
        let thrust = if self.controller.armed {
            9.81 * ((throttle - 1000.0).max(0.0) / (self.true_hover - 1000.0)).powf(1.7)
        } else {
            0.0
        };
        self.vz += (thrust - 9.81 - 0.2 * self.vz) * dt;
        self.z += self.vz * dt;
        if self.z <= self.ground {
            if self.vz < -0.05 {
                self.impact = Some(-self.vz);
            }
            self.z = self.ground;
            self.vz = self.vz.max(0.0);
        }
    }

    fn echo(&mut self) {
        // The reading of a ping arrives 30 ms later.
        let range = self.sonar.then_some(self.z - self.ground + STANDING).filter(|r| *r < 4.0);
        if self.ping > 0 {
            self.core.down_sonar(self.now, self.now - 30 * MS, range);
        }
        self.ping += 1;
    }

    pub(crate) fn step(&mut self) {
        if self.connected {
            let bytes = self.controller.transmit(self.now);
            self.core.receive(self.now, &bytes);
        }
        self.core.step(self.now);
        if self.connected {
            let bytes = self.core.waiting().to_vec();
            self.core.taken(bytes.len());
            self.controller.receive(self.now, &bytes);
        }
        self.attitudes.extend(self.core.take_attitude());
        self.powers += usize::from(self.core.take_power().is_some());
        self.states.push((self.now, self.core.state(self.now)));
    }

    pub(crate) fn state(&self) -> FlightState {
        self.core.state(self.now)
    }

    pub(crate) fn reason(&self) -> String {
        self.state().reason.as_str().to_owned()
    }

    /// `flight` is killed and started again: nothing is remembered.
    pub(crate) fn restart(&mut self) {
        self.core = Core::new(&Config::default(), 4);
        self.core.opened(self.now);
    }

    /// On the ground, armed by the rules, then in the air at a height.
    pub(crate) fn airborne(height: f32) -> Self {
        let mut world = Self::new(Controller::new());
        world.pilot = Some(Pilot::IDLE);
        world.run(1000);
        world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
        world.run(1500);
        assert!(world.controller.armed, "{}", world.reason());
        world.z = height;
        world.pilot = Some(Pilot::HOVER);
        world.controller.rc[3] = 1450;
        world.vz = 0.0;
        world.run(200);
        world.z = height;
        world.vz = 0.0;
        world
    }
}
