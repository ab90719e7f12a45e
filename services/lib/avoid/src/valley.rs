//! Valleys of the histogram and the sector to fly in one: equation 15 and its traps.

use crate::histogram::SECTORS;

/// A run of free sectors, counting upwards from `first` and wrapping at 71.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Valley {
    pub(crate) first: usize,
    pub(crate) width: usize,
}

impl Valley {
    pub(crate) fn last(self) -> usize {
        (self.first + self.width - 1) % SECTORS
    }

    pub(crate) fn contains(self, sector: usize) -> bool {
        (sector + SECTORS - self.first) % SECTORS < self.width
    }

    pub(crate) fn border(self, border: Border) -> usize {
        match border {
            Border::First => self.first,
            Border::Last => self.last(),
        }
    }
}

/// An end of a valley.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Border {
    /// Its first sector, counting upwards.
    First,
    /// Its last sector.
    Last,
}

/// Sectors between two, the short way round.
pub(crate) fn apart(a: usize, b: usize) -> usize {
    let forward = (a + SECTORS - b) % SECTORS;
    forward.min(SECTORS - forward)
}

/// Calls `visit` with every valley, in the order of their first sectors.
pub(crate) fn for_each(blocked: &[u8; SECTORS], mut visit: impl FnMut(Valley)) {
    let Some(wall) = blocked.iter().position(|b| *b != 0) else {
        visit(Valley { first: 0, width: SECTORS });
        return;
    };
    // Going once round from a blocked sector, no valley is cut in two at 71/0.
    let mut width = 0;
    for step in 1..=SECTORS {
        let sector = (wall + step) % SECTORS;
        if blocked[sector] == 0 {
            width += 1;
        } else if width > 0 {
            visit(Valley { first: (sector + SECTORS - width) % SECTORS, width });
            width = 0;
        }
    }
}

/// Equation 15 from a border of the valley: the mean of the near border k_n and the far border k_f, in sectors
/// (may end in .5), and whether the valley counts as wide. A wide valley's k_f lies `s_max` sectors from k_n
/// *into* the valley, whichever border is near; a narrow valley's is its far border.
pub(crate) fn from_border(valley: Valley, near: Border, s_max: usize) -> (f32, bool) {
    let wide = valley.width > s_max;
    let reach = if wide { s_max } else { valley.width - 1 };
    let offset = match near {
        Border::First => 0.5 * reach as f32,
        Border::Last => (valley.width - 1) as f32 - 0.5 * reach as f32,
    };
    ((valley.first as f32 + offset) % SECTORS as f32, wide)
}

/// Equation 15 for a target in a free sector, which then is k_n itself: k_f lies `s_max` sectors on, or at the
/// border, towards the larger part of the valley, and always to the same side where nothing is blocked. This is what
/// circles in figure 3.9.
pub(crate) fn from_inside(valley: Valley, target: usize, s_max: usize) -> (f32, bool) {
    if valley.width >= SECTORS {
        return ((target as f32 + 0.5 * s_max as f32) % SECTORS as f32, true);
    }
    let near = (target + SECTORS - valley.first) % SECTORS;
    let upwards = 2 * near < valley.width;
    let room = if upwards { valley.width - 1 - near } else { near };
    let half = 0.5 * room.min(s_max) as f32;
    let offset = if upwards { near as f32 + half } else { near as f32 - half };
    ((valley.first as f32 + offset) % SECTORS as f32, valley.width > s_max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free(ranges: &[(usize, usize)]) -> [u8; SECTORS] {
        let mut blocked = [1u8; SECTORS];
        for (first, last) in ranges {
            let mut k = *first;
            loop {
                blocked[k] = 0;
                if k == *last {
                    break;
                }
                k = (k + 1) % SECTORS;
            }
        }
        blocked
    }

    fn valleys(blocked: &[u8; SECTORS]) -> Vec<(usize, usize)> {
        let mut all = Vec::new();
        for_each(blocked, |v| all.push((v.first, v.last())));
        all
    }

    #[test]
    fn a_valley_over_71_and_0_is_one() {
        let mut found = valleys(&free(&[(68, 4), (20, 20)]));
        found.sort_unstable();
        assert_eq!(found, [(20, 20), (68, 4)]);
        assert_eq!(valleys(&[1; SECTORS]), []);
        assert_eq!(valleys(&[0; SECTORS]), [(0, 71)]);
        assert_eq!(valleys(&free(&[(71, 71)])), [(71, 71)]);
        assert_eq!(valleys(&free(&[(0, 0)])), [(0, 0)]);
    }

    #[test]
    fn a_wide_valley_is_entered_from_either_border() {
        let valley = Valley { first: 10, width: 31 };
        assert_eq!(from_border(valley, Border::First, 8), (14.0, true));
        assert_eq!(from_border(valley, Border::Last, 8), (36.0, true));
    }

    #[test]
    fn a_narrow_valley_is_flown_in_its_middle_across_the_wrap_too() {
        for near in [Border::First, Border::Last] {
            assert_eq!(from_border(Valley { first: 10, width: 7 }, near, 8), (13.0, false));
            assert_eq!(from_border(Valley { first: 69, width: 6 }, near, 8), (71.5, false));
            assert_eq!(from_border(Valley { first: 70, width: 5 }, near, 8), (0.0, false));
        }
    }

    #[test]
    fn with_nothing_blocked_the_course_keeps_to_one_side_of_the_target() {
        let around = Valley { first: 0, width: SECTORS };
        for target in [0, 1, 35, 36, 37, 71] {
            let (middle, wide) = from_inside(around, target, 15);
            assert_eq!(middle, (target as f32 + 7.5) % SECTORS as f32);
            assert!(wide);
        }
    }

    #[test]
    fn the_middle_is_always_inside() {
        for first in [0, 1, 35, 66, 71] {
            for width in 1..SECTORS {
                let valley = Valley { first, width };
                for s_max in [1, 8, 15, 40] {
                    let check = |k: f32| {
                        assert!((0.0..SECTORS as f32).contains(&k));
                        let sector = k.round() as usize % SECTORS;
                        assert!(valley.contains(sector), "{valley:?} s_max {s_max}: {k}");
                    };
                    check(from_border(valley, Border::First, s_max).0);
                    check(from_border(valley, Border::Last, s_max).0);
                    for inside in 0..width {
                        check(from_inside(valley, (first + inside) % SECTORS, s_max).0);
                    }
                }
            }
        }
    }
}
