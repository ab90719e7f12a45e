//! Faces, and the bodies that they make up.

use super::paint::Paint;
use crate::world::{Shape, Solid};

/// Sides of a mantle: round enough at arm's length, as its faces are lit as if it were round.
const SIDES: usize = 12;
/// A cylinder thinner than this is a pole: fewer sides, and no caps.
const POLE_M: f32 = 0.05;
const POLE_SIDES: usize = 6;
/// Most corners of a face.
pub(super) const MOST_CORNERS: usize = SIDES;

/// A flat face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// Where its corners begin among the points, and how many there are.
    pub first: u32,
    pub corners: u8,
    /// Outward unit normal.
    pub normal: [f32; 3],
    pub paint: Paint,
    /// Of a mantle: where its axis stands. It is lit as if it were round.
    pub axis: Option<(f32, f32)>,
}

/// Faces that are near each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub middle: [f32; 3],
    pub radius: f32,
    pub first: u32,
    pub last: u32,
    /// Shown only while the bit of this door is set.
    pub door: Option<u32>,
}

/// Many bodies.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    pub points: Vec<[f32; 3]>,
    pub faces: Vec<Face>,
    pub bodies: Vec<Body>,
}

/// One ring of a turned body: height, half widths ahead and to the side, and the paint up to the next ring.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    pub z: f32,
    pub ahead: f32,
    pub aside: f32,
    pub paint: Paint,
}

impl Mesh {
    pub(super) fn clear(&mut self) {
        self.points.clear();
        self.faces.clear();
        self.bodies.clear();
    }

    pub(super) fn face(&mut self, corners: &[[f32; 3]], paint: Paint, axis: Option<(f32, f32)>) {
        let first = self.points.len() as u32;
        self.points.extend_from_slice(corners);
        let normal = normal(corners);
        self.faces.push(Face { first, corners: corners.len() as u8, normal, paint, axis });
    }

    /// Drops the faces since `first` of which `drop` (their corners, their normal) says so.
    pub(super) fn drop_faces(&mut self, first: usize, drop: impl Fn(&[[f32; 3]], [f32; 3]) -> bool) {
        let mut number = 0;
        let points = &self.points;
        self.faces.retain(|face| {
            number += 1;
            let corners = &points[face.first as usize..face.first as usize + usize::from(face.corners)];
            number <= first || !drop(corners, face.normal)
        });
    }

    /// Makes one body of the faces since `first`.
    pub(super) fn body(&mut self, first: usize, door: Option<u32>) {
        let from = self.faces.get(first).map_or(self.points.len(), |face| face.first as usize);
        let points = &self.points[from..];
        let bound =
            |k: usize, start: f32, pick: fn(f32, f32) -> f32| points.iter().map(|p| p[k]).fold(start, pick);
        let low: [f32; 3] = std::array::from_fn(|k| bound(k, f32::MAX, f32::min));
        let high: [f32; 3] = std::array::from_fn(|k| bound(k, f32::MIN, f32::max));
        let middle = std::array::from_fn(|k| (low[k] + high[k]) * 0.5);
        let half: [f32; 3] = std::array::from_fn(|k| (high[k] - low[k]) * 0.5);
        let radius = super::look::dot(half, half).sqrt();
        self.bodies.push(Body { middle, radius, first: first as u32, last: self.faces.len() as u32, door });
    }

    /// The faces of an upright solid: its sides, its top when it can be seen from above and its bottom when it hangs.
    pub(super) fn solid(&mut self, solid: &Solid, paint: Paint, ceiling: f32) {
        let (bottom, top) = (solid.bottom, solid.top.min(ceiling));
        match solid.shape {
            Shape::Box => {
                let corners = solid.corners();
                self.prism(&corners, (bottom, top), paint, None);
                self.caps(&corners, (bottom, top), paint, ceiling);
            }
            Shape::Cylinder => {
                let pole = solid.half_x < POLE_M;
                let mut round = [(0.0, 0.0); SIDES];
                let sides = if pole { POLE_SIDES } else { SIDES };
                for (k, corner) in round.iter_mut().take(sides).enumerate() {
                    let (sin, cos) = (std::f32::consts::TAU * k as f32 / sides as f32).sin_cos();
                    *corner = (solid.x + solid.half_x * cos, solid.y + solid.half_x * sin);
                }
                let round = &round[..sides];
                self.prism(round, (bottom, top), paint, Some((solid.x, solid.y)));
                if !pole {
                    self.caps(round, (bottom, top), paint, ceiling);
                }
            }
        }
    }

    /// The sides of an upright prism; corners counter-clockwise from above.
    fn prism(&mut self, outline: &[(f32, f32)], span: (f32, f32), paint: Paint, axis: Option<(f32, f32)>) {
        for (k, a) in outline.iter().enumerate() {
            let b = outline[(k + 1) % outline.len()];
            let (low, high) = span;
            self.face(&[[a.0, a.1, low], [b.0, b.1, low], [b.0, b.1, high], [a.0, a.1, high]], paint, axis);
        }
    }

    fn caps(&mut self, outline: &[(f32, f32)], span: (f32, f32), paint: Paint, ceiling: f32) {
        let mut corners = [[0.0; 3]; MOST_CORNERS];
        let count = outline.len().min(MOST_CORNERS);
        if span.1 < ceiling {
            for (corner, at) in corners.iter_mut().zip(outline) {
                *corner = [at.0, at.1, span.1];
            }
            self.face(&corners[..count], paint, None);
        }
        if span.0 > 0.0 {
            for (corner, at) in corners.iter_mut().zip(outline.iter().rev()) {
                *corner = [at.0, at.1, span.0];
            }
            self.face(&corners[..count], paint, None);
        }
    }

    /// A body turned about an upright axis, lowest ring first, closed at both ends; `heading` is where it looks.
    pub(super) fn turned(&mut self, at: (f32, f32), heading: f32, rings: &[Ring], sides: usize) {
        let (sin, cos) = heading.sin_cos();
        let corner = |ring: &Ring, k: usize| {
            let (s, c) = (std::f32::consts::TAU * (k % sides) as f32 / sides as f32).sin_cos();
            let (ahead, aside) = (ring.ahead * c, ring.aside * s);
            [at.0 + ahead * cos - aside * sin, at.1 + ahead * sin + aside * cos, ring.z]
        };
        for pair in rings.windows(2) {
            let [low, high] = pair else { continue };
            for k in 0..sides {
                let corners = [corner(low, k), corner(low, k + 1), corner(high, k + 1), corner(high, k)];
                self.face(&corners, low.paint, Some(at));
            }
        }
        if let Some(top) = rings.last() {
            let mut corners = [[0.0; 3]; MOST_CORNERS];
            let count = sides.min(MOST_CORNERS);
            for (k, place) in corners.iter_mut().enumerate().take(count) {
                *place = corner(top, k);
            }
            self.face(&corners[..count], top.paint, None);
        }
    }
}

/// Outward unit normal of corners that go counter-clockwise as seen from outside (Newell's method: corners may fall together).
fn normal(corners: &[[f32; 3]]) -> [f32; 3] {
    let mut sum = [0.0f32; 3];
    for (k, a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % corners.len()];
        for (axis, total) in sum.iter_mut().enumerate() {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            *total += (a[i] - b[i]) * (a[j] + b[j]);
        }
    }
    let length = super::look::dot(sum, sum).sqrt().max(1e-12);
    sum.map(|v| v / length)
}
