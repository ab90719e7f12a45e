//! Cadence, order, identification, words, garbage and silence.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{Controller, MS, Pilot, World};
use flight::Config;
use ipc_types::{Ladder, LinkState};
use proptest::prelude::*;

fn in_window(world: &World, from: u64, to: u64, code: Option<u16>) -> usize {
    let counted = |c: &&common::Command| c.at > from && c.at <= to && code.is_none_or(|code| code == c.code);
    world.controller.log.iter().filter(counted).count()
}

#[test]
fn fifty_frames_and_at_most_ninety_commands_in_any_second() {
    let mut world = World::airborne(1.2);
    world.run(6_000);
    for start in (0..5_000).step_by(50).map(|ms| world.now - 6_000 * MS + ms * MS) {
        let all = in_window(&world, start, start + 1000 * MS, None);
        let frames = in_window(&world, start, start + 1000 * MS, Some(200));
        assert!(all <= 90, "{all}");
        assert!((49..=51).contains(&frames), "{frames}");
    }
    let per_second = |code| in_window(&world, world.now - 5_000 * MS, world.now, Some(code)) as f64 / 5.0;
    assert!(per_second(230) >= 28.5, "attitude and accelerometer {}", per_second(230));
    assert!(per_second(108) < 0.1, "the attitude alone {}", per_second(108));
    assert!((4.5..=5.5).contains(&per_second(101)), "status {}", per_second(101));
    assert!((1.5..=2.5).contains(&per_second(110)), "analog {}", per_second(110));
    // Nothing is asked twice that does not change.
    assert_eq!(in_window(&world, world.now - 5_000 * MS, world.now, Some(119)), 0);
    assert_eq!(world.state().refused, 0);
    assert_eq!(world.state().link, LinkState::Up.code());
    assert_eq!((world.state().variant, world.state().version[..3].to_vec()), (*b"BTFL", vec![25, 12, 6]));
}

#[test]
fn frames_go_on_at_fifty_without_the_pilot_too() {
    let mut world = World::new(Controller::new());
    world.run(4_000);
    let frames = in_window(&world, world.now - 3_000 * MS, world.now, Some(200));
    assert!((147..=153).contains(&frames), "{frames}");
    assert!(in_window(&world, world.now - 1_000 * MS, world.now, None) <= 90);
    assert_eq!(world.state().ladder, Ladder::Neutral.code());
    assert_eq!(world.controller.rc, [1500, 1500, 1500, 1000, 1000, 2000]);
}

#[test]
fn the_order_trap() {
    for map in [vec![0, 1, 3, 2], vec![1, 2, 3, 0], vec![2, 3, 0, 1, 4, 5, 6, 7]] {
        let mut controller = Controller::new();
        controller.map = map;
        let mut world = World::new(controller);
        world.pilot = Some(Pilot { roll: 1600, throttle: 1010, ..Pilot::IDLE });
        world.run(500);
        // As the controller understands them: roll, pitch, yaw, throttle, AUX1, AUX2.
        assert_eq!(world.controller.rc, [1600, 1500, 1500, 1010, 1000, 2000]);
    }
}

#[test]
fn an_order_that_makes_no_sense_is_said_and_never_armed_with() {
    let mut controller = Controller::new();
    controller.map = vec![0, 0, 3, 2, 4, 5, 6, 7];
    let mut world = World::new(controller);
    world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
    world.run(4_000);
    assert!(!world.controller.armed);
    assert!(world.reason().contains("channel order"), "{}", world.reason());
}

#[test]
fn the_accelerometer_comes_with_the_attitude_in_either_unit() {
    // 0.5 m/s2 forward, 1 to the right, one g up: in 512ths and in 256ths of g; half of it is a fall.
    let g = 9.806_65;
    for (read, felt) in [
        ([26, -52, 512], Some([26.0 / 512.0 * g, -52.0 / 512.0 * g, g])),
        ([13, -26, 256], Some([13.0 / 256.0 * g, -26.0 / 256.0 * g, g])),
        ([0, 0, 100], None),
        ([0, 0, 0], None),
        ([i16::MIN, i16::MAX, i16::MIN], None),
    ] {
        let mut controller = Controller::new();
        controller.accelerometer = Some(read);
        let mut world = World::new(controller);
        // Half a second of readings says which unit it is.
        world.run(1_500);
        let attitude = world.attitudes.last().unwrap();
        let force = [attitude.force_x_m_s2, attitude.force_y_m_s2, attitude.force_z_m_s2];
        match felt {
            Some(felt) => assert!(force.iter().zip(felt).all(|(a, b)| (a - b).abs() < 1e-3), "{force:?}"),
            None => assert!(force.iter().all(|axis| axis.is_nan()), "{read:?}: {force:?}"),
        }
    }
}

