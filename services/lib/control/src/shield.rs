//! The shield: every wish for motion passes it, whoever wishes.
//!
//! It trusts only what the drone's own sonars say now, the walls of the plan around the pose, and the braking
//! law. No sensor looking that way, no motion that way.

use crate::braking::Braking;
use crate::check::{RangeError, within};
use crate::held::seconds;
use crate::planar::{Vector, wrap_angle};
use crate::remembered::Remembered;
use crate::sight::{Glances, Sight, sight};
use floorplan::DistanceField;

/// Most sonars around.
pub const MAX_SENSORS: usize = 16;

/// Settings of the shield.
#[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShieldConfig {
    /// Room kept between disc and echo on top of the stopping distance, metres. A centred disc of 0.45 m has
    /// 0.225 m on each side of a door of 0.9 m.
    pub margin_m: f32,
    /// More room kept to what is flown straight at, metres: whoever stands before a wall is shaken by gusts of
    /// up to 0.3 m/s2, which cost 0.1 to 0.15 m; whoever passes a door soon leaves it.
    pub standoff_m: f32,
    /// Things nearer to the disc than this are moved away from, metres: in the
    /// middle of a 0.9 m door neither jamb is: sonars hear them in turns, and pushes in turns would swing it.
    pub near_m: f32,
    /// Speed away for each metre nearer than `near_m`, 1/s: both jambs of a door push alike, which centres.
    pub push_gain_per_s: f32,
    /// Fastest push, m/s: more than what gusts of 0.2 m/s2 make the velocity loop miss.
    pub max_push_m_s: f32,
    /// Half-angle to which a sonar and an answering neighbour join, degrees: 27.5 joins the flown layout at its widest.
    /// Beyond the cone that is a gap; beside a sonar that does not answer the cone is all.
    pub look_half_angle_deg: f32,
    /// Fastest way into a gap over which no cone has swept of late, m/s.
    pub gap_m_s: f32,
    /// A cone that swept over a gap vouches for it so long, seconds: the period of navigation's scan, and a sweep. What
    /// was heard meanwhile is remembered for longer.
    pub glance_s: f32,
    /// Half-angle of the cone in which an echo may lie, degrees (FACTS 2).
    pub cone_half_angle_deg: f32,
    /// Delay of the braking law beside the sweep, seconds (FACTS 2).
    pub reaction_s: f32,
    /// Deceleration of the braking law, m/s2 (FACTS 2).
    pub deceleration_m_s2: f32,
    /// Readings older than so many of the sensor's turns are worth nothing (DESIGN 4).
    pub stale_turns: f32,
    /// Room kept to the plan's walls beside the disc and the pose's sigma, metres: the plan is 3 cm wrong.
    pub plan_margin_m: f32,
    /// Speed at which the drone may still go where only a doubtful pose, and no echo, sees a wall, m/s.
    pub creep_m_s: f32,
    /// Most of the disc that an unsure pose may put inside a wall of the plan while the sonars say free, metres.
    pub plan_overlap_m: f32,
}

impl Default for ShieldConfig {
    fn default() -> Self {
        Self {
            margin_m: 0.07,
            standoff_m: 0.12,
            near_m: 0.15,
            push_gain_per_s: 0.8,
            max_push_m_s: 0.2,
            look_half_angle_deg: 28.0,
            gap_m_s: 0.25,
            glance_s: 1.6,
            cone_half_angle_deg: 15.0,
            reaction_s: 0.35,
            deceleration_m_s2: 2.0,
            stale_turns: 2.0,
            plan_margin_m: 0.03,
            creep_m_s: 0.15,
            plan_overlap_m: 0.08,
        }
    }
}

