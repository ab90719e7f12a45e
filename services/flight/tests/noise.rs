//! A line that loses, doubles and changes bytes, as UARTs beside motor wires do.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;
mod rig;

use airframe::controller::Firmware;
use common::{Controller, MS, Pilot, World};
use ipc_types::Ladder;
use rig::Rig;
use std::collections::VecDeque;

#[test]
fn attitudes_are_asked_for_though_the_last_was_not_answered() {
    let mut world = World::airborne(1.2);
    world.run(1_000);
    world.controller.mute = true;
    world.run(150);
    let asked = world
        .controller
        .log
        .iter()
        .filter(|c| matches!(c.code, 108 | 230) && c.at > world.now - 150 * MS)
        .count();
    assert!(asked >= 4, "{asked} in 150 ms");
}

#[test]
fn a_byte_lost_on_the_way_costs_one_command_and_not_two() {
    let mut rig = Rig::hovering(Firmware::Betaflight2025_12);
    let (sent, handled) = (rig.commands.len(), rig.flight.controller().commands_handled());
    let mut frames = 0;
    // Every fifth frame of channels loses its throttle's first byte; its own check byte then is taken for the rest of it.
    rig.spoil = Some(Box::new(move |to, mut bytes| {
        if to && bytes.len() > 20 && bytes[4] == 200 {
            frames += 1;
            if frames % 5 == 0 {
                bytes.remove(12);
            }
        }
        bytes
    }));
    rig.run(10.0);
    let (sent, handled) = (rig.commands.len() - sent, rig.flight.controller().commands_handled() - handled);
    let lost = sent as i64 - handled as i64;
    // 50 a second, of which every fifth: 100; one more or less is still on its way.
    assert!((98..=102).contains(&lost), "{lost} of {sent}");
    rig.expect_hover();
}

/// xorshift64*: bytes that are hit are the same in every run.
fn hit(state: &mut u64, one_in: u64) -> bool {
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33).is_multiple_of(one_in)
}

#[test]
fn one_byte_in_a_hundred_leaves_attitudes_enough_to_fly_by() {
    let kinds: [fn(&mut Vec<u8>, u8); 3] =
        [|_, _| (), |out, byte| out.extend([byte, byte]), |out, byte| out.push(byte ^ 0x10)];
    for firmware in Firmware::ALL {
        for (kind, spoilt) in kinds.into_iter().enumerate() {
            let mut rig = Rig::hovering(firmware);
            let mut state = 0x5eed + kind as u64;
            rig.spoil = Some(Box::new(move |_, bytes| {
                let mut out = Vec::new();
                for byte in bytes {
                    if hit(&mut state, 100) { spoilt(&mut out, byte) } else { out.push(byte) }
                }
                out
            }));
            let before = rig.attitudes.len();
            rig.run(20.0);
            let told = &rig.attitudes[before..];
            let name = firmware.name();
            // Thirty a second are asked for, and in the worst case (46 bytes there and back) 63 % come through.
            assert!(told.len() > 300, "{name} {kind}: {} in 20 s", told.len());
            let gap = told.windows(2).map(|w| w[1].sampled_ns - w[0].sampled_ns).max().unwrap();
            // One in five is lost (24 bytes there and back), and a damaged length makes the controller swallow 128 bytes, 90 ms.
            assert!(gap < 300 * MS, "{name} {kind}: {} ms without attitude", gap / MS);
            let tilted = told.iter().map(|a| a.roll_rad.abs().max(a.pitch_rad.abs())).fold(0.0, f32::max);
            assert!(tilted.to_degrees() < 15.0, "{name} {kind}: {} degrees", tilted.to_degrees());
            rig.expect_hover();
        }
    }
}

#[test]
fn an_attitude_of_nobody_is_not_told() {
    let mut world = World::new(Controller::new());
    world.run(1_000);
    for _ in 0..20 {
        world.controller.attitude = [0, 700, 0];
        // One answer is given in this time, or none.
        world.run(30);
        world.controller.attitude = [0; 3];
        world.run(200);
    }
    let tilted = world.attitudes.iter().filter(|a| a.pitch_rad > 0.1).count();
    assert_eq!(tilted, 0);
    assert!(world.state().refused >= 10, "{} were held back", world.state().refused);
    // One that stays is true after all.
    world.controller.attitude = [0, 700, 0];
    world.run(200);
    assert!(world.attitudes.last().unwrap().pitch_rad > 1.2);
}

