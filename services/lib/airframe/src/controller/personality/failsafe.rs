//! How the installer has set the failsafe.

use super::Firmware;

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
    /// `failsafe_landing_time` (`failsafe_off_delay` before Betaflight 2025.12 and in INAV), seconds.
    pub landing_s: u8,
    /// `failsafe_throttle`.
    pub throttle_us: u16,
    /// `failsafe_procedure`.
    pub procedure: Procedure,
    /// `rxfail 3 h`: the throttle is held and not dropped when its frames stop.
    pub hold_throttle: bool,
}

impl Default for FailsafeSettings {
    /// The factory's of the default firmware: the aircraft falls.
    fn default() -> Self {
        Self::factory(Firmware::default())
    }
}

impl FailsafeSettings {
    /// As the firmware comes: with every one of them the aircraft falls.
    #[must_use]
    pub const fn factory(firmware: Firmware) -> Self {
        let drop = Self {
            delay_ds: 15,
            landing_s: 60,
            throttle_us: 1000,
            procedure: Procedure::Drop,
            hold_throttle: false,
        };
        match firmware {
            Firmware::Betaflight2025_12 | Firmware::Betaflight2026_12 => drop,
            // `failsafe_off_delay` 10 (betaflight: src/main/flight/failsafe.c of 4.5).
            Firmware::Betaflight4_5 => Self { landing_s: 1, ..drop },
            // `failsafe_delay` 10, `failsafe_off_delay` 10 (cleanflight and betaflight of 2017: flight/failsafe.c).
            Firmware::Flip32 => Self { delay_ds: 10, landing_s: 1, ..drop },
            // Delay 0.5 s, LAND, `failsafe_off_delay` 200 and a throttle below idle: without a height estimate the
            // motors stop (inav: src/main/flight/failsafe.c). It stays armed until the landing time.
            Firmware::Inav9_1 => Self {
                delay_ds: 5,
                landing_s: 20,
                throttle_us: 1000,
                procedure: Procedure::AutoLand,
                hold_throttle: true,
            },
        }
    }

    /// The mitigation that FACTS 1 found to work, with the throttle just under hover.
    #[must_use]
    pub const fn level_descent(throttle_us: u16) -> Self {
        Self { delay_ds: 5, landing_s: 20, throttle_us, procedure: Procedure::AutoLand, hold_throttle: true }
    }
}
