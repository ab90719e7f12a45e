//! `pilot/channels` and `pilot/state`.

use crate::Text;
use crate::code::codes;
use crate::field::message;

codes! {
    /// Which wish was flown.
    pub enum ChannelSource {
        /// Nobody's: neutral, on the ground.
        Neutral = 0 => "neutral",
        /// The pilot's own: take-off, hover, landing.
        Pilot = 1 => "pilot",
        /// Navigation's setpoint.
        Navigation = 2 => "navigation",
        /// The holder of the sticks.
        Manual = 3 => "manual",
        /// A failsafe.
        Failsafe = 4 => "failsafe",
    }
}

message! {
    /// The RC channels to be flown, and what `flight` needs to go on alone.
    pub struct Channels on "pilot/channels" {
        /// Not to be flown at or after this time.
        pub expiry_ns: u64,
        /// Microseconds 1000..=2000: roll, pitch, throttle, yaw, AUX1 (arm), AUX2 (angle), ...
        pub channels_us: [u16; 18],
        /// Filled channels.
        pub count: u16,
        /// A [`ChannelSource`] code.
        pub source: u8,
        /// 1: motors are to run. Differs from the AUX1 channel only while `flight` sequences arming.
        pub arm: u8,
        /// Roll stick that keeps the body level, microseconds around 1500.
        pub level_roll_us: f32,
        /// Pitch stick that keeps the body level, microseconds around 1500.
        pub level_pitch_us: f32,
        /// Learned hover throttle, microseconds; NaN before it is known.
        pub hover_throttle_us: f32,
        /// Height above the floor as the pilot believes it; NaN when unknown.
        pub height_m: f32,
        /// Vertical velocity, up positive.
        pub climb_m_s: f32,
        /// 1 while the pilot believes the skids are on the ground.
        pub on_ground: u16,
        /// 1 when a hand has moved or let go: not to wait for the beat of the frames.
        pub prompt: u16,
    }
}

codes! {
    /// Phase of the flight.
    pub enum Phase {
        /// Motors off, on the ground.
        Grounded = 0 => "grounded",
        /// Waiting for the controller to arm.
        Arming = 1 => "arming",
        /// Climbing to the patrol height.
        TakeOff = 2 => "take-off",
        /// Standing in the air.
        Hover = 3 => "hover",
        /// Flying navigation's wishes.
        Autonomous = 4 => "autonomous",
        /// Flying a human's wishes.
        Manual = 5 => "manual",
        /// Coming down.
        Landing = 6 => "landing",
        /// Coming down because a failsafe said so.
        EmergencyLanding = 7 => "emergency landing",
        /// Motors cut in the air.
        Cut = 8 => "cut",
    }
}

codes! {
    /// Causes of DESIGN 4, from mild to severe.
    pub enum FailsafeCause {
        /// None.
        None = 0 => "none",
        /// Navigation fell silent.
        NavigationSilent = 1 => "navigation silent",
        /// Who held the sticks fell silent.
        OperatorSilent = 2 => "operator silent",
        /// A side sonar is silent; its sectors are closed.
        SideSonarSilent = 3 => "a side sonar is silent",
        /// The pose is stale, or P(lost) or sigma too large.
        PoseUncertain = 4 => "position uncertain",
        /// All side sonars are silent.
        AllSonarsSilent = 5 => "all side sonars are silent",
        /// The way home is just covered, or 3.5 V a cell for 10 s.
        BatteryReturn = 6 => "battery: return",
        /// 3.3 V a cell for 2 s.
        BatteryLand = 7 => "battery: land",
        /// The pose stayed uncertain for 20 s, or fewer than two walls answer.
        Lost = 8 => "lost",
        /// The down sonar is silent.
        HeightUnknown = 9 => "height unknown",
        /// The flight controller's link is down.
        LinkDown = 10 => "flight controller silent",
        /// Tilt over 60 degrees for 0.3 s.
        Tilt = 11 => "tilted over",
        /// The operator ordered it.
        Operator = 12 => "operator",
    }
}

codes! {
    /// What a failsafe does.
    pub enum FailsafeAction {
        /// Nothing.
        None = 0 => "none",
        /// Stop and hover.
        Hover = 1 => "hover",
        /// Fly home and land.
        Return = 2 => "return",
        /// Land here.
        Land = 3 => "land",
        /// Come down level without position control.
        Descend = 4 => "descend",
        /// Stop the motors.
        Cut = 5 => "cut",
    }
}

