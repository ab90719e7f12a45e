//! Why the controller will not arm, in words.

use core::fmt::{self, Write};
use msp::messages::Arming;

/// Names of the arming-disable flags that have kept their place from Betaflight 4.3 to 2026.12
/// (`runtime_config.h` of those versions).
const COMMON: [&str; 25] = [
    "no gyro",
    "failsafe active",
    "no channels received",
    "arm switch not reset after a failsafe",
    "failsafe switch on",
    "a runaway take-off was stopped",
    "a crash was detected",
    "throttle not low",
    "not level",
    "still starting up",
    "pre-arm switch off",
    "controller overloaded",
    "calibrating",
    "command line open",
    "on-screen menu open",
    "locked by its serial bus",
    "locked by another MSP program",
    "paralyzed until restart",
    "no GPS fix",
    "rescue switch on",
    "motor telemetry missing",
    "needs a restart",
    "motor signal fault",
    "accelerometer not calibrated",
    "motor protocol not set",
];
/// Flags that came later: from 27 flags on, and from 29.
const LATER: [(&str, u8); 3] =
    [("crash-flip switch on", 27), ("altitude-hold switch on", 29), ("position-hold switch on", 29)];
/// Names of the seventeen flags of Betaflight 3.2 (`fc/runtime_config.h` of 2017).
const OLD: [&str; 16] = [
    "no gyro",
    "failsafe active",
    "no channels received",
    "arm switch not reset after a failsafe",
    "failsafe switch on",
    "throttle not low",
    "not level",
    "still starting up",
    "pre-arm switch off",
    "controller overloaded",
    "calibrating",
    "command line open",
    "on-screen menu open",
    "on-screen menu open",
    "locked by its serial bus",
    "locked by another MSP program",
];
/// The least number of flags with which [`COMMON`] is right.
const COMMON_FROM: u8 = 26;

/// The name of flag `index` in a firmware with `count` flags; the last is always the arm switch.
#[must_use]
pub fn flag_name(index: u8, count: u8) -> Option<&'static str> {
    if count > 0 && index == count - 1 {
        return Some("arm switch on too early");
    }
    let index = usize::from(index);
    if usize::from(count) == OLD.len() + 1 {
        return OLD.get(index).copied();
    }
    if count < COMMON_FROM {
        return None;
    }
    COMMON.get(index).copied().or_else(|| {
        let (name, from) = LATER.get(index.checked_sub(COMMON.len())?)?;
        (count >= *from).then_some(*name)
    })
}

/// Writes all set flags, separated by commas.
///
/// # Errors
/// Only what `out` reports, when it is full.
pub fn write_blocks(arming: &Arming, out: &mut impl Write) -> fmt::Result {
    let mut separator = "";
    for index in (0..32u8).filter(|index| arming.flags & (1 << index) != 0) {
        out.write_str(separator)?;
        separator = ", ";
        match flag_name(index, arming.count) {
            Some(name) => out.write_str(name)?,
            None => write!(out, "block {index}")?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(flags: u32, count: u8) -> String {
        let mut text = String::new();
        write_blocks(&Arming { count, flags }, &mut text).unwrap();
        text
    }

    #[test]
    fn the_last_flag_is_the_arm_switch_whatever_the_version() {
        for count in [17, 26, 29, 30] {
            assert_eq!(words(1 << (count - 1), count), "arm switch on too early");
        }
        assert_eq!(words(1 << 25, 29), "crash-flip switch on");
        assert_eq!(words(1 << 28, 30), "block 28");
    }

    #[test]
    fn an_unknown_flag_is_a_number_and_never_a_wrong_name() {
        assert_eq!(words(1 << 7 | 1 << 9, 29), "throttle not low, still starting up");
        assert_eq!(words(1 << 7, 20), "block 7");
        assert_eq!(
            words(1 << 5 | 1 << 7 | 1 << 16 | 1 << 17, 17),
            "throttle not low, still starting up, arm switch on too early, block 17"
        );
        assert_eq!(words(1 << 31, 29), "block 31");
        assert_eq!(words(0, 29), "");
        assert_eq!(words(u32::MAX, 0).matches("block").count(), 32);
    }
}
