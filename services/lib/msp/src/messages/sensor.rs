//! What a sensor sends unasked, as version 2 requests to the controller.

use crate::encode::Writer;
use crate::reader::{Reader, TooShort};
use crate::request::{Layout, Request};

/// MSP2_SENSOR_RANGEFINDER.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RangeFrame {
    /// 0..=255, more is better.
    pub quality: u8,
    /// Millimetres along the sensor's axis; negative when out of range.
    pub distance_mm: i32,
}
impl Request for RangeFrame {
    const CODE: u16 = 0x1f01;
    type Reply<'a> = ();
    fn write(&self, payload: &mut Writer<'_>) {
        payload.u8(self.quality);
        payload.i32(self.distance_mm);
    }
}
impl Layout<'_> for RangeFrame {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { quality: reader.u8()?, distance_mm: reader.i32()? })
    }
}

/// MSP2_SENSOR_OPTIC_FLOW.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlowFrame {
    /// 0..=255, more is better.
    pub quality: u8,
    /// Counts since the last frame, sensor x.
    pub motion_x: i32,
    /// Counts since the last frame, sensor y.
    pub motion_y: i32,
}
impl Request for FlowFrame {
    const CODE: u16 = 0x1f02;
    type Reply<'a> = ();
    fn write(&self, payload: &mut Writer<'_>) {
        payload.u8(self.quality);
        payload.i32(self.motion_x);
        payload.i32(self.motion_y);
    }
}
impl Layout<'_> for FlowFrame {
    fn read(reader: &mut Reader<'_>) -> Result<Self, TooShort> {
        Ok(Self { quality: reader.u8()?, motion_x: reader.i32()?, motion_y: reader.i32()? })
    }
}
