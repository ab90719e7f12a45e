//! One ping: a cone of rays, and how loud what they meet answers.
//!
//! All levels are decibels against a plane wall that faces the sensor, on its axis. A wall at range `r` is
//! [`margin`] above what the sensor's comparator needs; the beam takes away what lies off the axis (there
//! and back), the surface what is not reflected back along the ray, small things what they are smaller
//! than a wall. What is left above zero is heard. For a smooth wall this means: heard up to 25-30 degrees
//! between the axis and the wall's normal, the more the nearer, with a draw near the limit (FACTS 2).

use super::{RANGE_M, dot, sub};
use crate::world::draw::{normal, uniform};
use crate::world::{Edge, RayHit, Role, Solid, Surface, World};
use rand::Rng;

/// Half-angle of the cone (FACTS 2).
pub const HALF_ANGLE_RAD: f32 = 15.0 * std::f32::consts::PI / 180.0;
/// Off the axis by this and less something is heard at all: the cone is where things of every size are heard at
/// every range, and what is large and near is heard a little beyond it.
const WIDEST_RAD: f32 = 24.0 * std::f32::consts::PI / 180.0;
/// Rays: one on the axis and rings of 6, 12, 18 and 20, and how far off the axis they look, in degrees.
const RINGS: [(usize, f32); 4] = [(6, 5.0), (12, 10.0), (18, 15.0), (20, 20.0)];
const RAYS: usize = 1 + 6 + 12 + 18 + 20;
/// Loss at the edge of the cone, there and back, growing with the square of the angle, and beyond it with its fourth power.
const EDGE_LOSS_DB: f32 = 8.0;
/// Loss at 10 degrees of incidence, growing with the square of the angle: plaster, coats, glass.
const HARD_LOSS_DB: f32 = 9.0;
const SOFT_LOSS_DB: f32 = 5.0;
const MIRROR_LOSS_DB: f32 = 25.0;
/// A soft surface swallows this much besides.
const SOFT_DB: f32 = 3.0;
/// Level of an outer corner at half a metre: it scatters a little, near by.
const OUTER_DB: f32 = -20.0;
/// Level of an inner corner: two walls send the sound back the way it came.
const INNER_DB: f32 = -6.0;
/// Spread of the comparator's level from ping to ping, and its bound.
const JITTER_DB: f32 = 1.5;
/// Echoes lost on coats beyond and within [`COAT_NEAR_M`] (DESIGN 6), less what drops out anyway.
const COAT_LOST: (f32, f32) = (0.7, 0.2);
const COAT_NEAR_M: f32 = 1.5;
/// Over soft ground an echo is lost or late by up to so much, metres: the sound goes into the pile.
const CARPET_LOST: f32 = 0.3;
const CARPET_LATE_M: (f32, f32) = (0.02, 0.10);
/// Nearer than this an edge or pole counts as seen when a ray towards it gets there, metres.
const SEEN_M: f32 = 0.03;

/// The nearest thing loud enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heard {
    /// Distance, metres, without noise and scale.
    pub range: f32,
    /// Where it answered from, world frame.
    pub place: [f32; 3],
}

/// Level above the comparator of a wall that faces the sensor, decibels, at a range in metres: spreading
/// and absorption, fitted so that the limits of incidence are 30 degrees at 1 m and 25 at 4 m.
#[must_use]
pub fn margin(range: f32) -> f32 {
    let range = range.max(0.1);
    28.0 - 15.0 * range.log10() - 0.7 * (range - 1.0)
}

/// The directions of a cone, as offsets from its axis.
#[derive(Clone, Debug)]
pub struct Cone {
    /// Cosine along the axis, sine towards left and up, loss by the beam.
    rays: [(f32, f32, f32, f32); RAYS],
}

impl Default for Cone {
    fn default() -> Self {
        Self::new()
    }
}

/// What a ping of this moment is like: drawn once, so that all rays of a ping share it.
struct Mood {
    jitter: f32,
    coat: f32,
    carpet: f32,
    late: f32,
}

