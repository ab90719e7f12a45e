//! What the firmware answers: payloads of the MSP messages of FACTS 1.

use super::personality::{FailsafeSettings, Personality, Procedure, StatusLayout};
use super::receiver::{CHANNELS, PITCH, ROLL, Receiver, THROTTLE, YAW};
use crate::vehicle::GRAVITY_M_S2;

const API_VERSION: u16 = 1;
const FC_VARIANT: u16 = 2;
const FC_VERSION: u16 = 3;
const MODE_RANGES: u16 = 34;
const FEATURE_CONFIG: u16 = 36;
const RX_CONFIG: u16 = 44;
const RX_MAP: u16 = 64;
const FAILSAFE_CONFIG: u16 = 75;
const RXFAIL_CONFIG: u16 = 77;
const STATUS: u16 = 101;
const RAW_IMU: u16 = 102;
const MOTOR: u16 = 104;
const RC: u16 = 105;
const ATTITUDE: u16 = 108;
const ALTITUDE: u16 = 109;
const ANALOG: u16 = 110;
const BOX_NAMES: u16 = 116;
const BOX_IDS: u16 = 119;
const STATUS_EX: u16 = 150;
pub(super) const MULTIPLE_MSP: u16 = 230;
pub(super) const SET_RAW_RC: u16 = 200;
pub(super) const SET_MOTOR: u16 = 214;

/// Outputs that the firmware knows; a quadrotor uses the first four.
pub(super) const MOTORS: usize = 8;
/// Accelerometer and gyro present, and the magnetometer: bits of the sensor word.
const SENSORS: u16 = 1 | 1 << 5;
const MAGNETOMETER: u16 = 1 << 2;
/// Permanent ids of the boxes whose state is told.
const BOX_ARM: u8 = 0;
const BOX_ANGLE: u8 = 1;
const BOX_FAILSAFE: u8 = 27;
const BOX_MSP_OVERRIDE: u8 = 50;
/// Receiver over MSP, and on a serial line: bits of Betaflight's feature word.
const FEATURE_RX_MSP: u32 = 1 << 14;
const FEATURE_RX_SERIAL: u32 = 1 << 3;

/// What answers are made of.
pub(super) struct View<'a> {
    pub(super) personality: &'a Personality,
    pub(super) failsafe: &'a FailsafeSettings,
    pub(super) receiver: &'a Receiver,
    pub(super) motors_us: &'a [u16; MOTORS],
    pub(super) roll_rad: f64,
    pub(super) pitch_rad: f64,
    pub(super) heading_rad: f64,
    /// Accelerometer behind its low-pass, body frame, m/s².
    pub(super) accelerometer: [f64; 3],
    pub(super) volts: f64,
    pub(super) amps: f64,
    pub(super) drawn_mah: f64,
    pub(super) magnetometer: bool,
}

/// A payload in the making; what does not fit is left out.
pub(super) struct Payload {
    bytes: [u8; 256],
    length: usize,
}

impl Payload {
    pub(super) fn new() -> Self {
        Self { bytes: [0; 256], length: 0 }
    }
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
    fn put(&mut self, bytes: &[u8]) {
        let end = (self.length + bytes.len()).min(self.bytes.len());
        let fits = end - self.length;
        self.bytes[self.length..end].copy_from_slice(&bytes[..fits]);
        self.length = end;
    }
    fn u8(&mut self, value: u8) {
        self.put(&[value]);
    }
    fn u16(&mut self, value: u16) {
        self.put(&value.to_le_bytes());
    }
    fn i16(&mut self, value: f64) {
        self.put(&(value as i16).to_le_bytes());
    }
    fn u32(&mut self, value: u32) {
        self.put(&value.to_le_bytes());
    }
    fn pad_to(&mut self, length: usize) {
        self.length = length.min(self.bytes.len());
    }
}

/// One g in the units of MSP_RAW_IMU: 2048 of an accelerometer of 16 g, divided by 4.
const ONE_G: f64 = 512.0;

