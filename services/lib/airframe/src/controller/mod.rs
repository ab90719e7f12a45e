//! A virtual flight controller that behaves like real firmware (FACTS 1): its loops, its attitude, its
//! receiver, its arming rules, and its MSP port with the time that bytes and the serial task take.

mod attitude;
mod companion;
mod framing;
mod loops;
mod messages;
mod personality;
mod receiver;
mod wire;

pub use personality::{
    BETAFLIGHT_4_5, BETAFLIGHT_2025_12, BETAFLIGHT_2026_12, FLIP32, FailsafeSettings, Firmware, Flags,
    INAV_9_1, MspOverride, Personality, Procedure, StatusLayout, StickLaw,
};
pub use wire::{BYTE_NS, Wire};

pub(crate) use framing::encode_v2;

use attitude::AttitudeFilter;
use framing::{Decoder, encode_v1};
use loops::Loops;
use messages::{MOTORS, Payload, SET_MOTOR, SET_RAW_RC, View};
use nalgebra::Vector3;
use receiver::{CHANNELS, Receiver};

/// The serial driver's receive buffer.
const RECEIVE_BUFFER: usize = 192;

/// What the board's sensors say in one step.
#[derive(Clone, Copy, Debug)]
pub struct Senses {
    /// Body rates, rad/s.
    pub gyro: Vector3<f64>,
    /// Specific force, m/s^2, body frame.
    pub accelerometer: Vector3<f64>,
    /// Compass, counter-clockwise from its zero, radians. Without a magnetometer only the first one counts, for where the
    /// board's own heading begins.
    pub heading_rad: f64,
    /// Battery voltage as measured.
    pub volts: f64,
    /// Battery current as measured.
    pub amps: f64,
    /// Charge drawn, milliampere-hours.
    pub drawn_mah: f64,
}

/// The board.
#[derive(Clone, Debug)]
pub struct Controller {
    personality: &'static Personality,
    failsafe: FailsafeSettings,
    attitude: AttitudeFilter,
    loops: Loops,
    receiver: Receiver,
    incoming: Wire,
    outgoing: Wire,
    buffer: [u8; RECEIVE_BUFFER],
    buffered: usize,
    overruns: u64,
    decoder: Decoder,
    next_serial_ns: u64,
    next_receiver_ns: u64,
    bench_us: [u16; MOTORS],
    motors_us: [u16; MOTORS],
    senses: Senses,
    commands_handled: u64,
    magnetometer: bool,
}

impl Controller {
    /// A board that is switched on at time 0; `idle` is the command of an armed idle motor, `phase_ns`
    /// shifts its tasks against the rest of the world.
    #[must_use]
    pub fn new(firmware: Firmware, failsafe: FailsafeSettings, idle: f64, phase_ns: u64) -> Self {
        let personality = firmware.personality();
        Self {
            personality,
            failsafe,
            attitude: AttitudeFilter::new(),
            loops: Loops::new(idle.clamp(0.0, 0.3)),
            receiver: Receiver::new(personality),
            incoming: Wire::new(),
            outgoing: Wire::new(),
            buffer: [0; RECEIVE_BUFFER],
            buffered: 0,
            overruns: 0,
            decoder: Decoder::new(personality.speaks_v2),
            next_serial_ns: phase_ns % personality.serial_pass_ns,
            next_receiver_ns: phase_ns % personality.receiver_pass_ns,
            bench_us: [1000, 1000, 1000, 1000, 0, 0, 0, 0],
            motors_us: [1000, 1000, 1000, 1000, 0, 0, 0, 0],
            senses: Senses {
                gyro: Vector3::zeros(),
                accelerometer: Vector3::zeros(),
                heading_rad: 0.0,
                volts: 0.0,
                amps: 0.0,
                drawn_mah: 0.0,
            },
            commands_handled: 0,
            magnetometer: true,
        }
    }

    /// The board with its PID numbers multiplied by `scale`, as whoever built the aircraft has tuned it.
    #[must_use]
    pub fn tuned(mut self, scale: f64) -> Self {
        self.loops.tune(scale);
        self
    }

    /// The board with a radio as its receiver: frames come by [`Self::radio`], and those of MSP are used while the radio's
    /// override switch (AUX3) is up, as the firmware does it.
    #[must_use]
    pub fn with_radio(mut self) -> Self {
        self.receiver.listen_to_radio();
        self
    }

    /// A frame of the radio: roll, pitch, yaw, throttle, AUX1 (arm), AUX2 (ANGLE), AUX3 (override), AUX4, microseconds.
    pub fn radio(&mut self, now_ns: u64, channels_us: &[u16; 8]) {
        self.receiver.radio(now_ns, channels_us, self.personality);
    }

    /// The board without its magnetometer: its heading begins anywhere and drifts with the gyro.
    #[must_use]
    pub fn without_magnetometer(mut self) -> Self {
        self.magnetometer = false;
        self
    }

    /// Bytes onto the wire towards the board.
    pub fn write(&mut self, now_ns: u64, bytes: &[u8]) {
        self.incoming.send(now_ns, bytes);
    }

    /// Bytes that have come over the wire from the board.
    pub fn read(&mut self, now_ns: u64, out: &mut [u8]) -> usize {
        self.outgoing.receive(now_ns, out)
    }