impl Cone {
    /// The rays of every sensor.
    #[must_use]
    pub fn new() -> Self {
        let mut rays = [(1.0, 0.0, 0.0, 0.0); RAYS];
        let mut next = 1;
        for (count, degrees) in RINGS {
            let off = degrees.to_radians();
            for k in 0..count {
                let around = std::f32::consts::TAU * k as f32 / count as f32;
                let (sin, cos) = around.sin_cos();
                rays[next] = (off.cos(), off.sin() * cos, off.sin() * sin, beam_loss(off));
                next += 1;
            }
        }
        Self { rays }
    }

    /// What a sensor hears. The number of draws is fixed.
    pub fn listen<R: Rng + ?Sized>(
        &self,
        world: &World,
        face: [f32; 3],
        axis: [f32; 3],
        rng: &mut R,
    ) -> Option<Heard> {
        let mood = Mood {
            jitter: (normal(rng) * JITTER_DB).clamp(-2.0 * JITTER_DB, 2.0 * JITTER_DB),
            coat: uniform(rng, 0.0, 1.0),
            carpet: uniform(rng, 0.0, 1.0),
            late: uniform(rng, CARPET_LATE_M.0, CARPET_LATE_M.1),
        };
        let (left, up) = across(axis);
        let mut nearest: Option<Heard> = None;
        let mut limit = RANGE_M.1;
        for (along, to_left, to_up, loss) in &self.rays {
            let ray: [f32; 3] = std::array::from_fn(|k| along * axis[k] + to_left * left[k] + to_up * up[k]);
            // A ray need not go beyond what was already heard.
            let Some(hit) = world.cast(face, ray, limit) else { continue };
            let Some(range) = answer(&hit, ray, *loss, &mood) else { continue };
            if range < limit {
                limit = range;
                let place = std::array::from_fn(|k| face[k] + hit.range * ray[k]);
                nearest = Some(Heard { range, place });
            }
        }
        let near = nearest.map_or(RANGE_M.1, |heard| heard.range);
        let fine = fine_things(world, face, axis, near, &mood);
        let heard = fine.or(nearest)?;
        (heard.range >= RANGE_M.0).then_some(heard)
    }
}

fn beam_loss(off_rad: f32) -> f32 {
    let off = off_rad / HALF_ANGLE_RAD;
    EDGE_LOSS_DB * if off > 1.0 { off.powi(4) } else { off.powi(2) }
}

/// Loss by a surface that is met at an angle.
fn incidence_loss(surface: Surface, cosine: f32) -> f32 {
    let tens = cosine.clamp(-1.0, 1.0).acos().to_degrees() * 0.1;
    match surface {
        Surface::Hard => HARD_LOSS_DB * tens * tens,
        Surface::Soft => SOFT_LOSS_DB * tens * tens + SOFT_DB,
        Surface::Mirror => MIRROR_LOSS_DB * tens * tens,
    }
}

/// Loss of an upright mantle against a plane: it sends the sound round about.
fn curvature_loss(radius: f32, range: f32) -> f32 {
    if radius.is_infinite() { 0.0 } else { 10.0 * ((radius + range) / radius.max(1e-3)).log10() }
}

/// The coat law: whether a soft thing swallows this ping.
fn swallowed(range: f32, mood: &Mood) -> bool {
    mood.coat < if range > COAT_NEAR_M { COAT_LOST.0 } else { COAT_LOST.1 }
}

fn answer(hit: &RayHit, ray: [f32; 3], beam: f32, mood: &Mood) -> Option<f32> {
    let on_top = hit.surface == Surface::Soft && hit.normal[2] > 0.5;
    if on_top {
        if mood.carpet < CARPET_LOST {
            return None;
        }
    } else if hit.surface == Surface::Soft && swallowed(hit.range, mood) {
        return None;
    }
    let loss =
        beam + incidence_loss(hit.surface, -dot(hit.normal, ray)) + curvature_loss(hit.curvature, hit.range);
    if margin(hit.range) + mood.jitter < loss {
        return None;
    }
    let late = if on_top { mood.late } else { 0.0 };
    Some(hit.range + late)
}