#[test]
fn a_firmware_that_answers_one_question_at_a_time_is_asked_for_the_attitude_alone() {
    // One that refuses, and one that knows no refusals.
    for sullen in [false, true] {
        let mut controller = Controller::new();
        (controller.accelerometer, controller.sullen) = (None, sullen);
        controller.attitude = [125, -30, 350];
        let mut world = World::new(controller);
        world.run(5_000);
        let from = world.now - 2_000 * MS;
        let alone = in_window(&world, from, world.now, Some(108));
        assert!(alone >= 30, "sullen {sullen}: {alone}");
        assert_eq!(in_window(&world, from, world.now, Some(230)), 0, "sullen {sullen}");
        let attitude = world.attitudes.last().unwrap();
        assert!((attitude.roll_rad.to_degrees() - 12.5).abs() < 1e-3 && attitude.force_x_m_s2.is_nan());
    }
}

#[test]
fn attitude_is_converted_and_dated() {
    let mut controller = Controller::new();
    controller.attitude = [125, -30, 350];
    let mut world = World::new(controller);
    world.pilot = Some(Pilot::IDLE);
    world.run(2_000);
    let attitude = world.attitudes.last().unwrap();
    assert!((attitude.roll_rad.to_degrees() - 12.5).abs() < 1e-3);
    assert!((attitude.pitch_rad.to_degrees() + 3.0).abs() < 1e-3);
    assert!((attitude.yaw_rad.to_degrees() - 10.0).abs() < 1e-3, "350 clockwise is 10 counter-clockwise");
    assert!(world.attitudes.windows(2).all(|w| w[0].sampled_ns < w[1].sampled_ns));
    let age = world.now - attitude.sampled_ns;
    assert!(age < 60 * MS, "{age}");
    assert!(world.powers >= 3);
}

#[test]
fn arming_follows_the_rules_and_modes_are_mapped_by_the_list_of_boxes() {
    let mut controller = Controller::new();
    controller.boxes = vec![1, 27, 0, 50];
    let mut world = World::new(controller);
    world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
    world.run(3_000);
    assert!(world.controller.armed, "{}", world.reason());
    assert_eq!((world.state().armed, world.state().modes & 1), (1, 1));
    // AUX1 was low with frames for 0.3 s before it went high.
    let raised = world.controller.frames().position(|f| f.payload[8..10] != [0xe8, 3]).unwrap();
    assert!(raised >= 14, "{raised} frames with the switch low");
    world.pilot = Some(Pilot::IDLE);
    world.run(60);
    assert!(!world.controller.armed, "disarming is immediate");
}

#[test]
fn it_says_in_words_why_the_controller_will_not_arm() {
    let mut controller = Controller::new();
    controller.booted = common::T0;
    controller.extra_blocks = 1 << 23;
    let mut world = World::new(controller);
    world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
    world.run(3_000);
    assert_eq!(world.reason(), "will not arm: still starting up, accelerometer not calibrated");
    assert!(world.controller.frames().all(|f| f.payload[8..10] == [0xe8, 3]), "AUX1 stays low meanwhile");
    world.controller.extra_blocks = 0;
    world.run(4_000);
    assert!(world.controller.armed && world.reason().is_empty(), "{}", world.reason());
}

#[test]
fn a_silent_controller_is_named_and_found_again() {
    let mut world = World::new(Controller::new());
    world.pilot = Some(Pilot::IDLE);
    world.run(1_000);
    world.controller.mute = true;
    world.run(2_500);
    assert_eq!(world.state().link, LinkState::Silent.code());
    assert!(world.reason().starts_with("no answer from the flight controller for"), "{}", world.reason());
    let now = world.now;
    let frames = in_window(&world, now - 1_000 * MS, now, Some(200));
    let asked = in_window(&world, now - 1_000 * MS, now, None) - frames;
    assert!(frames >= 49 && asked <= 6, "frames go on ({frames}), questions do not pile up ({asked})");
    world.controller.mute = false;
    world.run(1_500);
    assert_eq!(world.state().link, LinkState::Up.code());
}

