//! Whole flights of the pilot's core around a small aircraft.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod alone;
mod below;
mod expiry;
mod floor;
mod hand;
mod home;
mod kept;
mod orders;
mod rig;
mod sense;

use control::{Tilt, Vector};
use ipc_types::{
    ChannelSource, FailsafeAction, FailsafeCause, LinkState, LocalizationState, Phase, SetpointKind,
    SonarHealth, Verb,
};
use rig::{MS, Rig};

const NAN: Vector = Vector { x: f32::NAN, y: f32::NAN };

#[test]
fn takes_off_hovers_and_lands_softly_whatever_the_weight() {
    for (seed, hover) in [(1, 1400.0), (2, 1450.0), (3, 1500.0), (4, 1560.0)] {
        let mut rig = Rig::new(seed);
        rig.hover_us = hover;
        rig.level = Tilt { roll: 0.026, pitch: -0.02 };
        let pad = rig.place;
        rig.take_off();
        assert!((rig.height - 1.2).abs() < 0.2, "hover {hover}: {}", rig.height);
        rig.run(8.0);
        assert!((rig.height - 1.2).abs() < 0.07, "hover {hover}: {}", rig.height);
        assert!((rig.place - pad).norm() < 0.2, "hover {hover}: {:?}", rig.place - pad);
        assert!((rig.channels.hover_throttle_us - hover).abs() < 20.0);
        rig.order(Verb::Land);
        assert_eq!(rig.phase(), Phase::Landing);
        let seconds = rig.until_grounded(12.0);
        assert!((3.0..9.0).contains(&seconds), "{seconds}");
        assert!(rig.touched_at > -0.4, "hover {hover}: touched at {}", rig.touched_at);
        assert!(rig.touch_tilt < 0.07, "hover {hover}: tilted {}", rig.touch_tilt);
        assert!((rig.place - pad).norm() < 0.25, "hover {hover}: landed {:?} off", rig.place - pad);
        // And again, with what it learned.
        rig.take_off();
        rig.run(2.0);
        assert!((rig.height - 1.2).abs() < 0.1);
    }
}

#[test]
fn hover_drift_is_bounded_under_gusts_and_a_level_error() {
    for seed in 0..6 {
        let mut rig = Rig::new(seed);
        rig.level = Tilt { roll: -0.026, pitch: 0.026 };
        rig.gust_rms = 0.2;
        let pad = rig.place;
        rig.take_off();
        let (mut worst, mut height) = (0.0f32, 0.0f32);
        for _ in 0..3000 {
            rig.step();
            worst = worst.max((rig.place - pad).norm());
            height = height.max((rig.height - 1.2).abs());
        }
        assert!(worst < 0.6, "seed {seed}: drifted {worst}");
        assert!(height < 0.15, "seed {seed}: height {height}");
    }
}

#[test]
fn a_table_is_flown_over_and_lost_echoes_ridden_out() {
    let mut rig = Rig::new(7);
    rig.take_off();
    rig.run(4.0);
    for surface in [0.75, 0.0, 0.45, 0.75, 0.0] {
        rig.surface = surface;
        let mut worst = 0.0f32;
        for _ in 0..100 {
            rig.step();
            worst = worst.max((rig.height - 1.2).abs());
        }
        assert!(worst < 0.12, "{surface}: {worst}");
        assert!((rig.state.surface_m - surface).abs() < 0.08, "{surface}: {}", rig.state.surface_m);
    }
    rig.down_lost = 0.4;
    rig.run(10.0);
    assert!((rig.height - 1.2).abs() < 0.15);
    assert_eq!(rig.phase(), Phase::Hover);
}

