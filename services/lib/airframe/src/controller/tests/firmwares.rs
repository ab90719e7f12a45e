//! What the firmwares differ in, measured from outside, against FACTS 1.

use super::*;

/// Message, and its length with Betaflight 4.5, 2025.12, 2026.12, INAV 9.1 (the table of FACTS 1) and the Flip32 (thesis,
/// table 3.3; what it leaves out by its firmware's sources). -1: refused.
const LENGTHS: [(u8, [i32; 5]); 19] = [
    (1, [3, 3, 3, 3, 3]),
    (2, [4, 4, 4, 4, 4]),
    (3, [3, 13, 19, 3, 3]),
    (36, [4, 4, 4, 4, 4]),
    (44, [38, 39, 39, 24, 22]),
    (64, [8, 8, 8, 4, 8]),
    (75, [8, 8, 8, 20, 8]),
    (77, [54, 54, 54, -1, 54]),
    (101, [24, 25, 27, 11, 21]),
    (102, [18, 18, 18, 18, 18]),
    (104, [16, 16, 16, 16, 16]),
    (105, [36, 36, 36, 68, 36]),
    (108, [6, 6, 6, 6, 6]),
    (109, [6, 6, 6, 10, 6]),
    (110, [9, 9, 9, 7, 7]),
    (150, [24, 25, 27, 16, 21]),
    (100, [-1, -1, -1, -1, -1]),
    (133, [-1, -1, -1, -1, -1]),
    (254, [-1, -1, -1, -1, -1]),
];

#[test]
fn payloads_have_the_lengths_of_the_table() {
    for (index, firmware) in Firmware::ALL.into_iter().enumerate() {
        let mut bench = Bench::with(firmware, 1, 0.0, FailsafeSettings::factory(firmware));
        bench.send(&IDLE);
        bench.run(0.1);
        for (code, lengths) in LENGTHS {
            let (direction, payload) = bench.ask(code, &[]);
            let told = if direction == b'>' { payload.len() as i32 } else { -1 };
            assert_eq!(told, lengths[index], "{}: message {code}", firmware.name());
        }
        // One command more than fits is an error, and no acknowledgement carries anything.
        let most = if firmware == Firmware::Inav9_1 { 34 } else { 18 };
        assert_eq!(bench.ask(200, &[0xdc, 5].repeat(most)), (b'>', vec![]), "{}", firmware.name());
        assert_eq!(bench.ask(200, &[0xdc, 5].repeat(most + 1)), (b'!', vec![]), "{}", firmware.name());
        let several = if bench.controller.personality.answers_several { b'>' } else { b'!' };
        assert_eq!(bench.ask(230, &[108, 102]).0, several, "{}", firmware.name());
    }
}

#[test]
fn they_say_who_they_are() {
    let said = Firmware::ALL.map(|firmware| {
        let mut bench = Bench::with(firmware, 1, 0.0, FailsafeSettings::factory(firmware));
        bench.run(0.1);
        let version = bench.ask(3, &[]).1;
        (String::from_utf8(bench.ask(2, &[]).1).unwrap(), version)
    });
    let expected: [(&str, &[u8]); 5] = [
        ("BTFL", &[4, 5, 6]),
        ("BTFL", b"\x19\x0c\x06\x092025.12.6"),
        ("BTFL", b"\x1a\x0c\x00\x0f2026.12.0-alpha"),
        ("INAV", &[9, 1, 0]),
        ("BTFL", &[3, 2, 5]),
    ];
    for ((variant, version), (wanted, numbers)) in said.iter().zip(expected) {
        assert_eq!((variant.as_str(), version.as_slice()), (wanted, numbers));
    }
}

#[test]
fn channels_are_untold_before_a_receiver_is_known() {
    for (firmware, before) in Firmware::ALL.into_iter().zip([36, 36, 0, 0, 36]) {
        let mut bench = Bench::with(firmware, 1, 0.0, FailsafeSettings::factory(firmware));
        bench.run(0.1);
        let (direction, empty) = bench.ask(105, &[]);
        assert_eq!((direction, empty.len()), (b'>', before), "{}", firmware.name());
        bench.send(&IDLE);
        bench.run(0.2);
        assert!(bench.ask(105, &[]).1.len() >= 36, "{}", firmware.name());
    }
}

