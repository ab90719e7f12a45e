//! The `override` profile on the virtual flight controller: a safety pilot arms, lends the sticks and takes them back.
#![allow(clippy::unwrap_used, reason = "tests")]

mod rig;

use airframe::controller::{Firmware, MspOverride};
use rig::Rig;

/// Those that know the override switch.
fn firmwares() -> impl Iterator<Item = Firmware> {
    Firmware::ALL.into_iter().filter(|firmware| firmware.personality().msp_override != MspOverride::Unknown)
}

/// Of `flight/state`: ARM, ANGLE and MSP OVERRIDE.
const LENT: u32 = 1 | 2 | 8;

#[test]
fn a_human_arms_lends_the_sticks_and_disarms() {
    for firmware in firmwares() {
        let name = firmware.name();
        let mut rig = Rig::beside_a_radio(firmware, None);
        rig.run(8.0);
        assert!(!rig.armed(), "{name}: nobody has asked for it");
        let mut rig = rig.hover();
        assert!(rig.flight.safety_pilot().unwrap().lends(), "{name}");
        assert_eq!(rig.core.state(rig.now()).modes & LENT, LENT, "{name}");
        // Down, motors not wanted any more; he sees it stand and disarms.
        rig.pilot.height_m = Some(-0.2);
        rig.run(6.0);
        rig.pilot.height_m = None;
        rig.pilot.arm = false;
        rig.run(3.0);
        assert!(!rig.armed() && rig.height_m() < 0.05, "{name}");
        assert_eq!(rig.core.state(rig.now()).modes & LENT, 2, "{name}");
    }
}

#[test]
fn he_takes_the_sticks_back_and_lands_by_sight() {
    for firmware in firmwares() {
        let name = firmware.name();
        let mut rig = Rig::beside_a_radio(firmware, Some(15.0)).hover();
        // The companion climbs on towards the ceiling, 2.6 m, until he takes the sticks.
        rig.pilot.height_m = Some(2.0);
        rig.run(15.0);
        assert!(!rig.armed() && rig.height_m() < 0.05, "{name}: {} m", rig.height_m());
        let truth = rig.flight.truth();
        assert_eq!(truth.contacts, 0, "{name}: {truth:?}");
    }
}

/// The ladder is flown through the override switch as well.
#[test]
fn a_silent_pilot_is_brought_down() {
    for firmware in firmwares() {
        let name = firmware.name();
        let mut rig = Rig::beside_a_radio(firmware, None).hover();
        rig.pilot_speaks = false;
        rig.run(14.0);
        assert!(!rig.armed() && rig.height_m() < 0.05, "{name}: {} m", rig.height_m());
        assert_eq!(rig.flight.truth().contacts, 0, "{name}");
    }
}

/// Neutral sticks first is for the ground: in the air they would drop it.
#[test]
fn started_again_in_the_air_it_sends_no_neutral_first() {
    for firmware in firmwares() {
        for offset in 0..8 {
            let mut rig = Rig::beside_a_radio(firmware, None).hover();
            rig.run(0.005 * f64::from(offset));
            rig.restart(0.12);
            rig.run(3.0);
            rig.expect_hover();
        }
    }
}
