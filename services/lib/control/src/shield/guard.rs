//! What is left of a wish.

use super::heard::Hit;
use super::sight::Sight;
use super::{Braking, Footing, Guarded, Shield, Surroundings, Wish};
use crate::planar::{Vector, wrap_angle};

/// Cosine of the angle from which something begins to be straight ahead (40 degrees; all of it at 28).
const AHEAD_FROM: f32 = 0.766;
/// A wish is turned into the nearest watched direction when that is nearer than this, radians.
const BEND_RAD: f32 = 0.87;
/// Fastest way back to where no sonar looks, m/s: it came from there a moment ago.
const BLIND_M_S: f32 = 0.1;
/// The sonars hang under the body and look down by so much more than their cones when it tilts, radians (10 degrees).
const TILTED_RAD: f32 = 0.17;
/// Of the way to the floor along the cone's lower edge: mounts and clearance err.
const FLOOR_SHARE: f32 = 0.8;
/// Standard deviation of the place beyond which no wall of the plan is moved away from, metres.
const PUSHED_M: f32 = 0.2;
/// Echoes are not believed to come nearer by more than the velocity and this, m/s: errors of the velocity, and people.
const UNEXPECTED_M_S: f32 = 0.3;

impl Shield {
    /// Passes a wish (plan frame, m/s): what is left can be stopped before anything that is seen. What flies too fast
    /// towards a near thing is braked harder than by a smaller wish alone, and what is too near is moved away from.
    pub fn guard(&self, now: u64, wish: Wish, footing: &Footing, plan: &Surroundings<'_>) -> Guarded {
        let blind = if wish.back { BLIND_M_S } else { 0.0 };
        let wish = wish.velocity.known().unwrap_or(Vector::ZERO);
        let footing = &Footing { velocity: footing.velocity.known().unwrap_or(Vector::ZERO), ..*footing };
        let braking = self.braking();
        let mut velocity = self.slide(now, wish, footing, &braking);
        let speed = velocity.norm();
        if speed > 1e-4 {
            let bearing = wrap_angle(velocity.angle() - footing.heading);
            velocity = match self.sight(now, bearing) {
                Sight::Cone | Sight::Gap => velocity,
                Sight::Closed(Some((edge, off))) if off < BEND_RAD => {
                    Vector::along(edge + footing.heading) * (speed * off.cos()).min(self.config.gap_m_s)
                }
                _ => velocity.limited(blind),
            };
        }
        let speed = velocity.norm();
        if speed > 1e-4 {
            let allowed = self.allowed(now, velocity * (1.0 / speed), footing, plan);
            velocity = velocity.limited(allowed.min(self.beside(now, footing)).max(blind));
        }
        let retreat = self.retreat(now, footing, plan);
        if retreat != Vector::ZERO {
            velocity = self.seen(now, velocity + retreat, footing);
        }
        let wished = wish.norm();
        let allowed_m_s =
            if wished > 1e-3 { self.allowed(now, wish * (1.0 / wished), footing, plan) } else { 0.0 };
        Guarded {
            velocity: velocity.known().unwrap_or(Vector::ZERO),
            allowed_m_s,
            limited: (velocity - wish).norm() > 0.02,
        }
    }

    /// Most speed beside what is near: there is no time to find out where exactly a wall is that is slid along.
    fn beside(&self, now: u64, footing: &Footing) -> f32 {
        let heard = self.hits(now, footing.velocity).map(|hit| hit.centre.norm());
        let nearest =
            heard.chain(self.things(now, footing.place).map(Vector::norm)).fold(f32::INFINITY, f32::min);
        self.config.beside_m_s + self.config.beside_gain_per_s * (nearest - self.radius_m).max(0.0)
    }

    /// What points at a near thing is taken out of the wish, so that the rest may slide along it.
    fn slide(&self, now: u64, wish: Vector, footing: &Footing, braking: &Braking) -> Vector {
        let mut velocity = wish;
        for _ in 0..2 {
            let heard = self.hits(now, footing.velocity).map(|hit| hit.centre);
            for centre in heard.chain(self.things(now, footing.place)) {
                let distance = centre.norm();
                let towards = if distance > 1e-3 { centre * (1.0 / distance) } else { continue };
                let ahead = (wish.dot(towards) / wish.norm().max(1e-3) - AHEAD_FROM) / (1.0 - AHEAD_FROM);
                let room = self.config.margin_m + self.config.standoff_m * (2.0 * ahead).clamp(0.0, 1.0);
                let most = braking.speed(distance - self.radius_m - room);
                let excess = velocity.dot(towards) - most;
                if excess > 0.0 {
                    velocity = velocity - towards * excess;
                }
            }
        }
        velocity
    }

