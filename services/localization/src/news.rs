//! How much of what is heard is news.
//!
//! A filter takes each sweep for a new witness. A drone that stands hears the same witness again and again, and what is
//! wrong with it (something that the plan does not show, a door ajar) pulls the set a little farther each time. Filters
//! on wheels do not weigh at all until the robot has moved; one that hovers drifts, so here the sweeps count less, for the weights and for the doubt.

use mcl::wrap_angle;

/// Time over which moving is looked at, seconds.
const OVER_S: f32 = 1.5;
/// Moved by so much in that time, metres, or turned, radians, all is news: 0.2 m/s, 23 degrees a second.
const FAR_M: f32 = 0.3;
const TURNED_RAD: f32 = 0.6;

/// Where the drone was a moment ago.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct News {
    /// Way and heading, both late by [`OVER_S`].
    late: Option<([f32; 2], f32)>,
    /// Time since it began, seconds: what was heard before is not known.
    age_s: f32,
}

impl News {
    /// Follows the summed-up way, plan frame, and the heading, and says how much of a sweep is news now: 0..=1.
    pub(crate) fn follow(&mut self, dt_s: f32, way: [f32; 2], heading: f32) -> f32 {
        if self.late.is_none() {
            self.age_s = 0.0;
        }
        self.age_s += dt_s.max(0.0);
        let (late, turned_from) = self.late.unwrap_or((way, heading));
        let gone = [way[0] - late[0], way[1] - late[1]];
        let turned = wrap_angle(heading - turned_from);
        let share = (dt_s / OVER_S).clamp(0.0, 1.0);
        let late = [late[0] + share * gone[0], late[1] + share * gone[1]];
        let turned_from = wrap_angle(turned_from + share * turned);
        let news = (gone[0].hypot(gone[1]) / FAR_M).hypot(turned / TURNED_RAD);
        self.late = (late.iter().all(|axis| axis.is_finite()) && turned_from.is_finite())
            .then_some((late, turned_from));
        if self.late.is_none() || self.age_s < OVER_S { 1.0 } else { news.min(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four seconds of sweeps at a speed, m/s, and a rate of turn, rad/s.
    fn after(speed: f32, rate: f32) -> f32 {
        let mut news = News::default();
        (0..67).fold(f32::NAN, |_, i| {
            let t = 0.06 * i as f32;
            news.follow(0.06, [speed * t, 0.0], wrap_angle(rate * t))
        })
    }

    #[test]
    fn a_drone_that_stands_hears_little_that_is_new() {
        assert_eq!(after(0.0, 0.0), 0.0);
        assert!(after(0.03, 0.0) < 0.2, "drift: {}", after(0.03, 0.0));
        assert!((0.6..0.9).contains(&after(0.15, 0.0)), "{}", after(0.15, 0.0));
        assert_eq!(after(0.4, 0.0), 1.0);
        assert_eq!(after(0.0, 0.8), 1.0, "it turns, past half a turn too");
    }

    #[test]
    fn nonsense_counts_in_full_and_is_forgotten() {
        let mut news = News::default();
        let rest = |news: &mut News| (0..50).fold(f32::NAN, |_, _| news.follow(0.06, [0.0; 2], 0.0));
        assert_eq!(news.follow(0.06, [0.0; 2], 0.0), 1.0, "after a restart nothing was heard before");
        assert_eq!(rest(&mut news), 0.0);
        for (dt_s, x) in [(0.06, f32::NAN), (f32::NAN, 0.0)] {
            assert_eq!(news.follow(dt_s, [x, 0.0], 0.0), 1.0);
            assert_eq!(rest(&mut news), 0.0);
        }
    }
}