/// Several answers in one, each behind its length; what is not known is empty. `false` for none.
pub(super) fn multiple(codes: &[u8], view: &View<'_>, out: &mut Payload) -> bool {
    for code in codes.iter().filter(|code| u16::from(**code) != MULTIPLE_MSP) {
        let mut part = Payload::new();
        answer((*code).into(), view, &mut part);
        if out.length + 1 + part.length > out.bytes.len() {
            break;
        }
        out.u8(part.length as u8);
        out.put(part.bytes());
    }
    !codes.is_empty()
}

/// Accelerometer, gyroscope (whole degrees a second: nobody here asks for it) and compass, nine words.
fn raw_imu(view: &View<'_>, out: &mut Payload) {
    for axis in view.accelerometer {
        out.i16((axis / GRAVITY_M_S2 * ONE_G).round());
    }
    out.pad_to(18);
}

/// Writes the answer; `false` for a message that this firmware does not know.
pub(super) fn answer(code: u16, view: &View<'_>, out: &mut Payload) -> bool {
    let p = view.personality;
    match code {
        API_VERSION => out.put(&p.api),
        FC_VARIANT => out.put(&p.variant),
        FC_VERSION => {
            out.put(&p.version);
            if !p.version_text.is_empty() {
                out.u8(p.version_text.len() as u8);
                out.put(p.version_text.as_bytes());
            }
        }
        MODE_RANGES => mode_ranges(view, out),
        FEATURE_CONFIG if view.receiver.is_radio() && p.features & FEATURE_RX_MSP != 0 => {
            out.u32(p.features & !FEATURE_RX_MSP | FEATURE_RX_SERIAL);
        }
        FEATURE_CONFIG => out.u32(p.features),
        RX_CONFIG => rx_config(p, out),
        RX_MAP => out.put(p.rx_map.get(..p.rx_map_length).unwrap_or(&p.rx_map)),
        FAILSAFE_CONFIG => failsafe_config(view, out),
        RXFAIL_CONFIG if p.knows_rxfail => rxfail_config(view.failsafe, out),
        STATUS | STATUS_EX => status(code == STATUS_EX, view, out),
        RAW_IMU => raw_imu(view, out),
        MOTOR => view.motors_us.iter().for_each(|motor| out.u16(*motor)),
        RC => rc(view, out),
        ATTITUDE => attitude(view, out),
        // No barometer on this board: height and climb are zero.
        ALTITUDE => out.pad_to(p.altitude_length),
        ANALOG => analog(view, out),
        BOX_NAMES => {
            for (_, name) in p.boxes {
                out.put(name.as_bytes());
                out.u8(b';');
            }
        }
        BOX_IDS => p.boxes.iter().for_each(|(id, _)| out.u8(*id)),
        _ => return false,
    }
    true
}

/// Roll, pitch, YAW, THROTTLE: not the order of SET_RAW_RC (FACTS 1).
fn rc(view: &View<'_>, out: &mut Payload) {
    if view.personality.rc_needs_receiver && !view.receiver.is_known() {
        return;
    }
    let values = view.receiver.values();
    for channel in [ROLL, PITCH, YAW, THROTTLE] {
        out.u16(values[channel]);
    }
    values[4..].iter().for_each(|value| out.u16(*value));
    // Channels that no frame of ours reaches rest in the middle.
    (CHANNELS..view.personality.channels).for_each(|_| out.u16(1500));
}

/// Tenths of degrees; yaw whole degrees clockwise, cut off and not rounded.
fn attitude(view: &View<'_>, out: &mut Payload) {
    out.i16((view.roll_rad.to_degrees() * 10.0).round());
    out.i16((view.pitch_rad.to_degrees() * 10.0).round());
    let clockwise = (-view.heading_rad.to_degrees()).rem_euclid(360.0);
    out.u16((clockwise as u16) % 360);
}