#[test]
fn flies_what_navigation_wishes_and_lands_where_it_says() {
    let mut rig = Rig::new(3);
    let pad = rig.place;
    rig.run(1.5);
    rig.navigate(SetpointKind::Hover, Vector::ZERO, NAN);
    rig.order(Verb::PatrolStart);
    while rig.phase() != Phase::Autonomous {
        rig.step();
        assert!(rig.now < 25_000 * MS, "{}", rig.core.sentence());
    }
    rig.navigate(SetpointKind::Velocity, Vector::new(0.4, 0.0), NAN);
    // Nose first: between two cones it would fly more slowly.
    rig.setpoint.as_mut().unwrap().heading_rad = 0.0;
    rig.run(5.0);
    assert_eq!(rig.channels.source, ChannelSource::Navigation.code());
    assert!((rig.velocity.x - 0.4).abs() < 0.1 && rig.velocity.y.abs() < 0.1, "{:?}", rig.velocity);
    assert!(rig.place.x - pad.x > 1.2);
    rig.navigate(SetpointKind::Hover, Vector::ZERO, pad);
    rig.run(10.0);
    assert!((rig.place - pad).norm() < 0.2, "{:?}", rig.place - pad);
    rig.navigate(SetpointKind::Land, Vector::ZERO, pad);
    rig.step();
    rig.run(0.2);
    assert_eq!(rig.phase(), Phase::Landing);
    rig.until_grounded(12.0);
    assert!((rig.place - pad).norm() < 0.2, "{:?}", rig.place - pad);
    assert_eq!(rig.state.cause, FailsafeCause::None.code());
}

#[test]
fn no_wish_of_navigation_touches_a_wall() {
    for k in 0..8 {
        let mut rig = Rig::new(k);
        rig.gust_rms = 0.15;
        rig.run(1.5);
        rig.navigate(SetpointKind::Hover, Vector::ZERO, NAN);
        rig.order(Verb::PatrolStart);
        rig.run(12.0);
        assert_eq!(rig.phase(), Phase::Autonomous);
        rig.navigate(SetpointKind::Velocity, Vector::along(k as f32 * 0.8) * 0.7, NAN);
        rig.run(15.0);
        // At the full speed straight at a wall, with nobody but the shield to stop it, in gusts.
        assert!(rig.least_clearance > 0.0, "direction {k}: {}", rig.least_clearance);
    }
}

#[test]
fn navigation_that_falls_silent_is_a_hover_and_comes_back() {
    let mut rig = Rig::new(5);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.4, 0.1), NAN);
    rig.order(Verb::PatrolStart);
    rig.run(13.0);
    rig.setpoint = None;
    rig.run(0.5);
    let stopping = rig.place;
    assert_eq!(rig.state.cause, FailsafeCause::NavigationSilent.code());
    assert_eq!(rig.state.action, FailsafeAction::Hover.code());
    rig.run(3.0);
    assert!(rig.velocity.norm() < 0.12 && (rig.place - stopping).norm() < 0.5, "{:?}", rig.velocity);
    rig.navigate(SetpointKind::Velocity, Vector::new(-0.3, 0.0), NAN);
    rig.run(2.0);
    assert_eq!(rig.state.cause, FailsafeCause::None.code());
    assert!(rig.velocity.x < -0.2);
}

#[test]
fn localization_that_dies_is_no_more_than_a_drift() {
    for seed in 0..4 {
        let mut rig = Rig::new(seed);
        rig.level = Tilt { roll: 0.02, pitch: 0.02 };
        rig.run(1.5);
        rig.navigate(SetpointKind::Velocity, Vector::new(0.4, 0.0), NAN);
        rig.order(Verb::PatrolStart);
        rig.run(12.0);
        rig.localization_dead = true;
        rig.setpoint = None;
        let before = rig.place;
        rig.run(2.0);
        assert!(rig.velocity.norm() < 0.2, "seed {seed}: {:?}", rig.velocity);
        assert_eq!(rig.state.action, FailsafeAction::Hover.code());
        rig.localization_dead = false;
        rig.run(2.0);
        assert!((rig.place - before).norm() < 0.7, "seed {seed}: {:?}", rig.place - before);
        assert_eq!(rig.phase(), Phase::Autonomous);
    }
}

