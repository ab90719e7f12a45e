//! What the filter needs to know of the plan.

/// Says what a sonar would hear from a place on the plan.
pub trait RangeMap {
    /// Distance in metres to the nearest surface that sends an echo into a cone whose axis points along
    /// `angle` (plan frame, radians, any number of turns) from (`x`, `y`); infinite when nothing answers.
    fn range(&self, x: f32, y: f32, angle: f32) -> f32;

    /// The same for columns of equal length; `cos` and `sin` are those of `angle`.
    fn ranges(&self, x: &[f32], y: &[f32], angle: &[f32], cos: &[f32], sin: &[f32], out: &mut [f32]) {
        let _ = (cos, sin);
        for (((out, x), y), angle) in out.iter_mut().zip(x).zip(y).zip(angle) {
            *out = self.range(*x, *y, *angle);
        }
    }
}

impl RangeMap for floorplan::ConeTable {
    #[inline]
    fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        Self::range(self, x, y, angle)
    }

    #[inline]
    fn ranges(&self, x: &[f32], y: &[f32], angle: &[f32], cos: &[f32], sin: &[f32], out: &mut [f32]) {
        Self::ranges(self, x, y, angle, cos, sin, out);
    }
}

impl<M: RangeMap + ?Sized> RangeMap for std::sync::Arc<M> {
    #[inline]
    fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        M::range(self, x, y, angle)
    }

    #[inline]
    fn ranges(&self, x: &[f32], y: &[f32], angle: &[f32], cos: &[f32], sin: &[f32], out: &mut [f32]) {
        M::ranges(self, x, y, angle, cos, sin, out);
    }
}
