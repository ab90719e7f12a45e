//! Where a body is and where its sensors look.

use super::dot;

/// A body's pose: world frame position of the body frame's origin, roll right-positive, pitch
/// nose-down-positive, yaw counter-clockwise (REP-103).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose6 {
    /// Metres.
    pub x: f32,
    /// Metres.
    pub y: f32,
    /// Metres above the floor.
    pub z: f32,
    /// Radians, right side down positive.
    pub roll: f32,
    /// Radians, nose down positive.
    pub pitch: f32,
    /// Radians from world x.
    pub yaw: f32,
}

/// Where a sonar sits on the body and where it looks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mount {
    /// Azimuth of the axis, counter-clockwise from forward, radians.
    pub bearing_rad: f32,
    /// Elevation of the axis; -pi/2 looks straight down.
    pub elevation_rad: f32,
    /// Forward of the body frame's origin, metres.
    pub x_m: f32,
    /// Left of it, metres.
    pub y_m: f32,
    /// Above it, metres.
    pub z_m: f32,
}

impl Pose6 {
    /// A level body.
    #[must_use]
    pub fn level(x: f32, y: f32, z: f32, yaw: f32) -> Self {
        Self { x, y, z, roll: 0.0, pitch: 0.0, yaw }
    }

    /// A body-frame vector in the world frame: yaw, then pitch, then roll about the moving axes. With x
    /// forward and y left, right-handed turns about y put the nose down and about x the right side down.
    #[must_use]
    pub fn turn(&self, v: [f32; 3]) -> [f32; 3] {
        let (sr, cr) = self.roll.sin_cos();
        let (sp, cp) = self.pitch.sin_cos();
        let (sy, cy) = self.yaw.sin_cos();
        let rows = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ];
        rows.map(|row| dot(row, v))
    }

    /// World-frame place of a sonar's face and its axis.
    #[must_use]
    pub fn mounted(&self, mount: &Mount) -> ([f32; 3], [f32; 3]) {
        let at = self.turn([mount.x_m, mount.y_m, mount.z_m]);
        let (se, ce) = mount.elevation_rad.sin_cos();
        let (sb, cb) = mount.bearing_rad.sin_cos();
        let axis = self.turn([ce * cb, ce * sb, se]);
        ([self.x + at[0], self.y + at[1], self.z + at[2]], axis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn signs_are_those_of_the_house() {
        let near = |a: [f32; 3], b: [f32; 3]| {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6), "{a:?} is not {b:?}");
        };
        let nose_down = Pose6 { pitch: 0.3, ..Pose6::default() };
        assert!(nose_down.turn([1.0, 0.0, 0.0])[2] < -0.29);
        let right_down = Pose6 { roll: 0.3, ..Pose6::default() };
        assert!(right_down.turn([0.0, -1.0, 0.0])[2] < -0.29);
        near(Pose6::level(0.0, 0.0, 0.0, FRAC_PI_2).turn([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        let mount = Mount { elevation_rad: -FRAC_PI_2, z_m: -0.05, ..Mount::default() };
        let (face, axis) = Pose6::level(1.0, 2.0, 1.2, 0.4).mounted(&mount);
        near(face, [1.0, 2.0, 1.15]);
        near(axis, [0.0, 0.0, -1.0]);
    }
}