#[test]
fn a_place_that_stays_lost_brings_it_down_level() {
    let mut rig = Rig::new(2);
    rig.take_off();
    rig.run(10.0);
    rig.pose_state = LocalizationState::Lost;
    rig.run(15.0);
    assert_eq!(rig.phase(), Phase::Hover);
    rig.run(5.3);
    assert_eq!(rig.phase(), Phase::EmergencyLanding);
    assert_eq!(rig.state.cause, FailsafeCause::Lost.code());
    rig.until_grounded(12.0);
    assert!(rig.touched_at > -0.5, "{}", rig.touched_at);
}

#[test]
fn who_is_not_sure_of_its_place_turns_to_and_fro_in_the_hover() {
    let mut rig = Rig::new(5);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.2, 0.0), NAN);
    rig.order(Verb::PatrolStart);
    rig.run(12.0);
    rig.pose_state = LocalizationState::Lost;
    rig.run(1.5);
    let (place, from) = (rig.place, rig.heading);
    let (mut least, mut most) = (0.0f32, 0.0f32);
    for _ in 0..150 {
        rig.run(0.1);
        let turned = control::wrap_angle(rig.heading - from);
        (least, most) = (least.min(turned), most.max(turned));
    }
    assert_eq!(rig.state.action, FailsafeAction::Hover.code());
    assert!(most > 0.5 && least < -0.5 && most - least < 2.0, "{least} {most}");
    assert!((rig.place - place).norm() < 1.0, "{:?}", rig.place - place);
    rig.pose_state = LocalizationState::Tracking;
    rig.run(1.5);
    assert_eq!(rig.state.action, FailsafeAction::None.code(), "found again, it goes on");
}

#[test]
fn a_hover_that_flow_holds_needs_no_walls_and_one_adrift_comes_down() {
    let lost = |adrift: bool, seconds: f32| {
        let mut rig = Rig::new(6);
        rig.take_off();
        rig.run(10.0);
        (rig.pose_state, rig.walls_in_echo) = (LocalizationState::Lost, 1);
        rig.adrift_ns = if adrift { rig.now } else { 0 };
        rig.run(seconds);
        rig.phase()
    };
    assert_eq!(lost(false, 10.0), Phase::Hover);
    assert_eq!(lost(true, 1.0), Phase::Hover, "`failsafe.drift_land_s` is 1.5 s");
    assert_eq!(lost(true, 3.0), Phase::EmergencyLanding);
}

#[test]
fn a_silent_down_sonar_is_held_then_descended_blind() {
    for seed in 0..5 {
        let mut rig = Rig::new(seed);
        rig.take_off();
        rig.run(10.0);
        rig.down_lost = 1.0;
        rig.run(0.8);
        assert!((rig.height - 1.2).abs() < 0.15, "seed {seed}: {}", rig.height);
        assert_eq!(rig.state.cause, FailsafeCause::HeightUnknown.code());
        rig.run(0.6);
        assert_eq!(rig.phase(), Phase::EmergencyLanding);
        rig.until_grounded(20.0);
        assert!(rig.touched_at > -0.7, "seed {seed}: {}", rig.touched_at);
    }
}

#[test]
fn without_side_sonars_it_stops_and_then_lands() {
    let mut rig = Rig::new(4);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.3, 0.0), NAN);
    rig.order(Verb::PatrolStart);
    rig.run(12.0);
    rig.sides_dead = true;
    rig.run(1.5);
    assert_eq!(rig.state.cause, FailsafeCause::AllSonarsSilent.code());
    assert_eq!(rig.state.shield_speed_m_s, 0.0);
    rig.run(1.0);
    assert!(rig.velocity.norm() < 0.15, "{:?}", rig.velocity);
    rig.run(4.0);
    assert_eq!(rig.phase(), Phase::EmergencyLanding);
    rig.until_grounded(12.0);
    assert!(rig.touched_at > -0.5);
}

