//! Where the velocity was held last.
//!
//! On a floor that the flow sensor does not see, along a corridor in which no wall tells how far, a drone that waits for
//! something to move on drifts until nobody knows where it is. So it goes back and waits where it knew.

use crate::place::Place;
use ipc_types::seconds_between;

/// Standard deviation of a velocity that is held, m/s: a flow sensor over a good floor gives 0.02 to 0.03.
const HELD_M_S: f32 = 0.035;
/// And of one that is not: on a poor floor it grows from 0.03 to 0.1 in ten seconds.
const UNHELD_M_S: f32 = 0.05;
/// Places that are noted lie so far apart, metres: the one before the last is no edge of the good floor.
const APART_M: f32 = 0.4;
/// It goes back no farther than this, metres, and not to where it was longer ago than this, seconds.
const FARTHEST_M: f32 = 3.0;
const OLDEST_S: f64 = 40.0;

/// The last places where the velocity was held.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Firm {
    /// The newest first.
    places: [Option<(f32, f32)>; 2],
    seen_ns: u64,
    /// It waits there until the velocity is held again.
    goes_back: bool,
}

impl Firm {
    /// What was noted lies elsewhere.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Notes a place.
    pub(crate) fn see(&mut self, now: u64, place: &Place) {
        if !place.tracking || place.velocity_sigma > HELD_M_S {
            return;
        }
        self.seen_ns = now;
        if self.places[0].is_none_or(|last| place.distance(last) > APART_M) {
            self.places = [Some((place.x, place.y)), self.places[0]];
        }
    }

    /// Where to wait instead of here.
    pub(crate) fn wait_at(&mut self, now: u64, place: &Place) -> Option<(f32, f32)> {
        if place.velocity_sigma <= HELD_M_S {
            self.goes_back = false;
        } else if place.velocity_sigma > UNHELD_M_S {
            self.goes_back = true;
        }
        let known = self.goes_back && seconds_between(self.seen_ns, now) < OLDEST_S;
        self.places[1].or(self.places[0]).filter(|firm| known && place.distance(*firm) < FARTHEST_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    fn at(x: f32, velocity_sigma: f32) -> Place {
        Place { x, velocity_sigma, tracking: true, ..Place::default() }
    }

    #[test]
    fn who_waits_on_a_poor_floor_goes_back_to_the_good_one() {
        let mut firm = Firm::default();
        for step in 0..20u64 {
            firm.see(step * S / 4, &at(step as f32 * 0.1, 0.025));
        }
        // The good floor ended at 1.9 m; what is noted lies 0.4 m and more apart.
        assert_eq!(firm.wait_at(6 * S, &at(2.4, 0.04)), None, "not yet");
        let back = firm.wait_at(7 * S, &at(2.5, 0.06)).map(|(x, _)| x);
        assert!(back.is_some_and(|x| x > 0.7 && x < 1.6), "{back:?}");
        // On the way it is no better for a while: it goes on.
        assert!(firm.wait_at(8 * S, &at(2.0, 0.04)).is_some());
        assert_eq!(firm.wait_at(9 * S, &at(1.3, 0.03)), None, "there");
        // Too far, too long ago, or elsewhere.
        assert_eq!(firm.wait_at(10 * S, &at(9.0, 0.09)), None);
        assert_eq!(firm.wait_at(60 * S, &at(2.0, 0.09)), None);
        firm.forget();
        assert_eq!(firm.wait_at(11 * S, &at(2.0, 0.09)), None);
    }

    #[test]
    fn who_never_holds_a_velocity_waits_where_it_is() {
        let mut firm = Firm::default();
        for step in 0..20u64 {
            firm.see(step * S, &at(step as f32, 0.15));
        }
        assert_eq!(firm.wait_at(20 * S, &at(20.0, 0.15)), None);
    }
}
