//! What was found in the way: marked on the map, doors taken for shut, places given up after a number of tries.

use crate::journey::{Journey, MAX_GIVEN_UP, SAME_STOP_M};
use crate::place::Place;
use crate::setbacks::across;
use avoid::Window;
use avoid::swath::for_each_certain;

/// Things are taken for standing in the way this far ahead and this far to the side, metres.
const AHEAD_M: f32 = 1.3;
const BESIDE_M: f32 = 0.45;
/// A blockage nearer than this to a door's line is the door, metres: a leaf is ajar by a little.
const DOOR_M: f32 = 0.35;
/// What is marked for the rest of the round was heard twice in one place.
const SURE_CERTAINTY: u8 = 16;
/// A drone nearer than this to the line between the posts would have the leaf in its propellers, metres.
const IN_DOOR_M: f32 = 0.4;
/// Half of the stretch stamped when nothing was seen and still there was no progress, metres.
const UNSEEN_HALF_M: f32 = 0.15;

impl Journey {
    /// Something stands in the way, or the drone does not get on: remembers what the sonars have seen there, and gives the
    /// place up that it was flying to after a number of tries. `towards` is the direction of the way.
    pub fn obstruct(&mut self, place: &Place, towards: f32, cells: &[u8], window: &Window) {
        if !towards.is_finite() {
            return;
        }
        let (sin, cos) = towards.sin_cos();
        let mut nearest = f32::INFINITY;
        let (mut heard, mut in_door, mut there) = (0u32, 0u32, (0.0, 0.0));
        let map = &mut self.map;
        for_each_certain(cells, SURE_CERTAINTY, |index| {
            let (x, y) = window.centre(index);
            let (dx, dy) = (x - place.x, y - place.y);
            let (along, aside) = (dx * cos + dy * sin, dy * cos - dx * sin);
            if along > 0.0 && along < AHEAD_M && aside.abs() < BESIDE_M {
                map.mark_unmapped(x, y);
                nearest = nearest.min(along);
                heard += 1;
                if map.door_near(x, y, DOOR_M).is_some() {
                    (in_door, there) = (in_door + 1, (x, y));
                }
            }
        });
        if nearest.is_finite() {
            // A cone enters some of what it hears of a leaf before or behind it.
            let ahead = (place.x + nearest * cos, place.y + nearest * sin);
            let (x, y) = if 2 * in_door >= heard { there } else { ahead };
            if !self.shut_door(place, x, y) && self.setbacks.note(ahead.0, ahead.1, towards) {
                across(ahead.0, ahead.1, towards, |x, y| self.map.mark_unmapped(x, y));
            }
        } else {
            nearest = self.map.limits().radius_m + UNSEEN_HALF_M;
            for aside in [-UNSEEN_HALF_M, 0.0, UNSEEN_HALF_M] {
                self.map.mark_unmapped(
                    place.x + nearest * cos - aside * sin,
                    place.y + nearest * sin + aside * cos,
                );
            }
        }
        self.count_try();
    }

    /// What was seen in a door is the door, unless the drone itself stands in it. Whether it is.
    fn shut_door(&mut self, place: &Place, x: f32, y: f32) -> bool {
        let Some(door) = self.map.door_near(x, y, DOOR_M) else { return false };
        if self.map.doors().get(door).is_some_and(|door| door.distance(place.x, place.y) < IN_DOOR_M) {
            return false;
        }
        self.map.set_door(door, true);
        if let Some(times) = self.found_shut.get_mut(door) {
            *times += 1;
        }
        self.review = true;
        // The line between the posts is marked too: it survives a restart, the door's state does not.
        if let Some((a, b)) = self.map.doors().get(door).map(|door| (door.a, door.b)) {
            for i in 0..=8 {
                let t = i as f32 / 8.0;
                self.map.mark_unmapped(a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            }
        }
        true
    }

    fn count_try(&mut self) {
        let Some(stop) = self.stops.get(self.target).filter(|stop| stop.look) else {
            return;
        };
        if (self.tried.0 - stop.x).hypot(self.tried.1 - stop.y) < SAME_STOP_M {
            self.tries += 1;
        } else {
            (self.tried, self.tries) = ((stop.x, stop.y), 1);
        }
        if self.tries >= self.max_tries && self.given_up.len() < MAX_GIVEN_UP {
            self.given_up.push((stop.x, stop.y));
            self.tries = 0;
        }
    }
}