fn analog(view: &View<'_>, out: &mut Payload) {
    out.u8((view.volts * 10.0).round().clamp(0.0, 255.0) as u8);
    out.u16(view.drawn_mah.clamp(0.0, 65535.0) as u16);
    out.u16(if view.receiver.is_lost() { 0 } else { 1023 });
    out.i16((view.amps * 100.0).clamp(-32000.0, 32000.0));
    out.u16((view.volts * 100.0).round().clamp(0.0, 65535.0) as u16);
    out.pad_to(view.personality.analog_length);
}

fn status(extended: bool, view: &View<'_>, out: &mut Payload) {
    let p = view.personality;
    let mut modes = 0_u32;
    for (index, (id, _)) in p.boxes.iter().enumerate() {
        let on = match *id {
            BOX_ARM => view.receiver.is_armed(),
            BOX_ANGLE => view.receiver.is_angle(),
            BOX_FAILSAFE => view.receiver.is_failsafe(),
            BOX_MSP_OVERRIDE => view.receiver.is_overriding(),
            _ => false,
        };
        modes |= u32::from(on) << (index % 32);
    }
    out.u16(125);
    out.u16(0);
    out.u16(SENSORS | if view.magnetometer { MAGNETOMETER } else { 0 });
    out.u32(modes);
    out.u8(0);
    let StatusLayout::Flagged { tail } = p.status else {
        if extended {
            out.u16(12);
            out.u16(view.receiver.blocks() as u16);
            // All six sides of the accelerometer are calibrated.
            out.u8(0x3f);
        }
        return;
    };
    out.u16(12);
    if extended {
        out.u8(4);
        out.u8(0);
    } else {
        out.u16(0);
    }
    // No further mode bytes: all boxes fit in the word.
    out.u8(0);
    // The arm switch is the last flag.
    out.u8((p.flags.arm_switch + 1) as u8);
    out.u32(view.receiver.blocks());
    let end = out.length + tail;
    out.u8(0);
    out.u16(41);
    out.pad_to(end);
}

/// ARM on AUX1, ANGLE on AUX2 and, with a radio, MSP OVERRIDE on AUX3, from 1700 to 2100: in steps of 25 us from 900.
fn mode_ranges(view: &View<'_>, out: &mut Payload) {
    let end = out.length + 4 * view.personality.mode_slots;
    out.put(&[BOX_ARM, 0, 32, 48]);
    out.put(&[BOX_ANGLE, 1, 32, 48]);
    if view.receiver.is_radio() && view.personality.boxes.iter().any(|(id, _)| *id == BOX_MSP_OVERRIDE) {
        out.put(&[BOX_MSP_OVERRIDE, 2, 32, 48]);
    }
    out.pad_to(end);
}

fn rx_config(personality: &Personality, out: &mut Payload) {
    // Serial provider 0, stick ends, bind count, pulse limits.
    out.u8(0);
    out.u16(1900);
    out.u16(1500);
    out.u16(personality.low_throttle_us);
    out.u8(0);
    out.u16(885);
    out.u16(2115);
    out.pad_to(personality.rx_config_length);
}

fn failsafe_config(view: &View<'_>, out: &mut Payload) {
    let settings = view.failsafe;
    out.u8(settings.delay_ds);
    let landing = u16::from(settings.landing_s) * view.personality.landing_units_per_s;
    out.u8(landing.min(u8::MAX.into()) as u8);
    out.u16(settings.throttle_us);
    out.u8(0);
    out.u16(100);
    out.u8(match settings.procedure {
        Procedure::AutoLand => 0,
        Procedure::Drop => 1,
    });
    out.pad_to(view.personality.failsafe_length);
}

/// Mode (0 automatic, 1 hold, 2 value) and value of each channel, roll pitch yaw throttle first.
fn rxfail_config(settings: &FailsafeSettings, out: &mut Payload) {
    for channel in 0..CHANNELS {
        let hold = channel > 3 || channel == THROTTLE && settings.hold_throttle;
        out.u8(u8::from(hold));
        out.u16(1500);
    }
}
