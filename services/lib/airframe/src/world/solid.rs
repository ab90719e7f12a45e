//! Solids: upright boxes and cylinders with a bottom and a top, what a ray meets on them and how far they are.

use serde::{Deserialize, Serialize};

/// What an upright solid looks like from above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A rectangle, turned by a yaw.
    Box,
    /// A circle; both half sizes hold its radius.
    Cylinder,
}

/// How a surface answers a sonar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Surface {
    /// Plaster, wood, brick: smooth at 8.6 mm of wavelength.
    Hard,
    /// Cloth, foam, leaves, coats: swallows most of the sound.
    Soft,
    /// Glass, polished metal: reflects in a narrower lobe than plaster.
    Mirror,
}

/// Why a solid is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A cell block of the plan.
    Wall,
    /// The piece of wall over a door.
    Lintel,
    /// A shut door leaf.
    Door,
    /// Part of an object of the world file.
    Furniture,
    /// Part of an object drawn by seed.
    Clutter,
    /// A carpet or mat: part of the floor, never an obstacle.
    SoftFloor,
    /// A walking person.
    Person,
}

/// An upright solid in the world frame.
#[derive(Clone, Copy, Debug)]
pub struct Solid {
    /// Centre, metres.
    pub x: f32,
    /// Centre, metres.
    pub y: f32,
    /// Half the size along its own x, or the radius, metres.
    pub half_x: f32,
    /// Half the size along its own y, or the radius, metres.
    pub half_y: f32,
    /// Cosine of its yaw.
    pub cos: f32,
    /// Sine of its yaw.
    pub sin: f32,
    /// Lowest point above the floor, metres.
    pub bottom: f32,
    /// Highest point above the floor, metres.
    pub top: f32,
    /// Rectangle or circle.
    pub shape: Shape,
    /// How it answers a sonar.
    pub surface: Surface,
    /// Why it is there.
    pub role: Role,
    /// Index of the object that it is part of; `u16::MAX` for walls, lintels and people.
    pub object: u16,
}

/// No object.
pub(crate) const NO_OBJECT: u16 = u16::MAX;

/// Where a ray met a solid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    /// Distance along the ray; 0 when the ray starts inside.
    pub t: f32,
    /// Outward unit normal.
    pub normal: [f32; 3],
    /// Which face of a box, in its own frame: 0 +x, 1 -x, 2 +y, 3 -y, 4 top, 5 bottom; 6 for a mantle.
    pub face: u8,
}

/// Directions closer to parallel than this never meet a face.
const PARALLEL: f32 = 1e-7;

impl Solid {
    /// An upright box.
    #[must_use]
    pub fn new_box(centre: (f32, f32), size: (f32, f32), yaw: f32, bottom: f32, top: f32) -> Self {
        let (sin, cos) = yaw.sin_cos();
        Self {
            x: centre.0,
            y: centre.1,
            half_x: size.0 * 0.5,
            half_y: size.1 * 0.5,
            cos,
            sin,
            bottom,
            top,
            shape: Shape::Box,
            surface: Surface::Hard,
            role: Role::Furniture,
            object: NO_OBJECT,
        }
    }

    /// An upright cylinder.
    #[must_use]
    pub fn new_cylinder(centre: (f32, f32), radius: f32, bottom: f32, top: f32) -> Self {
        Self {
            shape: Shape::Cylinder,
            half_x: radius,
            half_y: radius,
            ..Self::new_box(centre, (0.0, 0.0), 0.0, bottom, top)
        }
    }

    /// The same with another surface.
    #[must_use]
    pub fn with_surface(self, surface: Surface) -> Self {
        Self { surface, ..self }
    }

    /// The same for another reason.
    #[must_use]
    pub fn with_role(self, role: Role) -> Self {
        Self { role, ..self }
    }

    /// Half the extent along world x and y.
    pub(crate) fn half_extent(&self) -> (f32, f32) {
        match self.shape {
            Shape::Cylinder => (self.half_x, self.half_y),
            Shape::Box => (
                self.half_x * self.cos.abs() + self.half_y * self.sin.abs(),
                self.half_x * self.sin.abs() + self.half_y * self.cos.abs(),
            ),
        }
    }

