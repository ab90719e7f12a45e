//! What differs between firmwares, as tables.

/// A firmware that the virtual flight controller can play.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Firmware {
    /// Betaflight 2025.12.6.
    #[default]
    Betaflight2025_12,
}

impl Firmware {
    /// By the name that configurations use.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        (name == "betaflight-2025.12").then_some(Self::Betaflight2025_12)
    }

    /// Names that [`Self::by_name`] knows.
    pub const NAMES: &'static [&'static str] = &["betaflight-2025.12"];

    /// Its numbers.
    #[must_use]
    pub const fn personality(self) -> &'static Personality {
        match self {
            Self::Betaflight2025_12 => &BETAFLIGHT_2025_12,
        }
    }
}

/// The numbers of one firmware. Sources: FACTS 1, and the firmware's public documentation for defaults.
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
    /// Bit of ARM_SWITCH, the last arming-disable flag.
    pub arm_switch_bit: u32,
    /// Bytes after the temperature in MSP_STATUS.
    pub status_tail: usize,
    /// Length of MSP_RX_CONFIG.
    pub rx_config_length: usize,
    /// Boxes in the order of MSP_BOXIDS: permanent id and name.
    pub boxes: &'static [(u8, &'static str)],
    /// Position in a SET_RAW_RC frame of roll, pitch, yaw, throttle and four more (MSP_RX_MAP).
    pub rx_map: [u8; 8],
    /// A receiver silent for this long is lost.
    pub loss_ns: u64,
    /// Channels are held for this long before they fall to their failsafe values.
    pub hold_ns: u64,
    /// Frames must come for this long before a loss is over.
    pub recovery_ns: u64,
    /// After a failsafe disarm: frames with the arm switch low must come for this long.
    pub rearm_ns: u64,
    /// No arming before this age.
    pub boot_grace_ns: u64,
    /// From the arm switch to armed, the receiver pass not included.
    pub arm_delay_ns: u64,
    /// Period of the receiver's and the modes' pass.
    pub receiver_pass_ns: u64,
    /// Period of the serial task: one command a pass.
    pub serial_pass_ns: u64,
    /// Degrees at full stick in ANGLE.
    pub angle_limit_deg: f64,
    /// Centre sensitivity and largest rate, degrees a second.
    pub rates_deg_s: [f64; 2],
    /// Throttle at and below which the craft may be armed.
    pub low_throttle_us: u16,
    /// The accelerometer's pull on the attitude, 1/s.
    pub attitude_gain_per_s: f64,
    /// From an angle error to a rate, 1/s.
    pub angle_gain_per_s: f64,
    /// Proportional, integral, derivative numbers of roll, pitch, yaw as the configurator shows them.
    pub pid: [[f64; 3]; 3],
}

/// Betaflight 2025.12.6 at its defaults with the receiver set to MSP and `map AETR1234`.
pub const BETAFLIGHT_2025_12: Personality = Personality {
    variant: *b"BTFL",
    version: [25, 12, 6],
    version_text: "2025.12.6",
    api: [0, 1, 47],
    arm_switch_bit: 28,
    status_tail: 1,
    rx_config_length: 39,
    boxes: &[
        (0, "ARM"),
        (1, "ANGLE"),
        (2, "HORIZON"),
        (3, "ALTHOLD"),
        (6, "HEADFREE"),
        (7, "HEADADJ"),
        (13, "BEEPERON"),
        (19, "OSD DISABLE"),
        (26, "BLACKBOX"),
        (27, "FAILSAFE"),
        (31, "BLACKBOX ERASE"),
        (36, "PREARM"),
        (35, "CRASHFLIP"),
        (45, "PARALYZE"),
        (50, "MSP OVERRIDE"),
        (53, "BEEPER MUTE"),
    ],
    rx_map: [0, 1, 3, 2, 4, 5, 6, 7],
    // 150 ms by setting; seen at 158 to 198 ms: eight for the task that looks, up to forty for its pass.
    loss_ns: 158_000_000,
    hold_ns: 300_000_000,
    recovery_ns: 500_000_000,
    rearm_ns: 1_200_000_000,
    boot_grace_ns: 5_000_000_000,
    arm_delay_ns: 90_000_000,
    receiver_pass_ns: 40_000_000,
    serial_pass_ns: 10_000_000,
    angle_limit_deg: 60.0,
    rates_deg_s: [70.0, 670.0],
    low_throttle_us: 1050,
    attitude_gain_per_s: 0.25,
    angle_gain_per_s: 5.0,
    pid: [[45.0, 80.0, 30.0], [47.0, 84.0, 34.0], [45.0, 80.0, 0.0]],
};

/// Arming-disable flags that this controller can raise, bit numbers common to the firmwares of the table.
pub(crate) mod block {
    pub(crate) const FAILSAFE: u32 = 1 << 1;
    pub(crate) const RX_LOSS: u32 = 1 << 2;
    pub(crate) const THROTTLE: u32 = 1 << 7;
    pub(crate) const ANGLE: u32 = 1 << 8;
    pub(crate) const BOOT_GRACE: u32 = 1 << 9;
    pub(crate) const CALIBRATING: u32 = 1 << 12;
}

/// What the firmware does when the receiver is silent in flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Procedure {
    /// Motors off.
    Drop,
    /// Level, throttle at a fixed value, motors off at the landing time.
    AutoLand,
}

/// Failsafe settings of the installer.
#[derive(Clone, Copy, Debug)]
pub struct FailsafeSettings {
    /// `failsafe_delay`, tenths of a second.
    pub delay_ds: u8,
    /// `failsafe_landing_time`, seconds.
    pub landing_s: u8,
    /// `failsafe_throttle`.
    pub throttle_us: u16,
    /// `failsafe_procedure`.
    pub procedure: Procedure,
    /// `rxfail 3 h`: the throttle is held and not dropped when its frames stop.
    pub hold_throttle: bool,
}

impl Default for FailsafeSettings {
    /// The factory's: the aircraft falls.
    fn default() -> Self {
        Self {
            delay_ds: 15,
            landing_s: 60,
            throttle_us: 1000,
            procedure: Procedure::Drop,
            hold_throttle: false,
        }
    }
}

impl FailsafeSettings {
    /// The mitigation that FACTS 1 found to work, with the throttle just under hover.
    #[must_use]
    pub fn level_descent(throttle_us: u16) -> Self {
        Self { delay_ds: 5, landing_s: 20, throttle_us, procedure: Procedure::AutoLand, hold_throttle: true }
    }
}
