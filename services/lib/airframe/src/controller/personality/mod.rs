//! What differs between firmwares, as tables: the types here, one file for each family.
//!
//! The numbers are those of FACTS 1 (measured on firmware in the loop). Where it is silent they are the firmware's
//! own public defaults, and the table says so beside the number.

mod betaflight;
mod failsafe;
mod flip32;
mod inav;
mod stick;

pub use betaflight::{BETAFLIGHT_4_5, BETAFLIGHT_2025_12, BETAFLIGHT_2026_12};
pub use failsafe::{FailsafeSettings, Procedure};
pub use flip32::FLIP32;
pub use inav::INAV_9_1;
pub use stick::StickLaw;

/// A firmware that the virtual flight controller can play.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Firmware {
    /// Betaflight 4.5.6.
    Betaflight4_5,
    /// Betaflight 2025.12.6.
    #[default]
    Betaflight2025_12,
    /// Betaflight 2026.12, alpha.
    Betaflight2026_12,
    /// INAV 9.1.
    Inav9_1,
    /// Betaflight 3.2.5, the last for the thesis's own board (STM32F1).
    Flip32,
}

impl Firmware {
    /// All of them, oldest last.
    pub const ALL: [Self; 5] =
        [Self::Betaflight4_5, Self::Betaflight2025_12, Self::Betaflight2026_12, Self::Inav9_1, Self::Flip32];

    /// The name that configurations use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Betaflight4_5 => "betaflight-4.5",
            Self::Betaflight2025_12 => "betaflight-2025.12",
            Self::Betaflight2026_12 => "betaflight-2026.12",
            Self::Inav9_1 => "inav-9.1",
            Self::Flip32 => "flip32",
        }
    }

    /// By the name that configurations use.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|firmware| firmware.name() == name)
    }

    /// Names that [`Self::by_name`] knows, for a sentence.
    #[must_use]
    pub fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }

    /// Its numbers.
    #[must_use]
    pub const fn personality(self) -> &'static Personality {
        match self {
            Self::Betaflight4_5 => &BETAFLIGHT_4_5,
            Self::Betaflight2025_12 => &BETAFLIGHT_2025_12,
            Self::Betaflight2026_12 => &BETAFLIGHT_2026_12,
            Self::Inav9_1 => &INAV_9_1,
            Self::Flip32 => &FLIP32,
        }
    }
}

/// The numbers of one firmware.
#[derive(Clone, Debug)]
pub struct Personality {
    /// Four letters of MSP_FC_VARIANT.
    pub variant: [u8; 4],
    /// Three numbers of MSP_FC_VERSION.
    pub version: [u8; 3],
    /// The text that follows them with its length; empty when the firmware sends none.
    pub version_text: &'static str,
    /// Protocol and API version of MSP_API_VERSION.
    pub api: [u8; 3],
    /// Whether native version 2 frames are understood; without, they are bytes between frames.
    pub speaks_v2: bool,
    /// Whether MSP_MULTIPLE_MSP is answered.
    pub answers_several: bool,
    /// Layout of MSP_STATUS.
    pub status: StatusLayout,
    /// Arming-disable flags: which bit means what.
    pub flags: Flags,
    /// Length of MSP_RX_CONFIG.
    pub rx_config_length: usize,
    /// Entries of MSP_RX_MAP.
    pub rx_map_length: usize,
    /// Position in a SET_RAW_RC frame of roll, pitch, yaw, throttle and four more (MSP_RX_MAP).
    pub rx_map: [u8; 8],
    /// Channels: of a SET_RAW_RC frame at most, and of MSP_RC.
    pub channels: usize,
    /// MSP_RC is empty until a receiver is known, that is until the first frame.
    pub rc_needs_receiver: bool,
    /// Length of MSP_ALTITUDE.
    pub altitude_length: usize,
    /// Length of MSP_ANALOG.
    pub analog_length: usize,
    /// MSP_FEATURE_CONFIG.
    pub features: u32,
    /// Slots of MSP_MODE_RANGES.
    pub mode_slots: usize,
    /// Length of MSP_FAILSAFE_CONFIG.
    pub failsafe_length: usize,
    /// Units of its landing time in a second.
    pub landing_units_per_s: u16,
    /// Whether MSP_RXFAIL_CONFIG is known: without, all channels are held until the failsafe acts.
    pub knows_rxfail: bool,
    /// Boxes in the order of MSP_BOXIDS: permanent id and name.
    pub boxes: &'static [(u8, &'static str)],
    /// A receiver silent for this long is lost.
    pub loss_ns: u64,
    /// Channels are held for this long before they fall to their failsafe values.
    pub hold_ns: u64,
    /// From the last valid frame the failsafe acts after this and the set delay.
    pub failsafe_base_ns: u64,
    /// Frames must come for this long before a loss is over.
    pub recovery_ns: u64,
    /// While it lands by failsafe, sticks must be this far from their centres together before it lets go of it.
    pub recovery_stick_us: u16,
    /// After a failsafe disarm: frames must come for this long before it arms again.
    pub rearm_ns: u64,
    /// ... with the arm switch low all the while, and not only at its end.
    pub rearm_low: bool,
    /// What becomes of MSP frames beside a radio.
    pub msp_override: MspOverride,
    /// No arming before this age.
    pub boot_grace_ns: u64,
    /// From the arm switch to armed, the receiver pass not included.
    pub arm_delay_ns: u64,
    /// Period of the receiver's and the modes' pass.
    pub receiver_pass_ns: u64,
    /// Period of the serial task: one command a pass.
    pub serial_pass_ns: u64,
    /// What sticks ask for.
    pub stick: StickLaw,
    /// Throttle at and below which the craft may be armed.
    pub low_throttle_us: u16,
    /// The accelerometer's pull on the attitude, 1/s.
    pub attitude_gain_per_s: f64,
    /// From an angle error to a rate, 1/s.
    pub angle_gain_per_s: f64,
    /// Proportional, integral, derivative numbers of roll, pitch, yaw as Betaflight's configurator shows them. The same for
    /// all: whoever installs a board tunes it to the craft, whatever the numbers are called there.
    pub pid: [[f64; 3]; 3],
}

/// What MSP_STATUS and MSP_STATUS_EX carry after cycle time, bus errors, sensors, modes and profile (11 bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StatusLayout {
    /// Load, two bytes more, a count of further mode bytes (none), a count of flags and their word; then this many bytes.
    Flagged {
        /// Reboot wanted, temperature and what later versions append.
        tail: usize,
    },
    /// Nothing; MSP_STATUS_EX has load, the lower half of the arming flags and the state of calibration.
    Bare,
}

/// What the override switch of a radio (box 50) does with the sticks of MSP frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MspOverride {
    /// Nothing: the firmware does not know it.
    Unknown,
    /// The sticks of the last frame, for ever and without a flag; 885 us, all four, before the first.
    Held,
    /// Those of the last frame while it is fresh, and the radio's own otherwise.
    WhileFresh {
        /// Not older than this.
        stale_ns: u64,
        /// After frames have come for this long.
        steady_ns: u64,
    },
}

/// Bit numbers of the arming-disable flags that this controller can raise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flags {
    /// Disarmed by its failsafe, and not let go of yet.
    pub failsafe: u32,
    /// No valid frames.
    pub rx_loss: u32,
    /// Throttle not low.
    pub throttle: u32,
    /// Tilted.
    pub angle: u32,
    /// Too young.
    pub boot_grace: u32,
    /// Sensors are being calibrated.
    pub calibrating: u32,
    /// The switch went up while something stood in the way.
    pub arm_switch: u32,
}