    /// A world point in the solid's own frame.
    fn local(&self, x: f32, y: f32) -> (f32, f32) {
        let (dx, dy) = (x - self.x, y - self.y);
        (dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin)
    }

    /// Signed horizontal distance from a point to the outline, negative inside.
    #[must_use]
    pub fn outline_distance(&self, x: f32, y: f32) -> f32 {
        match self.shape {
            Shape::Cylinder => (x - self.x).hypot(y - self.y) - self.half_x,
            Shape::Box => {
                let (lx, ly) = self.local(x, y);
                let (qx, qy) = (lx.abs() - self.half_x, ly.abs() - self.half_y);
                let outside = (qx.max(0.0).powi(2) + qy.max(0.0).powi(2)).sqrt();
                outside + qx.max(qy).min(0.0)
            }
        }
    }

    /// Distance between this solid and an upright cylinder, negative by the depth when they overlap.
    #[must_use]
    pub fn clearance(&self, x: f32, y: f32, bottom: f32, top: f32, radius: f32) -> f32 {
        let across = self.outline_distance(x, y) - radius;
        let along = (self.bottom - top).max(bottom - self.top);
        if along <= 0.0 {
            across.max(along)
        } else if across <= 0.0 {
            along
        } else {
            (across * across + along * along).sqrt()
        }
    }

    /// The vertical edges of a box, world frame.
    pub(crate) fn corners(&self) -> [(f32, f32); 4] {
        let at = |sx: f32, sy: f32| {
            let (lx, ly) = (sx * self.half_x, sy * self.half_y);
            (self.x + lx * self.cos - ly * self.sin, self.y + lx * self.sin + ly * self.cos)
        };
        [at(1.0, 1.0), at(-1.0, 1.0), at(-1.0, -1.0), at(1.0, -1.0)]
    }

    /// Where a ray first meets the solid within `reach`.
    pub(crate) fn meet(&self, from: [f32; 3], along: [f32; 3], reach: f32) -> Option<Meeting> {
        match self.shape {
            Shape::Box => self.meet_box(from, along, reach),
            Shape::Cylinder => self.meet_cylinder(from, along, reach),
        }
    }

    fn meet_box(&self, from: [f32; 3], along: [f32; 3], reach: f32) -> Option<Meeting> {
        let (ox, oy) = self.local(from[0], from[1]);
        let dx = along[0] * self.cos + along[1] * self.sin;
        let dy = along[1] * self.cos - along[0] * self.sin;
        let slabs = [
            (ox, dx, -self.half_x, self.half_x, 0u8),
            (oy, dy, -self.half_y, self.half_y, 2),
            (from[2], along[2], self.bottom, self.top, 4),
        ];
        let (mut enter, mut leave, mut face) = (f32::NEG_INFINITY, reach, 0u8);
        for (o, d, low, high, positive_face) in slabs {
            if d.abs() < PARALLEL {
                if o < low || o > high {
                    return None;
                }
                continue;
            }
            let (near, far) = if d > 0.0 { (low, high) } else { (high, low) };
            let near_t = (near - o) / d;
            if near_t > enter {
                enter = near_t;
                // A ray that travels towards +x enters through the -x face.
                face = positive_face + u8::from(d > 0.0);
            }
            leave = leave.min((far - o) / d);
        }
        if enter > leave || leave < 0.0 {
            return None;
        }
        let local = match face {
            0 => (1.0, 0.0, 0.0),
            1 => (-1.0, 0.0, 0.0),
            2 => (0.0, 1.0, 0.0),
            3 => (0.0, -1.0, 0.0),
            4 => (0.0, 0.0, 1.0),
            _ => (0.0, 0.0, -1.0),
        };
        let normal =
            [local.0 * self.cos - local.1 * self.sin, local.0 * self.sin + local.1 * self.cos, local.2];
        Some(Meeting { t: enter.max(0.0), normal, face })
    }

