//! The codec against arbitrary streams.
#![allow(clippy::unwrap_used, reason = "tests")]

use msp::{Decoder, Direction, Version, encode};
use proptest::collection::vec;
use proptest::prelude::*;

type Owned = (Version, Direction, u16, Vec<u8>);
const ROOM: usize = 1024;

fn decode(bytes: &[u8]) -> Vec<Owned> {
    let mut decoder = Decoder::<ROOM>::new();
    let mut frames = Vec::new();
    decoder.feed(bytes, |f| frames.push((f.version, f.direction, f.code, f.payload.to_vec())));
    frames
}

fn bytes_of((version, direction, code, payload): &Owned) -> Vec<u8> {
    let mut out = vec![0; payload.len() + 16];
    let length = encode(&mut out, *version, *direction, *code, payload).unwrap();
    out.truncate(length);
    out
}

fn any_frame() -> impl Strategy<Value = Owned> {
    let direction = prop_oneof![Just(Direction::Request), Just(Direction::Reply), Just(Direction::Refusal)];
    let payload = prop_oneof![4 => vec(any::<u8>(), 0..40), 1 => vec(any::<u8>(), 250..300)];
    (any::<bool>(), direction, any::<u16>(), payload).prop_map(|(second, direction, code, payload)| {
        if second {
            (Version::V2, direction, code, payload)
        } else {
            (Version::V1, direction, code % 255, payload)
        }
    })
}

/// The frame at the very start of `bytes`, taken apart in the plainest way: the other opinion.
fn reference(bytes: &[u8]) -> Option<Owned> {
    let version = match bytes.get(..2)? {
        b"$M" => Version::V1,
        b"$X" => Version::V2,
        _ => return None,
    };
    let direction = match bytes.get(2)? {
        b'<' => Direction::Request,
        b'>' => Direction::Reply,
        b'!' => Direction::Refusal,
        _ => return None,
    };
    let number = |at: usize| Some(u16::from(*bytes.get(at)?) | u16::from(*bytes.get(at + 1)?) << 8);
    let (code, head, length) = match version {
        Version::V2 => (number(4)?, 8, number(6)?),
        Version::V1 if *bytes.get(3)? == 255 => (u16::from(*bytes.get(4)?), 7, number(5)?),
        Version::V1 => (u16::from(*bytes.get(4)?), 5, u16::from(*bytes.get(3)?)),
    };
    let end = head + usize::from(length);
    let mut sum = 0u8;
    for byte in bytes.get(3..end)? {
        sum ^= byte;
        for _ in 0..if version == Version::V2 { 8 } else { 0 } {
            sum = if sum & 0x80 == 0 { sum << 1 } else { (sum << 1) ^ 0xd5 };
        }
    }
    (sum == *bytes.get(end)?).then(|| (version, direction, code, bytes[head..end].to_vec()))
}

proptest! {
    #[test]
    fn what_is_written_is_read_however_the_stream_is_cut(frames in vec(any_frame(), 1..6), cuts in vec(1usize..50, 1..60)) {
        let stream: Vec<u8> = frames.iter().flat_map(bytes_of).collect();
        let mut decoder = Decoder::<ROOM>::new();
        let mut read = Vec::new();
        let mut rest = &stream[..];
        for cut in cuts.iter().cycle() {
            if rest.is_empty() { break; }
            let (now, later) = rest.split_at((*cut).min(rest.len()));
            decoder.feed(now, |f| read.push((f.version, f.direction, f.code, f.payload.to_vec())));
            rest = later;
        }
        prop_assert_eq!(read, frames);
        prop_assert_eq!(decoder.refused(), msp::Refused::default());
    }

    #[test]
    fn a_changed_byte_is_rejected_or_its_frame_has_a_right_checksum(
        frame in any_frame(), at in any::<prop::sample::Index>(), flip in 1u8..=255)
    {
        let mut bad = bytes_of(&frame);
        let at = at.index(bad.len());
        bad[at] ^= flip;
        for read in decode(&bad) {
            prop_assert!((0..bad.len()).any(|start| reference(&bad[start..]) == Some(read.clone())));
        }
    }

    #[test]
    fn one_changed_payload_byte_never_passes(frame in any_frame(), at in any::<prop::sample::Index>(), flip in 1u8..=255) {
        prop_assume!(!frame.3.is_empty());
        let mut bad = bytes_of(&frame);
        let end = bad.len() - 1;
        let start = end - frame.3.len();
        bad[start + at.index(frame.3.len())] ^= flip;
        // Both checks see every error of one byte; a smaller frame inside the payload may still be found.
        prop_assert!(decode(&bad).iter().all(|read| read.3.len() < frame.3.len()));
    }

    #[test]
    fn garbage_never_panics_and_nothing_is_invented(garbage in vec(any::<u8>(), 0..3000)) {
        let mut decoder = Decoder::<64>::new();
        let mut frames = 0;
        let mut inside = 0;
        decoder.feed(&garbage, |f| { frames += 1; inside += f.payload.len(); });
        prop_assert!(frames * 6 + inside <= garbage.len());
    }

    #[test]
    fn a_frame_after_garbage_is_found(garbage in vec(any::<u8>(), 0..200), frame in any_frame()) {
        // Garbage may end in something that looks like the head of a long frame: then the true one comes
        // out when that one has been refused, at the latest when the buffer has been filled once.
        let mut stream = garbage;
        stream.extend(bytes_of(&frame));
        stream.extend(std::iter::repeat_n(0, ROOM));
        let found = decode(&stream);
        // A forged head with a colliding checksum over all of it is possible and is not what is tested.
        prop_assume!(found.len() <= 1 || found.contains(&frame));
        prop_assert!(found.contains(&frame) || !found.is_empty());
    }

    #[test]
    fn a_lost_byte_costs_one_frame(first in any_frame(), second in any_frame(), at in any::<prop::sample::Index>()) {
        let mut stream = bytes_of(&first);
        let at = at.index(stream.len());
        stream.remove(at);
        // Where the check byte that was lost is itself a `$`, the next frame's stands in its place: the stream
        // is the one of a first frame that is whole and a second that lost its head, and the second is the cost.
        let intact = if at == stream.len() && bytes_of(&first).ends_with(b"$") { &first } else { &second };
        stream.extend(bytes_of(&second));
        stream.extend(std::iter::repeat_n(0, ROOM));
        let found = decode(&stream);
        let collided = found.iter().any(|read| *read != first && *read != second);
        prop_assert!(found.contains(intact) || collided);
    }
}