    /// Back from what is too near or comes too fast. What was heard a moment ago and what the plan says do not hold it back:
    /// they may be wrong, and this is the way that the drone came.
    fn retreat(&self, now: u64, footing: &Footing, plan: &Surroundings<'_>) -> Vector {
        let c = &self.config;
        let flown = footing.velocity;
        let floor_m = self.floor_m(footing.clearance_m);
        let mut brake = self.brake(now, flown, floor_m);
        let fast = flown.norm();
        if fast > c.creep_m_s {
            let along = flown * (1.0 / fast);
            let most = self.braking().speed(self.sure_way(along, footing, plan)).max(c.creep_m_s);
            brake += along * (fast - most - brake.dot(along)).max(0.0);
        }
        let brake = brake.limited(c.max_brake_m_s);
        let push = self.push(now, flown, floor_m) + self.plan_push(footing, plan);
        push.limited(c.max_push_m_s) - brake
    }

    /// What of a velocity stops before every fresh echo, slowly where no sonar looks.
    fn seen(&self, now: u64, velocity: Vector, footing: &Footing) -> Vector {
        let speed = velocity.norm();
        if speed < 1e-4 {
            return Vector::ZERO;
        }
        let direction = velocity * (1.0 / speed);
        let open = match self.sight(now, wrap_angle(direction.angle() - footing.heading)) {
            Sight::Closed(_) => BLIND_M_S,
            Sight::Cone | Sight::Gap => f32::INFINITY,
        };
        let wide = self.radius_m + 0.5 * self.config.margin_m;
        let way = self.heard_way(now, direction, footing.velocity, wide);
        velocity.limited(self.braking().speed(way).min(open))
    }

    /// Echoes from nearer than this are not the floor's, metres: the cone's lower edge meets it farther away.
    fn floor_m(&self, clearance_m: f32) -> f32 {
        let down = self.config.cone_half_angle_deg.to_radians() + TILTED_RAD;
        if clearance_m.is_finite() { FLOOR_SHARE * clearance_m.max(0.0) / down.sin() } else { f32::INFINITY }
    }

    /// What is flown, or by the echoes comes nearer, faster than it can be stopped: the most of it in every direction.
    fn brake(&self, now: u64, flown: Vector, floor_m: f32) -> Vector {
        let braking = self.braking();
        let mut brake = Vector::ZERO;
        for hit in self.hits(now, flown) {
            let Some((towards, gap)) = self.side(&hit).filter(|_| hit.range < floor_m) else { continue };
            let believed = flown.dot(towards);
            let closing =
                hit.closing.map_or(believed, |closing| closing.clamp(believed, believed + UNEXPECTED_M_S));
            let excess = closing - braking.speed(gap - self.config.margin_m) - brake.dot(towards);
            if closing > 0.0 && excess > 0.0 {
                brake += towards * excess;
            }
        }
        brake
    }

    /// Away from what is near and was heard twice: both jambs of a door push alike, which centres.
    fn push(&self, now: u64, flown: Vector, floor_m: f32) -> Vector {
        let mut push = Vector::ZERO;
        for hit in self.hits(now, flown).filter(|hit| hit.confirmed) {
            let Some((towards, gap)) = self.side(&hit).filter(|_| hit.range < floor_m) else { continue };
            let missing = self.config.near_m - gap;
            if missing > 0.0 {
                push = push - towards * (self.config.push_gain_per_s * missing);
            }
        }
        push
    }

    /// Away from the nearest wall and no-fly zone of the plan, while the pose is sure of it.
    fn plan_push(&self, footing: &Footing, plan: &Surroundings<'_>) -> Vector {
        let c = &self.config;
        let Some(place) = footing.place.filter(|_| footing.sigma_m <= PUSHED_M) else { return Vector::ZERO };
        let fields =
            [(plan.walls, c.plan_near_m + c.plan_margin_m + footing.sigma_m), (plan.zones, c.zone_margin_m)];
        fields.into_iter().fold(Vector::ZERO, |push, (field, room)| {
            let Some(field) = field else { return push };
            let missing = room - (field.distance(place.x, place.y) - self.radius_m);
            let (x, y) = field.gradient(place.x, place.y);
            let away = Vector::new(x, y);
            let steep = away.norm();
            if missing <= 0.0 || steep < 0.3 {
                return push;
            }
            push + away * (c.push_gain_per_s * missing / steep.max(1.0))
        })
    }

    /// Direction of an echo and the gap between it and the disc.
    fn side(&self, hit: &Hit) -> Option<(Vector, f32)> {
        let distance = hit.centre.norm();
        (distance > 1e-3).then(|| (hit.centre * (1.0 / distance), distance - self.radius_m))
    }
}