impl ShieldConfig {
    /// # Errors
    /// When a value is outside its bounds.
    pub fn validate(&self) -> Result<(), RangeError> {
        within("shield.margin_m", self.margin_m, 0.0, 0.2)?;
        within("shield.standoff_m", self.standoff_m, 0.0, 0.3)?;
        within("shield.near_m", self.near_m, 0.0, 0.6)?;
        within("shield.push_gain_per_s", self.push_gain_per_s, 0.0, 2.0)?;
        within("shield.max_push_m_s", self.max_push_m_s, 0.0, 0.3)?;
        within("shield.look_half_angle_deg", self.look_half_angle_deg, 15.0, 45.0)?;
        within("shield.gap_m_s", self.gap_m_s, 0.0, 0.5)?;
        within("shield.glance_s", self.glance_s, 0.0, 4.0)?;
        within("shield.cone_half_angle_deg", self.cone_half_angle_deg, 5.0, 30.0)?;
        within("shield.reaction_s", self.reaction_s, 0.2, 1.0)?;
        within("shield.deceleration_m_s2", self.deceleration_m_s2, 0.5, 2.5)?;
        within("shield.stale_turns", self.stale_turns, 1.5, 4.0)?;
        within("shield.plan_margin_m", self.plan_margin_m, 0.0, 0.2)?;
        within("shield.creep_m_s", self.creep_m_s, 0.0, 0.3)?;
        within("shield.plan_overlap_m", self.plan_overlap_m, 0.0, 0.15)
    }
}

/// What a ping of a side sonar brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Echo {
    /// Something at this distance from the sensor's face, metres.
    Range(f32),
    /// The sensor works and heard nothing.
    Nothing,
}

/// One ping of one side sonar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// When the ping left.
    pub at_ns: u64,
    /// Heading of the body then, plan frame.
    pub heading: f32,
    /// Middle of the body then, plan frame; `None` when it is not known, and nothing is remembered.
    pub place: Option<Vector>,
    /// What came back.
    pub echo: Echo,
}

#[derive(Clone, Copy, Debug)]
struct Sensor {
    bearing: f32,
    mount: Vector,
    look: Option<Look>,
}

/// Where the drone stands on the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footing {
    /// Plan frame; `None` when it is not known.
    pub place: Option<Vector>,
    /// Larger standard deviation of the place, metres.
    pub sigma_m: f32,
    /// Plan frame.
    pub heading: f32,
}

/// What the shield made of a wish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guarded {
    /// To be flown, plan frame.
    pub velocity: Vector,
    /// Speed that can still be stopped in the wished direction, m/s.
    pub allowed_m_s: f32,
    /// Whether less than the wish is left.
    pub limited: bool,
}

/// The shield.
#[derive(Clone, Debug)]
pub struct Shield {
    config: ShieldConfig,
    radius_m: f32,
    sensors: [Option<Sensor>; MAX_SENSORS],
    remembered: Remembered,
    glances: Glances,
    sweep_s: f32,
}

/// An echo from so far within the airframe's edge is none, metres: more than ranges and mounts err.
const INSIDE_M: f32 = 0.03;
/// Free way beyond which nothing matters at indoor speeds, metres.
const FAR_M: f32 = 4.0;
/// Directions within a cone that an echo is tried at.
const ARC: [f32; 7] = [-1.0, -0.667, -0.333, 0.0, 0.333, 0.667, 1.0];
/// Cosine of the angle from which something begins to be straight ahead (40 degrees; all of it at 28).
const AHEAD_FROM: f32 = 0.766;
/// A wish is turned into the nearest watched direction when that is nearer than this, radians.
const BEND_RAD: f32 = 0.87;

impl Shield {
    /// For a disc of this radius and sonars given by index, azimuth of the axis (body frame, counter-clockwise
    /// from forward) and position of the face (body frame). Sonars that look down do not belong here.
    pub fn new(
        config: ShieldConfig,
        radius_m: f32,
        sonars: impl IntoIterator<Item = (usize, f32, Vector)>,
    ) -> Self {
        let mut sensors = [None; MAX_SENSORS];
        for (index, bearing, mount) in sonars {
            if let Some(slot) = sensors.get_mut(index) {
                *slot = Some(Sensor { bearing, mount, look: None });
            }
        }
        Self {
            config,
            radius_m,
            sensors,
            remembered: Remembered::new(),
            glances: Glances::new(),
            sweep_s: 0.24,
        }
    }

    /// Sets the period of a whole sweep through all sonars, seconds.
    pub fn set_sweep(&mut self, sweep_s: f32) {
        if sweep_s.is_finite() {
            self.sweep_s = sweep_s.clamp(0.05, 2.0);
        }
    }

