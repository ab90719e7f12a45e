//! What goes from set to set beside the particles.

use crate::maths::wrap_angle;
use core::f32::consts::PI;

/// The mean of the heading offset is followed this slowly, seconds of being sure of the place: a round past several of the
/// things that turn a compass.
const HEADING_MEAN_S: f32 = 120.0;

/// The slow quantities that must survive a restart along with the set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// Probability of being lost, 0..=1.
    pub p_lost: f32,
    /// Effective sample size of the set it goes with.
    pub effective: f32,
    /// Particles wanted in the next set.
    pub wanted: f32,
    /// What the heading offset wanders about, radians; `None` while nothing is known of it.
    pub heading_mean: Option<f32>,
}

impl Memory {
    /// For a message.
    #[must_use]
    pub fn to_array(&self) -> [f32; 16] {
        let mut out = [0.0; 16];
        [out[0], out[1], out[2]] = [self.p_lost, self.effective, self.wanted];
        out[3] = self.heading_mean.unwrap_or(f32::NAN);
        out
    }

    /// From a message; values that make no sense become doubtful ones.
    #[must_use]
    pub fn from_array(array: &[f32; 16]) -> Self {
        let sane = |v: f32, otherwise: f32| if v.is_finite() && v >= 0.0 { v } else { otherwise };
        Self {
            p_lost: sane(array[0], 0.5).min(1.0),
            effective: sane(array[1], 0.0),
            wanted: sane(array[2], 0.0),
            heading_mean: Some(array[3]).filter(|mean| mean.abs() <= PI),
        }
    }

    /// The mean of the heading offset after `sure_s` more seconds with this one.
    pub(crate) fn heading_mean_after(&self, sure_s: f32, offset: f32) -> Option<f32> {
        let share = if sure_s > 0.0 { (sure_s / HEADING_MEAN_S).min(1.0) } else { 0.0 };
        self.heading_mean.map(|mean| wrap_angle(mean + share * wrap_angle(offset - mean)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_survives_a_message_and_what_makes_no_sense_is_doubt() {
        let memory = Memory { p_lost: 0.02, effective: 900.0, wanted: 2_000.0, heading_mean: Some(-3.1) };
        assert_eq!(Memory::from_array(&memory.to_array()), memory);
        let unknown = Memory { heading_mean: None, ..memory };
        assert_eq!(Memory::from_array(&unknown.to_array()), unknown);
        let mut told = [0.0; 16];
        told[..4].copy_from_slice(&[f32::NAN, -1.0, f32::INFINITY, 7.0]);
        let nonsense = Memory::from_array(&told);
        assert_eq!(nonsense, Memory { p_lost: 0.5, effective: 0.0, wanted: 0.0, heading_mean: None });
    }

    #[test]
    fn the_mean_follows_in_minutes_the_short_way_round() {
        let mut memory = Memory { p_lost: 0.0, effective: 1.0, wanted: 1.0, heading_mean: Some(3.0) };
        for _ in 0..120 {
            memory.heading_mean = memory.heading_mean_after(1.0, -3.0);
        }
        // Two thirds of the 0.28 rad across the half turn.
        let way = wrap_angle(memory.heading_mean.unwrap() - 3.0);
        assert!((0.15..0.21).contains(&way), "{way}");
        assert_eq!(Memory { heading_mean: None, ..memory }.heading_mean_after(1.0, 1.0), None);
    }
}
