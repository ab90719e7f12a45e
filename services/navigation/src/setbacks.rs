//! Where the way was blocked before: what blocks it again in the same place is not somebody who comes by.

use avoid::wrap;

/// Blocked within this of where it was before, metres, and on a way that leads there within 60 degrees, is the same again.
const SAME_M: f32 = 0.5;
const SAME_RAD: f32 = core::f32::consts::FRAC_PI_3;
/// So often in one place: the way is closed from side to side, whatever was heard of the thing.
const CLOSED_AFTER: u32 = 2;
/// So often: it stays closed the next time that everything else is forgiven, and is tried the time after that. People turn
/// round after a while, things do not.
const LASTING_AFTER: u32 = 3;
/// Half of what is closed, metres: as far to each side as things are looked for in the way.
const HALF_M: f32 = 0.45;
/// Places remembered in one round.
const MOST: usize = 64;

/// One place where the way was blocked.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Setback {
    x: f32,
    y: f32,
    towards: f32,
    times: u32,
}

/// All of a round.
#[derive(Clone, Debug)]
pub(crate) struct Setbacks(Vec<Setback>);

impl Setbacks {
    /// None, with room for all that is remembered.
    pub(crate) fn new() -> Self {
        Self(Vec::with_capacity(MOST))
    }

    /// A new round.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// The way that leads `towards` is blocked at a place. Whether it is to be closed there.
    pub(crate) fn note(&mut self, x: f32, y: f32, towards: f32) -> bool {
        let same = |before: &&mut Setback| {
            (before.x - x).hypot(before.y - y) < SAME_M && wrap(before.towards - towards).abs() < SAME_RAD
        };
        if let Some(before) = self.0.iter_mut().find(same) {
            before.times += 1;
            return before.times >= CLOSED_AFTER;
        }
        if self.0.len() < MOST {
            self.0.push(Setback { x, y, towards, times: 1 });
        }
        false
    }

    /// Everything is forgiven: what stays closed this time, point by point.
    pub(crate) fn forgive(&mut self, mut mark: impl FnMut(f32, f32)) {
        for setback in self.0.iter_mut().filter(|setback| setback.times >= LASTING_AFTER) {
            setback.times = LASTING_AFTER - 1;
            across(setback.x, setback.y, setback.towards, &mut mark);
        }
    }
}

/// The points of a bar across a way.
pub(crate) fn across(x: f32, y: f32, towards: f32, mut mark: impl FnMut(f32, f32)) {
    let (sin, cos) = towards.sin_cos();
    let steps = (HALF_M / avoid::CELL_M) as i32;
    for step in -steps..=steps {
        let aside = step as f32 * avoid::CELL_M;
        mark(x - aside * sin, y + aside * cos);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::{FRAC_PI_2, PI};

    fn kept(setbacks: &mut Setbacks) -> usize {
        let mut points = 0;
        setbacks.forgive(|_, _| points += 1);
        points
    }

    #[test]
    fn what_blocks_the_same_way_twice_closes_it_and_thrice_longer() {
        let mut setbacks = Setbacks::new();
        assert!(!setbacks.note(4.0, 2.0, 0.1), "once: somebody may have come by");
        assert!(setbacks.note(4.3, 2.2, -0.3), "again, seen from beside");
        assert_eq!(kept(&mut setbacks), 0);
        assert!(setbacks.note(4.2, 1.9, 0.0));
        assert_eq!(kept(&mut setbacks), 19, "0.9 m from side to side in steps of 5 cm");
        assert_eq!(kept(&mut setbacks), 0, "the next time it is tried");
        assert!(setbacks.note(4.1, 2.0, 0.0), "and closed at once when it still stands there");
        assert_eq!(kept(&mut setbacks), 19);
        setbacks.clear();
        assert_eq!(kept(&mut setbacks), 0);
        assert!(!setbacks.note(4.0, 2.0, 0.1), "a new round knows nothing");
    }

    #[test]
    fn elsewhere_or_on_another_way_is_another_thing() {
        let mut setbacks = Setbacks::new();
        assert!(!setbacks.note(4.0, 2.0, 0.0));
        assert!(!setbacks.note(4.6, 2.0, 0.0), "0.6 m on");
        assert!(!setbacks.note(4.0, 2.0, FRAC_PI_2), "across");
        assert!(!setbacks.note(4.0, 2.0, PI), "from the other side");
        assert!(setbacks.note(4.0, 2.0, -0.1), "and the first is remembered");
    }

    #[test]
    fn only_so_many_are_remembered() {
        let mut setbacks = Setbacks::new();
        for i in 0..100 {
            setbacks.note(10.0 * i as f32, 0.0, 0.0);
        }
        assert_eq!(setbacks.0.len(), MOST);
        assert!(!setbacks.note(990.0, 0.0, 0.0), "the hundredth was not");
        assert!(setbacks.note(0.0, 0.0, 0.0));
    }

    #[test]
    fn the_bar_lies_across_the_way() {
        let mut points = Vec::new();
        across(1.0, 2.0, FRAC_PI_2, |x, y| points.push((x, y)));
        let (low, high) = points.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p.0), h.max(p.0)));
        assert!((low - 0.55).abs() < 1e-4 && (high - 1.45).abs() < 1e-4, "{low} {high}");
        assert!(points.iter().all(|p| (p.1 - 2.0).abs() < 1e-4));
    }
}
