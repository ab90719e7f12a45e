//! `sonar/ranges` and `flow/motion`.

use crate::code::codes;
use crate::field::{fields, message};

/// Most sonars a vehicle may carry.
pub const MAX_SONARS: usize = 16;

codes! {
    /// What one ping brought back.
    pub enum SonarStatus {
        /// `range_m` holds the distance of the nearest echo.
        Ok = 1 => "ok",
        /// The sensor worked and heard nothing within its reach.
        NoEcho = 2 => "no echo",
        /// The sensor did not answer, or what it answered is impossible.
        Fault = 3 => "fault",
    }
}

codes! {
    /// What the recent readings of one sensor say about it.
    pub enum SonarHealth {
        /// Nothing wrong seen.
        Good = 0 => "good",
        /// Several faults in a row: not to be relied on.
        Silent = 1 => "silent",
        /// The same reading again and again while others move.
        Stuck = 2 => "stuck",
    }
}

fields! {
    /// One ping of one sensor.
    pub struct SonarReading {
        /// When the ping left the sensor. 0: never pinged.
        pub ping_ns: u64,
        /// Distance from the sensor's face to the nearest echo; NaN unless `status` is ok.
        pub range_m: f32,
        /// Mount: azimuth of the axis in the body frame, counter-clockwise from forward.
        pub bearing_rad: f32,
        /// Mount: elevation of the axis in the body frame; -pi/2 looks straight down.
        pub elevation_rad: f32,
        /// Mount: position of the face in the body frame, forward.
        pub mount_x_m: f32,
        /// Mount: position of the face in the body frame, left.
        pub mount_y_m: f32,
        /// Mount: position of the face in the body frame, up.
        pub mount_z_m: f32,
        /// Index in the vehicle's list of sonars.
        pub sensor: u8,
        /// A [`SonarStatus`] code.
        pub status: u8,
        /// A [`SonarHealth`] code.
        pub health: u8,
        /// Always zero.
        pub reserved: [u8; 5],
    }
}

impl SonarReading {
    /// Whether the sensor looks at the ground and not around.
    #[must_use]
    pub fn looks_down(&self) -> bool {
        self.elevation_rad < -core::f32::consts::FRAC_PI_4
    }
    /// The range when there is a believable one.
    #[must_use]
    pub fn range(&self) -> Option<f32> {
        (self.status == SonarStatus::Ok.code() && self.range_m.is_finite() && self.range_m > 0.0)
            .then_some(self.range_m)
    }
}

message! {
    /// The echoes of one ping group: sensors that were fired together.
    pub struct SonarRanges on "sonar/ranges" {
        /// How many of `readings` are filled; more than [`MAX_SONARS`] is a broken message.
        pub count: u32,
        /// Which group of the firing schedule.
        pub group: u32,
        /// Period of a whole sweep through all groups, seconds.
        pub sweep_s: f32,
        /// How many sonars the vehicle has.
        pub sensors: u32,
        /// One entry a sensor of the group.
        pub readings: [SonarReading; 16],
    }
}

impl SonarRanges {
    /// The filled readings; never more than there are.
    #[must_use]
    pub fn filled(&self) -> &[SonarReading] {
        &self.readings[..(self.count as usize).min(MAX_SONARS)]
    }
}

message! {
    /// Motion over the ground from the down-looking optical-flow sensor.
    pub struct FlowMotion on "flow/motion" {
        /// Middle of the interval that was integrated.
        pub sampled_ns: u64,
        /// When the range was measured; 0 without one.
        pub ranged_ns: u64,
        /// Velocity of the body over the ground, body frame forward, levelled, compensated for tilt rates.
        /// NaN when the quality gate refused the frame.
        pub velocity_x_m_s: f32,
        /// The same, left.
        pub velocity_y_m_s: f32,
        /// Standard deviation of each component, of whichever of the two velocities there is.
        pub sigma_m_s: f32,
        /// Where the quality gate refused the frame: the velocity as it would be if the sensor had told all
        /// motion apart, body frame forward. Over a poor floor it under-reports, by an unknown share. NaN when
        /// the frame is good, shows nothing at all or has no height.
        pub dim_x_m_s: f32,
        /// The same, left.
        pub dim_y_m_s: f32,
        /// Image motion as the sensor sent it, body x, radians a second.
        pub raw_x_rad_s: f32,
        /// Image motion as the sensor sent it, body y, radians a second.
        pub raw_y_rad_s: f32,
        /// Distance to the ground along the sensor's axis by its own range finder; NaN when out of range.
        pub range_m: f32,
        /// 0..=255 as the sensor sent it.
        pub quality: u32,
        /// Frames refused since start: bad quality, no height, checksum.
        pub refused: u32,
    }
}
