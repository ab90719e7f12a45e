//! `flight` on the virtual flight controller, with every firmware that it plays and MSP as the receiver.
#![allow(clippy::unwrap_used, reason = "tests")]

mod rig;

use airframe::controller::Firmware;
use ipc_types::LinkState;
use rig::{MS, Rig, T0};

/// From power-up over arming and hovering to disarmed on the floor; within what the controller's task can answer.
#[test]
fn flight_flies_every_firmware() {
    for firmware in Firmware::ALL {
        let name = firmware.name();
        let mut rig = Rig::hovering(firmware);
        let (now, expected) = (rig.now(), firmware.personality());
        let state = rig.core.state(now);
        assert_eq!(rig.core.link_state(now), LinkState::Up, "{name}");
        assert_eq!((state.variant, &state.version[..3]), (expected.variant, &expected.version[..]), "{name}");
        // ARM and ANGLE, wherever the firmware lists them.
        assert_eq!((state.armed, state.modes & 3), (1, 3), "{name}");
        // Nothing that came was broken, too short or unasked for.
        assert_eq!(state.refused, 0, "{name}");

        let second = 1_000 * MS;
        for start in (T0 + second..now - second).step_by(50_000_000) {
            let all = rig.count(start, start + second, None);
            assert!(all <= 90, "{name}: {all} commands in a second");
        }
        let frames = rig.count(now - 5 * second, now, Some(200));
        assert!((247..=253).contains(&frames), "{name}: {frames} frames in 5 s");
        // Attitude alone or with the accelerometer, whichever the firmware answers.
        let several = expected.answers_several;
        let asked = rig.count(now - 5 * second, now, Some(if several { 230 } else { 108 }));
        assert!(asked >= 140, "{name}: {asked} attitudes in 5 s");
        let told = rig.attitudes.last().unwrap();
        assert_eq!(told.force_z_m_s2.is_finite(), several, "{name}");
        assert!(rig.powers >= 30, "{name}: {} readings of the battery", rig.powers);

        rig.pilot.height_m = Some(-0.2);
        rig.run(6.0);
        assert!(rig.height_m() < 0.05, "{name}: {}", rig.height_m());
        rig.pilot.height_m = None;
        rig.pilot.arm = false;
        rig.run(0.2);
        assert!(!rig.armed(), "{name}");
    }
}

/// FACTS 1: gaps of up to 250 ms are held. The port is away for 150 ms and found again within 50 more.
#[test]
fn a_port_that_vanishes_in_flight_and_returns() {
    for firmware in Firmware::ALL {
        let mut rig = Rig::hovering(firmware);
        rig.connected = false;
        rig.core.closed("/dev/ttyX: no such port");
        rig.run(0.15);
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Closed);
        rig.connected = true;
        rig.core.opened(rig.now());
        rig.run(3.0);
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Up, "{}", firmware.name());
        rig.expect_hover();
    }
}

/// `flight` is killed in the air and started again within 120 ms: it knows nothing, not even how to speak.
#[test]
fn a_flight_that_is_started_again_in_the_air_holds_every_firmware() {
    for firmware in Firmware::ALL {
        for offset in 0..8 {
            let mut rig = Rig::hovering(firmware);
            // The moment against the controller's task and the pilot's beat.
            rig.run(0.005 * f64::from(offset));
            rig.restart(0.12);
            rig.run(3.0);
            rig.expect_hover();
        }
    }
}

/// A board that is switched on seconds after `flight` is found, and spoken to by version 2 where it knows it.
#[test]
fn a_controller_that_comes_late_is_found() {
    for firmware in Firmware::ALL {
        let mut rig = Rig::new(firmware);
        rig.connected = false;
        for _ in 0..20 {
            // What is sent meanwhile goes nowhere.
            rig.run(0.1);
            let lost = rig.core.waiting().len();
            rig.core.taken(lost);
        }
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Silent);
        rig.connected = true;
        rig.run(6.0);
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Up, "{}", firmware.name());
        rig.commands.clear();
        rig.pilot.arm = true;
        rig.run(2.5);
        assert!(rig.armed(), "{}: {}", firmware.name(), rig.reason());
    }
}