#[test]
fn the_arm_switch_is_the_last_flag_wherever_there_are_any() {
    for (firmware, bit) in Firmware::ALL.into_iter().zip([Some(25), Some(28), Some(29), None, Some(16)]) {
        let mut bench = Bench::with(firmware, 2, 0.0, FailsafeSettings::factory(firmware));
        bench.send(&ARM);
        bench.run(7.0);
        assert!(!bench.controller.is_armed(), "{}: it went up too early", firmware.name());
        let status = bench.ask(101, &[]).1;
        match bit {
            Some(bit) => {
                assert_eq!(u32::from(status[16]), bit + 1, "{}", firmware.name());
                let flags = u32::from_le_bytes([status[17], status[18], status[19], status[20]]);
                assert_eq!(flags, 1 << bit, "{}", firmware.name());
            }
            // The lower half of INAV's own word, in MSP_STATUS_EX.
            None => {
                let more = bench.ask(150, &[]).1;
                assert_eq!(u16::from_le_bytes([more[13], more[14]]), 1 << 14);
            }
        }
        bench.send(&IDLE);
        bench.run(1.0);
        bench.send(&ARM);
        let armed = bench.until(1.0, |b| b.controller.is_armed()).expect("arms");
        // 135 ms of FACTS 1, up to 20 ms to the next frame, and the frame's own way.
        assert!(armed <= 0.18, "{}: armed after {armed}", firmware.name());
        // ARM is a mode like any other: its bit stands where BOXIDS says.
        let place = bench.ask(119, &[]).1.iter().position(|id| *id == 0).unwrap();
        let status = bench.ask(101, &[]).1;
        let modes = u32::from_le_bytes([status[6], status[7], status[8], status[9]]);
        assert_ne!(modes & 1 << place, 0, "{}", firmware.name());
    }
}

#[test]
fn the_flip32_does_not_hear_version_two() {
    for firmware in Firmware::ALL {
        let mut bench = Bench::with(firmware, 1, 0.0, FailsafeSettings::factory(firmware));
        bench.controller.write(0, b"$X<\x00\x77\x00\x00\x00\xee");
        bench.run(0.1);
        assert_eq!(bench.received.is_empty(), firmware == Firmware::Flip32, "{}", firmware.name());
    }
}

/// FACTS 1: no loss at 10 Hz and more, always lost at 6 Hz and less (the trigger of INAV, 200 ms, is longer than that).
#[test]
fn the_least_rate_of_frames() {
    for firmware in Firmware::ALL {
        let slow = if firmware == Firmware::Inav9_1 { 230 } else { 170 };
        for (period_ms, lost) in [(20, false), (100, false), (slow, true)] {
            let mut bench = Bench::with(firmware, 8, 0.0, FailsafeSettings::factory(firmware));
            let frame = v1(200, &IDLE.iter().flat_map(|c| c.to_le_bytes()).collect::<Vec<u8>>());
            let mut losses = 0;
            for ms in 0..8000_u64 {
                if ms.is_multiple_of(period_ms) {
                    bench.controller.write(bench.now, &frame);
                }
                bench.step();
                losses += u64::from(ms > 2000 && bench.controller.receiver.is_lost());
            }
            let share = losses as f64 / 6000.0;
            assert!(
                if lost { share > 0.5 } else { share == 0.0 },
                "{}, {period_ms} ms: {share}",
                firmware.name()
            );
        }
    }
}

/// With the tilt that each asks for by its own curve, all of them hover alike.
#[test]
fn all_hover_through_msp_bytes_alone() {
    for firmware in Firmware::ALL {
        let mut bench = Bench::armed_with(firmware, 3, FailsafeSettings::factory(firmware));
        let throttle = bench.hover(1.2, 16.0);
        let m = bench.craft.motion();
        assert!((m.position.z - 1.2).abs() < 0.15, "{}: {:?}", firmware.name(), m.position);
        assert!(m.position.x.hypot(m.position.y) < 0.6, "{}: {:?}", firmware.name(), m.position);
        assert!((1400.0..1620.0).contains(&throttle), "{}: hover throttle {throttle}", firmware.name());
        bench.send(&IDLE);
        bench.until(0.2, |b| !b.controller.is_armed()).expect("disarms");
    }
}

#[test]
fn without_a_magnetometer_the_heading_is_its_own() {
    let headings = |magnetometer: bool| {
        let mut bench = Bench::new(4, 0.0, FailsafeSettings::default());
        bench.compass = Compass::undisturbed(1.0);
        if !magnetometer {
            bench.controller = bench.controller.clone().without_magnetometer();
        }
        bench.run(1.0);
        // A magnet comes near: whoever has a compass follows it.
        bench.compass = Compass::undisturbed(2.0);
        bench.run(15.0);
        let sensors = bench.ask(101, &[]).1[4];
        (bench.controller.attitude().2, sensors & 4 != 0)
    };
    let (with, told) = headings(true);
    assert!((with - 2.0).abs() < 0.05 && told, "{with}");
    let (without, told) = headings(false);
    assert!((without - 1.0).abs() < 0.05 && !told, "{without}");
}