/// Poles and upright edges slip between rays: each is looked at by itself.
fn fine_things(world: &World, face: [f32; 3], axis: [f32; 3], near: f32, mood: &Mood) -> Option<Heard> {
    // The cone's shadow on the floor.
    let level = (axis[0] * axis[0] + axis[1] * axis[1]).sqrt();
    if level < 0.5 {
        // What looks down sees floors and tops, not edges.
        return None;
    }
    let middle = (face[0] + axis[0] * near * 0.5, face[1] + axis[1] * near * 0.5);
    let wide = near * (WIDEST_RAD.sin() + 0.02);
    let (hx, hy) = (
        (axis[0] * near * 0.5).abs() + wide * axis[1].abs() + 0.1,
        (axis[1] * near * 0.5).abs() + wide * axis[0].abs() + 0.1,
    );
    let extent = [middle.0 - hx, middle.1 - hy, middle.0 + hx, middle.1 + hy];
    let mut best: Option<Heard> = None;
    let mut limit = near;
    world.edges_within(extent, |edge| {
        if let Some(heard) = edge_answer(world, edge, face, axis, limit, mood) {
            limit = heard.range;
            best = Some(heard);
        }
    });
    world.cylinders_within(extent, |solid| {
        if let Some(heard) = cylinder_answer(world, solid, face, axis, limit, mood) {
            limit = heard.range;
            best = Some(heard);
        }
    });
    best
}

/// Direction, distance and loss by the beam of a place, when it lies in the cone and before `limit`.
fn aim(face: [f32; 3], axis: [f32; 3], place: [f32; 3], limit: f32) -> Option<([f32; 3], f32, f32)> {
    let to = sub(place, face);
    let range = dot(to, to).sqrt();
    if range >= limit || range < 1e-3 {
        return None;
    }
    let along = to.map(|v| v / range);
    let cosine = dot(along, axis);
    (cosine >= WIDEST_RAD.cos()).then(|| (along, range, beam_loss(cosine.min(1.0).acos())))
}

fn is_seen(world: &World, face: [f32; 3], along: [f32; 3], range: f32) -> bool {
    world.cast(face, along, range - SEEN_M).is_none()
}

fn edge_answer(
    world: &World,
    edge: &Edge,
    face: [f32; 3],
    axis: [f32; 3],
    limit: f32,
    mood: &Mood,
) -> Option<Heard> {
    let place = [edge.x, edge.y, face[2].clamp(edge.bottom, edge.top)];
    let (along, range, beam) = aim(face, axis, place, limit)?;
    let level = if edge.inner { INNER_DB } else { OUTER_DB - 10.0 * (range / 0.5).max(0.2).log10() };
    // Upright edges are mirrors in the upright direction.
    let upright = incidence_loss(Surface::Hard, (1.0 - along[2] * along[2]).max(0.0).sqrt());
    if margin(range) + mood.jitter + level < beam + upright || !is_seen(world, face, along, range) {
        return None;
    }
    Some(Heard { range, place })
}

fn cylinder_answer(
    world: &World,
    solid: &Solid,
    face: [f32; 3],
    axis: [f32; 3],
    limit: f32,
    mood: &Mood,
) -> Option<Heard> {
    if solid.role == Role::SoftFloor {
        return None;
    }
    let (dx, dy) = (face[0] - solid.x, face[1] - solid.y);
    let away = dx.hypot(dy);
    if away <= solid.half_x {
        return None;
    }
    let share = solid.half_x / away;
    let height = face[2].clamp(solid.bottom, solid.top);
    let place = [solid.x + dx * share, solid.y + dy * share, height];
    let (along, range, beam) = aim(face, axis, place, limit)?;
    if solid.surface == Surface::Soft && swallowed(range, mood) {
        return None;
    }
    let upright = incidence_loss(solid.surface, (1.0 - along[2] * along[2]).max(0.0).sqrt());
    let loss = beam + upright + curvature_loss(solid.half_x, range);
    if margin(range) + mood.jitter < loss || !is_seen(world, face, along, range) {
        return None;
    }
    Some(Heard { range, place })
}

/// Two unit vectors at right angles to a unit vector and to each other.
fn across(axis: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let helper = if axis[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let left = cross(helper, axis);
    let length = dot(left, left).sqrt().max(1e-9);
    let left = left.map(|v| v / length);
    (left, cross(axis, left))
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
