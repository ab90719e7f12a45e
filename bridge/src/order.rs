//! An order or an input of the sticks as it comes over the network: what is no order is refused in a sentence.

use crate::roles::Role;
use ipc_types::{ArmSwitch, HEADING_HOLD, HEIGHT_HOLD, Sticks, Text, Verb};
use serde::{Deserialize, Serialize};

/// An order or an input whose newest beacon is older than this is refused, nanoseconds.
pub const BEACON_LIFE_NS: u64 = 2_000_000_000;
/// Longest address of e-mail (RFC 5321, 4.5.3.1.3), bytes. A message has room for its beginning.
const LONGEST_ACCOUNT: usize = 254;
/// Farther from the plan's origin nothing is, metres.
const FAR_M: f32 = 10_000.0;
/// Browsers tell the time in steps of up to this, milliseconds.
const CLOCK_STEP_MS: f64 = 2.0;
/// Most milliseconds between a beacon and the input that names it.
const LONGEST_SINCE_MS: f64 = 60_000.0;

/// The JSON of an order (`docs/off-board.md`, *An order*).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OrderText {
    /// 16 hexadecimal digits drawn at random.
    pub id: String,
    /// The newest beacon that its sender has seen.
    pub beacon_ns: u64,
    /// Who gives it; the certificate itself when absent.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub account: String,
    /// Role of the account; that of the certificate when absent.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub role: String,
    /// Which connection of the account it came by.
    #[serde(default)]
    pub socket: u64,
    /// For `sticks-release`.
    #[serde(default)]
    pub lease: u64,
    /// For `goto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x_m: Option<f32>,
    /// For `goto`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y_m: Option<f32>,
}

/// An order that makes sense; whether it may be given is decided elsewhere.
#[derive(Debug, Clone)]
pub struct Order {
    /// Drawn at random by its sender.
    pub id: u64,
    /// The newest beacon that its sender has seen.
    pub beacon_ns: u64,
    /// Who gives it; empty for the certificate itself.
    pub account: Text<32>,
    /// Role of the account, if it has one.
    pub role: Option<Role>,
    /// Which connection of the account it came by.
    pub socket: u64,
    /// For `sticks-release`.
    pub lease: u64,
    /// For `goto`; NaN otherwise.
    pub x_m: f32,
    /// For `goto`; NaN otherwise.
    pub y_m: f32,
}

/// The identity of an order or a change.
pub(crate) fn identity(id: &str) -> Result<u64, String> {
    if id.len() != 16 || !id.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err(format!("id = {}: 16 hexadecimal digits are needed", shown(id)));
    }
    u64::from_str_radix(id, 16).map_err(|_| "id: no number".to_owned())
}

/// The role that an account is said to have, if it is said.
pub(crate) fn claimed_role(word: &str) -> Result<Option<Role>, String> {
    if word.is_empty() {
        return Ok(None);
    }
    Role::from_word(word)
        .map(Some)
        .ok_or_else(|| format!("role = {}: allowed are viewer, guard, installer, administrator", shown(word)))
}

impl Order {
    /// Reads an order of `verb`.
    ///
    /// # Errors
    /// One sentence that names field, value and what is allowed.
    pub fn parse(verb: Verb, json: &[u8]) -> Result<Self, String> {
        let text: OrderText = read("an order", json)?;
        let id = identity(&text.id)?;
        let role = claimed_role(&text.role)?;
        if text.account.len() > LONGEST_ACCOUNT || text.account.chars().any(char::is_control) {
            return Err(format!(
                "account = {}: at most {LONGEST_ACCOUNT} bytes of text",
                shown(&text.account)
            ));
        }
        let (x_m, y_m) = match (verb, text.x_m, text.y_m) {
            (Verb::GoTo, Some(x), Some(y)) if x.abs() <= FAR_M && y.abs() <= FAR_M => (x, y),
            (Verb::GoTo, ..) => {
                return Err(format!("goto needs x_m and y_m, metres on the plan, -{FAR_M} to {FAR_M}"));
            }
            (_, None, None) => (f32::NAN, f32::NAN),
            _ => return Err("x_m and y_m belong to goto only".to_owned()),
        };
        if text.lease != 0 && verb != Verb::SticksRelease {
            return Err("lease belongs to sticks-release only".to_owned());
        }
        Ok(Self {
            id,
            beacon_ns: text.beacon_ns,
            account: Text::new(&text.account),
            role,
            socket: text.socket,
            lease: text.lease,
            x_m,
            y_m,
        })
    }
}