#[test]
fn the_battery_sends_it_home_and_then_down() {
    let mut rig = Rig::new(4);
    rig.run(1.5);
    rig.navigate(SetpointKind::Velocity, Vector::new(0.1, 0.0), NAN);
    rig.order(Verb::PatrolStart);
    rig.run(12.0);
    rig.cell_volts = 3.45;
    rig.run(11.0);
    assert_eq!(rig.state.action, FailsafeAction::Return.code());
    // Navigation flies it home.
    assert_eq!(rig.channels.source, ChannelSource::Navigation.code());
    rig.cell_volts = 3.2;
    rig.run(3.0);
    assert_eq!(rig.phase(), Phase::EmergencyLanding);
    rig.until_grounded(12.0);
    assert!(rig.core.sentence().contains("battery"), "{}", rig.core.sentence());
}

#[test]
fn a_take_off_is_refused_in_words() {
    type Change = fn(&mut Rig);
    let cases: [(Change, &str); 12] = [
        (|r| r.pose_state = LocalizationState::Converging, "does not know where it is"),
        (|r| r.localization_dead = true, "the localization is silent"),
        (|r| r.cell_volts = 3.5, "battery at 3.50 V a cell, 3.60 needed"),
        (|r| r.cell_volts = f32::NAN, "does not tell the battery's voltage"),
        (|r| r.cell_volts = 0.0, "does not tell the battery's voltage"),
        (|r| r.power_told = false, "does not tell the battery's voltage"),
        (|r| r.drawn_mah = f32::NAN, "does not tell the charge drawn"),
        (|r| r.link_state = LinkState::Silent, "flight controller: controller silent"),
        (|r| r.blocks = 4, "will not arm: no gyro"),
        (|r| r.down_health = SonarHealth::Stuck, "the down sonar is not healthy"),
        (|r| r.sides_dead = true, "8 of the side sonars silent"),
        (|r| r.armed = true, "armed already"),
    ];
    for (change, words) in cases {
        let mut rig = Rig::new(1);
        change(&mut rig);
        rig.run(1.5);
        if words == "armed already" {
            // An armed controller on the ground is switched off by the pilot's own silence on the matter.
            assert!(!rig.armed);
            continue;
        }
        rig.order(Verb::TakeOff);
        assert_eq!(rig.phase(), Phase::Grounded);
        assert!(rig.core.sentence().contains(words), "{}", rig.core.sentence());
        rig.run(1.0);
        assert!(!rig.armed && rig.height == 0.0);
    }
    // Nothing heard at all.
    let mut rig = Rig::new(1);
    rig.order(Verb::TakeOff);
    assert!(rig.core.sentence().contains("flight service is silent"), "{}", rig.core.sentence());
}

#[test]
fn two_lost_pings_do_not_keep_it_on_the_ground() {
    let mut rig = Rig::new(1);
    rig.run(1.5);
    rig.sides_dead = true;
    rig.run(0.7);
    rig.order(Verb::TakeOff);
    assert_eq!(rig.phase(), Phase::Arming, "{}", rig.core.sentence());
}

#[test]
fn a_controller_that_does_not_arm_ends_the_take_off() {
    let mut rig = Rig::new(1);
    rig.will_arm = false;
    rig.run(1.5);
    rig.order(Verb::TakeOff);
    rig.run(2.5);
    assert_eq!(rig.phase(), Phase::Arming);
    assert_eq!(rig.channels.channels_us[2], 1000);
    rig.run(1.0);
    assert_eq!(rig.phase(), Phase::Grounded);
    assert!(rig.core.sentence().contains("did not arm"), "{}", rig.core.sentence());
}

