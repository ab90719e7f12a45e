//! Where the drone is, as far as it may be believed.

use avoid::wrap;
use ipc_types::{LocalizationState, Pose, seconds_between};

/// Farther than this from the plan's origin is no place, metres.
const FARTHEST_M: f32 = 10_000.0;
/// Longest time over which a pose is carried on by its velocity, seconds.
const LONGEST_CARRY_S: f64 = 0.3;
/// Turn rates beyond this are jumps of the estimate, radians a second.
const FASTEST_TURN_RAD_S: f32 = 3.0;

/// A place farther from where the last one led is another place, metres: a gust moves nobody half a metre in 20 ms, and
/// estimates are corrected by centimetres.
const JUMP_M: f32 = 0.5;

/// A pose that makes sense.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Time that it is for.
    pub stamp_ns: u64,
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// Plan frame, radians.
    pub heading: f32,
    /// Plan frame, metres a second.
    pub vx: f32,
    /// Plan frame, metres a second.
    pub vy: f32,
    /// Turn rate between the last two poses, radians a second.
    pub turn: f32,
    /// Larger standard deviation of the position, metres.
    pub sigma: f32,
    /// Standard deviation of the velocity, metres a second.
    pub velocity_sigma: f32,
    /// Whether localization believes in it.
    pub tracking: bool,
    /// Whether it is in a frame of localization's own, while that searches the plan.
    pub searching: bool,
}

impl Place {
    /// The message as a place; `None` when it makes no sense. `last` gives the turn rate.
    #[must_use]
    pub fn of(pose: &Pose, last: Option<&Self>) -> Option<Self> {
        let state = u8::try_from(pose.state).ok().and_then(LocalizationState::from_code)?;
        let variances = [pose.variance_x_m2, pose.covariance_xy_m2, pose.variance_y_m2];
        let finite = [pose.heading_rad, pose.velocity_x_m_s, pose.velocity_y_m_s, pose.sigma_m()]
            .iter()
            .chain(&variances)
            .all(|v| v.is_finite());
        let near = |v: f32| v.is_finite() && v.abs() <= FARTHEST_M;
        let fast = pose.velocity_x_m_s.hypot(pose.velocity_y_m_s) > 20.0;
        if !finite || fast || !near(pose.x_m) || !near(pose.y_m) || pose.estimated_ns == 0 {
            return None;
        }
        let heading = wrap(pose.heading_rad);
        let turn = last
            .map(|last| {
                (wrap(heading - last.heading), seconds_between(last.stamp_ns, pose.estimated_ns) as f32)
            })
            .filter(|(_, dt)| (0.005..0.5).contains(dt))
            .map_or(0.0, |(turned, dt)| turned / dt);
        Some(Self {
            stamp_ns: pose.estimated_ns,
            x: pose.x_m,
            y: pose.y_m,
            heading,
            vx: pose.velocity_x_m_s,
            vy: pose.velocity_y_m_s,
            turn: if turn.abs() <= FASTEST_TURN_RAD_S { turn } else { 0.0 },
            sigma: pose.sigma_m(),
            velocity_sigma: if pose.velocity_sigma_m_s.is_finite() {
                pose.velocity_sigma_m_s.abs()
            } else {
                1.0
            },
            tracking: state == LocalizationState::Tracking && pose.searching == 0,
            searching: pose.searching != 0,
        })
    }

    /// The place at another, near time.
    #[must_use]
    pub fn at(&self, now: u64) -> Self {
        let dt = seconds_between(self.stamp_ns, now).clamp(-LONGEST_CARRY_S, LONGEST_CARRY_S) as f32;
        Self {
            x: self.x + self.vx * dt,
            y: self.y + self.vy * dt,
            heading: wrap(self.heading + self.turn * dt),
            ..*self
        }
    }

    /// Whether the plan's frame has moved since `last`: what was noted in it then lies elsewhere now.
    #[must_use]
    pub fn jumped(&self, last: &Self) -> bool {
        self.searching != last.searching
            || self.distance((last.at(self.stamp_ns).x, last.at(self.stamp_ns).y)) > JUMP_M
    }

    /// Seconds since it was true.
    #[must_use]
    pub fn age_s(&self, now: u64) -> f32 {
        seconds_between(self.stamp_ns, now) as f32
    }

    /// Distance to a point, metres.
    #[must_use]
    pub fn distance(&self, (x, y): (f32, f32)) -> f32 {
        (x - self.x).hypot(y - self.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused() {
        let good = Pose { estimated_ns: 5, x_m: 1.0, y_m: 2.0, state: 2, ..Pose::default() };
        assert!(Place::of(&good, None).is_some_and(|p| p.tracking));
        for bad in [
            Pose { x_m: f32::NAN, ..good },
            Pose { y_m: 1e9, ..good },
            Pose { state: 77, ..good },
            Pose { state: 300, ..good },
            Pose { heading_rad: f32::INFINITY, ..good },
            Pose { variance_x_m2: f32::NAN, ..good },
            Pose { estimated_ns: 0, ..good },
            Pose { velocity_x_m_s: 1e6, ..good },
        ] {
            assert!(Place::of(&bad, None).is_none(), "{bad:?}");
        }
    }

    #[test]
    fn it_is_carried_on_by_its_velocity_but_not_far() {
        let place = Place { stamp_ns: 1_000_000_000, vx: 0.5, turn: 1.0, heading: 3.1, ..Place::default() };
        let later = place.at(1_200_000_000);
        assert!((later.x - 0.1).abs() < 1e-4 && later.heading < -2.9);
        assert!((place.at(9_000_000_000).x - 0.15).abs() < 1e-4);
    }
}
