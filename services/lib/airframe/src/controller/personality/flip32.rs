//! The thesis's own board, a Flip32 (STM32F103), with the last firmware that runs on it: Betaflight 3.2.5 (FACTS 1).
//!
//! FACTS has no measurement of it. Thesis, table 3.3: version 1 framing, MSP_ANALOG of seven bytes, MSP_RC of 18
//! channels. The rest is read in public sources: its own of 2017 (betaflight/betaflight: the file stands beside
//! the number), and what Betaflight's configurator expects of MSP 1.36.

use super::{BETAFLIGHT_2025_12, Flags, MspOverride, Personality, StatusLayout, StickLaw};

/// Betaflight 3.2.5 on an STM32F103.
pub const FLIP32: Personality = Personality {
    version: [3, 2, 5],
    version_text: "",
    api: [0, 1, 36],
    // Figure 3.17 of the thesis knows no other framing.
    speaks_v2: false,
    answers_several: false,
    // 21 bytes: the flags are there since MSP 1.36, and nothing comes after them yet.
    status: StatusLayout::Flagged { tail: 0 },
    // Seventeen flags: fc/runtime_config.h of late 2017, before the later ones moved them.
    flags: Flags {
        failsafe: 1,
        rx_loss: 2,
        throttle: 5,
        angle: 6,
        boot_grace: 7,
        calibrating: 10,
        arm_switch: 16,
    },
    // Serial provider to radio channel count: fc/fc_msp.c.
    rx_config_length: 22,
    analog_length: 7,
    landing_units_per_s: 10,
    // No MSP OVERRIDE.
    boxes: &[
        (0, "ARM"),
        (1, "ANGLE"),
        (2, "HORIZON"),
        (5, "MAG"),
        (6, "HEADFREE"),
        (7, "HEADADJ"),
        (13, "BEEPER"),
        (26, "BLACKBOX"),
        (27, "FAILSAFE"),
        (28, "AIR MODE"),
    ],
    // DELAY_10_HZ, rx/rx.c, and the eight of 2025.12 for the task that looks.
    loss_ns: 108_000_000,
    // Held for 300 ms (MAX_INVALID_PULS_TIME), and only then the periods of flight/failsafe.h begin: 200 ms and the delay.
    failsafe_base_ns: 500_000_000,
    // PERIOD_RXDATA_RECOVERY, flight/failsafe.h.
    recovery_ns: 200_000_000,
    // PERIOD_OF_3_SECONDS after a drop, flight/failsafe.c; the switch is looked at when they are over.
    rearm_ns: 3_000_000_000,
    rearm_low: false,
    msp_override: MspOverride::Unknown,
    // `level_limit` 55, in proportion to the stick, and the default rates 1.00 with a super rate of 0.70: flight/pid.c.
    stick: StickLaw::Linear { angle_limit_deg: 55.0, super_rate: 0.7 },
    ..BETAFLIGHT_2025_12
};