    /// One pass of `dt` seconds (1 ms); motor commands 0..=1 in the order rear right, front right, rear left,
    /// front left.
    pub fn step(&mut self, now_ns: u64, dt: f64, senses: &Senses) -> [f64; 4] {
        self.senses = *senses;
        while let Some(byte) = self.incoming.next(now_ns) {
            if self.buffered < RECEIVE_BUFFER {
                self.buffer[self.buffered] = byte;
                self.buffered += 1;
            } else {
                self.overruns += 1;
            }
        }
        if now_ns >= self.next_serial_ns {
            self.next_serial_ns += self.personality.serial_pass_ns;
            self.serial_pass(now_ns);
        }
        self.attitude.step(
            dt,
            &senses.gyro,
            &senses.accelerometer,
            (senses.heading_rad, self.magnetometer),
            self.receiver.is_armed(),
            self.personality.attitude_gain_per_s,
        );
        if now_ns >= self.next_receiver_ns {
            self.next_receiver_ns += self.personality.receiver_pass_ns;
            let tilt = self.attitude.up().z.clamp(-1.0, 1.0).acos();
            let before = self.receiver.is_armed();
            self.receiver.pass(now_ns, tilt, self.personality, &self.failsafe);
            if before && !self.receiver.is_armed() {
                self.loops.rest();
            }
        }
        let commands = if self.receiver.is_armed() {
            self.loops.step(
                dt,
                self.receiver.sticks(&self.failsafe),
                self.receiver.is_angle(),
                &senses.gyro,
                &self.attitude,
                self.personality,
            )
        } else {
            // The bench: unchecked, without timeout, and back after every disarming (FACTS 1). What the speed
            // controllers do with a value beyond their range is to take its nearest end.
            std::array::from_fn(|i| ((f64::from(self.bench_us[i]) - 1000.0) / 1000.0).clamp(0.0, 1.0))
        };
        for (told, command) in self.motors_us.iter_mut().zip(commands) {
            *told = 1000 + (command * 1000.0).round() as u16;
        }
        commands
    }

    /// One command at most; bytes behind it stay in the buffer.
    fn serial_pass(&mut self, now_ns: u64) {
        let mut used = 0;
        while used < self.buffered {
            let byte = self.buffer[used];
            used += 1;
            if let Some(request) = self.decoder.push(byte) {
                self.commands_handled += 1;
                self.handle(now_ns, request.code, request.length, request.v2);
                break;
            }
        }
        self.buffer.copy_within(used..self.buffered, 0);
        self.buffered -= used;
    }

    fn handle(&mut self, now_ns: u64, code: u16, length: usize, v2: bool) {
        let mut payload = Payload::new();
        let known = match code {
            SET_RAW_RC => self.set_raw_rc(now_ns, length / 2),
            SET_MOTOR => self.set_motor(),
            _ => {
                let (roll_rad, pitch_rad) = self.attitude.tilt();
                let view = View {
                    personality: self.personality,
                    failsafe: &self.failsafe,
                    receiver: &self.receiver,
                    motors_us: &self.motors_us,
                    roll_rad,
                    pitch_rad,
                    heading_rad: self.attitude.heading(),
                    accelerometer: self.attitude.accelerometer(),
                    volts: self.senses.volts,
                    amps: self.senses.amps,
                    drawn_mah: self.senses.drawn_mah,
                    magnetometer: self.magnetometer,
                };
                if code == messages::MULTIPLE_MSP && self.personality.answers_several {
                    messages::multiple(
                        self.decoder.payload().get(..length).unwrap_or_default(),
                        &view,
                        &mut payload,
                    )
                } else {
                    messages::answer(code, &view, &mut payload)
                }
            }
        };
        let direction = if known { b'>' } else { b'!' };
        let body = if known { payload.bytes() } else { &[] };
        let mut frame = [0_u8; 288];
        let total = if v2 {
            encode_v2(direction, code, body, &mut frame)
        } else {
            encode_v1(direction, code, body, &mut frame)
        };
        self.outgoing.send(now_ns, &frame[..total]);
    }

    fn set_raw_rc(&mut self, now_ns: u64, count: usize) -> bool {
        if count > self.personality.channels {
            return false;
        }
        let count = count.min(CHANNELS);
        let mut frame = [0_u16; CHANNELS];
        for (value, pair) in frame.iter_mut().zip(self.decoder.payload().chunks_exact(2)) {
            *value = u16::from_le_bytes([pair[0], pair[1]]);
        }
        self.receiver.frame(now_ns, &frame[..count], self.personality);
        true
    }

    fn set_motor(&mut self) -> bool {
        for (value, pair) in self.bench_us.iter_mut().zip(self.decoder.payload().chunks_exact(2)) {
            *value = u16::from_le_bytes([pair[0], pair[1]]);
        }
        true
    }

    /// Whether the motors obey the loops.
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.receiver.is_armed()
    }
    /// How often it was armed since power-up.
    #[must_use]
    pub fn armings(&self) -> u32 {
        self.receiver.armings()
    }
    /// Arming-disable flags as MSP_STATUS tells them.
    #[must_use]
    pub fn arming_blocks(&self) -> u32 {
        self.receiver.blocks()
    }
    /// The firmware's own roll, pitch (nose down positive) and heading (counter-clockwise from compass
    /// zero): for scorers and tests, the drone has MSP_ATTITUDE.
    #[must_use]
    pub fn attitude(&self) -> (f64, f64, f64) {
        let (roll, pitch) = self.attitude.tilt();
        (roll, pitch, self.attitude.heading())
    }
    /// Bytes lost because the receive buffer was full.
    #[must_use]
    pub fn overruns(&self) -> u64 {
        self.overruns + self.incoming.lost()
    }
    /// Commands taken since power-up.
    #[must_use]
    pub fn commands_handled(&self) -> u64 {
        self.commands_handled
    }
}

#[cfg(test)]
mod tests;