#[test]
fn a_frame_larger_than_the_buffer_is_refused_at_once() {
    let mut decoder = Decoder::<32>::new();
    decoder.feed(b"$X<\x00\x01\x00\xff\xff", |_| panic!("no frame here"));
    assert_eq!(decoder.refused().oversize, 1);
    assert!(!decoder.in_frame());
}

#[test]
fn frames_swallowed_by_a_false_head_come_out_together() {
    // A head that claims 18 bytes, then three whole frames of 6: the last byte finishes and unmasks it.
    let mut stream = b"$M>\x12\x6c".to_vec();
    for _ in 0..4 {
        stream.extend_from_slice(b"$M<\x00\x6c\x6c");
    }
    assert_eq!(decode(&stream).len(), 4);
}

#[test]
fn a_short_payload_may_be_a_frame() {
    // What a flow sensor sees may be anything.
    let frame = (Version::V2, Direction::Request, 0x1f02, b"$X<\x00\x64\x00\x00\x00\x8f".to_vec());
    assert_eq!(decode(&bytes_of(&frame)), [frame]);
}

#[test]
fn a_damaged_length_hides_nothing_that_follows() {
    // A head that claims 128 bytes (one bit of a length of 0), then whole frames: each comes out with its last byte.
    let mut decoder = Decoder::<512>::new();
    decoder.feed(b"$M>\x80\x6c\x6c", |_| panic!("no frame here"));
    for _ in 0..4 {
        decoder.feed(b"$M>\x00\x6c", |_| panic!("not complete yet"));
        assert_eq!(decoder.push(b'\x6c').map(|frame| frame.code), Some(108));
    }
    assert_eq!(decoder.refused(), msp::Refused { checksum: 1, oversize: 0, bytes: 6 });
}

#[test]
fn broken_frames_inside_an_incomplete_one_do_not_hide_a_whole_one() {
    let mut stream = b"$X>\x00\x6c\x00\x40\x00\x01$M>\x00\x6c\x6d$$X>".to_vec();
    stream.extend_from_slice(b"$M>\x00\x6c\x6c");
    assert_eq!(decode(&stream), [(Version::V1, Direction::Reply, 108, vec![])]);
}

#[test]
fn an_abandoned_head_frees_what_stands_behind_it() {
    let mut decoder = Decoder::<512>::new();
    // The second is still incomplete when the first is given up.
    decoder.feed(b"$M>\x80\x6c$M<\x01\x6c", |_| panic!("no frame here"));
    assert!(decoder.in_frame());
    decoder.abandon();
    assert!(decoder.pending().is_none() && decoder.in_frame());
    decoder.feed(b"\x07", |_| panic!("no frame here"));
    assert_eq!(decoder.push(b'\x6a').map(|frame| frame.payload.to_vec()), Some(vec![7]));
    decoder.abandon();
    assert!(decoder.pending().is_none() && !decoder.in_frame());
}
