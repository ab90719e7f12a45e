//! Attitude at any recent time, and the rates between two times.

use ipc_types::Attitude;

/// Samples kept: half a second at 30 a second.
const KEPT: usize = 16;
/// Most time between two samples to interpolate over, or beyond the newest to extrapolate to.
const GAP_NS: u64 = 120_000_000;
/// Yaw comes in whole degrees: its rate is taken over at least this time.
const YAW_SPAN_NS: u64 = 150_000_000;

/// Attitude and body rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt {
    /// Right side down positive, radians.
    pub roll_rad: f32,
    /// Nose down positive, radians.
    pub pitch_rad: f32,
    /// Body rate about x, right side down positive, rad/s.
    pub roll_rate: f32,
    /// Body rate about y, nose down positive, rad/s.
    pub pitch_rate: f32,
    /// An end of the interval lies beyond the newest sample.
    pub extrapolated: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    at_ns: u64,
    roll: f32,
    pitch: f32,
    yaw: f32,
}

/// The newest attitudes, oldest first.
#[derive(Debug, Clone, Default)]
pub struct TiltHistory {
    samples: [Sample; KEPT],
    count: usize,
}

fn seconds(from: u64, to: u64) -> f32 {
    (to.saturating_sub(from) as f64 * 1e-9) as f32
}

fn turn(from: f32, to: f32) -> f32 {
    (to - from + core::f32::consts::PI).rem_euclid(core::f32::consts::TAU) - core::f32::consts::PI
}

impl TiltHistory {
    /// Adds an attitude; false when it makes no sense or is not newer than the last.
    pub fn push(&mut self, attitude: &Attitude) -> bool {
        let sample = Sample {
            at_ns: attitude.sampled_ns,
            roll: attitude.roll_rad,
            pitch: attitude.pitch_rad,
            yaw: attitude.yaw_rad,
        };
        let newest = self.newest_ns();
        if !(sample.roll + sample.pitch + sample.yaw).is_finite()
            || newest.is_some_and(|at| sample.at_ns <= at)
        {
            return false;
        }
        if self.count == KEPT {
            self.samples.copy_within(1.., 0);
            self.count -= 1;
        }
        self.samples[self.count] = sample;
        self.count += 1;
        true
    }

    fn filled(&self) -> &[Sample] {
        self.samples.get(..self.count).unwrap_or(&[])
    }

    /// When the newest was sampled.
    #[must_use]
    pub fn newest_ns(&self) -> Option<u64> {
        self.filled().last().map(|sample| sample.at_ns)
    }

    /// Roll and pitch at a time, on the line through the two samples around it (or the two newest).
    fn at(&self, time_ns: u64) -> Option<(f32, f32)> {
        let after = self.filled().iter().position(|sample| sample.at_ns >= time_ns);
        let second = after.unwrap_or(self.count.checked_sub(1)?).max(1);
        let (a, b) = (self.filled().get(second - 1)?, self.filled().get(second)?);
        let beyond = time_ns.saturating_sub(b.at_ns).max(a.at_ns.saturating_sub(time_ns));
        if b.at_ns - a.at_ns > GAP_NS || beyond > GAP_NS {
            return None;
        }
        let share = (time_ns as f64 - a.at_ns as f64) / (b.at_ns - a.at_ns) as f64;
        let share = share as f32;
        Some((a.roll + share * (b.roll - a.roll), a.pitch + share * (b.pitch - a.pitch)))
    }

    fn yaw_rate(&self, end_ns: u64) -> f32 {
        let filled = self.filled();
        let Some(last) = filled.iter().rposition(|sample| sample.at_ns <= end_ns) else { return 0.0 };
        let end = filled[last];
        let start = filled[..last].iter().rev().find(|sample| end.at_ns - sample.at_ns >= YAW_SPAN_NS);
        start.map_or(0.0, |start| turn(start.yaw, end.yaw) / seconds(start.at_ns, end.at_ns))
    }

    /// Mean attitude and body rates between two times; `None` when attitudes are missing there.
    #[must_use]
    pub fn between(&self, start_ns: u64, end_ns: u64) -> Option<Tilt> {
        let (roll0, pitch0) = self.at(start_ns)?;
        let (roll1, pitch1) = self.at(end_ns)?;
        let span = seconds(start_ns, end_ns);
        if span <= 0.0 {
            return None;
        }
        let (roll, pitch) = (0.5 * (roll0 + roll1), 0.5 * (pitch0 + pitch1));
        let yaw_rate = self.yaw_rate(end_ns);
        // Body rates from Euler rates, order yaw, pitch, roll.
        Some(Tilt {
            roll_rad: roll,
            pitch_rad: pitch,
            roll_rate: (roll1 - roll0) / span - yaw_rate * pitch.sin(),
            pitch_rate: (pitch1 - pitch0) / span * roll.cos() + yaw_rate * pitch.cos() * roll.sin(),
            extrapolated: self.newest_ns().is_some_and(|newest| newest < end_ns),
        })
    }
}
