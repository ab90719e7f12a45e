//! Golden bytes, computed by hand, and the payload lengths of the firmwares in FACTS 1.
#![allow(clippy::unwrap_used, reason = "tests")]

use msp::messages::*;
use msp::{
    Decoder, Direction, EncodeError, Request, Version, crc8_dvb_s2, encode, encode_request, parse_reply,
};

fn written<R: Request>(version: Version, request: &R) -> Vec<u8> {
    let mut out = [0; 128];
    let length = encode_request(&mut out, version, request).unwrap();
    out[..length].to_vec()
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

#[test]
fn requests_without_payload() {
    assert_eq!(written(Version::V1, &Motor), hex("24 4d 3c 00 68 68"));
    assert_eq!(written(Version::V1, &Rc), hex("24 4d 3c 00 69 69"));
    assert_eq!(written(Version::V1, &Attitude), hex("24 4d 3c 00 6c 6c"));
    assert_eq!(written(Version::V1, &Analog), hex("24 4d 3c 00 6e 6e"));
    assert_eq!(written(Version::V1, &Status), hex("24 4d 3c 00 65 65"));
    // The published example of the version 2 specification: MSP_IDENT, 100, is 24 58 3c 00 64 00 00 00 8f.
    let mut out = [0; 16];
    let length = encode(&mut out, Version::V2, Direction::Request, 100, &[]).unwrap();
    assert_eq!(out[..length], hex("24 58 3c 00 64 00 00 00 8f"));
}

#[test]
fn the_check_value_of_the_crc() {
    // The catalogue's check value of CRC-8/DVB-S2 over the digits 1 to 9.
    assert_eq!(crc8_dvb_s2(b"123456789"), 0xbc);
}

#[test]
fn channels_in_both_framings() {
    let channels = SetRawRc::new(&[1500, 1500, 1000, 1500, 2000]).unwrap();
    // 1500 = 05dc, 1000 = 03e8, 2000 = 07d0; XOR of 0a c8 dc 05 dc 05 e8 03 dc 05 d0 07.
    assert_eq!(written(Version::V1, &channels), hex("24 4d 3c 0a c8 dc 05 dc 05 e8 03 dc 05 d0 07 27"));
    let second = written(Version::V2, &channels);
    assert_eq!(second[..18], hex("24 58 3c 00 c8 00 0a 00 dc 05 dc 05 e8 03 dc 05 d0 07"));
    assert_eq!(second[18], bitwise_crc(&second[3..18]));
}

/// The definition, bit by bit: x^8 + x^7 + x^6 + x^4 + x^2 + 1.
fn bitwise_crc(bytes: &[u8]) -> u8 {
    let mut register = 0u32;
    for bit in bytes.iter().flat_map(|byte| (0..8).rev().map(move |i| u32::from(byte >> i & 1))) {
        register = (register << 1) ^ (bit << 8);
        if register & 0x100 != 0 {
            register ^= 0x1d5;
        }
    }
    register as u8
}

#[test]
fn an_attitude_reply_of_version_one() {
    // roll +12.5, pitch -3.0, yaw 270: 7d 00 e2 ff 0e 01; XOR of 06 6c 7d 00 e2 ff 0e 01.
    let mut decoder = Decoder::<64>::new();
    let mut read = None;
    decoder.feed(&hex("24 4d 3e 06 6c 7d 00 e2 ff 0e 01 05"), |frame| {
        assert_eq!((frame.direction, frame.code), (Direction::Reply, 108));
        read = Some(parse_reply(&Attitude, frame.payload).unwrap());
    });
    let expected = AttitudeReply { roll_decidegrees: 125, pitch_decidegrees: -30, yaw_degrees: 270 };
    assert_eq!(read, Some(expected));
}

#[test]
fn a_refusal_is_a_frame_with_its_own_direction() {
    let mut decoder = Decoder::<64>::new();
    let mut read = Vec::new();
    decoder.feed(&hex("24 4d 21 00 64 64"), |frame| read.push((frame.direction, frame.code)));
    assert_eq!(read, [(Direction::Refusal, 100)]);
}

#[test]
fn analog_of_seven_and_of_nine_bytes() {
    // 11.1 V, 850 mAh, rssi 512, 12.34 A (charging would be negative), then 11.14 V.
    let nine = hex("6f 52 03 00 02 d2 04 5a 04");
    let short = parse_reply(&Analog, &nine[..7]).unwrap();
    assert_eq!((short.decivolts, short.drawn_mah, short.rssi, short.centiamps), (111, 850, 512, 1234));
    assert_eq!(short.centivolts, None);
    assert!((short.volts() - 11.1).abs() < 1e-4);
    assert!((parse_reply(&Analog, &nine).unwrap().volts() - 11.14).abs() < 1e-4);
    assert!(parse_reply(&Analog, &nine[..6]).is_err());
}

#[test]
fn status_of_every_firmware() {
    // Betaflight 2025.12: 25 bytes, modes ARM + ANGLE, two more mode bytes would be announced by the count.
    let mut status = hex("7d 00 01 00 21 00 03 00 00 00 00 0c 00 03 00 00 1d 00 00 00 10 00 1e 00 00");
    let reply = parse_reply(&Status, &status).unwrap();
    assert_eq!((reply.cycle_us, reply.modes, reply.load_percent), (125, 3, Some(12)));
    let arming = reply.arming.unwrap();
    assert_eq!((arming.count, arming.flags, arming.arm_switch()), (29, 1 << 28, Some(1 << 28)));
    assert!(reply.mode(0) && reply.mode(1) && !reply.mode(2) && !reply.mode(200));
    // 4.5: one byte shorter at the end; 2026.12: longer.
    assert!(parse_reply(&Status, &status[..24]).unwrap().arming.is_some());
    status.extend([0, 0]);
    assert_eq!(parse_reply(&Status, &status).unwrap().arming, Some(arming));
    // Two bytes of further modes: index 32 + 9.
    let more = hex("7d 00 01 00 21 00 01 00 00 00 00 0c 00 03 00 02 00 02 1d 00 00 00 00 00 1e 00");
    let reply = parse_reply(&Status, &more).unwrap();
    assert!(reply.mode(41) && !reply.mode(40) && reply.arming.is_some());
    // INAV: 11, and 16 for STATUS_EX, without the flags.
    for length in [11, 16] {
        let reply = parse_reply(&StatusEx, &status[..length]).unwrap();
        assert_eq!((reply.modes, reply.arming), (3, None));
    }
    assert!(parse_reply(&Status, &status[..10]).is_err());
    assert_eq!(Arming { count: 0, flags: 0 }.arm_switch(), None);
    assert_eq!(Arming { count: 200, flags: 0 }.arm_switch(), None);
}

#[test]
fn identities_with_tails() {
    assert_eq!(parse_reply(&FcVariant, b"BTFL").unwrap().letters, *b"BTFL");
    // 2025.12.6 says 25, 12, 6, then a length and a text.
    let version = parse_reply(&FcVersion, &hex("19 0c 06 09 32 30 32 35 2e 31 32 2e 36")).unwrap();
    assert_eq!((version.major, version.minor, version.patch), (25, 12, 6));
    assert_eq!(parse_reply(&ApiVersion, &[0, 1, 47]).unwrap().minor, 47);
    assert!(parse_reply(&ApiVersion, &[0, 1]).is_err());
    let map = parse_reply(&RxMap, &[0, 1, 3, 2]).unwrap();
    assert_eq!((map.count, &map.positions[..4]), (4, &[0, 1, 3, 2][..]));
    assert_eq!(parse_reply(&RxMap, &[0, 1, 3, 2, 4, 5, 6, 7, 9]).unwrap().count, 8);
    assert!(parse_reply(&RxMap, &[0, 1, 3]).is_err());
    assert_eq!(parse_reply(&BoxIds, &[0, 1, 27, 50]).unwrap().ids, [0, 1, 27, 50]);
    let names: Vec<&str> = parse_reply(&BoxNames, b"ARM;ANGLE;\xff;FAILSAFE;").unwrap().names().collect();
    assert_eq!(names, ["ARM", "ANGLE", "", "FAILSAFE"]);
}

#[test]
fn channels_and_motors_of_any_length() {
    let rc: Vec<u8> = (0..18u16).flat_map(|i| (1000 + i).to_le_bytes()).collect();
    let reply = parse_reply(&Rc, &rc).unwrap();
    assert_eq!((reply.count, reply.channels_us[17]), (18, 1017));
    assert_eq!(parse_reply(&Rc, &[]).unwrap().count, 0);
    assert_eq!(parse_reply(&Rc, &[0; 68]).unwrap().count, 18);
    assert_eq!(parse_reply(&Motor, &rc[..16]).unwrap().motors_us[7], 1007);
    assert_eq!(parse_reply(&Motor, &rc[..8]).unwrap().motors_us, [1000, 1001, 1002, 1003, 0, 0, 0, 0]);
    assert!(parse_reply(&Motor, &rc[..6]).is_err());
    let altitude = parse_reply(&Altitude, &hex("9c ff ff ff f6 ff 01 02 03 04")).unwrap();
    assert_eq!((altitude.altitude_cm, altitude.climb_cm_s), (-100, -10));
    let failsafe = parse_reply(&FailsafeConfig, &hex("0f 0a e8 03 00 64 00 01")).unwrap();
    assert_eq!((failsafe.delay_deciseconds, failsafe.throttle_us, failsafe.procedure), (15, 1000, 1));
}

#[test]
fn orders_outside_the_range_cannot_be_made() {
    assert_eq!(SetMotor::new(&[1000; 9]), Err(Refusal::Count { count: 9, most: 8 }));
    assert_eq!(SetMotor::new(&[1000, 999]), Err(Refusal::Value { index: 1, value_us: 999 }));
    assert_eq!(SetMotor::new(&[2001]), Err(Refusal::Value { index: 0, value_us: 2001 }));
    assert_eq!(SetRawRc::new(&[1500; 19]), Err(Refusal::Count { count: 19, most: 18 }));
    assert!(SetRawRc::new(&[]).is_err() && SetRawRc::new(&[1500, 885]).is_err());
    assert_eq!(written(Version::V1, &SetMotor::new(&[1000; 4]).unwrap())[3..5], [8, 214]);
    assert!(Refusal::Count { count: 9, most: 8 }.to_string().contains("1..=8"));
    assert!(Refusal::Value { index: 1, value_us: 999 }.to_string().contains("1000..=2000"));
}

#[test]
fn sensor_frames() {
    let flow = FlowFrame { quality: 200, motion_x: -5, motion_y: 7 };
    let bytes = written(Version::V2, &flow);
    assert_eq!(bytes[..17], hex("24 58 3c 00 02 1f 09 00 c8 fb ff ff ff 07 00 00 00"));
    let range = RangeFrame { quality: 255, distance_mm: -1 };
    let mut decoder = Decoder::<64>::new();
    let mut read = None;
    decoder.feed(&written(Version::V2, &range), |frame| {
        assert_eq!(frame.code, RangeFrame::CODE);
        read = Some(<RangeFrame as msp::Layout>::read(&mut msp::Reader::new(frame.payload)).unwrap());
    });
    assert_eq!(read, Some(range));
}

#[test]
fn what_does_not_fit_is_said() {
    let mut small = [0; 8];
    assert_eq!(encode_request(&mut small, Version::V2, &Status), Err(EncodeError::NoRoom { room: 8 }));
    assert_eq!(
        encode_request(&mut small, Version::V1, &RangeFrame::default()),
        Err(EncodeError::CodeTooLarge { code: 0x1f01 })
    );
    let long = vec![0; 65_536];
    assert_eq!(
        encode(&mut [], Version::V2, Direction::Reply, 1, &long),
        Err(EncodeError::TooLong { length: 65_536 })
    );
    let mut out = [0; 300];
    let length = encode(&mut out, Version::V1, Direction::Reply, 116, &[7; 260]).unwrap();
    assert_eq!((length, &out[..7]), (268, &hex("24 4d 3e ff 74 04 01")[..]));
}

#[test]
fn attitude_and_accelerometer_in_one() {
    // MSP_MULTIPLE_MSP, 230 = e6, for 108 = 6c and 102 = 66.
    assert_eq!(written(Version::V1, &AttitudeAndImu), hex("24 4d 3c 02 e6 6c 66 ee"));
    // Roll 1.2 degrees, pitch -0.5, yaw 90; accelerometer 10 -20 512; gyroscope and compass behind it.
    let both = hex("06 0c 00 fb ff 5a 00 12 0a 00 ec ff 00 02 01 00 02 00 03 00 00 00 00 00 00 00");
    let reply = parse_reply(&AttitudeAndImu, &both).unwrap();
    let attitude = AttitudeReply { roll_decidegrees: 12, pitch_decidegrees: -5, yaw_degrees: 90 };
    assert_eq!(reply.attitude, attitude);
    assert_eq!(reply.imu, Some(RawImuReply { accelerometer: [10, -20, 512] }));
    // A board without an accelerometer answers nothing for it, and what does not fit is left out whole.
    for short in [&both[..7], &hex("06 0c 00 fb ff 5a 00 00")] {
        let reply = parse_reply(&AttitudeAndImu, short).unwrap();
        assert_eq!((reply.attitude, reply.imu), (attitude, None), "{short:02x?}");
    }
    for broken in [&both[..0], &both[..6], &both[..8], &both[..12], &hex("05 0c 00 fb ff 5a")] {
        assert!(parse_reply(&AttitudeAndImu, broken).is_err(), "{broken:02x?}");
    }
    // A byte of the attitude that was lost or came twice on the way, with the next frame's `$` at the end or without the
    // last byte: whatever the check byte says of it, this is no attitude.
    for at in 1..=6 {
        let (mut lost, mut doubled) = (both.clone(), both.clone());
        lost.remove(at);
        lost.push(b'$');
        doubled.insert(at, both[at]);
        doubled.pop();
        assert!(parse_reply(&AttitudeAndImu, &lost).is_err(), "lost {at}");
        assert!(parse_reply(&AttitudeAndImu, &doubled).is_err(), "doubled {at}");
    }
}
