//! Standing, landing and bumping: stiff springs with damping and friction.

use super::{Motion, Shape, Surroundings};
use nalgebra::{Rotation3, Vector3};

/// Faster onto a surface than this is a contact and not a landing (DESIGN 5).
pub const TOUCH_LIMIT_M_S: f64 = 0.7;
/// More tilted onto a surface than this is a contact and not a landing: ten degrees (DESIGN 5).
pub const TOUCH_LIMIT_RAD: f64 = 0.174_532_925;

/// Natural frequency of the whole craft on its feet, rad/s: stiff, and still far below the step rate.
const FOOT_FREQUENCY: f64 = 80.0;
/// Share of critical damping: skids do not bounce much.
const FOOT_DAMPING: f64 = 0.6;
/// Deepest spring travel that still pushes harder: a surface may appear under the craft at once.
const FOOT_TRAVEL_M: f64 = 0.03;
/// Rubber feet on a hard floor.
const FRICTION: f64 = 0.7;
/// Slip at which friction is fully developed, m/s.
const SLIP_M_S: f64 = 0.02;
/// Feet stand at this share of the radius.
const FOOT_SHARE: f64 = 0.6;

/// Stiffness of a bump, 1/s^2 a metre of depth, its cap in m/s^2, and its damping, 1/s.
const BUMP_STIFFNESS: f64 = 600.0;
const BUMP_CAP_M_S2: f64 = 40.0;
const BUMP_DAMPING: f64 = 12.0;
/// Guards scrape along what they touch.
const BUMP_FRICTION: f64 = 0.4;

/// A solid that the airframe has run into.
#[derive(Clone, Copy, Debug)]
pub struct Push {
    /// Away from the solid, world frame, unit length.
    pub normal: Vector3<f64>,
    /// How deep, metres.
    pub depth_m: f64,
}

/// Force (world frame), torque (body frame), and whether anything presses from below.
pub(super) fn react(
    shape: &Shape,
    motion: &Motion,
    body: &Rotation3<f64>,
    around: &Surroundings,
) -> (Vector3<f64>, Vector3<f64>, bool) {
    let mut force = Vector3::zeros();
    let mut twist = Vector3::zeros();
    let mut touching = false;
    if motion.position.z - around.surface_m < shape.radius_m + shape.height_m {
        touching = stand(shape, motion, body, around.surface_m, &mut force, &mut twist);
    }
    if let Some(push) = around.push {
        bump(shape, motion, body, &push, &mut force, &mut twist);
    }
    (force, twist, touching)
}

/// Four feet and, for a craft that lies on its side or back, four corners at the top.
fn stand(
    shape: &Shape,
    motion: &Motion,
    body: &Rotation3<f64>,
    surface_m: f64,
    force: &mut Vector3<f64>,
    twist: &mut Vector3<f64>,
) -> bool {
    let stiffness = shape.mass_kg * FOOT_FREQUENCY * FOOT_FREQUENCY / 4.0;
    let damping = 2.0 * FOOT_DAMPING * shape.mass_kg * FOOT_FREQUENCY / 4.0;
    let reach = FOOT_SHARE * shape.radius_m * std::f64::consts::FRAC_1_SQRT_2;
    let mut touching = false;
    for corner in 0..8_u8 {
        let sign = |bit: u8| if corner & bit == 0 { 1.0 } else { -1.0 };
        let top = corner & 4 != 0;
        let share = if top { shape.radius_m * std::f64::consts::FRAC_1_SQRT_2 } else { reach };
        let up = if top { shape.height_m - shape.foot_drop_m } else { -shape.foot_drop_m };
        let arm = Vector3::new(sign(1) * share, sign(2) * share, up);
        let arm_world = body * arm;
        let depth = surface_m - (motion.position.z + arm_world.z);
        if depth <= 0.0 {
            continue;
        }
        touching |= !top;
        let speed = motion.velocity + body * motion.rates.cross(&arm);
        let press = (stiffness * depth.min(FOOT_TRAVEL_M) - damping * speed.z).max(0.0);
        let slip = speed.x.hypot(speed.y);
        let grip = FRICTION * press / slip.max(SLIP_M_S);
        let push = Vector3::new(-grip * speed.x, -grip * speed.y, press);
        *force += push;
        *twist += arm.cross(&body.inverse_transform_vector(&push));
    }
    touching
}

/// The rim nearest to the solid is pushed back and rubs along it.
fn bump(
    shape: &Shape,
    motion: &Motion,
    body: &Rotation3<f64>,
    push: &Push,
    force: &mut Vector3<f64>,
    twist: &mut Vector3<f64>,
) {
    let closing = motion.velocity.dot(&push.normal);
    let spring = (BUMP_STIFFNESS * push.depth_m.max(0.0)).min(BUMP_CAP_M_S2);
    let press = shape.mass_kg * (spring - BUMP_DAMPING * closing.min(0.0)).min(2.0 * BUMP_CAP_M_S2);
    let along = motion.velocity - push.normal * closing;
    let speed = along.norm();
    let rub = if speed > 0.01 { along * (-BUMP_FRICTION * press / speed.max(0.2)) } else { Vector3::zeros() };
    let total = push.normal * press + rub;
    // Guards sit above the centre of mass: a bump tips the craft as well.
    let arm_world = -push.normal * shape.radius_m + body * Vector3::new(0.0, 0.0, shape.rotor_rise_m);
    *force += total;
    *twist += body.inverse_transform_vector(&arm_world.cross(&total));
}
