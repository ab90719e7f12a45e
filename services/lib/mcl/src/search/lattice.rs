//! The places of a plan that a search looks at.

use floorplan::{Cell, DistanceField, Plan};

/// Side of the lattice, metres.
const LATTICE_M: f32 = 0.2;

/// The places of a plan that are looked at: those with room for a body.
#[derive(Debug)]
pub struct Lattice(Vec<(f32, f32)>);

impl Lattice {
    /// Of `plan`, for a body that keeps `clearance_m` from what is not free.
    #[must_use]
    pub fn new(plan: &Plan, clearance_m: f32) -> Self {
        let field = DistanceField::of_not_free(plan, clearance_m + 1.0);
        let step = (LATTICE_M / plan.resolution()).round().max(1.0) as usize;
        let places = (step / 2..plan.height())
            .step_by(step)
            .flat_map(|iy| (step / 2..plan.width()).step_by(step).map(move |ix| (ix, iy)))
            .filter(|(ix, iy)| plan.cell(*ix, *iy) == Cell::Free && field.at_cell(*ix, *iy) >= clearance_m)
            .map(|(ix, iy)| plan.centre(ix, iy))
            .collect();
        Self(places)
    }

    /// Plan frame, metres.
    #[must_use]
    pub fn places(&self) -> &[(f32, f32)] {
        &self.0
    }
}