#[test]
fn garbage_on_the_line_is_counted_and_named() {
    let mut world = World::new(Controller::new());
    world.pilot = Some(Pilot::IDLE);
    world.run(1_000);
    for i in 0..400u64 {
        world.core.receive(world.now, &[i as u8, 0x24, 0x4d, 0x3e, 0x02, 0x6c, 1, 2, 3]);
        world.run(5);
    }
    assert!(world.state().refused > 100);
    assert_eq!(world.state().link, LinkState::Up.code(), "answers between the garbage are still found");
    world.controller.mute = true;
    for _ in 0..400 {
        world.core.receive(world.now, b"U\x00\xffboot: 9600 baud");
        world.run(5);
    }
    assert_eq!(world.state().link, LinkState::Silent.code());
    assert!(world.reason().contains("not MSP"), "{}", world.reason());
}

#[test]
fn a_port_that_vanishes_and_returns_goes_on() {
    let mut world = World::new(Controller::new());
    world.pilot = Some(Pilot::IDLE);
    world.run(1_000);
    world.core.closed("/dev/ttyX: no such port");
    world.connected = false;
    world.run(700);
    assert_eq!(world.state().link, LinkState::Closed.code());
    assert_eq!(world.reason(), "port closed: /dev/ttyX: no such port");
    world.connected = true;
    world.core.opened(world.now);
    world.run(800);
    assert_eq!(world.state().link, LinkState::Up.code());
}

#[test]
fn the_override_profile_sends_four_sticks_and_asks_a_human_to_arm() {
    let mut world = World::override_profile(Controller::new());
    world.pilot = Some(Pilot { arm: true, throttle: 1200, on_ground: true, ..Pilot::IDLE });
    world.run(900);
    assert!(world.controller.frames().all(|f| f.payload.len() == 8));
    assert!(world.controller.frames().all(|f| f.payload[4..6] == [0xe8, 3]), "neutral first");
    world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
    world.run(1_000);
    assert!(
        world.reason().starts_with("arm with the radio") || world.reason().starts_with("not armed"),
        "{}",
        world.reason()
    );
    assert!(!world.controller.armed);
}

#[test]
fn version_one_framing_works_too() {
    let mut world = World::with(Controller::new(), &Config { msp_version: 1, ..Config::default() });
    world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
    world.run(3_000);
    assert!(world.controller.armed && world.state().link == LinkState::Up.code());
}

#[test]
fn messages_that_make_no_sense_are_not_followed() {
    let mut world = World::new(Controller::new());
    world.pilot = Some(Pilot::IDLE);
    world.run(500);
    let good = Pilot::IDLE.message(world.now);
    for bad in [
        ipc_types::Channels { count: 3, ..good },
        ipc_types::Channels { count: 19, ..good },
        ipc_types::Channels { arm: 2, ..good },
        ipc_types::Channels { channels_us: [999; 18], ..good },
        ipc_types::Channels {
            header: ipc_types::Header { stamp_ns: world.now + 1_000 * MS, ..good.header },
            ..good
        },
    ] {
        world.core.pilot(world.now, &bad);
    }
    assert_eq!(world.core.refused(), 5);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn never_a_value_out_of_range(
        channels in proptest::collection::vec(any::<u16>(), 18), count in 0u16..25, arm in 0u8..3,
        trim in any::<f32>(), hover in any::<f32>(), climb in any::<f32>(), height in any::<f32>(),
        near in proptest::bool::ANY)
    {
        let mut world = World::new(Controller::in_flight(1450));
        world.z = 1.0;
        let mut message = Pilot::HOVER.message(world.now);
        for (slot, value) in message.channels_us.iter_mut().zip(&channels) {
            *slot = if near { 1000 + value % 1001 } else { *value };
        }
        message.count = count;
        message.arm = arm;
        message.level_roll_us = trim;
        message.level_pitch_us = -trim;
        message.hover_throttle_us = hover;
        message.climb_m_s = climb;
        message.height_m = height;
        for _ in 0..10 {
            message.header.stamp_ns = world.now;
            message.expiry_ns = world.now + 100 * MS;
            world.core.pilot(world.now, &message);
            world.run(20);
        }
        // And down the whole ladder.
        world.run(1_500);
        prop_assert!(!world.controller.seen_out_of_range);
        prop_assert!(world.controller.frames().count() > 50);
    }
}
