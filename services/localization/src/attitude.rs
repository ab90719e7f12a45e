//! The attitude's recent past: an update needs it at the time of a ping, not at the time of the message.

use mcl::wrap_angle;

/// Samples kept: two seconds at 30 Hz.
const KEPT: usize = 64;
/// A sample stands for the time around it up to this, seconds: four times its usual period.
const REACH_S: f64 = 0.13;
/// Beyond the newest sample the yaw goes on turning for so long, seconds.
const EXTRAPOLATE_S: f64 = 0.06;
/// Points of an interval that its mean is taken over.
const POINTS: u32 = 5;

/// No accelerometer feels more indoors, m/s²: three g are a crash.
const MOST_FORCE_M_S2: f32 = 30.0;

/// One attitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tilt {
    pub(crate) roll: f32,
    pub(crate) pitch: f32,
    pub(crate) yaw: f32,
    /// Specific force along body x and y, m/s²; NaN when it is not known.
    pub(crate) force: [f32; 2],
}

impl Default for Tilt {
    fn default() -> Self {
        Self { roll: 0.0, pitch: 0.0, yaw: 0.0, force: [f32::NAN; 2] }
    }
}

/// A ring of attitudes in the order of their times.
#[derive(Clone, Debug)]
pub struct Attitudes {
    ring: [(u64, Tilt); KEPT],
    next: usize,
    filled: usize,
}

/// The attitude over an interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mean {
    /// Right side down positive, radians.
    pub roll: f32,
    /// Nose down positive, radians.
    pub pitch: f32,
    /// Compass frame, radians.
    pub yaw: f32,
    /// Specific force along body x and y, m/s²; NaN when some of it is not known.
    pub force: [f32; 2],
    /// How much of the interval no sample stands for, seconds.
    pub blind_s: f32,
}

impl Default for Attitudes {
    fn default() -> Self {
        Self { ring: [(0, Tilt::default()); KEPT], next: 0, filled: 0 }
    }
}

impl Attitudes {
    /// Appends a sample; false when it makes no sense or is older than the newest one.
    pub fn push(&mut self, time_ns: u64, roll: f32, pitch: f32, yaw: f32) -> bool {
        self.push_felt(time_ns, roll, pitch, yaw, [f32::NAN; 2])
    }

    /// The same with the specific force along body x and y, m/s²; NaN when it is not known.
    pub fn push_felt(&mut self, time_ns: u64, roll: f32, pitch: f32, yaw: f32, force: [f32; 2]) -> bool {
        // Half a turn bounds any roll; the yaw may have been counted on for many turns, not for ever.
        let sane = roll.abs() <= 3.2 && pitch.abs() <= 3.2 && yaw.abs() < 1e3;
        if !sane || time_ns == 0 || self.newest().is_some_and(|n| time_ns <= n.0) {
            return false;
        }
        let force = force.map(|axis| if axis.abs() < MOST_FORCE_M_S2 { axis } else { f32::NAN });
        self.ring[self.next] = (time_ns, Tilt { roll, pitch, yaw: wrap_angle(yaw), force });
        self.next = (self.next + 1) % KEPT;
        self.filled = (self.filled + 1).min(KEPT);
        true
    }

