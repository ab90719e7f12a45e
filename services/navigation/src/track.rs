//! The line to follow and how far along it the drone is.

use avoid::wrap;

/// Most corners of a line.
pub const MAX_CORNERS: usize = 1100;
/// How far back and ahead on the line the drone's place on it is looked for at each step, metres. Ahead is
/// short so that a dead end flown in and out is not cut off.
const SEARCH_BACK_M: f32 = 0.3;
/// See [`SEARCH_BACK_M`].
const SEARCH_AHEAD_M: f32 = 0.6;
/// A corner sharper than this is flown up to before the line beyond is aimed at, radians: the aim would
/// otherwise fall back next to the drone.
const REVERSAL_RAD: f32 = 100.0 * core::f32::consts::PI / 180.0;
/// Points nearer together than this are one, metres: shorter pieces have no direction.
pub const SHORTEST_M: f32 = 1e-3;
/// Near enough to such a corner to have been there, metres.
const CORNER_M: f32 = 0.25;

/// A polyline with the progress along it.
#[derive(Clone, Debug, Default)]
pub struct Track {
    points: Vec<(f32, f32)>,
    /// Length of the line up to each point, metres.
    lengths: Vec<f32>,
    /// Progress, metres.
    along: f32,
    /// Distance of the drone from the line, metres.
    aside: f32,
}

impl Track {
    /// An empty line with room for [`MAX_CORNERS`]: later lines do not allocate.
    #[must_use]
    pub fn new() -> Self {
        Self {
            points: Vec::with_capacity(MAX_CORNERS),
            lengths: Vec::with_capacity(MAX_CORNERS),
            along: 0.0,
            aside: 0.0,
        }
    }

    /// Replaces the line. Points past [`MAX_CORNERS`], points that are not finite and repetitions of the point
    /// before are left out.
    pub fn set(&mut self, points: impl IntoIterator<Item = (f32, f32)>) {
        self.clear();
        for (x, y) in points {
            self.push(x, y);
        }
    }

    /// Adds a point at the end. False when it was left out.
    pub fn push(&mut self, x: f32, y: f32) -> bool {
        if self.points.len() >= MAX_CORNERS || !(x.is_finite() && y.is_finite()) {
            return false;
        }
        let last = self.points.last().zip(self.lengths.last());
        let length = last.map_or(0.0, |(last, length)| length + (x - last.0).hypot(y - last.1));
        if self.lengths.last().is_some_and(|last| length - last < SHORTEST_M) {
            return false;
        }
        self.points.push((x, y));
        self.lengths.push(length);
        true
    }

    /// Drops the first points, passed ones; the progress stays at the same place.
    pub fn forget(&mut self, points: usize) {
        let Some(cut) = self.lengths.get(points).copied() else {
            return;
        };
        self.points.drain(..points);
        self.lengths.drain(..points);
        for length in &mut self.lengths {
            *length -= cut;
        }
        self.along -= cut;
    }

    /// No line.
    pub fn clear(&mut self) {
        self.points.clear();
        self.lengths.clear();
        self.along = 0.0;
        self.aside = 0.0;
    }

    /// Whether there is nothing to follow.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Its last point.
    #[must_use]
    pub fn end(&self) -> Option<(f32, f32)> {
        self.points.last().copied()
    }

    /// Progress from the first point, metres.
    #[must_use]
    pub fn along(&self) -> f32 {
        self.along
    }

    /// What is left to fly, metres.
    #[must_use]
    pub fn remaining(&self) -> f32 {
        self.lengths.last().map_or(0.0, |length| length - self.along)
    }

    /// How far the drone is from the line, metres.
    #[must_use]
    pub fn aside(&self) -> f32 {
        self.aside
    }

    /// Index of the first point not yet passed; the number of points when all are.
    #[must_use]
    pub fn next(&self) -> usize {
        self.lengths.iter().position(|length| *length > self.along + 1e-3).unwrap_or(self.points.len())
    }

    /// Moves the progress to the nearest place on the line that is near the last progress.
    pub fn advance(&mut self, x: f32, y: f32) {
        if !(x.is_finite() && y.is_finite()) || self.points.is_empty() {
            return;
        }
        let (low, high) = (self.along - SEARCH_BACK_M, self.along + SEARCH_AHEAD_M);
        let high = self.reversal_after(self.along).map_or(high, |corner| high.min(corner));
        let mut best = (f32::INFINITY, self.along);
        for i in 1..self.points.len() {
            let (from, to) = (self.lengths[i - 1], self.lengths[i]);
            if to < low || from > high {
                continue;
            }
            let (a, b) = (self.points[i - 1], self.points[i]);
            let length = to - from;
            if length <= 0.0 {
                continue;
            }
            let (ux, uy) = ((b.0 - a.0) / length, (b.1 - a.1) / length);
            let least = (low - from).clamp(0.0, length);
            let most = (high - from).clamp(least, length);
            let t = ((x - a.0) * ux + (y - a.1) * uy).clamp(least, most);
            let distance = (a.0 + t * ux - x).hypot(a.1 + t * uy - y);
            // Of equal ones the later: progress.
            if distance <= best.0 + 1e-4 {
                best = (distance, from + t);
            }
        }
        if best.0.is_finite() {
            (self.aside, self.along) = best;
        } else if let Some(only) = self.points.first() {
            self.aside = (only.0 - x).hypot(only.1 - y);
        }
        if let Some(corner) = self.reversal_after(self.along)
            && corner - self.along < CORNER_M
        {
            let (cx, cy) = self.at(corner);
            if (cx - x).hypot(cy - y) < CORNER_M {
                // A little beyond, so that it counts as passed.
                self.along = corner + 1e-3;
            }
        }
    }

