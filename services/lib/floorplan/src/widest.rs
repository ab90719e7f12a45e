use crate::rooms::components;
use crate::{DistanceField, Pad, Plan};

/// More room than this around a pad is no better, metres: the sonars shall still hear walls from it.
const ENOUGH_M: f32 = 2.0;
/// Free space that is kept around an airframe on its way, metres: narrower places part the plan.
const MARGIN_M: f32 = 0.15;

/// A pad for a plan whose installer named none: of the largest connected part that an airframe of this radius (metres)
/// can fly in, the place farthest from everything that is not free, up to 2 m; of equal places the lowest, then the
/// leftmost. The heading is 0. `None` when the airframe fits nowhere.
pub fn widest_place(plan: &Plan, radius_m: f32) -> Option<Pad> {
    let needed = radius_m.max(0.0) + MARGIN_M;
    let field = DistanceField::of_not_free(plan, ENOUGH_M.max(needed + plan.resolution()));
    let room = |cell: usize| field.at_cell(cell % plan.width(), cell / plan.width());
    let fits: Vec<bool> = (0..plan.cells().len()).map(|cell| room(cell) > needed).collect();
    // Of equally large parts and equally wide places `reduce` keeps the first.
    let part = components(plan, &fits).into_iter().reduce(|a, b| if b.len() > a.len() { b } else { a })?;
    let first = |a: usize, b: usize| {
        let (ra, rb) = (room(a), room(b));
        if rb > ra || rb == ra && b < a { b } else { a }
    };
    let cell = part.into_iter().reduce(first)?;
    let (x, y) = plan.centre(cell % plan.width(), cell / plan.width());
    Some(Pad { x, y, heading_deg: 0.0 })
}