    /// Whether nothing came yet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.filled == 0
    }

    /// Number of samples kept.
    #[must_use]
    pub fn len(&self) -> usize {
        self.filled
    }

    /// `back` samples before the newest.
    fn sample(&self, back: usize) -> Option<(u64, Tilt)> {
        (back < self.filled).then(|| self.ring[(self.next + 2 * KEPT - 1 - back) % KEPT])
    }

    pub(crate) fn newest(&self) -> Option<(u64, Tilt)> {
        self.sample(0)
    }

    /// The attitude at a time: between samples interpolated; after the newest one its tilt is held and
    /// its yaw turned on for a moment; before the oldest one that one. `None` without samples.
    pub(crate) fn at(&self, time_ns: u64) -> Option<Tilt> {
        let newest = self.newest()?;
        if time_ns >= newest.0 {
            let ahead = seconds(newest.0, time_ns).min(EXTRAPOLATE_S);
            let rate = self.sample(1).map_or(0.0, |before| {
                let dt = seconds(before.0, newest.0);
                // A gap says nothing about a rate.
                if dt < REACH_S {
                    f64::from(wrap_angle(newest.1.yaw - before.1.yaw)) / dt.max(1e-3)
                } else {
                    0.0
                }
            });
            // Faster turns are a compass that jumped.
            let turned = rate.clamp(-4.0, 4.0) * ahead;
            return Some(Tilt { yaw: wrap_angle(newest.1.yaw + turned as f32), ..newest.1 });
        }
        let mut after = newest;
        for back in 1..self.filled {
            let Some(before) = self.sample(back) else { break };
            if before.0 <= time_ns {
                let part = (seconds(before.0, time_ns) / seconds(before.0, after.0)) as f32;
                let between = |a: f32, b: f32| a + part * (b - a);
                return Some(Tilt {
                    roll: between(before.1.roll, after.1.roll),
                    pitch: between(before.1.pitch, after.1.pitch),
                    yaw: wrap_angle(before.1.yaw + part * wrap_angle(after.1.yaw - before.1.yaw)),
                    force: [0, 1].map(|axis| between(before.1.force[axis], after.1.force[axis])),
                });
            }
            after = before;
        }
        Some(after.1)
    }

    /// The mean over an interval, and how much of it is guesswork. Without samples all zeros, blind.
    #[must_use]
    pub fn mean(&self, from_ns: u64, to_ns: u64) -> Mean {
        let length = seconds(from_ns, to_ns).max(0.0);
        let mut mean = Mean { blind_s: length as f32, ..Mean::default() };
        let Some(first) = self.at(from_ns) else { return mean };
        let (mut yaw, share) = (0.0, 1.0 / POINTS as f32);
        let mut blind = 0;
        for point in 0..POINTS {
            // Middles of equal parts.
            let time = from_ns + (length * 1e9 * (f64::from(point) + 0.5) / f64::from(POINTS)) as u64;
            let tilt = self.at(time).unwrap_or(first);
            if self.known(time) {
                mean.roll += tilt.roll * share;
                mean.pitch += tilt.pitch * share;
                mean.force = [0, 1].map(|axis| mean.force[axis] + tilt.force[axis] * share);
            } else {
                // Level, on average: that is how indoor drones fly.
                blind += 1;
                mean.force = [f32::NAN; 2];
            }
            yaw += wrap_angle(tilt.yaw - first.yaw) * share;
        }
        mean.yaw = wrap_angle(first.yaw + yaw);
        mean.blind_s = (length * f64::from(blind) / f64::from(POINTS)) as f32;
        mean
    }

    /// Whether a sample stands for this time.
    fn known(&self, time_ns: u64) -> bool {
        (0..self.filled).filter_map(|back| self.sample(back)).any(|s| seconds(s.0, time_ns).abs() <= REACH_S)
    }

    /// Mean of all samples kept: for the ground, where nothing changes. `None` without samples.
    pub(crate) fn resting(&self) -> Option<Tilt> {
        let first = self.newest()?.1;
        let share = 1.0 / self.filled as f32;
        let mut mean = Tilt { yaw: first.yaw, ..Tilt::default() };
        for sample in (0..self.filled).filter_map(|back| self.sample(back)) {
            mean.roll += sample.1.roll * share;
            mean.pitch += sample.1.pitch * share;
            mean.yaw += wrap_angle(sample.1.yaw - first.yaw) * share;
        }
        mean.yaw = wrap_angle(mean.yaw);
        Some(mean)
    }
}

/// Seconds from one time to another, negative backwards.
pub(crate) fn seconds(from_ns: u64, to_ns: u64) -> f64 {
    ipc_types::seconds_between(from_ns, to_ns)
}

#[cfg(test)]
mod tests {
    use super::Attitudes;

    const MS: u64 = 1_000_000;

    fn turning() -> Attitudes {
        let mut a = Attitudes::default();
        for i in 0..100u64 {
            assert!(a.push(1000 * MS + i * 33 * MS, 0.01 * (i % 2) as f32, 0.05, 3.0 + 0.033 * i as f32));
        }
        a
    }

    #[test]
    fn between_samples_it_interpolates_through_the_half_turn() {
        let a = turning();
        let newest = 1000 + 99 * 33;
        let tilt = a.at((newest - 16) * MS).unwrap();
        let expected = mcl::wrap_angle(3.0 + 0.001 * (99.0 * 33.0 - 16.0));
        assert!((tilt.yaw - expected).abs() < 1e-3, "{} {expected}", tilt.yaw);
        assert!((tilt.roll - 0.005).abs() < 3e-4);
    }

    #[test]
    fn after_the_newest_the_yaw_turns_on_for_a_moment_only() {
        let a = turning();
        let newest = (1000 + 99 * 33) * MS;
        let yaw = |ms: u64| mcl::wrap_angle(a.at(newest + ms * MS).unwrap().yaw - a.at(newest).unwrap().yaw);
        assert!((yaw(30) - 0.03).abs() < 1e-3, "1 rad/s for 30 ms");
        assert!((yaw(500) - 0.06).abs() < 1e-3);
    }

    #[test]
    fn time_without_samples_is_blind_and_counts_as_level() {
        let a = turning();
        let newest = (1000 + 99 * 33) * MS;
        assert_eq!(a.mean(newest - 60 * MS, newest).blind_s, 0.0);
        let late = a.mean(newest, newest + 1000 * MS);
        assert!((late.blind_s - 0.8).abs() < 0.11, "{late:?}");
        assert!(late.pitch < 0.02, "{late:?}");
        assert_eq!(Attitudes::default().mean(0, 1000 * MS).blind_s, 1.0);
    }

    #[test]
    fn samples_that_make_no_sense_are_not_taken() {
        let mut a = Attitudes::default();
        assert!(!a.push(0, 0.0, 0.0, 0.0));
        assert!(!a.push(5, f32::NAN, 0.0, 0.0) && !a.push(5, 0.0, 0.0, f32::INFINITY));
        assert!(a.push(5, 0.0, 0.0, 0.0) && !a.push(5, 0.0, 0.0, 0.0), "time stands still");
        assert_eq!(a.len(), 1);
    }
}
