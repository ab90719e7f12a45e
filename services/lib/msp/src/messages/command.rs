//! Orders to the controller, checked before they exist.

use crate::encode::Writer;
use crate::request::Request;
use core::fmt;

/// Most RC channels in a frame; more is an error to the firmware.
pub const MAX_CHANNELS: usize = 18;
/// Most motors in a frame.
pub const MAX_MOTORS: usize = 8;
/// Least value of a channel or motor (thesis 3.3): below, the controller falls into its failsafe.
pub const CHANNEL_MIN_US: u16 = 1000;
/// Greatest value of a channel or motor.
pub const CHANNEL_MAX_US: u16 = 2000;

/// Why an order was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Too many values, or none.
    Count {
        /// How many there were.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// A value that the firmware would take for a fault.
    Value {
        /// Which.
        index: usize,
        /// Microseconds.
        value_us: u16,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { count, most } => write!(f, "{count} values; allowed 1..={most}"),
            Self::Value { index, value_us } => {
                write!(f, "value {value_us} us at index {index}; allowed {CHANNEL_MIN_US}..={CHANNEL_MAX_US}")
            }
        }
    }
}
impl core::error::Error for Refusal {}

/// Up to `N` checked values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Values<const N: usize> {
    values: [u16; N],
    count: usize,
}

impl<const N: usize> Values<N> {
    fn new(values_us: &[u16]) -> Result<Self, Refusal> {
        if values_us.is_empty() || values_us.len() > N {
            return Err(Refusal::Count { count: values_us.len(), most: N });
        }
        let mut values = [0; N];
        for (index, (slot, &value_us)) in values.iter_mut().zip(values_us).enumerate() {
            if !(CHANNEL_MIN_US..=CHANNEL_MAX_US).contains(&value_us) {
                return Err(Refusal::Value { index, value_us });
            }
            *slot = value_us;
        }
        Ok(Self { values, count: values_us.len() })
    }

    fn filled(&self) -> &[u16] {
        self.values.get(..self.count).unwrap_or(&[])
    }

    fn write(&self, payload: &mut Writer<'_>) {
        for value in self.filled() {
            payload.u16(*value);
        }
    }
}

/// MSP_SET_RAW_RC: channels in the **receiver's** order ([`RxMap`](super::RxMap)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetRawRc(Values<MAX_CHANNELS>);

impl SetRawRc {
    /// Up to 18 channels.
    ///
    /// # Errors
    /// None, more than 18, or one outside 1000..=2000 microseconds.
    pub fn new(channels_us: &[u16]) -> Result<Self, Refusal> {
        Values::new(channels_us).map(Self)
    }

    /// The channels.
    #[must_use]
    pub fn channels_us(&self) -> &[u16] {
        self.0.filled()
    }
}

impl Request for SetRawRc {
    const CODE: u16 = 200;
    type Reply<'a> = ();
    fn write(&self, payload: &mut Writer<'_>) {
        self.0.write(payload);
    }
}

/// MSP_SET_MOTOR (SET_RAW_MOTOR in the thesis): a bench test of disarmed motors without any timeout in the
/// firmware (FACTS 1). No service sends it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetMotor(Values<MAX_MOTORS>);

impl SetMotor {
    /// Up to 8 motors.
    ///
    /// # Errors
    /// None, more than 8, or one outside 1000..=2000 microseconds.
    pub fn new(motors_us: &[u16]) -> Result<Self, Refusal> {
        Values::new(motors_us).map(Self)
    }

    /// The motors.
    #[must_use]
    pub fn motors_us(&self) -> &[u16] {
        self.0.filled()
    }
}

impl Request for SetMotor {
    const CODE: u16 = 214;
    type Reply<'a> = ();
    fn write(&self, payload: &mut Writer<'_>) {
        self.0.write(payload);
    }
}
