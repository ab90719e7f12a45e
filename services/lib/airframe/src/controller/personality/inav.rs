//! INAV 9.1 at its defaults, with the receiver set to MSP. What FACTS 1 does not give is read in the public sources
//! of INAV (iNavFlight/inav: the file stands beside each number).

use super::{BETAFLIGHT_2025_12, Flags, MspOverride, Personality, StatusLayout, StickLaw};

/// INAV 9.1.
pub const INAV_9_1: Personality = Personality {
    variant: *b"INAV",
    version: [9, 1, 0],
    version_text: "",
    // msp/msp_protocol.h.
    api: [0, 2, 5],
    speaks_v2: true,
    // No MSP_MULTIPLE_MSP in fc/fc_msp.c.
    answers_several: false,
    status: StatusLayout::Bare,
    // fc/runtime_config.h. It has no boot grace: its sensors are being calibrated for that time here.
    flags: Flags {
        failsafe: 7,
        rx_loss: 18,
        throttle: 19,
        angle: 8,
        boot_grace: 9,
        calibrating: 9,
        arm_switch: 14,
    },
    rx_config_length: 24,
    rx_map_length: 4,
    // 34 channels are 68 bytes.
    channels: 34,
    rc_needs_receiver: true,
    altitude_length: 10,
    analog_length: 7,
    // The receiver is no feature here.
    features: 0,
    // MAX_MODE_ACTIVATION_CONDITION_COUNT, fc/rc_modes.h.
    mode_slots: 40,
    // Recovery delay, three angles, stick threshold, least distance and its procedure follow the first eight bytes: fc/fc_msp.c.
    failsafe_length: 20,
    landing_units_per_s: 10,
    knows_rxfail: false,
    // A multirotor with compass and without barometer and GPS, in the order of fc/fc_msp_box.c.
    boxes: &[
        (0, "ARM"),
        (51, "PREARM"),
        (61, "MULTI FUNCTION"),
        (1, "ANGLE"),
        (2, "HORIZON"),
        (35, "TURN ASSIST"),
        (5, "HEADING HOLD"),
        (8, "CAMSTAB"),
        (6, "HEADFREE"),
        (7, "HEADADJ"),
        (32, "FPV ANGLE MIX"),
        (46, "MC BRAKING"),
        (13, "BEEPER"),
        (60, "BEEPER MUTE"),
        (19, "OSD OFF"),
        (26, "BLACKBOX"),
        (27, "FAILSAFE"),
        (50, "MSP RC OVERRIDE"),
    ],
    loss_ns: 200_000_000,
    // All sticks are held until the failsafe acts: rx/rx.c.
    hold_ns: u64::MAX,
    // PERIOD_RXDATA_FAILURE, flight/failsafe.h: with the delay of 0.5 s the 0.7 to 0.8 s of FACTS 1.
    failsafe_base_ns: 200_000_000,
    // PERIOD_RXDATA_RECOVERY and `failsafe_recovery_delay` 5, flight/failsafe.c.
    recovery_ns: 700_000_000,
    // `failsafe_stick_threshold` 50, fc/settings.yaml.
    recovery_stick_us: 50,
    // PERIOD_OF_30_SECONDS after a landing, flight/failsafe.c; the switch is looked at when they are over.
    rearm_ns: 30_000_000_000,
    rearm_low: false,
    // The periods of a lost and a found receiver, for frames beside a radio too: rx/msp_override.c.
    msp_override: MspOverride::WhileFresh { stale_ns: 700_000_000, steady_ns: 700_000_000 },
    // `max_angle_inclination_rll` 300, `rc_expo` 70, `yaw_rate` 20, `rc_yaw_expo` 20: fc/settings.yaml.
    stick: StickLaw::Expo { angle: [30.0, 0.7], yaw: [200.0, 0.2] },
    // `min_check`, rx/rx.c.
    low_throttle_us: 1100,
    ..BETAFLIGHT_2025_12
};
