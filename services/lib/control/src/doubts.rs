//! Heights that did not fit, one after the other, and the straight line that they lie on.

use crate::held::seconds;

/// Doubted readings looked at together: a third of a second.
pub(crate) const DOUBTS: usize = 6;
/// Doubted readings farther apart than this do not belong together, seconds.
pub(crate) const DOUBT_APART_S: f32 = 0.4;
/// Two readings that differ by more are of different things, metres: 0.2 s of free fall end in 0.12 m a reading.
const ANOTHER_M: f32 = 0.35;

/// Readings in a row that did not fit: when, and by how much.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Doubts {
    pub(crate) count: usize,
    at_ns: [u64; DOUBTS],
    pub(crate) error_m: [f32; DOUBTS],
}

/// The straight line through doubted errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    /// At the newest reading, metres.
    pub(crate) error_m: f32,
    /// Growth, metres a second.
    pub(crate) slope_m_s: f32,
    /// Rms distance of the readings from it, metres.
    pub(crate) scatter_m: f32,
}

impl Doubts {
    pub(crate) fn last(&self) -> Option<(u64, f32)> {
        let last = self.count.checked_sub(1)?;
        Some((self.at_ns[last], self.error_m[last]))
    }

    /// Appends a reading; begins anew when it is late or tells of something else.
    pub(crate) fn push(&mut self, at_ns: u64, error_m: f32) {
        if self.last().is_some_and(|(at, error)| {
            seconds(at, at_ns) > DOUBT_APART_S || (error - error_m).abs() > ANOTHER_M
        }) {
            self.count = 0;
        }
        if self.count == DOUBTS {
            self.at_ns.rotate_left(1);
            self.error_m.rotate_left(1);
            self.count -= 1;
        }
        (self.at_ns[self.count], self.error_m[self.count]) = (at_ns, error_m);
        self.count += 1;
    }

    /// Least squares; `None` with fewer than three readings.
    pub(crate) fn line(&self) -> Option<Line> {
        let n = self.count as f32;
        let (newest, _) = self.last().filter(|_| self.count >= 3)?;
        let points = || {
            let times = self.at_ns[..self.count].iter().map(|at| -seconds(*at, newest));
            times.zip(&self.error_m[..self.count])
        };
        let (t, e) = points().fold((0.0, 0.0), |(t, e), (time, error)| (t + time / n, e + error / n));
        let (tt, te) = points().fold((0.0, 0.0), |(tt, te), (time, error)| {
            (tt + (time - t) * (time - t), te + (time - t) * (error - e))
        });
        let slope_m_s = if tt > 1e-6 { te / tt } else { 0.0 };
        let error_m = e - slope_m_s * t;
        let scatter =
            points().map(|(time, error)| (error - error_m - slope_m_s * time).powi(2)).sum::<f32>() / n;
        Some(Line { error_m, slope_m_s, scatter_m: scatter.sqrt() })
    }
}