    /// Takes a ping. Faults and sensors known to be stuck are not to be told: they fall silent. False when
    /// there is no such side sonar or the ping makes no sense.
    pub fn hear(&mut self, sensor: usize, look: Look) -> bool {
        let sane = match look.echo {
            Echo::Range(range) => range > 0.0 && range < 20.0,
            Echo::Nothing => true,
        };
        // Nothing answers from within the airframe: propeller wash.
        let within = |sensor: &Sensor, range: f32| {
            range + sensor.mount.dot(Vector::along(sensor.bearing)) < self.radius_m - INSIDE_M
        };
        match self.sensors.get_mut(sensor) {
            Some(Some(sensor)) if matches!(look.echo, Echo::Range(range) if within(sensor, range)) => sane,
            Some(Some(sensor)) if sane && look.heading.is_finite() => {
                sensor.look = Some(look);
                let cone = self.config.cone_half_angle_deg.to_radians();
                self.glances.look(look.at_ns, sensor.bearing + look.heading, cone);
                if let (Some(place), Echo::Range(range)) = (look.place.and_then(Vector::known), look.echo) {
                    let face = place + sensor.mount.rotated(look.heading);
                    self.remembered.hear(look.at_ns, place, face, sensor.bearing + look.heading, range);
                }
                true
            }
            _ => false,
        }
    }

    /// The braking law at the present sweep.
    #[must_use]
    pub fn braking(&self) -> Braking {
        Braking {
            delay_s: self.sweep_s + self.config.reaction_s,
            deceleration_m_s2: self.config.deceleration_m_s2,
        }
    }

    /// Side sonars silent for two of their turns, and side sonars at all.
    #[must_use]
    pub fn silent(&self, now: u64) -> (u32, u32) {
        let all = self.sensors.iter().flatten();
        all.fold((0, 0), |(silent, all), s| (silent + u32::from(self.fresh(s, now).is_none()), all + 1))
    }

    /// How many of the side sonars have not answered for so long, seconds.
    #[must_use]
    pub fn silent_for(&self, now: u64, longer_s: f32) -> u32 {
        let silent = |s: &&Sensor| s.look.is_none_or(|look| seconds(look.at_ns, now) > longer_s);
        self.sensors.iter().flatten().filter(silent).count() as u32
    }

    fn fresh(&self, sensor: &Sensor, now: u64) -> Option<Look> {
        sensor.look.filter(|look| seconds(look.at_ns, now) <= self.config.stale_turns * self.sweep_s)
    }

    /// Nearest echo to the disc's edge among fresh readings, metres; infinite without one.
    #[must_use]
    pub fn nearest_m(&self, now: u64) -> f32 {
        self.hits(now).map(|(_, centre)| centre.norm() - self.radius_m).fold(f32::INFINITY, f32::min)
    }