/// Roll, pitch, throttle and yaw that the controller has, in its order: roll, pitch, yaw, throttle.
fn sticks(world: &World) -> [u16; 4] {
    [world.controller.rc[0], world.controller.rc[1], world.controller.rc[3], world.controller.rc[2]]
}

#[test]
fn without_attitude_it_is_level_and_then_comes_down_though_the_pilot_speaks() {
    let mut world = World::airborne(1.2);
    world.run(1_000);
    assert_eq!(sticks(&world), [1530, 1500, 1450, 1500]);
    world.controller.mute = true;
    world.run(250);
    assert_eq!(sticks(&world), [1530, 1500, 1450, 1500], "a gap is a gap");
    world.run(100);
    // What the pilot learns of the trim from now on is nonsense.
    world.pilot = Some(Pilot { level_roll: 1580.0, ..Pilot::HOVER });
    world.run(100);
    assert_eq!(sticks(&world), [1504, 1500, 1450, 1500]);
    assert_eq!(world.state().ladder, Ladder::Level.code());
    assert!(world.reason().contains("too late or not at all"), "{}", world.reason());
    // It is told again: the pilot is followed again.
    world.controller.mute = false;
    world.run(200);
    assert_eq!(sticks(&world), [1530, 1500, 1450, 1500]);
    assert_eq!(world.state().ladder, Ladder::Following.code());
    world.controller.mute = true;
    world.run(1_200);
    assert_eq!((sticks(&world)[0], world.state().ladder), (1580, Ladder::Descend.code()));
    world.run(1_000);
    assert!(world.vz < -0.4, "it drifts, and comes down at {} m/s only", -world.vz);
    world.run(8_000);
    assert!(!world.controller.armed && world.z < 0.01, "{} m, {}", world.z, world.reason());
    let impact = world.impact.unwrap();
    assert!(impact < 0.7, "{impact} m/s");
    // And stays there whatever the pilot wants.
    world.controller.mute = false;
    world.run(3_000);
    assert!(!world.controller.armed);
}

#[test]
fn on_the_ground_a_silent_controller_changes_nothing() {
    let mut world = World::new(Controller::new());
    world.pilot = Some(Pilot { arm: true, ..Pilot::IDLE });
    world.run(3_000);
    assert!(world.controller.armed, "{}", world.reason());
    world.controller.mute = true;
    world.run(3_000);
    assert!(world.controller.armed);
    assert_eq!(world.state().ladder, Ladder::Following.code());
}

/// Both ways later by so many ticks of 5 ms.
fn delayed(ticks: usize) -> rig::Spoil {
    let mut held = [VecDeque::new(), VecDeque::new()];
    Box::new(move |to, bytes| {
        let way = &mut held[usize::from(to)];
        way.push_back(bytes);
        if way.len() > ticks { way.pop_front().unwrap() } else { Vec::new() }
    })
}

#[test]
fn a_line_too_slow_to_fly_by_is_come_down_by_and_a_slower_one_is_flown() {
    let mut rig = Rig::hovering(Firmware::Betaflight2025_12);
    rig.spoil = Some(delayed(6));
    rig.run(5.0);
    rig.expect_hover();
    let (told, now) = (rig.attitudes.last().unwrap(), rig.now());
    // 30 ms on the way back, some ms on the wire, and up to 33 since it came.
    let age_ms = (now - told.sampled_ns) / MS;
    assert!((25..90).contains(&age_ms), "{age_ms} ms");
    assert_eq!(rig.core.state(now).ladder, Ladder::Following.code());

    rig.spoil = Some(delayed(30));
    rig.run(1.5);
    assert_eq!(rig.core.state(rig.now()).ladder, Ladder::Descend.code(), "{}", rig.reason());
    let mut fastest = 0.0_f32;
    for _ in 0..200 {
        rig.run(0.05);
        if rig.height_m() > 0.02 {
            fastest = -rig.flight.truth().velocity_m_s[2].min(0.0);
        }
    }
    assert!(rig.height_m() < 0.05 && !rig.armed(), "{} m, {}", rig.height_m(), rig.reason());
    assert!(fastest < 0.7, "{fastest} m/s");
}
