//! Payloads, orders, framing, the serial task.

use super::*;

#[test]
fn payloads_have_the_lengths_of_the_table() {
    let mut bench = Bench::new(1, 0.0, FailsafeSettings::default());
    bench.run(0.1);
    // Column 2025.12.6 of FACTS 1.
    let lengths = [
        (1, 3),
        (2, 4),
        (3, 13),
        (101, 25),
        (150, 25),
        (102, 18),
        (104, 16),
        (105, 36),
        (108, 6),
        (109, 6),
        (110, 9),
        (44, 39),
        (64, 8),
        (75, 8),
    ];
    for (code, length) in lengths {
        let (direction, payload) = bench.ask(code, &[]);
        assert_eq!((direction, payload.len()), (b'>', length), "message {code}");
    }
    for unknown in [100, 133, 254] {
        assert_eq!(bench.ask(unknown, &[]), (b'!', vec![]), "message {unknown}");
    }
    assert_eq!(bench.ask(2, &[]).1, b"BTFL");
    assert_eq!(bench.ask(3, &[]).1[..4], [25, 12, 6, 9]);
    assert_eq!(bench.ask(200, &[0xdc, 5].repeat(19)), (b'!', vec![]));
    assert_eq!(bench.ask(200, &[0xdc, 5].repeat(18)), (b'>', vec![]));
}

#[test]
fn v2_is_answered_in_v2_and_box_names_match_box_ids() {
    let mut bench = Bench::new(1, 0.0, FailsafeSettings::default());
    bench.controller.write(0, b"$X<\x00\x77\x00\x00\x00\xee");
    bench.run(0.1);
    let ids: Vec<u8> = bench.received.clone();
    assert_eq!(&ids[..6], b"$X>\x00\x77\x00", "{ids:02x?}");
    let count = usize::from(u16::from_le_bytes([ids[6], ids[7]]));
    let names = bench.ask(116, &[]).1;
    assert_eq!(String::from_utf8(names).unwrap().split_terminator(';').count(), count);
    // Permanent ids are not indices.
    assert!(ids[8..8 + count].iter().enumerate().any(|(i, id)| i != usize::from(*id)));
}

#[test]
fn sent_in_receiver_order_and_told_in_its_own() {
    let mut bench = Bench::new(1, 0.0, FailsafeSettings::default());
    bench.send(&[1510, 1520, 1030, 1540, 1050, 1060]);
    bench.run(0.2);
    let rc: Vec<u16> = bench.ask(105, &[]).1.chunks(2).map(|c| u16::from_le_bytes([c[0], c[1]])).collect();
    assert_eq!(rc[..6], [1510, 1520, 1540, 1030, 1050, 1060]);
    assert_eq!(bench.ask(64, &[]).1, [0, 1, 3, 2, 4, 5, 6, 7]);
}

#[test]
fn one_command_a_pass_and_bytes_take_their_time() {
    let mut bench = Bench::new(1, 0.0, FailsafeSettings::default());
    bench.run(0.5);
    for _ in 0..20 {
        bench.controller.write(bench.now, &v1(108, &[]));
    }
    let before = bench.controller.commands_handled();
    bench.run(0.1);
    assert!((9..=10).contains(&(bench.controller.commands_handled() - before)));
    bench.run(0.2);
    assert_eq!(bench.controller.commands_handled() - before, 20);
    assert_eq!(bench.received.len(), 20 * 12);
    // Flooded, it loses bytes and finds its way again.
    for _ in 0..40 {
        bench.controller.write(bench.now, &v1(200, &[0; 36]));
    }
    bench.run(3.0);
    assert!(bench.controller.overruns() > 0);
    assert_eq!(bench.ask(2, &[]).1, b"BTFL");
}

#[test]
fn bench_motors_turn_only_while_disarmed_and_come_back() {
    let mut bench = Bench::new(9, 0.0, FailsafeSettings::default());
    bench.send(&IDLE);
    bench.run(5.2);
    let turn: Vec<u8> = [1100_u16, 1000, 1000, 1000].iter().flat_map(|m| m.to_le_bytes()).collect();
    bench.ask(214, &turn);
    bench.run(0.4);
    let told = |b: &Bench| b.controller.motors_us[..4].to_vec();
    assert_eq!(told(&bench), [1100, 1000, 1000, 1000]);
    bench.send(&ARM);
    bench.run(0.3);
    assert!(bench.controller.is_armed());
    assert!(told(&bench)[1] > 1020, "armed: the loops' idle, {:?}", told(&bench));
    bench.send(&IDLE);
    bench.run(0.3);
    assert_eq!(told(&bench), [1100, 1000, 1000, 1000], "old values come back");
}

#[test]
fn several_answers_in_one_and_one_g_at_rest() {
    let mut bench = Bench::new(1, 0.0, FailsafeSettings::default());
    bench.run(2.0);
    let (direction, both) = bench.ask(230, &[108, 102]);
    assert_eq!((direction, both.len(), both[0], both[7]), (b'>', 26, 6, 18));
    let word = |at: usize| i16::from_le_bytes([both[at], both[at + 1]]);
    assert!(word(8).abs() < 6 && word(10).abs() < 6 && (506..=518).contains(&word(12)), "{both:02x?}");
    assert_eq!(both[1..5], bench.ask(108, &[]).1[..4], "roll and pitch");
    // What is not known is empty, nothing is in itself, and nothing asked for is an error.
    assert_eq!(bench.ask(230, &[100, 230, 108]).1.len(), 1 + 7);
    assert_eq!(bench.ask(230, &[]), (b'!', vec![]));
}
