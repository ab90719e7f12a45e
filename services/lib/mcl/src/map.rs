//! What the filter needs to know of the plan.

/// Says what a sonar would hear from a place on the plan.
pub trait RangeMap {
    /// Distance in metres to the nearest surface that sends an echo into a cone whose axis points along
    /// `angle` (plan frame, radians, any number of turns) from (`x`, `y`); infinite when nothing answers.
    fn range(&self, x: f32, y: f32, angle: f32) -> f32;
}

impl RangeMap for floorplan::ConeTable {
    #[inline]
    fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        Self::range(self, x, y, angle)
    }
}

impl<M: RangeMap + ?Sized> RangeMap for std::sync::Arc<M> {
    #[inline]
    fn range(&self, x: f32, y: f32, angle: f32) -> f32 {
        M::range(self, x, y, angle)
    }
}
