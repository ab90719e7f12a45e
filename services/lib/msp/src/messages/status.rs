//! Modes and what stands in the way of arming.

use crate::reader::{Reader, TooShort};
use crate::request::{Layout, Request};

/// MSP_STATUS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status;
/// MSP_STATUS_EX: the same answer in Betaflight, a longer one in INAV.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatusEx;

/// The arming-disable word of Betaflight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arming {
    /// How many flags this firmware has; the last is ARM_SWITCH.
    pub count: u8,
    /// Bit set: arming is disabled for this reason.
    pub flags: u32,
}

impl Arming {
    /// The bit of ARM_SWITCH: 25 in 4.5, 28 in 2025.12, 29 in 2026.12; `None` when the count makes no sense.
    #[must_use]
    pub fn arm_switch(&self) -> Option<u32> {
        (1..=32).contains(&self.count).then(|| 1 << (self.count - 1))
    }
}

/// Answer to [`Status`] and [`StatusEx`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatusReply {
    /// Period of the control loop, microseconds.
    pub cycle_us: u16,
    /// Errors on the sensor bus.
    pub bus_errors: u16,
    /// Sensors present, one bit each.
    pub sensors: u16,
    /// Active modes 0..=31: bit = index into BOXIDS.
    pub modes: u32,
    /// Active modes from 32 on, eight a byte.
    pub more_modes: [u8; 15],
    /// Settings profile.
    pub profile: u8,
    /// Processor load, percent; absent in the 11 bytes of INAV.
    pub load_percent: Option<u16>,
    /// Absent in INAV.
    pub arming: Option<Arming>,
    /// The controller wants to be restarted.
    pub reboot_required: bool,
}

impl StatusReply {
    /// Whether the mode at this index of BOXIDS is active.
    #[must_use]
    pub fn mode(&self, index: usize) -> bool {
        match index {
            0..=31 => self.modes & (1 << index) != 0,
            _ => self.more_modes.get(index / 8 - 4).is_some_and(|byte| byte & (1 << (index % 8)) != 0),
        }
    }
}

impl Request for Status {
    const CODE: u16 = 101;
    type Reply<'a> = StatusReply;
}
impl Request for StatusEx {
    const CODE: u16 = 150;
    type Reply<'a> = StatusReply;
}

/// What Betaflight sends after the load.
fn extension(reader: &mut Reader<'_>) -> Result<([u8; 15], Arming, bool), TooShort> {
    reader.u16()?;
    let mut more_modes = [0; 15];
    let count = usize::from(reader.u8()? & 0x0f);
    for (slot, byte) in more_modes.iter_mut().zip(reader.bytes(count)?) {
        *slot = *byte;
    }
    let arming = Arming { count: reader.u8()?, flags: reader.u32()? };
    Ok((more_modes, arming, reader.u8().is_ok_and(|byte| byte & 1 != 0)))
}

impl Layout<'_> for StatusReply {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        let mut status = Self {
            cycle_us: reader.u16()?,
            bus_errors: reader.u16()?,
            sensors: reader.u16()?,
            modes: reader.u32()?,
            profile: reader.u8()?,
            load_percent: reader.u16().ok(),
            more_modes: [0; 15],
            arming: None,
            reboot_required: false,
        };
        if let Ok((more_modes, arming, reboot)) = extension(reader) {
            status.more_modes = more_modes;
            status.arming = Some(arming);
            status.reboot_required = reboot;
        }
        Ok(status)
    }
}
