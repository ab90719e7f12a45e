//! Past what stands in the way, beside the route.
//!
//! The histogram looks from where the drone is: before a gap that is 0.8 m wide every direction through it ends at what
//! stands beside it, until the drone is before its middle. So whoever stands blocked looks along the route from a little to
//! the left and right too: a straight strip that is free to its end is a way on, and the drone moves over to it first.

use super::{STANDS_CERTAINTY, Scene};
use avoid::swath::for_each_certain;

/// Strips, so far apart, metres: 0.5 m to either side.
const LANES: usize = 41;
const APART_M: f32 = 0.025;
/// Free on either side of the airframe, metres: of what the sonars have seen, which cones make wider, and of the plan.
const SEEN_M: f32 = 0.05;
const MAPPED_M: f32 = 0.07;
/// A strip is free when nothing stands in it for so long, metres.
const LONG_M: f32 = 1.3;
/// The plan is asked every so often, metres.
const STEP_M: f32 = 0.1;
/// Nearer to the middle of the strip than this the drone flies on, metres.
const IN_LANE_M: f32 = 0.07;
/// Onward, and aside for each metre that it is off, and at most: metres a second, 1/s.
const ONWARD_M_S: f32 = 0.2;
const ASIDE_PER_S: f32 = 1.0;
const ASIDE_M_S: f32 = 0.15;

/// The velocity past what stands in the way, plan frame, metres a second, along a route in a direction (radians); `None`
/// when no strip is free.
pub(super) fn past(scene: &Scene<'_>, radius_m: f32, direction: f32) -> Option<(f32, f32)> {
    if !direction.is_finite() {
        return None;
    }
    let (sin, cos) = direction.sin_cos();
    let place = &scene.place;
    let offset = |lane: usize| APART_M * (lane as f32 - (LANES / 2) as f32);
    let mut free = [true; LANES];
    for_each_certain(scene.cells, STANDS_CERTAINTY, |index| {
        let (x, y) = scene.window.centre(index);
        let (dx, dy) = (x - place.x, y - place.y);
        let (along, aside) = (dx * cos + dy * sin, dy * cos - dx * sin);
        if (0.0..LONG_M).contains(&along) {
            for (lane, free) in free.iter_mut().enumerate() {
                *free &= (aside - offset(lane)).abs() > radius_m + SEEN_M;
            }
        }
    });
    for (lane, free) in free.iter_mut().enumerate().filter(|(_, free)| **free) {
        let (x, y) = (place.x - sin * offset(lane), place.y + cos * offset(lane));
        let steps = (LONG_M / STEP_M) as usize;
        *free = (0..=steps)
            .map(|step| step as f32 * STEP_M)
            .all(|along| scene.field.distance(x + along * cos, y + along * sin) > radius_m + MAPPED_M);
    }
    let middle = nearest_run(&free).map(|(first, last)| 0.5 * (offset(first) + offset(last)))?;
    let aside = (ASIDE_PER_S * middle).clamp(-ASIDE_M_S, ASIDE_M_S);
    let onward = if middle.abs() < IN_LANE_M { ONWARD_M_S } else { 0.0 };
    Some((onward * cos - aside * sin, onward * sin + aside * cos))
}

/// First and last of the run of free strips that is nearest to the middle one.
fn nearest_run(free: &[bool; LANES]) -> Option<(usize, usize)> {
    let from_middle = |lane: &usize| lane.abs_diff(LANES / 2);
    let nearest = (0..LANES).filter(|lane| free[*lane]).min_by_key(from_middle)?;
    let first = (0..=nearest).rev().take_while(|lane| free[*lane]).last()?;
    let last = (nearest..LANES).take_while(|lane| free[*lane]).last()?;
    Some((first, last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_run_of_strips_nearest_to_the_drone_is_taken() {
        let runs = |ranges: &[core::ops::RangeInclusive<usize>]| {
            let mut free = [false; LANES];
            ranges.iter().cloned().flatten().for_each(|lane| free[lane] = true);
            nearest_run(&free)
        };
        assert_eq!(runs(&[]), None);
        assert_eq!(runs(&[0..=40]), Some((0, 40)));
        assert_eq!(runs(&[0..=14, 23..=25]), Some((23, 25)));
        assert_eq!(runs(&[16..=18, 23..=40]), Some((16, 18)));
    }
}
