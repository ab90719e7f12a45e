//! `flight/attitude`, `flight/state`, `flight/power`.

use crate::Text;
use crate::code::codes;
use crate::field::message;

/// Most RC channels in a frame (FACTS 1: more than 18 is an error).
pub const MAX_CHANNELS: usize = 18;

/// How the reason of `flight/state` begins when a human with a radio is asked to arm (the `override` profile).
pub const ARM_WITH_THE_RADIO: &str = "arm with the radio";

message! {
    /// Attitude by the flight controller's own filter (it is wrong under acceleration).
    pub struct Attitude on "flight/attitude" {
        /// Best guess of when the controller sampled it: half the round trip before the answer.
        pub sampled_ns: u64,
        /// Right side down positive.
        pub roll_rad: f32,
        /// Nose down positive.
        pub pitch_rad: f32,
        /// Counter-clockwise from compass zero, -pi..pi. **Compass zero is not plan zero.**
        pub yaw_rad: f32,
        /// What the accelerometer feels along body x (forward), smoothed by the controller, in the frame that its
        /// attitude is of (m/s2); NaN when the firmware does not tell or its unit is not known.
        pub force_x_m_s2: f32,
        /// The same along body y (left).
        pub force_y_m_s2: f32,
        /// The same along body z (up): one g at rest.
        pub force_z_m_s2: f32,
    }
}

codes! {
    /// The serial link to the flight controller.
    pub enum LinkState {
        /// The port could not be opened; tried again and again.
        Closed = 0 => "port closed",
        /// Open; asking who is there.
        Identifying = 1 => "identifying",
        /// The controller answers.
        Up = 2 => "up",
        /// Open, but nothing came back for a second.
        Silent = 3 => "controller silent",
    }
}

codes! {
    /// How far `flight` has taken over because `pilot/channels` went stale.
    pub enum Ladder {
        /// The pilot's channels are fresh and flown.
        Following = 0 => "following",
        /// Stale for 100 ms: level with the learned trim and hover throttle.
        Level = 1 => "level",
        /// Stale for 300 ms: level and descending under flight's own height loop.
        Descend = 2 => "descend",
        /// Touched down: disarming.
        TouchDown = 3 => "touch down",
        /// No pilot yet, disarmed: neutral frames.
        Neutral = 4 => "neutral",
    }
}

message! {
    /// What the flight controller and the link to it are doing.
    pub struct FlightState on "flight/state" {
        /// Mode bits of MSP_STATUS, already mapped: bit 0 ARM, bit 1 ANGLE, bit 2 FAILSAFE, bit 3 MSP OVERRIDE.
        pub modes: u32,
        /// Arming-disable flags as the controller sends them; 0 means nothing stands in the way.
        pub arming_blocks: u32,
        /// Seconds since the last answer of the controller.
        pub link_age_s: f32,
        /// Frames sent, answers received, answers refused (checksum, length), since the port opened.
        pub frames_sent: u32,
        /// Answers received since the port opened.
        pub answers: u32,
        /// Answers that were broken or unasked for.
        pub refused: u32,
        /// Four ASCII letters, `BTFL` or `INAV`; zero before the controller is known.
        pub variant: [u8; 4],
        /// Year or major, month or minor, patch.
        pub version: [u8; 4],
        /// Last channels sent, microseconds, in AETR order then AUX1...; 0 before the first frame.
        pub channels_us: [u16; 18],
        /// Motor outputs as MSP_MOTOR answers, microseconds; 0 for absent motors.
        pub motors_us: [u16; 8],
        /// 1 when the controller says that it is armed.
        pub armed: u8,
        /// A [`LinkState`] code.
        pub link: u8,
        /// A [`Ladder`] code.
        pub ladder: u8,
        /// 0 receiver, 1 override: the link profile in use.
        pub profile: u8,
        /// Why the controller will not arm, or what is wrong with the link; empty when nothing is.
        pub reason: Text<128>,
    }
}

message! {
    /// The battery and the radio.
    pub struct Power on "flight/power" {
        /// Battery voltage; NaN when the controller does not say.
        pub volts: f32,
        /// Current, positive when drawn.
        pub amps: f32,
        /// Charge drawn since power-up, milliampere-hours.
        pub drawn_mah: f32,
        /// Radio signal strength 0..1.
        pub rssi: f32,
        /// Cells in series, guessed once at rest and then kept.
        pub cells: u32,
        /// Always zero.
        pub reserved: u32,
    }
}
