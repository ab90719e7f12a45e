//! How far the way is free in a direction, and how fast it may be flown.

use super::sight::{Sight, sight};
use super::{Footing, Shield, Surroundings};
use crate::planar::{Vector, wrap_angle};
use floorplan::DistanceField;

/// Free way beyond which nothing matters at indoor speeds, metres.
const FAR_M: f32 = 4.0;
/// What is no farther ahead is abreast: where a slide along a thing ends, rounding would say one or the other. Metres.
const ABREAST_M: f32 = 1e-4;
/// Directions within a cone that an echo is tried at.
const ARC: [f32; 7] = [-1.0, -0.667, -0.333, 0.0, 0.333, 0.667, 1.0];
/// Up to this standard deviation the place is sure of where the disc is, metres: twice what a flight with a flow sensor
/// says of itself.
const SURE_M: f32 = 0.08;

/// Most of the place's standard deviation that is added to the room kept to no-fly zones, metres: beyond it the place is
/// uncertain for the failsafe table (0.5 m).
const ZONE_SIGMA_M: f32 = 0.5;

impl Shield {
    /// Free way of the disc with its margin in a direction (unit vector, plan frame) by the echoes alone,
    /// metres: a fresh echo may come from anywhere on the arc across its cone, and the worst place counts; one
    /// that is remembered from `place` counts for the middle of its arc.
    #[must_use]
    pub fn free_way(&self, now: u64, direction: Vector, footing: &Footing) -> f32 {
        let wide = self.radius_m + self.config.margin_m;
        let mut free = self.heard_way(now, direction, footing.velocity, wide);
        for thing in self.things(now, footing.place) {
            free = free.min(way_to(thing, direction, wide));
        }
        free
    }

    /// Free way of a disc of radius `wide` by the fresh echoes alone, for a drone that has flown with `flown` since.
    #[must_use]
    pub fn heard_way(&self, now: u64, direction: Vector, flown: Vector, wide: f32) -> f32 {
        let half = self.config.cone_half_angle_deg.to_radians();
        let mut free = FAR_M;
        for hit in self.hits(now, flown) {
            for part in ARC {
                let point = hit.face + Vector::along(hit.axis + part * half) * hit.range;
                free = free.min(way_to(point, direction, wide));
            }
        }
        free
    }

    /// What was heard a moment ago or stands in the grid, from the middle of the drone.
    pub(super) fn things(&self, now: u64, place: Option<Vector>) -> impl Iterator<Item = Vector> + '_ {
        place.into_iter().flat_map(move |place| {
            self.remembered.things(now).chain(self.grid.points(now)).map(move |thing| thing - place)
        })
    }

    /// Free way of a disc of `radius` by the plan's walls. Inside the radius sliding along and away is free.
    fn plan_way(walls: &DistanceField, from: Vector, direction: Vector, radius: f32) -> f32 {
        let mut way = 0.0;
        let mut before = walls.distance(from.x, from.y);
        let mut within = before < radius;
        while way < FAR_M {
            let step = (before - radius).max(0.03);
            let at = from + direction * (way + step);
            let distance = walls.distance(at.x, at.y);
            within = within && distance < radius;
            if distance < radius && (!within || distance < before - 0.2 * step) {
                // As far as the walls were away before the step nothing can be met.
                return way + (before - radius).max(0.0);
            }
            before = distance;
            way += step;
        }
        FAR_M
    }

    /// The same as far as the place is sure, with the room that the plan and the place may err by.
    pub(super) fn sure_way(&self, direction: Vector, footing: &Footing, plan: &Surroundings<'_>) -> f32 {
        let Some(place) = footing.place else { return FAR_M };
        let zone = self.zone_way(place, direction, footing, plan.zones);
        match plan.walls {
            Some(walls) if footing.sigma_m < SURE_M => {
                let radius_m = self.radius_m + self.config.plan_margin_m + footing.sigma_m;
                zone.min(Self::plan_way(walls, place, direction, radius_m))
            }
            _ => zone,
        }
    }

    /// Free way by the no-fly zones; without a known place nobody knows where they are.
    fn zone_way(
        &self,
        place: Vector,
        direction: Vector,
        footing: &Footing,
        zones: Option<&DistanceField>,
    ) -> f32 {
        let sigma =
            if footing.sigma_m.is_finite() { footing.sigma_m.clamp(0.0, ZONE_SIGMA_M) } else { ZONE_SIGMA_M };
        let radius_m = self.radius_m + self.config.zone_margin_m + sigma;
        zones.map_or(FAR_M, |zones| Self::plan_way(zones, place, direction, radius_m))
    }

    /// How well a direction (body frame) is watched now.
    pub(super) fn sight(&self, now: u64, bearing: f32) -> Sight {
        let ring =
            self.sensors.iter().flatten().map(|s| (s.bearing, self.fresh(s, now).is_some() && !s.doubted()));
        let (cone, look) = (self.config.cone_half_angle_deg, self.config.look_half_angle_deg);
        sight(&ring, bearing, cone.to_radians(), look.to_radians())
    }

    /// The speed that may be flown in a direction (unit vector, plan frame).
    pub(super) fn allowed(
        &self,
        now: u64,
        direction: Vector,
        footing: &Footing,
        plan: &Surroundings<'_>,
    ) -> f32 {
        let c = &self.config;
        let seen = self.sight(now, wrap_angle(direction.angle() - footing.heading));
        let most = match seen {
            Sight::Closed(_) => return 0.0,
            Sight::Gap if self.glances.age_s(now, direction.angle()) > c.glance_s => c.gap_m_s,
            Sight::Gap | Sight::Cone => f32::INFINITY,
        };
        let braking = self.braking();
        let speed = braking.speed(self.free_way(now, direction, footing)).min(most);
        let Some(place) = footing.place else { return speed };
        let speed = speed.min(braking.speed(self.zone_way(place, direction, footing, plan.zones)));
        let Some(walls) = plan.walls else { return speed };
        let unsure = if footing.sigma_m.is_finite() { footing.sigma_m.max(0.0) } else { f32::INFINITY };
        let sigma = unsure.min(SURE_M);
        let soft = Self::plan_way(walls, place, direction, self.radius_m + c.plan_margin_m + sigma);
        let overlap = (2.0 * (unsure - SURE_M)).clamp(-c.plan_near_m, c.plan_overlap_m);
        let hard = Self::plan_way(walls, place, direction, (self.radius_m - overlap).max(0.05));
        // Where no cone looks, nobody says that the plan is wrong.
        let meets = place + direction * soft;
        let (x, y) = walls.gradient(meets.x, meets.y);
        let wall = Vector::new(x, y) * -walls.distance(meets.x, meets.y);
        let towards = (direction * soft + wall).angle() - footing.heading;
        let looks = seen == Sight::Cone && self.sight(now, wrap_angle(towards)) == Sight::Cone;
        let creep = if looks { c.creep_m_s.min(braking.speed(hard)) } else { 0.0 };
        speed.min(braking.speed(soft).max(creep))
    }
}

