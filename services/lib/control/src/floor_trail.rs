//! Where there was floor below on the way: what a drone lands on that cannot choose its place.
//!
//! While it comes down the down sonar hears less and less beside the middle: its cone is 12 cm wide at the height of a table
//! half a metre below, and the rim of the disc meets the table's edge unheard. From cruising height it hears the floor
//! as wide as the disc. So what was below is remembered along the way, and an emergency lands where the floor was seen on
//! the way in and on the way out, as near as possible.

use crate::planar::Vector;

/// Places are remembered this far apart, metres, and so many of them: five metres of way.
const APART_M: f32 = 0.1;
const PLACES: usize = 50;
/// What is below is floor up to this level, metres: as thin as what the height estimate flies over like the floor.
const FLOOR_M: f32 = 0.15;
/// Floor must be seen on both sides of a landing place, no nearer and no farther than this, metres.
const BESIDE_M: (f32, f32) = (0.15, 0.5);
/// And nothing else nearer than the disc and this, metres: what the way errs by within some metres, and the sinking itself.
const ROOM_M: f32 = 0.2;

/// A remembered place: how the way led there, and the highest level that was seen below while it was the nearest.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    at: Vector,
    level_m: f32,
}

/// The levels below along the last metres of the way. The frame does not turn with what is believed of the heading: give
/// velocities in the compass's.
#[derive(Clone, Debug)]
pub struct FloorTrail {
    radius_m: f32,
    places: [Place; PLACES],
    newest: usize,
    count: usize,
    here: Vector,
}

impl FloorTrail {
    /// Nothing seen yet; the disc's radius in metres.
    #[must_use]
    pub fn new(radius_m: f32) -> Self {
        Self { radius_m, places: [Place::default(); PLACES], newest: 0, count: 0, here: Vector::ZERO }
    }

    /// Forgets the way: after it nobody knows how it led on.
    pub fn forget(&mut self) {
        self.count = 0;
    }

    /// Goes on with a velocity for `dt` seconds. `level_m`: what is below is so much above the floor, where that is known now.
    pub fn go(&mut self, dt: f32, velocity: Vector, level_m: Option<f32>) {
        let Some(way) = (velocity * dt).known() else { return self.forget() };
        self.here += way;
        let Some(level_m) = level_m.filter(|level| level.is_finite()) else { return };
        let newest = &mut self.places[self.newest];
        if self.count > 0 && (newest.at - self.here).norm() < APART_M {
            newest.level_m = newest.level_m.max(level_m);
            return;
        }
        self.newest = (self.newest + 1) % PLACES;
        self.count = (self.count + 1).min(PLACES);
        self.places[self.newest] = Place { at: self.here, level_m };
    }

    /// The nearest place to land on, not farther than `most_m`, to be given to [`Self::way_to`]; `None` where there is none.
    #[must_use]
    pub fn nearest(&self, most_m: f32) -> Option<Vector> {
        core::iter::once(self.here)
            .chain(self.seen().map(|place| place.at))
            .filter(|at| self.way_to(*at).norm() <= most_m)
            .filter(|at| self.is_free(*at) && self.is_between(*at))
            .min_by(|a, b| self.way_to(*a).norm().total_cmp(&self.way_to(*b).norm()))
    }

    /// The way from here to a place.
    #[must_use]
    pub fn way_to(&self, place: Vector) -> Vector {
        place - self.here
    }

    /// Whether something else than floor was seen where the drone is now.
    #[must_use]
    pub fn stands_over_something(&self) -> bool {
        !self.is_free(self.here)
    }

    fn seen(&self) -> impl Iterator<Item = Place> + Clone {
        (0..self.count).map(|back| self.places[(self.newest + PLACES - back) % PLACES])
    }

    fn is_free(&self, at: Vector) -> bool {
        let near = |place: &Place| (place.at - at).norm() < self.radius_m + ROOM_M;
        !self.seen().any(|place| near(&place) && place.level_m > FLOOR_M)
    }

    fn is_between(&self, at: Vector) -> bool {
        let (from, to) = BESIDE_M;
        let beside = self.seen().map(|place| place.at - at).filter(|way| (from..=to).contains(&way.norm()));
        beside.clone().any(|one| beside.clone().any(|other| one.dot(other) < 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flies east at half a metre a second over a profile of levels: one a decimetre.
    fn flown(levels: &[f32]) -> FloorTrail {
        let mut trail = FloorTrail::new(0.225);
        for level in levels {
            for _ in 0..10 {
                trail.go(0.02, Vector::new(0.5, 0.0), Some(*level));
            }
        }
        trail
    }

    #[test]
    fn over_a_table_it_goes_back_to_where_the_floor_was_on_both_sides() {
        // Two metres of floor and the first half of a table.
        let trail = flown(&[[0.0; 20].as_slice(), &[0.75; 5]].concat());
        let way = trail.nearest(2.0).map(|at| trail.way_to(at)).unwrap_or_default();
        // Half a metre back to the edge, and the disc with some room.
        assert!((-1.15..=-0.9).contains(&way.x) && way.y == 0.0, "{way:?}");
        assert_eq!(trail.nearest(0.8), None, "farther than it may go");
        assert!(trail.stands_over_something());
    }

    #[test]
    fn at_the_end_of_the_way_only_one_side_is_known() {
        let trail = flown(&[0.0; 20]);
        let way = trail.nearest(2.0).map(|at| trail.way_to(at)).unwrap_or_default();
        assert!(!trail.stands_over_something() && (-0.35..=-0.1).contains(&way.x), "{way:?}");
        // Flown on and come back: both sides are.
        let mut back = trail;
        for _ in 0..50 {
            back.go(0.02, Vector::new(-0.5, 0.0), Some(0.0));
        }
        assert_eq!(back.nearest(2.0).map(|at| back.way_to(at)), Some(Vector::ZERO));
    }

    #[test]
    fn what_is_thin_is_floor_and_an_edge_that_was_seen_once_counts() {
        let trail = flown(&[[0.1; 20].as_slice(), &[0.0; 10]].concat());
        assert!(trail.nearest(2.0).is_some_and(|at| trail.way_to(at).x > -0.35));
        // On the spot the level flickers between table and floor.
        let mut edge = flown(&[0.0; 20]);
        for k in 0..50 {
            edge.go(0.02, Vector::ZERO, Some(if k % 2 == 0 { 0.75 } else { 0.0 }));
        }
        assert!(edge.nearest(2.0).is_some_and(|at| edge.way_to(at).x < -0.35));
    }

    #[test]
    fn nothing_known_is_no_place_and_a_way_that_is_no_number_ends_all_knowledge() {
        assert_eq!(FloorTrail::new(0.225).nearest(2.0), None);
        let mut trail = flown(&[0.0; 20]);
        trail.go(0.02, Vector::new(f32::NAN, 0.0), Some(0.0));
        assert_eq!(trail.nearest(2.0), None);
        // Unknown levels are no floor: blind for three metres.
        let mut blind = flown(&[0.0; 20]);
        for _ in 0..300 {
            blind.go(0.02, Vector::new(0.5, 0.0), None);
        }
        assert_eq!(blind.nearest(2.0), None);
    }
}
