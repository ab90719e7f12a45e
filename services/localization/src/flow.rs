//! Optical-flow frames waiting to be used.

use crate::attitude::{Attitudes, seconds};
use mcl::{Flow, wrap_angle};

/// Frames kept: a third of a second at 50 Hz.
const KEPT: usize = 16;
/// Older frames say nothing about the velocity now, seconds.
const OLDEST_S: f64 = 0.25;
/// What a frame may differ from the expected velocity, m/s, beside four of its sigmas.
const GATE_M_S: f32 = 0.6;
/// After so many frames in a row outside the gate it is the expectation that is wrong.
const INSISTENT: u32 = 8;
/// Averaging helps less than independence would have it: the sensor's scale errs for all frames alike.
const LEAST_SHARE: f32 = 0.6;
/// m/s².
const GRAVITY: f32 = 9.806_65;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Frame {
    pub(crate) time_ns: u64,
    /// Body frame.
    pub(crate) velocity: [f32; 2],
    pub(crate) sigma: f32,
}

/// Frames that no update has used yet.
#[derive(Clone, Debug, Default)]
pub struct Flows {
    frames: [Frame; KEPT],
    count: usize,
    outside: u32,
}

impl Flows {
    /// Takes a frame measured at `time_ns`: velocity over the ground in the body frame and its standard
    /// deviation, m/s. False when it makes no sense.
    pub fn push(&mut self, time_ns: u64, velocity: [f32; 2], sigma: f32) -> bool {
        // No indoor drone flies faster than 10 m/s.
        let sane = time_ns > 0 && velocity.iter().all(|v| v.abs() < 10.0) && (1e-3..=5.0).contains(&sigma);
        if !sane {
            return false;
        }
        if self.count == KEPT {
            self.frames.copy_within(1.., 0);
            self.count -= 1;
        }
        self.frames[self.count] = Frame { time_ns, velocity, sigma };
        self.count += 1;
        true
    }

    pub(crate) fn waiting(&self) -> &[Frame] {
        &self.frames[..self.count]
    }

    /// Forgets the newest frame when it is too far from the velocity expected in the body frame; unless
    /// that has happened too often in a row. The frame, when it stays.
    pub(crate) fn gate(&mut self, expected: [f32; 2]) -> Option<Frame> {
        let newest = *self.waiting().last()?;
        let miss = (newest.velocity[0] - expected[0]).hypot(newest.velocity[1] - expected[1]);
        if miss > GATE_M_S + 4.0 * newest.sigma && self.outside < INSISTENT {
            self.outside += 1;
            self.count -= 1;
            None
        } else {
            self.outside = 0;
            Some(newest)
        }
    }

    /// Uses up the frames measured before `time_ns`: their mean as a velocity at `time_ns`, in the body
    /// frame of that time, each carried on by the acceleration that the tilt since has given (less
    /// `level`, roll and pitch).
    pub fn take(&mut self, time_ns: u64, attitudes: &Attitudes, level: [f32; 2]) -> Option<Flow> {
        let now = attitudes.at(time_ns)?;
        let (mut sum, mut sigma, mut used) = ([0.0f32; 2], 0.0, 0.0);
        let mut left = 0;
        for i in 0..self.count {
            let frame = self.frames[i];
            let age = seconds(frame.time_ns, time_ns);
            if age < 0.0 {
                self.frames[left] = frame;
                left += 1;
                continue;
            }
            if age > OLDEST_S {
                continue;
            }
            let between = attitudes.mean(frame.time_ns, time_ns);
            let turn = attitudes.at(frame.time_ns).map_or(0.0, |then| wrap_angle(then.yaw - now.yaw));
            let (sin, cos) = turn.sin_cos();
            let [x, y] = frame.velocity;
            let forward = GRAVITY * (between.pitch - level[1]).tan();
            let leftward = -GRAVITY * (between.roll - level[0]).tan();
            sum[0] += cos * x - sin * y + forward * age as f32;
            sum[1] += sin * x + cos * y + leftward * age as f32;
            sigma += frame.sigma;
            used += 1.0f32;
        }
        self.count = left;
        let share = (1.0 / used.sqrt()).max(LEAST_SHARE);
        (used > 0.0).then(|| Flow {
            velocity_x: sum[0] / used,
            velocity_y: sum[1] / used,
            sigma: sigma / used * share,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Flows;
    use crate::Attitudes;

    const MS: u64 = 1_000_000;

    fn level() -> Attitudes {
        let mut a = Attitudes::default();
        for i in 1..40 {
            a.push(i * 33 * MS, 0.0, 0.1, 0.0);
        }
        a
    }

    #[test]
    fn frames_are_carried_on_by_the_tilt() {
        let mut flows = Flows::default();
        assert!(flows.push(900 * MS, [0.5, 0.0], 0.08));
        let flow = flows.take(1000 * MS, &level(), [0.0, 0.0]).unwrap();
        assert!((flow.velocity_x - (0.5 + 9.81 * 0.1f32.tan() * 0.1)).abs() < 2e-3, "{flow:?}");
        assert!(flows.take(1000 * MS, &level(), [0.0; 2]).is_none(), "a frame is used once");
    }

    #[test]
    fn later_frames_wait_and_old_ones_are_dropped() {
        let mut flows = Flows::default();
        for (time, v) in [(500, 3.0), (980, 0.2), (1020, 0.4)] {
            flows.push(time * MS, [v, 0.0], 0.08);
        }
        let flow = flows.take(1000 * MS, &level(), [0.0, 0.1]).unwrap();
        assert!((flow.velocity_x - 0.2).abs() < 1e-3, "{flow:?}");
        assert_eq!(flows.waiting().len(), 1);
    }

    #[test]
    fn a_frame_far_from_expected_is_dropped_until_it_insists() {
        let mut flows = Flows::default();
        for i in 0..9 {
            flows.push((900 + i) * MS, [3.0, 0.0], 0.08);
            flows.gate([0.0, 0.0]);
            assert_eq!(flows.waiting().len(), usize::from(i == 8), "frame {i}");
        }
        assert!(!flows.push(2, [f32::NAN, 0.0], 0.1) && !flows.push(2, [0.0, 0.0], 0.0));
    }
}
