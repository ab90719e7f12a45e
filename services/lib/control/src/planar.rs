//! Vectors in the horizontal plane and angles.

use core::f32::consts::{PI, TAU};
use core::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A horizontal vector; which frame it is in is said where it is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector {
    /// Plan: right. Body: forward.
    pub x: f32,
    /// Plan: up. Body: left.
    pub y: f32,
}

impl Vector {
    /// Neither here nor there.
    pub const ZERO: Self = Self { x: 0.0, y: 0.0 };

    /// A vector of these components.
    #[must_use]
    pub const fn new(x: f32, y: f32) -> Self {
        Self { x, y }
    }

    /// The unit vector along `angle`, counter-clockwise from x.
    #[must_use]
    pub fn along(angle: f32) -> Self {
        let (y, x) = angle.sin_cos();
        Self { x, y }
    }

    /// Turned counter-clockwise by `angle`: body to plan when `angle` is the heading.
    #[must_use]
    pub fn rotated(self, angle: f32) -> Self {
        let (s, c) = angle.sin_cos();
        Self { x: c * self.x - s * self.y, y: s * self.x + c * self.y }
    }

    /// Length.
    #[must_use]
    pub fn norm(self) -> f32 {
        self.x.hypot(self.y)
    }

    /// Direction, counter-clockwise from x, -pi..pi.
    #[must_use]
    pub fn angle(self) -> f32 {
        self.y.atan2(self.x)
    }

    /// Inner product.
    #[must_use]
    pub fn dot(self, other: Self) -> f32 {
        self.x * other.x + self.y * other.y
    }

    /// Outer product: positive when `other` lies to the left of `self`.
    #[must_use]
    pub fn cross(self, other: Self) -> f32 {
        self.x * other.y - self.y * other.x
    }

    /// The same direction, at most this long.
    #[must_use]
    pub fn limited(self, most: f32) -> Self {
        let norm = self.norm();
        if norm > most && norm > 0.0 { self * (most.max(0.0) / norm) } else { self }
    }

    /// Whether both components are numbers.
    #[must_use]
    pub fn is_finite(self) -> bool {
        self.x.is_finite() && self.y.is_finite()
    }

    /// The vector when it is made of numbers.
    #[must_use]
    pub fn known(self) -> Option<Self> {
        self.is_finite().then_some(self)
    }

    /// One step of at most `most` towards `to`.
    #[must_use]
    pub fn approached(self, to: Self, most: f32) -> Self {
        self + (to - self).limited(most)
    }
}

impl Add for Vector {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y }
    }
}
impl AddAssign for Vector {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl Sub for Vector {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }
}
impl Mul<f32> for Vector {
    type Output = Self;
    fn mul(self, by: f32) -> Self {
        Self { x: self.x * by, y: self.y * by }
    }
}
impl Neg for Vector {
    type Output = Self;
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y }
    }
}

/// The same angle in -pi..=pi; what is no number stays none.
#[must_use]
pub fn wrap_angle(angle: f32) -> f32 {
    let wrapped = (angle + PI).rem_euclid(TAU) - PI;
    if wrapped < -PI { wrapped + TAU } else { wrapped }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::FRAC_PI_2;

    #[test]
    fn forward_at_heading_north_is_up_on_the_plan() {
        let v = Vector::new(1.0, 0.0).rotated(FRAC_PI_2);
        assert!(v.x.abs() < 1e-6 && (v.y - 1.0).abs() < 1e-6);
        assert!(Vector::new(1.0, 0.0).cross(Vector::new(0.0, 1.0)) > 0.0);
    }

    #[test]
    fn limits_keep_the_direction() {
        let v = Vector::new(3.0, 4.0).limited(1.0);
        assert!((v.norm() - 1.0).abs() < 1e-6 && (v.x / v.y - 0.75).abs() < 1e-6);
        assert_eq!(Vector::ZERO.limited(0.0), Vector::ZERO);
    }

    #[test]
    fn angles_wrap() {
        for turns in -5..5 {
            let a = wrap_angle(0.3 + turns as f32 * TAU);
            assert!((a - 0.3).abs() < 1e-4, "{a}");
        }
    }
}
