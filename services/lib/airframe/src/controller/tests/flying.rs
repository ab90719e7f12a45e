//! What the loops and the attitude do in the air.

use super::*;

#[test]
fn it_hovers_through_msp_bytes_alone_at_a_plausible_throttle() {
    let mut bench = Bench::armed(3, FailsafeSettings::default());
    let throttle = bench.hover(1.2, 20.0);
    let m = bench.craft.motion();
    assert!((m.position.z - 1.2).abs() < 0.15, "{:?}", m.position);
    assert!(m.position.x.hypot(m.position.y) < 0.6, "{:?}", m.position);
    assert!((1400.0..1600.0).contains(&throttle), "hover throttle {throttle}");
    let analog = bench.ask(110, &[]).1;
    assert!((140..=168).contains(&analog[0]), "{analog:?}");
    let amps = f64::from(i16::from_le_bytes([analog[5], analog[6]])) / 100.0;
    assert!((6.0..16.0).contains(&amps), "{amps}");
}

#[test]
fn a_tilt_step_answers_in_a_fraction_of_a_second() {
    let mut bench = Bench::armed(3, FailsafeSettings::default());
    let throttle = bench.hover(2.0, 12.0).round() as u16;
    // 8 degrees of roll.
    let channels = [
        1500 + stick(&BETAFLIGHT_2025_12.stick, 8.0_f64.to_radians()).round() as u16,
        1500,
        throttle,
        1500,
        2000,
        2000,
    ];
    bench.send(&channels);
    let start = bench.now;
    let half = bench.until(1.0, |b| b.craft.motion().angles().0.to_degrees() > 0.63 * 8.0);
    let told = half.expect("it rolls");
    assert!((0.06..0.35).contains(&told), "63 % after {told}");
    bench.run(0.6 - (bench.now - start) as f64 * 1e-9);
    let roll = bench.craft.motion().angles().0.to_degrees();
    assert!((7.0..11.0).contains(&roll), "{roll}");
}

/// The thesis's airframe has 2.9 times the inertia and 1.5 times the leverage of watchman's: by the firmware's default
/// numbers it overshoots what the sticks ask for; by those that its file has, it follows them.
#[test]
fn a_heavy_aircraft_needs_its_own_numbers() {
    let greatest = |pid_scale: Option<f32>| {
        let mut vehicle = crate::testing::thesis();
        vehicle.motors.pid_scale = pid_scale.unwrap_or(vehicle.motors.pid_scale);
        let firmware = Firmware::Betaflight2025_12;
        let mut bench = Bench::on(&vehicle, firmware, 5, 0.0, FailsafeSettings::default()).arm();
        let throttle = bench.hover(2.0, 6.0).round() as u16;
        let lean = stick(&BETAFLIGHT_2025_12.stick, 8.0_f64.to_radians()).round() as u16;
        bench.send(&[1500 + lean, 1500, throttle, 1500, 2000, 2000]);
        let mut greatest = 0.0_f64;
        for _ in 0..80 {
            bench.run(0.01);
            greatest = greatest.max(bench.craft.motion().angles().0.to_degrees());
        }
        greatest
    };
    let (tuned, default) = (greatest(None), greatest(Some(1.0)));
    assert!(tuned < 11.0, "{tuned} degrees for 8");
    assert!(default - 8.0 > 1.5 * (tuned - 8.0), "{default} degrees for 8 by the default numbers, {tuned}");
}

/// FACTS 1: -10.7 told for a true -13.5 after 1.2 s of acceleration. Here: told less than true by a
/// sixth to a third.
#[test]
fn attitude_is_wrong_under_acceleration_within_bounds() {
    let mut bench = Bench::armed(4, FailsafeSettings::default());
    let throttle = bench.hover(3.0, 14.0).round() as u16 + 10;
    bench.send(&[
        1500,
        1500 + stick(&BETAFLIGHT_2025_12.stick, 11.0_f64.to_radians()).round() as u16,
        throttle,
        1500,
        2000,
        2000,
    ]);
    bench.run(1.2);
    let truth = bench.craft.motion().angles().1.to_degrees();
    let told = bench.controller.attitude().1.to_degrees();
    assert!(truth > 10.0, "{truth}");
    assert!((0.67..0.9).contains(&(told / truth)), "told {told}, true {truth}");
    let answer = bench.ask(108, &[]).1;
    let tenths = i16::from_le_bytes([answer[2], answer[3]]);
    assert!(tenths > 50, "nose down is positive: {tenths}");
}

#[test]
fn yaw_stick_turns_clockwise_at_the_measured_rate() {
    let mut bench = Bench::armed(5, FailsafeSettings::default());
    let throttle = bench.hover(2.0, 12.0).round() as u16;
    let before = bench.craft.motion().angles().2;
    bench.send(&[1500, 1500, throttle, 1700, 2000, 2000]);
    bench.run(1.2);
    let turned = (before - bench.craft.motion().angles().2).to_degrees().rem_euclid(360.0);
    // FACTS 1: +200 us turns about 135 degrees in 1.2 s.
    assert!((115.0..155.0).contains(&turned), "{turned}");
}
