//! `localization/pose` and `localization/particles`.

use crate::code::codes;
use crate::field::message;

/// Capacity of the particle set.
pub const MAX_PARTICLES: usize = 50_000;

codes! {
    /// How far the estimate may be trusted.
    pub enum LocalizationState {
        /// Nothing is known, or what was known no longer fits.
        Lost = 0 => "lost",
        /// Hypotheses compete.
        Converging = 1 => "converging",
        /// One place, believed.
        Tracking = 2 => "tracking",
    }
}

message! {
    /// Where the drone is on the plan.
    pub struct Pose on "localization/pose" {
        /// The time that the estimate is for: the newest measurement in it, predicted to the step's `now`.
        pub estimated_ns: u64,
        /// Since when neither a particle set that trusts itself nor a flow sensor has held the velocity; zero: it is held.
        pub adrift_ns: u64,
        /// Plan frame.
        pub x_m: f32,
        /// Plan frame.
        pub y_m: f32,
        /// Plan frame, -pi..pi.
        pub heading_rad: f32,
        /// Plan frame.
        pub velocity_x_m_s: f32,
        /// Plan frame.
        pub velocity_y_m_s: f32,
        /// Covariance xx, m2.
        pub variance_x_m2: f32,
        /// Covariance xy, m2.
        pub covariance_xy_m2: f32,
        /// Covariance yy, m2.
        pub variance_y_m2: f32,
        /// Standard deviation of the heading.
        pub heading_sigma_rad: f32,
        /// Standard deviation of each velocity component.
        pub velocity_sigma_m_s: f32,
        /// Acceleration that the tilt does not explain (moving air, errors of the attitude), plan frame; NaN when
        /// nothing is known of it.
        pub air_x_m_s2: f32,
        /// See `air_x_m_s2`.
        pub air_y_m_s2: f32,
        /// Plan heading minus compass yaw: to be added to `flight/attitude` yaw.
        pub heading_offset_rad: f32,
        /// What the controller's roll reads when the body is level.
        pub level_roll_rad: f32,
        /// What the controller's pitch reads when the body is level.
        pub level_pitch_rad: f32,
        /// 1 / sum of squared normalised weights.
        pub effective_particles: f32,
        /// Probability that the true place is not the one said here, 0..1.
        pub p_lost: f32,
        /// Particles in use.
        pub particles: u32,
        /// A [`LocalizationState`] code in the low byte.
        pub state: u32,
        /// Walls that answered within the last second and fit the plan.
        pub walls_in_echo: u32,
        /// 1: nobody knows yet where on the plan the drone is, and the plan is being searched. Place, velocity and heading
        /// are then in a frame of their own, whose place and turn against the plan are not known.
        pub searching: u32,
        /// Zero.
        pub reserved: u32,
    }
}

impl Pose {
    /// The larger standard deviation of the position, in any direction.
    #[must_use]
    pub fn sigma_m(&self) -> f32 {
        let mean = 0.5 * (self.variance_x_m2 + self.variance_y_m2);
        let half = 0.5 * (self.variance_x_m2 - self.variance_y_m2);
        (mean + half.hypot(self.covariance_xy_m2)).max(0.0).sqrt()
    }
}

message! {
    /// The particle set itself: columns in shared memory, the filter's working memory.
    pub struct Particles on "localization/particles" {
        /// Time the set is for.
        pub estimated_ns: u64,
        /// Updates since the filter started.
        pub updates: u64,
        /// State of the filter's random number generator after this update.
        pub generator: [u64; 4],
        /// Slow averages that must survive a restart; their meaning is the filter's.
        pub memory: [f32; 16],
        /// Particles in use; more than [`MAX_PARTICLES`] is a broken message.
        pub count: u32,
        /// Hash of the plan the set lives on, folded to 32 bits: a set for another plan is not used.
        pub plan: u32,
        /// Plan frame, metres.
        pub x_m: [f32; 50_000],
        /// Plan frame, metres.
        pub y_m: [f32; 50_000],
        /// Plan frame, metres a second.
        pub velocity_x_m_s: [f32; 50_000],
        /// Plan frame, metres a second.
        pub velocity_y_m_s: [f32; 50_000],
        /// Plan heading minus compass yaw.
        pub heading_offset_rad: [f32; 50_000],
        /// Level error in roll.
        pub level_roll_rad: [f32; 50_000],
        /// Level error in pitch.
        pub level_pitch_rad: [f32; 50_000],
        /// Normalised weights (equation 4), summing to 1.
        pub weight: [f32; 50_000],
    }
}
