//! What the controller measures and does.

use crate::encode::Writer;
use crate::reader::{Reader, TooShort};
use crate::request::{Layout, Request};

/// MSP_ATTITUDE.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Attitude;
/// Answer to [`Attitude`], in the controller's own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttitudeReply {
    /// 0.1 degree, right side down positive.
    pub roll_decidegrees: i16,
    /// 0.1 degree, nose down positive.
    pub pitch_decidegrees: i16,
    /// Whole degrees 0..360, **clockwise** from compass zero.
    pub yaw_degrees: i16,
}
impl Request for Attitude {
    const CODE: u16 = 108;
    type Reply<'a> = AttitudeReply;
}
impl Layout<'_> for AttitudeReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self {
            roll_decidegrees: reader.i16()?,
            pitch_decidegrees: reader.i16()?,
            yaw_degrees: reader.i16()?,
        })
    }
}

/// MSP_RAW_IMU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawImu;
/// Answer to [`RawImu`]: the accelerometer; gyroscope and compass, which follow, are not read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RawImuReply {
    /// Specific force along x forward, y left, z up, smoothed by the firmware. One g is about 512 of these (MultiWii's
    /// unit; by the accelerometer's own scale it may be 256): what it reads at rest tells.
    pub accelerometer: [i16; 3],
}
impl Request for RawImu {
    const CODE: u16 = 102;
    type Reply<'a> = RawImuReply;
}
impl Layout<'_> for RawImuReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { accelerometer: [reader.i16()?, reader.i16()?, reader.i16()?] })
    }
}

/// [`Attitude`] and [`RawImu`] in one request: MSP_MULTIPLE_MSP (Betaflight: `src/main/msp/msp.c`; the answers one
/// after the other, each behind its length). A firmware without it refuses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttitudeAndImu;
/// Answer to [`AttitudeAndImu`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttitudeAndImuReply {
    /// The attitude.
    pub attitude: AttitudeReply,
    /// The accelerometer, read in the same pass; absent on a board without one.
    pub imu: Option<RawImuReply>,
}
impl Request for AttitudeAndImu {
    const CODE: u16 = 230;
    type Reply<'a> = AttitudeAndImuReply;
    fn write(&self, payload: &mut Writer<'_>) {
        payload.u8(Attitude::CODE as u8);
        payload.u8(RawImu::CODE as u8);
    }
}
/// Three words each of accelerometer, gyroscope and compass, in every firmware.
const RAW_IMU: usize = 18;
/// The accelerometer may be missing, but not be half there: a byte that is lost or comes twice shifts the second length,
/// and one such frame in 256 passes the check byte.
impl Layout<'_> for AttitudeAndImuReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        let length = reader.u8()?.into();
        let attitude = AttitudeReply::read(&mut Reader::new(reader.bytes(length)?))?;
        if reader.left() == 0 {
            return Ok(Self { attitude, imu: None });
        }
        let length = usize::from(reader.u8()?);
        let absent = length == 0 && reader.left() == 0;
        if length < RAW_IMU && !absent {
            return Err(TooShort { length, needed: RAW_IMU });
        }
        let imu = reader.bytes(length)?;
        let imu = if imu.is_empty() { None } else { Some(RawImuReply::read(&mut Reader::new(imu))?) };
        Ok(Self { attitude, imu })
    }
}

/// MSP_ALTITUDE.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Altitude;
/// Answer to [`Altitude`]; INAV appends the barometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AltitudeReply {
    /// Centimetres above where it was armed.
    pub altitude_cm: i32,
    /// Centimetres a second, up positive.
    pub climb_cm_s: i16,
}
impl Request for Altitude {
    const CODE: u16 = 109;
    type Reply<'a> = AltitudeReply;
}
impl Layout<'_> for AltitudeReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { altitude_cm: reader.i32()?, climb_cm_s: reader.i16()? })
    }
}

/// MSP_ANALOG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Analog;
/// Answer to [`Analog`]: 7 bytes in the thesis and INAV, 9 in Betaflight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AnalogReply {
    /// 0.1 volt.
    pub decivolts: u8,
    /// Drawn since power-up.
    pub drawn_mah: u16,
    /// 0..=1023.
    pub rssi: u16,
    /// 0.01 ampere, negative when charging.
    pub centiamps: i16,
    /// 0.01 volt, finer than `decivolts`; absent in short answers.
    pub centivolts: Option<u16>,
}
impl AnalogReply {
    /// The best voltage in the answer.
    #[must_use]
    pub fn volts(&self) -> f32 {
        self.centivolts.map_or(f32::from(self.decivolts) * 0.1, |fine| f32::from(fine) * 0.01)
    }
}
impl Request for Analog {
    const CODE: u16 = 110;
    type Reply<'a> = AnalogReply;
}
impl Layout<'_> for AnalogReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self {
            decivolts: reader.u8()?,
            drawn_mah: reader.u16()?,
            rssi: reader.u16()?,
            centiamps: reader.i16()?,
            centivolts: reader.u16().ok(),
        })
    }
}

/// MSP_MOTOR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motor;
/// Answer to [`Motor`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MotorReply {
    /// Microseconds; 0 for a motor that is not there.
    pub motors_us: [u16; 8],
}
impl Request for Motor {
    const CODE: u16 = 104;
    type Reply<'a> = MotorReply;
}
impl Layout<'_> for MotorReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        let mut motors_us = [0; 8];
        if reader.u16s(&mut motors_us) < 4 {
            // Four motors are the least that a quadrotor has; this reports what is missing.
            reader.bytes(8)?;
        }
        Ok(Self { motors_us })
    }
}

/// MSP_RC.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rc;
/// Answer to [`Rc`]: roll, pitch, **yaw, throttle**, AUX1... whatever the receiver's order is. Empty before
/// the controller knows a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RcReply {
    /// Microseconds; the first `count` are filled.
    pub channels_us: [u16; super::MAX_CHANNELS],
    /// 0..=18; what INAV sends beyond is ignored.
    pub count: u8,
}
impl Request for Rc {
    const CODE: u16 = 105;
    type Reply<'a> = RcReply;
}
impl Layout<'_> for RcReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        let mut channels_us = [0; super::MAX_CHANNELS];
        let count = reader.u16s(&mut channels_us) as u8;
        Ok(Self { channels_us, count })
    }
}

/// MSP_FAILSAFE_CONFIG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FailsafeConfig;
/// Answer to [`FailsafeConfig`]: what the controller does when frames stop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FailsafeConfigReply {
    /// 0.1 second from loss to action.
    pub delay_deciseconds: u8,
    /// Seconds (0.1 second before 2025.12) of the landing stage.
    pub landing_time: u8,
    /// Throttle of the landing stage, microseconds.
    pub throttle_us: u16,
    /// What the failsafe switch does.
    pub switch_mode: u8,
    /// 0.1 second of low throttle after which it only disarms.
    pub throttle_low_deciseconds: u16,
    /// 0 auto-land, 1 drop.
    pub procedure: u8,
}
impl Request for FailsafeConfig {
    const CODE: u16 = 75;
    type Reply<'a> = FailsafeConfigReply;
}
impl Layout<'_> for FailsafeConfigReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self {
            delay_deciseconds: reader.u8()?,
            landing_time: reader.u8()?,
            throttle_us: reader.u16()?,
            switch_mode: reader.u8()?,
            throttle_low_deciseconds: reader.u16()?,
            procedure: reader.u8()?,
        })
    }
}