    fn meet_cylinder(&self, from: [f32; 3], along: [f32; 3], reach: f32) -> Option<Meeting> {
        let (ox, oy) = (from[0] - self.x, from[1] - self.y);
        let a = along[0] * along[0] + along[1] * along[1];
        let b = ox * along[0] + oy * along[1];
        let c = ox * ox + oy * oy - self.half_x * self.half_x;
        let (mut enter, mut leave) = (f32::NEG_INFINITY, f32::INFINITY);
        if a > PARALLEL {
            let discriminant = b * b - a * c;
            if discriminant < 0.0 {
                return None;
            }
            let root = discriminant.sqrt();
            (enter, leave) = ((-b - root) / a, (-b + root) / a);
        } else if c > 0.0 {
            return None;
        }
        let mut face = 6;
        if along[2].abs() > PARALLEL {
            let (low, high) = ((self.bottom - from[2]) / along[2], (self.top - from[2]) / along[2]);
            if low.min(high) > enter {
                enter = low.min(high);
                face = if along[2] > 0.0 { 5 } else { 4 };
            }
            leave = leave.min(low.max(high));
        } else if from[2] < self.bottom || from[2] > self.top {
            return None;
        }
        if enter > leave || leave < 0.0 || enter > reach {
            return None;
        }
        let t = enter.max(0.0);
        let normal = match face {
            4 => [0.0, 0.0, 1.0],
            5 => [0.0, 0.0, -1.0],
            _ => {
                let inverse = 1.0 / self.half_x.max(1e-6);
                [(ox + t * along[0]) * inverse, (oy + t * along[1]) * inverse, 0.0]
            }
        };
        Some(Meeting { t, normal, face })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clearance_agrees_with_hand_geometry() {
        // A 2 x 1 m box turned by a quarter: 1 m along x, 2 m along y, from 0.4 to 1.0 m.
        let solid = Solid::new_box((5.0, 5.0), (2.0, 1.0), std::f32::consts::FRAC_PI_2, 0.4, 1.0);
        let near = |a: f32, b: f32| assert!((a - b).abs() < 1e-4, "{a} is not {b}");
        near(solid.clearance(6.0, 5.0, 0.5, 0.8, 0.2), 0.3);
        near(solid.clearance(6.0, 7.0, 0.5, 0.8, 0.2), 0.5 * f32::sqrt(5.0) - 0.2);
        // Above it: only the gap counts; above and beside: the diagonal.
        near(solid.clearance(5.0, 5.0, 1.3, 1.5, 0.2), 0.3);
        near(solid.clearance(6.0, 5.0, 1.4, 1.6, 0.2), 0.5);
        // Below it, and overlapping by 0.1 m from the side.
        near(solid.clearance(5.0, 5.0, 0.0, 0.1, 0.2), 0.3);
        near(solid.clearance(5.6, 5.0, 0.5, 0.8, 0.2), -0.1);
        let pole = Solid::new_cylinder((0.0, 0.0), 0.5, 0.0, 2.0);
        near(pole.clearance(3.0, 4.0, 0.5, 0.8, 0.25), 4.25);
    }

    #[test]
    fn rays_meet_faces_mantles_and_caps() {
        let solid = Solid::new_box((2.0, 0.0), (1.0, 1.0), 0.0, 0.0, 1.0);
        let hit = solid.meet([0.0, 0.0, 0.5], [1.0, 0.0, 0.0], 4.0).expect("face");
        assert!((hit.t - 1.5).abs() < 1e-5 && hit.normal[0] < -0.99 && hit.face == 1);
        assert!(solid.meet([0.0, 0.0, 1.2], [1.0, 0.0, 0.0], 4.0).is_none());
        assert!(solid.meet([0.0, 0.0, 0.5], [1.0, 0.0, 0.0], 1.0).is_none());
        let hit = solid.meet([2.0, 0.0, 3.0], [0.0, 0.0, -1.0], 4.0).expect("top");
        assert!((hit.t - 2.0).abs() < 1e-5 && hit.normal[2] > 0.99);
        let pole = Solid::new_cylinder((2.0, 0.0), 0.5, 0.0, 1.0);
        let hit = pole.meet([0.0, 0.0, 0.5], [1.0, 0.0, 0.0], 4.0).expect("mantle");
        assert!((hit.t - 1.5).abs() < 1e-5 && hit.normal[0] < -0.99);
        let hit = pole.meet([2.1, 0.1, 3.0], [0.0, 0.0, -1.0], 4.0).expect("cap");
        assert!((hit.t - 2.0).abs() < 1e-5 && hit.face == 4);
        assert!(pole.meet([2.0, 0.6, 3.0], [0.0, 0.0, -1.0], 4.0).is_none());
    }
}
