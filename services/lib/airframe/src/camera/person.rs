//! Somebody who walks: legs, coat, arms and a head, with a stride.

use super::Figure;
use super::paint::{COATS, HAIR, Paint, SHOES, SKIN, TROUSERS};
use super::shapes::{Mesh, Ring};

/// Sides of limbs, of the trunk and of the head.
const LIMB: usize = 6;
const TRUNK: usize = 10;
/// Strides a second, and how far a foot and a hand swing, metres.
const STRIDE_HZ: f64 = 0.9;
const FOOT_M: f32 = 0.16;
const HAND_M: f32 = 0.12;

/// Adds the faces of a person.
pub(super) fn add(figure: &Figure, index: usize, time_s: f64, mesh: &mut Mesh) {
    let first = mesh.faces.len();
    let (coat, trousers) = (COATS[index % COATS.len()], TROUSERS[index % TROUSERS.len()]);
    let hair = HAIR[index % HAIR.len()];
    let h = figure.height;
    let phase = ((time_s * STRIDE_HZ + index as f64 * 0.37).fract() * std::f64::consts::TAU) as f32;
    let swing = phase.sin();
    let (sin, cos) = figure.heading.sin_cos();
    let place =
        |ahead: f32, left: f32| (figure.x + ahead * cos - left * sin, figure.y + ahead * sin + left * cos);
    for (side, way) in [(1.0, 1.0), (-1.0, -1.0)] {
        let ring = |z: f32, ahead: f32, aside: f32, paint: Paint| Ring { z: z * h, ahead, aside, paint };
        // A leg leans from the hip to the foot: two upright pieces, each a little farther on.
        let foot = place(FOOT_M * swing * way, 0.085 * side);
        let knee = place(FOOT_M * 0.55 * swing * way + 0.02, 0.085 * side);
        let shoe = [ring(0.0, 0.11, 0.05, SHOES), ring(0.045, 0.10, 0.05, SHOES)];
        mesh.turned(foot, figure.heading, &shoe, LIMB);
        let shin = [ring(0.045, 0.055, 0.055, trousers), ring(0.28, 0.07, 0.065, trousers)];
        mesh.turned(foot, figure.heading, &shin, LIMB);
        let thigh = [ring(0.26, 0.07, 0.065, trousers), ring(0.50, 0.09, 0.085, trousers)];
        mesh.turned(knee, figure.heading, &thigh, LIMB);
        let hand = place(-HAND_M * swing * way, 0.235 * side);
        let elbow = place(-HAND_M * 0.5 * swing * way, 0.225 * side);
        let lower =
            [ring(0.44, 0.035, 0.03, SKIN), ring(0.49, 0.045, 0.04, coat), ring(0.64, 0.05, 0.045, coat)];
        mesh.turned(hand, figure.heading, &lower, LIMB);
        let upper = [ring(0.62, 0.05, 0.045, coat), ring(0.81, 0.06, 0.05, coat)];
        mesh.turned(elbow, figure.heading, &upper, LIMB);
    }
    let middle = place(0.0, 0.0);
    let ring = |z: f32, ahead: f32, aside: f32, paint: Paint| Ring { z: z * h, ahead, aside, paint };
    let trunk = [
        ring(0.46, 0.11, 0.17, coat),
        ring(0.56, 0.105, 0.165, coat),
        ring(0.70, 0.125, 0.19, coat),
        ring(0.80, 0.11, 0.205, coat),
        ring(0.835, 0.07, 0.12, coat),
        ring(0.845, 0.055, 0.055, coat),
    ];
    mesh.turned(middle, figure.heading, &trunk, TRUNK);
    let neck = [ring(0.835, 0.055, 0.055, SKIN), ring(0.875, 0.05, 0.05, SKIN)];
    mesh.turned(place(0.01, 0.0), figure.heading, &neck, LIMB);
    let face = place(0.025, 0.0);
    let head = [
        ring(0.865, 0.05, 0.045, SKIN),
        ring(0.885, 0.085, 0.065, SKIN),
        ring(0.925, 0.095, 0.075, SKIN),
        ring(0.96, 0.095, 0.075, hair),
        ring(0.985, 0.075, 0.06, hair),
        ring(1.0, 0.03, 0.025, hair),
    ];
    mesh.turned(face, figure.heading, &head, TRUNK);
    // Hair behind, so that it is seen which way somebody looks.
    let nape =
        [ring(0.885, 0.06, 0.066, hair), ring(0.93, 0.085, 0.078, hair), ring(0.975, 0.07, 0.066, hair)];
    mesh.turned(place(-0.015, 0.0), figure.heading, &nape, TRUNK);
    mesh.body(first, None);
}