codes! {
    /// How far a human has the drone in hand.
    pub enum SticksState {
        /// Nobody holds the sticks.
        Free = 0 => "free",
        /// Granted; the drone comes to a stop first.
        Stopping = 1 => "stopping",
        /// It stands; the sticks must pass neutral.
        AwaitingNeutral = 2 => "awaiting neutral sticks",
        /// It follows while the button is held.
        Ready = 3 => "ready",
        /// It follows.
        Following = 4 => "following",
        /// Nothing new is heard of the holder: it hovers.
        Silent = 5 => "silent",
    }
}

message! {
    /// What the pilot is doing: survives a restart of the pilot.
    pub struct PilotState on "pilot/state" {
        /// When the phase began.
        pub phase_since_ns: u64,
        /// When the failsafe began; 0 without one.
        pub failsafe_since_ns: u64,
        /// Stamp of the newest operator command heard; 0 before any.
        pub command_ns: u64,
        /// The lease of the sticks: numbers never come back; 0 while nobody holds them.
        pub lease: u64,
        /// The connection that holds them; 0 while nobody does.
        pub holder_socket: u64,
        /// When a stop that nobody answers lands the drone; 0 without one.
        pub stop_lands_ns: u64,
        /// Causes that hold now: bit = [`FailsafeCause`] code.
        pub causes: u32,
        /// Sequence of the last operator command heard: what `answer` is about.
        pub command_sequence: u32,
        /// A [`Phase`] code.
        pub phase: u8,
        /// A [`FailsafeCause`] code: the one that acts. It may have gone when only the ground ends what it began.
        pub cause: u8,
        /// A [`FailsafeAction`] code.
        pub action: u8,
        /// A [`FailsafeAction`] code: what would be done in the end if the pose were lost now for good, all else being
        /// as it is. So are the others.
        pub if_pose_lost: u8,
        /// If the link of who holds the sticks were lost.
        pub if_operator_lost: u8,
        /// If the down sonar were lost.
        pub if_height_lost: u8,
        /// 1 while the skids are believed to be on the ground.
        pub on_ground: u8,
        /// 1 while motors are wanted.
        pub arm: u8,
        /// Learned hover throttle, microseconds.
        pub hover_throttle_us: f32,
        /// Learned level trim, microseconds around 1500.
        pub level_roll_us: f32,
        /// Learned level trim, microseconds around 1500.
        pub level_pitch_us: f32,
        /// Height above the floor.
        pub height_m: f32,
        /// Vertical velocity, up positive.
        pub climb_m_s: f32,
        /// Level of the surface below against the floor at take-off (a table top).
        pub surface_m: f32,
        /// Learned acceleration disturbance, plan frame.
        pub disturbance_x_m_s2: f32,
        /// Learned acceleration disturbance, plan frame.
        pub disturbance_y_m_s2: f32,
        /// Place held in hover, plan frame; NaN without.
        pub hold_x_m: f32,
        /// Place held in hover, plan frame; NaN without.
        pub hold_y_m: f32,
        /// Plan-frame heading held.
        pub hold_heading_rad: f32,
        /// Speed that the shield allows along the wished direction.
        pub shield_speed_m_s: f32,
        /// An [`crate::Answer`] code: what became of the last command.
        pub answer: u32,
        /// If all side sonars were lost.
        pub if_sonars_lost: u8,
        /// If navigation were lost.
        pub if_navigation_lost: u8,
        /// If the flight controller were lost.
        pub if_controller_lost: u8,
        /// If what is known of the battery were lost.
        pub if_charge_lost: u8,
        /// A [`SticksState`] code.
        pub sticks: u8,
        /// 1 while the automatic may move the drone.
        pub automatic: u8,
        /// Always zero.
        pub reserved: [u8; 2],
        /// Age of the holder's newest input on the drone's clock, milliseconds; NaN without a holder.
        pub sticks_age_ms: f32,
        /// The answer in one sentence.
        pub answer_text: Text<96>,
        /// Who holds the sticks; empty for nobody.
        pub holder: Text<32>,
        /// One sentence for people.
        pub text: Text<96>,
    }
}
