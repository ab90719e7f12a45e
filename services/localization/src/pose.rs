//! The estimate as a message.

use crate::predict::Predicted;
use ipc_types::{LocalizationState, MAX_SONARS, Pose};
use mcl::{Estimate, State};

/// A sensor counts among the walls in echo for so long after it fitted, nanoseconds.
const FRESH_NS: u64 = 1_000_000_000;

/// When each sensor last heard what the plan promises.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Walls([u64; MAX_SONARS]);

impl Walls {
    pub(crate) fn take(&mut self, sensors: &[u8], fits: u32, time_ns: u64) {
        for (i, sensor) in sensors.iter().enumerate() {
            if fits >> i & 1 == 1
                && let Some(last) = self.0.get_mut(usize::from(*sensor))
            {
                *last = time_ns;
            }
        }
    }

    pub(crate) fn in_echo(&self, now: u64) -> u32 {
        self.0.iter().filter(|t| **t > 0 && now.saturating_sub(**t) <= FRESH_NS).count() as u32
    }
}

/// Fills every field but the header and `adrift_ns`.
pub(crate) fn fill(pose: &mut Pose, now: u64, e: &Estimate, p: &Predicted, particles: usize, walls: u32) {
    pose.estimated_ns = now;
    pose.x_m = p.position[0];
    pose.y_m = p.position[1];
    pose.heading_rad = p.heading;
    pose.velocity_x_m_s = p.velocity[0];
    pose.velocity_y_m_s = p.velocity[1];
    pose.variance_x_m2 = e.variance_x + p.variance;
    pose.covariance_xy_m2 = e.covariance_xy;
    pose.variance_y_m2 = e.variance_y + p.variance;
    pose.heading_sigma_rad = e.heading_sigma;
    pose.velocity_sigma_m_s = p.velocity_sigma;
    [pose.air_x_m_s2, pose.air_y_m_s2] = p.air;
    pose.heading_offset_rad = e.heading_offset;
    pose.level_roll_rad = e.level_roll;
    pose.level_pitch_rad = e.level_pitch;
    pose.effective_particles = e.effective;
    pose.p_lost = e.p_lost;
    pose.particles = particles as u32;
    let state = match e.state {
        State::Lost => LocalizationState::Lost,
        State::Converging => LocalizationState::Converging,
        State::Tracking => LocalizationState::Tracking,
    };
    pose.state = u32::from(state.code());
    pose.walls_in_echo = walls;
}