    /// Fresh echoes: the plan-frame axis with the sensor's face, and the point on the axis, from the middle.
    fn hits(&self, now: u64) -> impl Iterator<Item = ((f32, Vector, f32), Vector)> + '_ {
        self.sensors.iter().flatten().filter_map(move |sensor| {
            let look = self.fresh(sensor, now)?;
            let Echo::Range(range) = look.echo else { return None };
            let axis = sensor.bearing + look.heading;
            let face = sensor.mount.rotated(look.heading);
            Some(((axis, face, range), face + Vector::along(axis) * range))
        })
    }

    /// Free way of the disc with its margin in a direction (unit vector, plan frame) by the echoes alone,
    /// metres: a fresh echo may come from anywhere on the arc across its cone, and the worst place counts; one
    /// that is remembered from `place` counts for the middle of its arc.
    #[must_use]
    pub fn free_way(&self, now: u64, direction: Vector, place: Option<Vector>) -> f32 {
        let wide = self.radius_m + self.config.margin_m;
        let half = self.config.cone_half_angle_deg.to_radians();
        let mut free = FAR_M;
        for ((axis, face, range), _) in self.hits(now) {
            for part in ARC {
                let point = face + Vector::along(axis + part * half) * range;
                free = free.min(way_to(point, direction, wide));
            }
        }
        for thing in self.things(now, place) {
            free = free.min(way_to(thing, direction, wide));
        }
        free
    }

    /// What was heard a moment ago, from the middle of the drone.
    fn things(&self, now: u64, place: Option<Vector>) -> impl Iterator<Item = Vector> + '_ {
        place.into_iter().flat_map(move |place| self.remembered.things(now).map(move |thing| thing - place))
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
                return way;
            }
            before = distance;
            way += step;
        }
        FAR_M
    }

    /// How well a direction (body frame) is watched now.
    fn sight(&self, now: u64, bearing: f32) -> Sight {
        let ring = self.sensors.iter().flatten().map(|s| (s.bearing, self.fresh(s, now).is_some()));
        let (cone, look) = (self.config.cone_half_angle_deg, self.config.look_half_angle_deg);
        sight(&ring, bearing, cone.to_radians(), look.to_radians())
    }

    /// The speed that may be flown in a direction (unit vector, plan frame).
    fn allowed(&self, now: u64, direction: Vector, footing: &Footing, walls: Option<&DistanceField>) -> f32 {
        let c = &self.config;
        let most = match self.sight(now, wrap_angle(direction.angle() - footing.heading)) {
            Sight::Closed(_) => return 0.0,
            Sight::Gap if self.glances.age_s(now, direction.angle()) > c.glance_s => c.gap_m_s,
            Sight::Gap | Sight::Cone => f32::INFINITY,
        };
        let braking = self.braking();
        let speed = braking.speed(self.free_way(now, direction, footing.place)).min(most);
        let (Some(walls), Some(place)) = (walls, footing.place) else { return speed };
        let sigma = if footing.sigma_m.is_finite() { footing.sigma_m.clamp(0.0, 0.08) } else { 0.08 };
        let soft = Self::plan_way(walls, place, direction, self.radius_m + c.plan_margin_m + sigma);
        let overlap = (sigma - c.plan_margin_m).clamp(-c.plan_margin_m, c.plan_overlap_m);
        let hard = Self::plan_way(walls, place, direction, (self.radius_m - overlap).max(0.05));
        speed.min(braking.speed(soft).max(c.creep_m_s.min(braking.speed(hard))))
    }

    /// Passes a wish (plan frame, m/s): what is left can be stopped before anything that is seen. `flown` is
    /// the velocity now: what is too fast towards a near thing is braked harder than by a smaller wish alone.
    /// `may_push` is for the air well above ground, where near echoes are no floor.
    pub fn guard(
        &self,
        now: u64,
        wish: Vector,
        flown: Vector,
        footing: &Footing,
        walls: Option<&DistanceField>,
        may_push: bool,
    ) -> Guarded {
        let wish = wish.known().unwrap_or(Vector::ZERO);
        let flown = flown.known().unwrap_or(Vector::ZERO);
        let braking = self.braking();
        let mut velocity = wish;
        let mut push = Vector::ZERO;
        // What points at a near thing is taken out of the wish, so that the rest may slide along it.
        for _ in 0..2 {
            let heard = self.hits(now).map(|(_, centre)| centre);
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
        if may_push {
            for (_, centre) in self.hits(now) {
                let distance = centre.norm().max(1e-3);
                let missing = self.config.near_m - (distance - self.radius_m);
                if missing > 0.0 {
                    let towards = centre * (1.0 / distance);
                    let stoppable = braking.speed(distance - self.radius_m - self.config.margin_m);
                    let too_fast = (flown.dot(towards) - stoppable).clamp(0.0, 1.0);
                    push = push - towards * (self.config.push_gain_per_s * missing + too_fast);
                }
            }
            velocity += push.limited(self.config.max_push_m_s);
        }
        let speed = velocity.norm();
        if speed > 1e-4 {
            let bearing = wrap_angle(velocity.angle() - footing.heading);
            velocity = match self.sight(now, bearing) {
                Sight::Cone | Sight::Gap => velocity,
                Sight::Closed(Some((edge, off))) if off < BEND_RAD => {
                    Vector::along(edge + footing.heading) * (speed * off.cos())
                }
                _ => Vector::ZERO,
            };
        }
        let speed = velocity.norm();
        if speed > 1e-4 {
            velocity = velocity.limited(self.allowed(now, velocity * (1.0 / speed), footing, walls));
        }
        let wished = wish.norm();
        let allowed_m_s =
            if wished > 1e-3 { self.allowed(now, wish * (1.0 / wished), footing, walls) } else { 0.0 };
        Guarded {
            velocity: velocity.known().unwrap_or(Vector::ZERO),
            allowed_m_s,
            limited: (velocity - wish).norm() > 0.02,
        }
    }
}

/// Way of a disc of radius `wide` in a direction until its edge is at a point, metres; infinite past it.
fn way_to(point: Vector, direction: Vector, wide: f32) -> f32 {
    let (ahead, aside) = (point.dot(direction), point.cross(direction).abs());
    if ahead > 0.0 && aside < wide {
        (ahead - (wide * wide - aside * aside).sqrt()).max(0.0)
    } else {
        f32::INFINITY
    }
}
