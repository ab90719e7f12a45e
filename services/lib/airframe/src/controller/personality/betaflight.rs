//! Betaflight 4.5 and later at its defaults, with `map AETR1234`.

use super::{Flags, MspOverride, Personality, StatusLayout, StickLaw};

/// Flags that have kept their place from 4.3 on; ARM_SWITCH is always the last.
const fn flags(arm_switch: u32) -> Flags {
    Flags { failsafe: 1, rx_loss: 2, throttle: 7, angle: 8, boot_grace: 9, calibrating: 12, arm_switch }
}

/// Betaflight 2025.12.6.
pub const BETAFLIGHT_2025_12: Personality = Personality {
    variant: *b"BTFL",
    version: [25, 12, 6],
    version_text: "2025.12.6",
    api: [0, 1, 47],
    speaks_v2: true,
    answers_several: true,
    // 25 bytes: reboot, temperature, one more.
    status: StatusLayout::Flagged { tail: 4 },
    flags: flags(28),
    rx_config_length: 39,
    rx_map_length: 8,
    rx_map: [0, 1, 3, 2, 4, 5, 6, 7],
    channels: 18,
    rc_needs_receiver: false,
    altitude_length: 6,
    analog_length: 9,
    // Receiver over MSP and air mode: bits 14 and 22.
    features: 1 << 14 | 1 << 22,
    mode_slots: 20,
    failsafe_length: 8,
    landing_units_per_s: 1,
    knows_rxfail: true,
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
    // 150 ms by setting; seen at 158 to 198 ms: eight for the task that looks, up to forty for its pass.
    loss_ns: 158_000_000,
    hold_ns: 300_000_000,
    // The delay of 1.5 s runs from the last frame: disarmed at 1.52 to 1.55 s.
    failsafe_base_ns: 0,
    recovery_ns: 500_000_000,
    recovery_stick_us: 0,
    rearm_ns: 1_200_000_000,
    rearm_low: true,
    // Of 4.5.6 as well.
    msp_override: MspOverride::Held,
    boot_grace_ns: 5_000_000_000,
    arm_delay_ns: 90_000_000,
    receiver_pass_ns: 40_000_000,
    serial_pass_ns: 10_000_000,
    stick: StickLaw::Actual { angle_limit_deg: 60.0, rates_deg_s: [70.0, 670.0] },
    low_throttle_us: 1050,
    attitude_gain_per_s: 0.25,
    angle_gain_per_s: 5.0,
    pid: [[45.0, 80.0, 30.0], [47.0, 84.0, 34.0], [45.0, 80.0, 0.0]],
};

/// Betaflight 4.5.6.
pub const BETAFLIGHT_4_5: Personality = Personality {
    version: [4, 5, 6],
    version_text: "",
    api: [0, 1, 46],
    // 24 bytes: reboot, temperature.
    status: StatusLayout::Flagged { tail: 3 },
    flags: flags(25),
    rx_config_length: 38,
    // `failsafe_off_delay` is in tenths (betaflight: src/main/flight/failsafe.c of 4.5).
    landing_units_per_s: 10,
    // Without ALTHOLD, which came later.
    boxes: &[
        (0, "ARM"),
        (1, "ANGLE"),
        (2, "HORIZON"),
        (6, "HEADFREE"),
        (7, "HEADADJ"),
        (13, "BEEPER"),
        (19, "OSD DISABLE"),
        (26, "BLACKBOX"),
        (27, "FAILSAFE"),
        (31, "BLACKBOX ERASE"),
        (36, "PREARM"),
        (35, "FLIP OVER AFTER CRASH"),
        (45, "PARALYZE"),
        (50, "MSP OVERRIDE"),
        (53, "BEEPER MUTE"),
    ],
    // 100 ms, and the eight of 2025.12 for the task that looks.
    loss_ns: 108_000_000,
    ..BETAFLIGHT_2025_12
};

/// Betaflight 2026.12, alpha. FACTS gives no trigger of its own: that of 2025.12 stands.
pub const BETAFLIGHT_2026_12: Personality = Personality {
    version: [26, 12, 0],
    // Nineteen bytes with the three numbers and the length.
    version_text: "2026.12.0-alpha",
    api: [0, 1, 48],
    // 27 bytes.
    status: StatusLayout::Flagged { tail: 6 },
    flags: flags(29),
    rc_needs_receiver: true,
    // The radio's own within 0.3 s, the radio's frame and the pass included.
    msp_override: MspOverride::WhileFresh { stale_ns: 240_000_000, steady_ns: 0 },
    ..BETAFLIGHT_2025_12
};
