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
    }
}

message! {
    /// A command with who gave it.
    pub struct Command on "operator/command" {
        /// Lease under which it is given; 0 for commands that need none.
        pub lease: u64,
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
        /// Role of the account.
        pub role: Text<16>,
    }
}