    /// Place of the first sharp corner after `along`, metres from the start.
    fn reversal_after(&self, along: f32) -> Option<f32> {
        self.points
            .windows(3)
            .zip(self.lengths.iter().skip(1))
            .filter(|(_, length)| **length > along)
            .find(|(corner, _)| {
                let into = (corner[1].1 - corner[0].1).atan2(corner[1].0 - corner[0].0);
                let out = (corner[2].1 - corner[1].1).atan2(corner[2].0 - corner[1].0);
                wrap(out - into).abs() > REVERSAL_RAD
            })
            .map(|(_, length)| *length)
    }

    /// The point this far from the start, metres.
    #[must_use]
    pub fn at(&self, along: f32) -> (f32, f32) {
        let Some(i) = self.lengths.iter().position(|length| *length >= along) else {
            return self.end().unwrap_or_default();
        };
        if i == 0 {
            return self.points[0];
        }
        let (a, b) = (self.points[i - 1], self.points[i]);
        let length = self.lengths[i] - self.lengths[i - 1];
        let t = if length > 0.0 { (along - self.lengths[i - 1]) / length } else { 1.0 };
        (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
    }

    /// The point to aim at, `look_ahead` metres on, but not beyond a sharp corner.
    #[must_use]
    pub fn aim(&self, look_ahead: f32) -> (f32, f32) {
        let along = self.along + look_ahead;
        self.at(self.reversal_after(self.along).map_or(along, |corner| along.min(corner)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(points: &[(f32, f32)]) -> Track {
        let mut track = Track::new();
        track.set(points.iter().copied());
        track
    }

    #[test]
    fn progress_follows_the_drone_and_the_aim_goes_before_it() {
        let mut track = track(&[(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)]);
        for i in 0..=10 {
            track.advance(0.1 * i as f32, 0.2);
        }
        assert!((track.along() - 1.0).abs() < 1e-4 && (track.aside() - 0.2).abs() < 1e-4);
        assert_eq!(track.next(), 1);
        assert_eq!(track.aim(0.5), (1.5, 0.0));
        let (x, y) = track.aim(1.5);
        assert!((x - 2.0).abs() < 1e-4 && (y - 0.5).abs() < 1e-4);
        assert!((track.remaining() - 3.0).abs() < 1e-4);
    }

    #[test]
    fn a_dead_end_is_flown_to_its_tip() {
        let mut track = track(&[(0.0, 0.0), (1.0, 0.0), (0.0, 0.0), (0.0, 3.0)]);
        let (mut x, mut y) = (0.0f32, 0.0f32);
        let mut tip = 0.0f32;
        for _ in 0..400 {
            track.advance(x, y);
            let (ax, ay) = track.aim(1.0);
            let (dx, dy) = (ax - x, ay - y);
            let distance = dx.hypot(dy);
            assert!(distance > 0.05 || track.remaining() < 0.1, "the aim fell onto the drone at {x} {y}");
            if distance > 0.0 {
                x += 0.025 * dx / distance;
                y += 0.025 * dy / distance;
            }
            tip = tip.max(x);
            if track.remaining() < 0.1 {
                break;
            }
        }
        assert!(tip > 0.7, "{tip}");
        assert!(track.remaining() < 0.1 && (y - 3.0).abs() < 0.3);
    }

    #[test]
    fn crossing_lines_are_not_confused() {
        let mut track = track(&[(0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (2.0, 2.0), (2.0, -2.0)]);
        for i in 0..=20 {
            track.advance(0.1 * i as f32, 0.0);
        }
        assert!((track.along() - 2.0).abs() < 1e-3, "at the crossing, on the first pass");
    }

    #[test]
    fn forgetting_what_is_passed_changes_nothing_ahead() {
        let mut track = track(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)]);
        for i in 0..=15 {
            track.advance(0.1 * i as f32, 0.0);
        }
        let (aim, remaining) = (track.aim(1.0), track.remaining());
        track.forget(1);
        assert_eq!(track.next(), 1);
        assert!((track.aim(1.0).0 - aim.0).abs() < 1e-5 && (track.remaining() - remaining).abs() < 1e-5);
        track.forget(9);
        assert!((track.remaining() - remaining).abs() < 1e-5);
    }

    #[test]
    fn empty_single_and_broken_lines_are_survived() {
        let mut empty = track(&[]);
        empty.advance(1.0, 1.0);
        assert_eq!((empty.remaining(), empty.next(), empty.end()), (0.0, 0, None));
        assert_eq!(empty.aim(1.0), (0.0, 0.0));
        let mut one = track(&[(1.0, 1.0), (f32::NAN, 0.0)]);
        one.advance(0.0, 1.0);
        assert_eq!((one.aim(1.0), one.aside()), ((1.0, 1.0), 1.0));
        let mut double = track(&[(1.0, 1.0), (1.0, 1.0), (2.0, 1.0)]);
        double.advance(1.5, 1.0);
        assert!((double.along() - 0.5).abs() < 1e-4);
        double.advance(f32::NAN, 1.0);
        assert!((double.along() - 0.5).abs() < 1e-4);
    }
}
