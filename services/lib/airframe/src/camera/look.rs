//! From the world into the picture.

use super::Lens;
use crate::acoustics::Pose6;

/// Nothing nearer than this is seen, metres.
pub(super) const NEAR_M: f32 = 0.04;
/// Nothing farther away, metres.
pub(super) const FAR_M: f32 = 60.0;

/// Where the lens is, where it looks, and how its picture is scaled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub eye: [f32; 3],
    pub right: [f32; 3],
    pub up: [f32; 3],
    pub ahead: [f32; 3],
    /// Pixels from the middle per unit of tangent.
    pub focal: f32,
    /// The middle of the picture, pixels.
    pub middle: (f32, f32),
}

impl Look {
    pub(super) fn new(pose: &Pose6, lens: &Lens, width: usize, height: usize) -> Self {
        let at = pose.turn([lens.x_m, lens.y_m, lens.z_m]);
        let (sin, cos) = lens.elevation_rad.sin_cos();
        let middle = (width as f32 * 0.5, height as f32 * 0.5);
        Self {
            eye: [pose.x + at[0], pose.y + at[1], pose.z + at[2]],
            right: pose.turn([0.0, -1.0, 0.0]),
            up: pose.turn([-sin, 0.0, cos]),
            ahead: pose.turn([cos, 0.0, sin]),
            focal: middle.0 / (lens.field_of_view_rad * 0.5).tan(),
            middle,
        }
    }

    /// A world-frame place as right, up and ahead of the lens, metres.
    pub(super) fn place(&self, at: [f32; 3]) -> [f32; 3] {
        self.turn(std::array::from_fn(|k| at[k] - self.eye[k]))
    }

    /// A world-frame direction as right, up and ahead of the lens.
    pub(super) fn turn(&self, v: [f32; 3]) -> [f32; 3] {
        [dot(self.right, v), dot(self.up, v), dot(self.ahead, v)]
    }

    /// World-frame direction through the middle of a pixel, one metre ahead.
    pub(super) fn ray(&self, column: f32, row: f32) -> [f32; 3] {
        let (x, y) = ((column - self.middle.0) / self.focal, (self.middle.1 - row) / self.focal);
        std::array::from_fn(|k| self.ahead[k] + x * self.right[k] + y * self.up[k])
    }

    /// Whether a ball (its middle as [`Look::place`] gives it) may reach into the picture.
    pub(super) fn may_see(&self, middle: [f32; 3], radius: f32) -> bool {
        let [x, y, z] = middle;
        if z < NEAR_M - radius || z > FAR_M + radius {
            return false;
        }
        // Planes through the eye and the picture's edges: the distance to each, times the length of its normal.
        let beyond = |across: f32, half: f32| {
            let (edge, ahead) = (self.focal, half);
            across.abs() * edge - z * ahead > radius * edge.hypot(ahead)
        };
        !beyond(x, self.middle.0) && !beyond(y, self.middle.1)
    }
}

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
