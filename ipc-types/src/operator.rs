//! `operator/sticks` and `operator/command`.

use crate::Text;
use crate::code::codes;
use crate::field::message;

message! {
    /// Sticks of the holder: velocity and climb rate, never raw throttle.
    pub struct Sticks on "operator/sticks" {
        /// Counts every input of the human; a repeated value is not a new input.
        pub input_sequence: u64,
        /// Lease under which these are sent.
        pub lease: u64,
        /// Milliseconds since the human's hand last moved or confirmed, on the drone's clock.
        pub age_ms: f32,
        /// -1..1, forward.
        pub forward: f32,
        /// -1..1, left.
        pub left: f32,
        /// -1..1, up.
        pub up: f32,
        /// -1..1, counter-clockwise.
        pub turn: f32,
        /// 1 while the take-over button is held.
        pub held: u32,
        /// Bits: [`HEIGHT_HOLD`], [`HEADING_HOLD`].
        pub switches: u32,
        /// An [`ArmSwitch`] code.
        pub arm: u32,
    }
}

/// In [`Sticks::switches`]: a centred climb stick holds the height.
pub const HEIGHT_HOLD: u32 = 1;
/// In [`Sticks::switches`]: a centred turn stick holds the heading.
pub const HEADING_HOLD: u32 = 2;

codes! {
    /// Where the arm channel of a human's transmitter stands.
    pub enum ArmSwitch {
        /// The device has none.
        Absent = 0 => "absent",
        /// Low: in the air, land.
        Off = 1 => "off",
        /// High: on the ground, arm and take off.
        On = 2 => "on",
    }
}

codes! {
    /// What an operator may ask for.
    pub enum Verb {
        /// Arm and climb to the patrol height.
        TakeOff = 1 => "takeoff",
        /// Land here.
        Land = 2 => "land",
        /// Stop and hover.
        Hold = 3 => "hold",
        /// Fly to (x, y) and hover.
        GoTo = 4 => "goto",
        /// Take off if need be and fly the round.
        PatrolStart = 5 => "patrol start",
        /// Hover and keep the round.
        PatrolPause = 6 => "patrol pause",
        /// Give the round up and return to the pad.
        PatrolStop = 7 => "patrol stop",
        /// Return to the pad and land.
        Home = 8 => "home",
        /// Brake and hover; land if nobody orders anything else for a while.
        Stop = 9 => "stop",
        /// Stop the motors at once: the drone falls.
        Cut = 10 => "cut",
        /// Give me the sticks.
        SticksTake = 11 => "sticks take",
        /// I let go of them.
        SticksRelease = 12 => "sticks release",
        /// Nothing automatic moves the drone until it is allowed again, but failsafes and home.
        AutomaticOff = 13 => "automatic off",
        /// The automatic may move it again; nothing begins by itself.
        AutomaticOn = 14 => "automatic on",
    }
}

codes! {
    /// What a service says of the last command that it heard.
    pub enum Answer {
        /// It has heard none.
        None = 0 => "none",
        /// Taken; whether it can be done is being worked out.
        Working = 1 => "working it out",
        /// It is being obeyed.
        Accepted = 2 => "accepted",
        /// It is not; a sentence says why.
        Refused = 3 => "refused",
    }
}

/// For how long a command may be obeyed after it was given, nanoseconds: a service that is restarted or a reader that
/// joins late takes a tenth of it, and a person who sees nothing happen for two seconds gives another order.
pub const COMMAND_LIFE_NS: u64 = 2_000_000_000;
/// A command may be this much newer than the step that takes it, nanoseconds: a step reads the clock before its inputs.
const COMMAND_AHEAD_NS: u64 = 100_000_000;

message! {
    /// A command with who gave it.
    pub struct Command on "operator/command" {
        /// Not to be obeyed at or after this time; at most [`COMMAND_LIFE_NS`] after the stamp.
        pub expiry_ns: u64,
        /// Lease under which it is given; 0 for commands that need none.
        pub lease: u64,
        /// Which connection of the account it came by: a lease belongs to one; 0 for the command line on the drone.
        pub socket: u64,
        /// Plan frame, for `goto`; NaN otherwise.
        pub x_m: f32,
        /// Plan frame, for `goto`; NaN otherwise.
        pub y_m: f32,
        /// A [`Verb`] code.
        pub verb: u32,
        /// Differs for every command of every operator: a command is obeyed once.
        pub command_sequence: u32,
        /// Account, or `local` for the command line on the drone.
        pub account: Text<32>,
        /// Role of the account, capped by that of the certificate.
        pub role: Text<16>,
        /// Name of the certificate by which it came; empty for the command line on the drone.
        pub certificate: Text<32>,
    }
}

impl Command {
    /// Whether it may be obeyed at `now_ns` by somebody who has heard one of `newest_ns` (0 for none): it has not
    /// expired, and no newer command has overtaken it. Every publisher's last command stays in its history, so that a
    /// restarted service hears all of them again, in any order.
    #[must_use]
    pub fn counts(&self, now_ns: u64, newest_ns: u64) -> bool {
        let given_ns = self.header.stamp_ns;
        given_ns >= newest_ns
            && given_ns <= now_ns.saturating_add(COMMAND_AHEAD_NS)
            && now_ns < self.expiry_ns
            && self.expiry_ns <= given_ns.saturating_add(COMMAND_LIFE_NS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_counts_for_a_while_and_until_a_newer_one() {
        let given = 50_000_000_000;
        let mut command = Command { expiry_ns: given + COMMAND_LIFE_NS, ..Command::default() };
        command.header.stamp_ns = given;
        assert!(command.counts(given, 0));
        assert!(command.counts(given - COMMAND_AHEAD_NS, given));
        assert!(command.counts(given + COMMAND_LIFE_NS - 1, given));
        assert!(!command.counts(given + COMMAND_LIFE_NS, 0), "expired");
        assert!(!command.counts(given + 1, given + 1), "overtaken");
        assert!(!command.counts(given - COMMAND_AHEAD_NS - 1, 0), "from the future");
        command.expiry_ns += 1;
        assert!(!command.counts(given, 0), "nobody may order for longer");
        command.expiry_ns = 0;
        assert!(!command.counts(given, 0), "without an expiry");
    }
}