/// Way of a disc of radius `wide` in a direction until its edge is at a point, metres; infinite past it.
fn way_to(point: Vector, direction: Vector, wide: f32) -> f32 {
    let (ahead, aside) = (point.dot(direction), point.cross(direction).abs());
    if ahead > ABREAST_M && aside < wide {
        (ahead - (wide * wide - aside * aside).sqrt()).max(0.0)
    } else {
        f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::way_to;
    use crate::planar::Vector;
    use crate::shield::Shield;
    use floorplan::DistanceField;

    /// A wall a metre or two to the right, met head-on and aslant from four hundred places: the cells of the field are 5 cm wide,
    /// and what is between their middles is interpolated.
    #[test]
    fn a_wall_straight_ahead_is_as_far_away_as_it_is() {
        let blocked: Vec<bool> = (0..80 * 80).map(|cell| cell % 80 >= 60).collect();
        let walls = DistanceField::from_blocked(&blocked, 80, 0.05, (0.0, 0.0), 3.0);
        for k in 0..400u16 {
            let from = Vector::new(0.8 + 0.0031 * f32::from(k), 2.0 + 0.0007 * f32::from(k));
            for angle in [0.0f32, 0.01, -0.4] {
                let way = Shield::plan_way(&walls, from, Vector::along(angle), 0.3);
                let true_m = ((3.0 - from.x) - 0.3) / angle.cos();
                assert!((way - true_m).abs() < 0.08, "{way} of {true_m} m from {from:?} along {angle}");
            }
        }
    }

    /// A disc of 0.25 m that goes along x comes to touch at 0.6 m ahead, earlier or never by how far aside it is.
    #[test]
    fn a_point_is_touched_by_the_edge_and_passed_by_what_is_abreast_or_wide_of_it() {
        let way = |x: f32, y: f32| way_to(Vector::new(x, y), Vector::new(1.0, 0.0), 0.25);
        assert!((way(0.6, 0.0) - 0.35).abs() < 1e-6);
        // The triangle of sides 3, 4 and 5: 0.15 m aside, the edge is 0.2 m ahead of the middle.
        assert!((way(0.6, 0.15) - 0.4).abs() < 1e-6 && (way(0.6, -0.15) - 0.4).abs() < 1e-6);
        assert_eq!(way(0.1, 0.1), 0.0, "within the disc already");
        assert_eq!(way(2e-4, 0.1), 0.0, "and not past it");
        for (x, y) in [(0.6, 0.25), (0.6, -0.3), (5e-5, 0.2), (0.0, 0.1), (-0.1, 0.0)] {
            assert_eq!(way(x, y), f32::INFINITY, "{x}, {y} is passed");
        }
    }
}
