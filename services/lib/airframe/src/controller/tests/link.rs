//! Arming, loss of the link, failsafe.

use super::*;

#[test]
fn arming_follows_the_rules_in_order() {
    for seed in 0..6 {
        let mut bench = Bench::new(seed, 0.0, FailsafeSettings::default());
        bench.run(0.5);
        assert_ne!(bench.blocks() & block_rx(), 0);
        bench.send(&IDLE);
        let cleared = bench.until(2.0, |b| b.blocks() & block_rx() == 0).expect("loss clears");
        assert!((0.48..=0.62).contains(&cleared), "RXLOSS cleared after {cleared}");
        let grace = bench.until(6.0, |b| b.blocks() == 0).expect("nothing in the way");
        let age = bench.now as f64 * 1e-9;
        assert!((4.99..5.06).contains(&age), "{grace} {age}");
        bench.send(&ARM);
        let armed = bench.until(1.0, |b| b.controller.is_armed()).expect("arms");
        assert!(armed <= 0.16, "armed after {armed}, {seed}");
        bench.send(&IDLE);
        let disarmed = bench.until(1.0, |b| !b.controller.is_armed()).expect("disarms");
        assert!(disarmed < 0.1);
    }
}

fn block_rx() -> u32 {
    1 << 2
}

#[test]
fn the_arm_switch_latches_until_it_goes_low() {
    let mut bench = Bench::new(2, 0.0, FailsafeSettings::default());
    bench.send(&ARM);
    bench.run(7.0);
    assert!(!bench.controller.is_armed());
    assert_eq!(bench.blocks(), 1 << 28, "only the latch is left");
    let status = bench.ask(101, &[]).1;
    assert_eq!(status[16], 29, "flag count");
    assert_eq!(u32::from_le_bytes([status[17], status[18], status[19], status[20]]) & 1 << 28, 1 << 28);
    bench.send(&IDLE);
    bench.run(1.0);
    assert_eq!(bench.blocks(), 0);
    // With throttle up, the switch latches again.
    let mut high = ARM;
    high[2] = 1200;
    bench.send(&high);
    bench.run(0.5);
    assert!(!bench.controller.is_armed());
    bench.send(&ARM);
    bench.run(0.5);
    assert!(!bench.controller.is_armed(), "still latched");
    bench.send(&IDLE);
    bench.run(0.2);
    bench.send(&ARM);
    bench.run(0.2);
    assert!(bench.controller.is_armed());
}

#[test]
fn frames_that_stop_are_held_then_it_falls_and_disarms() {
    for seed in 0..4 {
        let mut bench = Bench::armed(seed, FailsafeSettings::default());
        bench.hover(3.0, 14.0);
        // A gap of 250 ms is flown through.
        bench.channels = None;
        bench.run(0.25);
        let m = bench.craft.motion();
        assert!(m.velocity.z > -0.5, "held for 250 ms: {:?}", m.velocity);
        bench.hover(3.0, 3.0);
        bench.channels = None;
        let start = bench.now;
        let age = |b: &Bench| (b.now - start) as f64 * 1e-9;
        bench.until(1.0, |b| b.controller.motors_us[..4].iter().all(|m| *m < 1250)).expect("throttle drops");
        let dropped = age(&bench);
        assert!((0.27..0.40).contains(&dropped), "dropped after {dropped}");
        bench.run(0.15);
        assert!(bench.craft.motion().velocity.z < -0.7, "{:?}", bench.craft.motion().velocity);
        bench.until(3.0, |b| !b.controller.is_armed()).expect("disarms");
        let disarmed = age(&bench);
        assert!((1.48..1.56).contains(&disarmed), "disarmed after {disarmed}");
        assert_ne!(bench.blocks() & 1 << 1, 0, "FAILSAFE stands in the way");
        // The arm switch still up: nothing. Down for more than 1.2 s: it arms again.
        bench.send(&ARM);
        bench.run(2.0);
        assert!(!bench.controller.is_armed());
        bench.send(&IDLE);
        bench.run(1.4);
        bench.send(&ARM);
        bench.run(0.16);
        assert!(bench.controller.is_armed() || bench.craft.motion().tilt() > 0.4, "{:#x}", bench.blocks());
    }
}

#[test]
fn the_mitigation_holds_the_throttle_and_descends_level() {
    let mut bench = Bench::armed(6, FailsafeSettings::default());
    let hover = bench.hover(2.0, 12.0);
    let mut bench = Bench::armed(6, FailsafeSettings::level_descent(hover as u16 - 25));
    bench.hover(2.0, 12.0);
    bench.channels = None;
    bench.run(1.0);
    assert!(bench.craft.motion().position.z > 1.3, "{:?}", bench.craft.motion().position);
    let landed = bench.until(8.0, |b| b.craft.touching());
    assert!(landed.is_some(), "{:?}", bench.craft.motion());
    assert!(bench.craft.motion().tilt() < 0.3);
    bench.until(25.0, |b| !b.controller.is_armed()).expect("motors off at the landing time");
}

#[test]
fn an_out_of_range_flight_channel_is_a_lost_link_and_aux_keeps_its_value() {
    let mut bench = Bench::armed(7, FailsafeSettings::default());
    bench.hover(2.0, 10.0);
    let last = bench.channels.clone().unwrap();
    let mut bad = last.clone();
    bad[0] = 2116;
    bench.send(&bad);
    bench.run(0.14);
    assert!(!bench.controller.receiver.is_lost());
    bench.run(0.1);
    assert!(bench.controller.receiver.is_lost(), "one bad stick loses the whole link");
    assert_eq!(bench.controller.receiver.values()[0], last[0], "held");
    bench.run(0.15);
    assert_eq!(bench.controller.receiver.values()[0], 1500, "centred after 300 ms");
    assert_eq!(bench.controller.receiver.values()[3], last[2], "the good channels are still followed");
    // Four channels only: AUX is held, it stays armed. 2115 and 885 are in range.
    bench.send(&last[..4]);
    bench.run(1.0);
    assert!(bench.controller.is_armed() && !bench.controller.receiver.is_lost());
    let mut aux = last;
    aux[4] = 5000;
    bench.send(&aux);
    bench.run(0.5);
    assert!(bench.controller.is_armed() && !bench.controller.receiver.is_lost());
}

#[test]
fn the_link_is_good_at_10_hz_and_lost_at_6_hz() {
    for (period_ms, lost) in [(20, false), (100, false), (170, true)] {
        let mut bench = Bench::new(8, 0.0, FailsafeSettings::default());
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
        assert!(if lost { share > 0.9 } else { share == 0.0 }, "{period_ms} ms: lost {share}");
    }
}
