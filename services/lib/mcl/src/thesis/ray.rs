//! What a particle measures: the distance along a sensor's axis.

use crate::map::RangeMap;
use floorplan::Plan;
use std::sync::Arc;

/// The first wall along a ray, whatever the angle at which it is met: a sonar taken for a laser.
///
/// The thesis casts rays and leaves for later how; the aperture of 30 degrees (FACTS 7) has no part in a ray. FACTS 5 has
/// what that costs: 0.31 m and 22 of 32 runs kept, against 0.085 m and all with the nearest of three rays.
#[derive(Clone, Debug)]
pub struct CentreRay {
    plan: Arc<Plan>,
    reach_m: f32,
}

impl CentreRay {
    /// Rays on `plan`, up to `reach_m` metres.
    #[must_use]
    pub fn new(plan: Arc<Plan>, reach_m: f32) -> Self {
        Self { plan, reach_m }
    }
}

impl RangeMap for CentreRay {
    fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        self.plan.cast_ray(x, y, angle, self.reach_m).map_or(f32::INFINITY, |hit| hit.range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_measures_along_the_axis_and_not_around_it() {
        let rows = ["##########", "#        #", "#   #    #", "#        #", "##########"];
        let ray = CentreRay::new(Arc::new(Plan::from_ascii(&rows, 0.5)), 3.0);
        let at = |x: f32, angle: f32| ray.range(x, 1.25, angle);
        // From x = 0.75 to the pillar's face at x = 2.
        assert!((at(0.75, 0.0) - 1.25).abs() < 1e-4, "{}", at(0.75, 0.0));
        // 15 degrees up it passes the pillar, which a cone of 30 degrees would hear.
        assert!(at(0.75, 15f32.to_radians()) > 2.0);
        assert_eq!(ray.range(-9.0, 1.25, 0.0), f32::INFINITY, "no wall within reach");
        assert_eq!(at(f32::NAN, 0.0), f32::INFINITY);
    }
}