#[test]
fn a_command_is_obeyed_once() {
    let mut rig = Rig::new(1);
    rig.take_off();
    rig.run(1.0);
    rig.order(Verb::Land);
    rig.until_grounded(12.0);
    // The same message again, as a late joiner or a restarted pilot would see it.
    let retained = rig.state;
    rig.restart(100);
    assert_eq!(rig.state.command_sequence, retained.command_sequence);
    let mut command = ipc_types::Command {
        expiry_ns: rig.now + ipc_types::COMMAND_LIFE_NS,
        verb: Verb::TakeOff.code().into(),
        command_sequence: retained.command_sequence,
        ..Default::default()
    };
    command.header.stamp_ns = rig.now;
    rig.core.command(rig.now, &command);
    rig.run(1.0);
    assert_eq!(rig.phase(), Phase::Grounded);
    // With another number it would have been obeyed: that is what the assertion above can fail by.
    command.command_sequence += 1;
    rig.core.command(rig.now, &command);
    assert_eq!(rig.phase(), Phase::Arming);
}

#[test]
fn killed_in_the_air_it_goes_on_as_if_nothing_had_been() {
    for seed in 0..10 {
        let mut rig = Rig::new(seed);
        rig.gust_rms = 0.15;
        rig.level = Tilt { roll: 0.02, pitch: -0.02 };
        rig.run(1.5);
        rig.navigate(SetpointKind::Velocity, Vector::new(0.3, 0.05), NAN);
        rig.order(Verb::PatrolStart);
        // Somewhere between take-off and a wall.
        rig.run(3.0 + seed as f32);
        let phase = rig.phase();
        let before = rig.height;
        rig.restart(120);
        let mut round = Box::<ipc_types::Patrol>::default();
        round.state = ipc_types::PatrolState::Flying.code().into();
        rig.core.patrol(&round);
        let mut lowest = rig.height;
        rig.step();
        assert_eq!(rig.channels.arm, 1, "seed {seed}: never disarms because it restarted");
        for _ in 0..200 {
            rig.step();
            lowest = lowest.min(rig.height);
        }
        assert!(rig.armed, "seed {seed} in {phase}");
        assert!(lowest > before - 0.15, "seed {seed} in {phase}: {before} to {lowest}");
        rig.run(6.0);
        assert_eq!(rig.phase(), Phase::Autonomous, "seed {seed}, killed in {phase}");
        assert!((rig.height - 1.2).abs() < 0.15, "seed {seed}: {}", rig.height);
        assert!(rig.least_clearance > 0.02);
    }
}

#[test]
fn killed_while_landing_it_lands() {
    for k in 0..8 {
        let mut rig = Rig::new(k);
        rig.take_off();
        rig.run(3.0);
        rig.order(Verb::Land);
        rig.run(0.02 + 0.4 * k as f32);
        rig.touched_at = 0.0;
        let place = rig.place;
        rig.restart(100);
        rig.until_grounded(14.0);
        assert!(rig.touched_at > -0.6, "killed at {k}: {}", rig.touched_at);
        assert!((rig.place - place).norm() < 0.3);
    }
}

#[test]
fn a_pilot_without_memory_takes_over_a_flying_drone() {
    let mut rig = Rig::new(6);
    rig.take_off();
    rig.run(5.0);
    for _ in 0..5 {
        rig.step();
    }
    let config = pilot::PilotConfig::default();
    rig.core = pilot::PilotCore::new(config, rig::craft(), None);
    let mut silent = 0;
    while rig.phase() == Phase::Grounded {
        let old = rig.channels;
        rig.step();
        // Until it knows, it says nothing, and flight flies the ladder.
        if rig.phase() == Phase::Grounded && rig.core.fills_channels() {
            assert_eq!(old.arm, 1);
        }
        silent += 1;
        assert!(silent < 20, "never took over");
    }
    rig.run(4.0);
    assert_eq!(rig.phase(), Phase::Hover);
    assert!(rig.armed && (rig.height - 1.2).abs() < 0.15, "{}", rig.height);
}

#[test]
fn a_controller_that_disarmed_by_itself_is_not_fought() {
    let mut rig = Rig::new(6);
    rig.take_off();
    rig.run(2.0);
    rig.will_arm = false;
    rig.armed = false;
    rig.run(3.0);
    assert_eq!(rig.phase(), Phase::Grounded);
    assert_eq!(rig.channels.arm, 0);
    assert!(rig.core.sentence().contains("disarmed by itself"));
}