/// The JSON of an input of the sticks (`docs/off-board.md`, *Sticks*).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SticksText {
    /// The lease under which it is sent.
    pub lease: u64,
    /// The connection that holds the lease.
    pub socket: u64,
    /// Counts the inputs of the human; one that is repeated keeps its number.
    pub input_sequence: u64,
    /// The newest beacon that the page has seen before the input.
    pub beacon_ns: u64,
    /// Milliseconds at the page between the arrival of that beacon and the input.
    pub since_ms: f64,
    /// -1 to 1.
    pub forward: f32,
    /// -1 to 1.
    pub left: f32,
    /// -1 to 1.
    pub up: f32,
    /// -1 to 1, counter-clockwise.
    pub turn: f32,
    /// While the take-over button is held.
    pub held: bool,
    /// A centred climb stick holds the height.
    pub height_hold: bool,
    /// A centred turn stick holds the heading.
    pub heading_hold: bool,
    /// `absent`, `off` or `on`.
    pub arm: String,
}

/// An input with the connection by which it came.
#[derive(Debug, Clone, Copy)]
pub struct Input {
    /// The input, its age as it was at `now`.
    pub sticks: Sticks,
    /// The connection.
    pub socket: u64,
}

/// Reads an input that comes at `now` on the drone's clock; beacons before `first_beacon_ns` were another start's.
///
/// # Errors
/// One sentence that names field, value and what is allowed.
pub fn parse_sticks(json: &[u8], now: u64, first_beacon_ns: u64) -> Result<Input, String> {
    let text: SticksText = read("sticks", json)?;
    for (field, value) in
        [("forward", text.forward), ("left", text.left), ("up", text.up), ("turn", text.turn)]
    {
        if !(-1.0..=1.0).contains(&value) {
            return Err(format!("{field} = {value}: allowed is -1 to 1"));
        }
    }
    if !(0.0..=LONGEST_SINCE_MS).contains(&text.since_ms) {
        return Err(format!("since_ms = {}: allowed is 0 to {LONGEST_SINCE_MS}", text.since_ms));
    }
    let arm = ArmSwitch::ALL
        .iter()
        .find(|arm| arm.word() == text.arm)
        .ok_or_else(|| format!("arm = {}: allowed are absent, off, on", shown(&text.arm)))?;
    if text.beacon_ns > now || text.beacon_ns < first_beacon_ns {
        return Err(format!("beacon_ns = {}: no beacon of this drone", text.beacon_ns));
    }
    // No clock but the drone's: the beacon was sent at `beacon_ns`, so the input cannot be younger than this.
    let age_ms = (now - text.beacon_ns) as f64 * 1e-6 - text.since_ms;
    if age_ms < -CLOCK_STEP_MS {
        return Err(format!("since_ms = {}: longer than the beacon is old", text.since_ms));
    }
    let age_ms = age_ms.max(0.0);
    let switch = |on: bool, bit: u32| if on { bit } else { 0 };
    Ok(Input {
        sticks: Sticks {
            input_sequence: text.input_sequence,
            lease: text.lease,
            age_ms: age_ms as f32,
            forward: text.forward,
            left: text.left,
            up: text.up,
            turn: text.turn,
            held: u32::from(text.held),
            switches: switch(text.height_hold, HEIGHT_HOLD) | switch(text.heading_hold, HEADING_HOLD),
            arm: u32::from(arm.code()),
            ..Sticks::default()
        },
        socket: text.socket,
    })
}

fn read<'a, T: Deserialize<'a>>(what: &str, json: &'a [u8]) -> Result<T, String> {
    if json.len() > crate::zenoh_config::MAX_ORDER {
        return Err(format!(
            "{} bytes are no {what}: allowed are at most {}",
            json.len(),
            crate::zenoh_config::MAX_ORDER
        ));
    }
    serde_json::from_slice(json)
        .map_err(|error| format!("not the JSON of {what}: {}", shortened(&error.to_string())))
}

/// What somebody said, as an answer may quote it.
fn shown(text: &str) -> String {
    format!("\"{}\"", shortened(text))
}

fn shortened(text: &str) -> String {
    manifest::plain(&text.chars().take(80).collect::<String>())
}
