//! What comes over the network: orders, sticks, lists of clients and sets of particles.

use super::{FILE, refused, text_memory, within_memory};
use bridge::form::{decode_particles, encode};
use bridge::order::{Order, parse_sticks};
use bridge::roles::Clients;
use ipc_types::Verb;

/// The drone's clock when it comes, and its first beacon.
const NOW_NS: u64 = 123_500_000_000;
const FIRST_NS: u64 = 100_000_000_000;

/// One byte that selects: `0` to `9` and on for an order of each verb, `s` for sticks, `c` for a list of clients, `p` for
/// particles; then the message.
///
/// What is no order is refused in one plain line. An order that is taken names a place for `goto` alone, sticks that are taken
/// are within their range and not younger than their beacon allows, a list is written as it is read.
pub fn network(data: &[u8]) -> bool {
    let Some((&selector, message)) = data.split_first() else { return false };
    match selector {
        b's' => sticks(message),
        b'c' => clients(message),
        b'p' => particles(message),
        selector => order(selector, message),
    }
}

/// A refusal is one plain line that is not long. Returns false: the input was not accepted.
pub(super) fn said(error: &str) -> bool {
    assert!(!error.is_empty() && !error.chars().any(char::is_control), "not one plain line: {error:?}");
    assert!(error.len() < 1000, "{} bytes of answer", error.len());
    false
}

fn order(selector: u8, json: &[u8]) -> bool {
    let verb = Verb::ALL[usize::from(selector.wrapping_sub(b'0')) % Verb::ALL.len()];
    match within_memory(text_memory(json.len()), || Order::parse(verb, json)) {
        Err(error) => said(&error),
        Ok(order) => {
            assert_eq!(order.x_m.is_finite() && order.y_m.is_finite(), verb == Verb::GoTo);
            assert!(order.lease == 0 || verb == Verb::SticksRelease);
            assert!(!order.account.as_str().chars().any(char::is_control));
            true
        }
    }
}

fn sticks(json: &[u8]) -> bool {
    match within_memory(text_memory(json.len()), || parse_sticks(json, NOW_NS, FIRST_NS)) {
        Err(error) => said(&error),
        Ok(input) => {
            let sticks = input.sticks;
            for value in [sticks.forward, sticks.left, sticks.up, sticks.turn] {
                assert!((-1.0..=1.0).contains(&value));
            }
            assert!((0.0..=(NOW_NS - FIRST_NS) as f32 * 1e-6).contains(&sticks.age_ms), "{}", sticks.age_ms);
            assert!(sticks.held <= 1 && sticks.switches <= 3 && sticks.arm <= 2);
            true
        }
    }
}

fn clients(text: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(text) else { return false };
    match within_memory(text_memory(text.len()), || Clients::parse(FILE, text)) {
        Err(error) => refused(&error),
        Ok(clients) => {
            assert_eq!(Clients::parse(FILE, &clients.to_toml()).as_ref(), Ok(&clients));
            true
        }
    }
}

fn particles(bytes: &[u8]) -> bool {
    let Some(set) = decode_particles(bytes) else { return false };
    assert_eq!(encode(&*set), bytes);
    true
}
