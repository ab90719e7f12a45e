use floorplan::{Cell, DistanceField, Door, Plan, Rooms};

use crate::{Bits, Limits, Raster};

/// What a step costs at the least clearance, beside the 1 of free space: steep, so that half a metre of
/// detour is taken for ten centimetres of clearance in a door.
const CLEARANCE_WEIGHT: f32 = 8.0;
/// What a step costs where no surface is within the sonars' reach, beside the 1 of free space.
const FAR_WEIGHT: f32 = 2.0;
/// A shut door fills this much to either side of the line between its posts, metres.
const LEAF_M: f32 = 0.15;
/// Clearances are known up to here, metres; more changes nothing.
const CAP_M: f32 = 2.0;
/// Rounding of clearances, metres: a passage that is just wide enough is.
const SLACK_M: f32 = 0.01;
const NO_DOOR: u16 = u16::MAX;
const NO_ROOM: u8 = u8::MAX;

/// Where the vehicle may fly, on a grid of about 10 cm: the plan, and over it the doors that were found
/// shut and the things that were found standing about.
#[derive(Clone, Debug)]
pub struct Costmap {
    raster: Raster,
    limits: Limits,
    doors: Vec<Door>,
    closed: Vec<bool>,
    field: DistanceField,
    /// Largest clearance inside the cell by the plan, metres.
    mapped: Vec<f32>,
    /// Clearance to what the plan does not show, metres.
    unmapped_clearance: Vec<f32>,
    /// Nearest mapped surface, metres.
    surface: Vec<f32>,
    /// Whether sight ends here by the plan.
    wall: Vec<bool>,
    /// Whether the floor is free here by the plan.
    floor: Vec<bool>,
    door: Vec<u16>,
    room: Vec<u8>,
    unmapped: Bits,
    /// Cost of a metre through the cell; infinite when it cannot be flown through.
    cost: Vec<f32>,
}

impl Costmap {
    /// The plan alone: every door open, nothing in the way.
    pub fn new(plan: &Plan, rooms: &Rooms, doors: &[Door], limits: &Limits) -> Self {
        let raster = Raster::over(plan);
        let count = raster.len();
        let field = DistanceField::of_not_free(plan, CAP_M);
        let walls = DistanceField::new(plan, limits.horizon_m + 1.0);
        let content = Content::new(plan, &raster);
        let mut map = Self {
            raster,
            limits: *limits,
            doors: doors.to_vec(),
            closed: vec![false; doors.len()],
            mapped: vec![0.0; count],
            unmapped_clearance: vec![f32::INFINITY; count],
            surface: vec![0.0; count],
            wall: (0..count).map(|cell| content.is_wall(cell)).collect(),
            floor: (0..count).map(|cell| content.is_floor(cell)).collect(),
            door: vec![NO_DOOR; count],
            room: vec![NO_ROOM; count],
            unmapped: Bits::default(),
            cost: vec![f32::INFINITY; count],
            field,
        };
        for cell in 0..count {
            let (x, y) = raster.centre(cell);
            map.surface[cell] = walls.distance(x, y);
            map.mapped[cell] = map.best_clearance(x, y);
            if let Some(room) = rooms.room_at(x, y) {
                map.room[cell] = room.min(usize::from(NO_ROOM) - 1) as u8;
            }
            let nearest = doors.iter().position(|door| door.distance(x, y) <= LEAF_M.max(raster.cell_m));
            if let Some(door) = nearest {
                map.door[cell] = door.min(usize::from(NO_DOOR) - 1) as u16;
            }
        }
        for cell in 0..count {
            map.refresh(cell);
        }
        map
    }

    /// Clearance at the best place of a cell: the grid must not make a door narrower than it is.
    fn best_clearance(&self, x: f32, y: f32) -> f32 {
        // A quarter of a cell apart: with plan cells half as large, their middles are among the samples.
        let quarter = 0.25 * self.raster.cell_m;
        let offsets = || (-2..=2).map(move |k| k as f32 * quarter);
        offsets()
            .flat_map(|dy| offsets().map(move |dx| (dx, dy)))
            .map(|(dx, dy)| self.field.distance(x + dx, y + dy))
            .fold(0.0, f32::max)
    }

    /// The grid's place in the plan frame.
    pub fn raster(&self) -> &Raster {
        &self.raster
    }

    /// What the vehicle needs.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The doors of the plan.
    pub fn doors(&self) -> &[Door] {
        &self.doors
    }

    /// Says that a door is shut or open. An index that is none is ignored.
    pub fn set_door(&mut self, door: usize, closed: bool) {
        if self.closed.get(door).is_none_or(|was| *was == closed) {
            return;
        }
        self.closed[door] = closed;
        for cell in 0..self.raster.len() {
            if usize::from(self.door[cell]) == door {
                self.refresh(cell);
            }
        }
    }

    /// Whether a door was found shut.
    pub fn door_closed(&self, door: usize) -> bool {
        self.closed.get(door).copied().unwrap_or(false)
    }

    /// The door nearest to a place, within `within_m` of the line between its posts.
    pub fn door_near(&self, x: f32, y: f32, within_m: f32) -> Option<usize> {
        let distances = self.doors.iter().map(|door| door.distance(x, y)).enumerate();
        distances.filter(|(_, d)| *d <= within_m).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(door, _)| door)
    }

    /// Says that something stands here that the plan does not show. Places in walls or outside are ignored.
    pub fn mark_unmapped(&mut self, x: f32, y: f32) {
        let Some(cell) = self.raster.cell(x, y) else { return };
        if !self.floor[cell] || self.unmapped.get(&self.raster, cell) {
            return;
        }
        self.unmapped.set(&self.raster, cell, true);
        self.stamp(cell);
    }

    /// Forgets what was marked within `radius_m` of a place.
    pub fn forget_unmapped(&mut self, x: f32, y: f32, radius_m: f32) {
        let raster = self.raster;
        let mut kept = self.unmapped.clone();
        for cell in self.unmapped.cells(&raster) {
            let (cx, cy) = raster.centre(cell);
            if (cx - x).hypot(cy - y) <= radius_m {
                kept.set(&raster, cell, false);
            }
        }
        self.set_unmapped(&kept);
    }

    /// Replaces all that stands about, such as after a restart.
    pub fn set_unmapped(&mut self, bits: &Bits) {
        let raster = self.raster;
        self.unmapped.clear();
        self.unmapped_clearance.fill(f32::INFINITY);
        for cell in 0..raster.len() {
            self.refresh(cell);
        }
        for cell in bits.cells(&raster) {
            let (x, y) = raster.centre(cell);
            self.mark_unmapped(x, y);
        }
    }

    /// What stands about that the plan does not show.
    pub fn unmapped(&self) -> &Bits {
        &self.unmapped
    }

    /// Clearance at a place, to mapped and unmapped things, metres, at most 2.
    pub fn clearance(&self, x: f32, y: f32) -> f32 {
        let Some(cell) = self.raster.cell(x, y) else { return 0.0 };
        self.field.distance(x, y).min(self.unmapped_clearance[cell])
    }

    /// Clearance at a place to what the plan shows, metres, at most 2.
    pub fn mapped_clearance(&self, x: f32, y: f32) -> f32 {
        self.field.distance(x, y)
    }

    /// Whether the vehicle may be at a place.
    pub fn passable(&self, x: f32, y: f32) -> bool {
        self.raster.cell(x, y).is_some_and(|cell| self.is_passable(cell))
    }

    /// The room at a cell of the raster.
    pub fn room_of(&self, cell: usize) -> Option<usize> {
        self.room.get(cell).filter(|room| **room != NO_ROOM).map(|room| usize::from(*room))
    }

    /// Whether the plan has free floor at a cell of the raster.
    pub fn is_floor(&self, cell: usize) -> bool {
        self.floor.get(cell).copied().unwrap_or(false)
    }

    /// Whether sight ends at a cell: a wall, a shut door, or something that stands there.
    pub fn is_opaque(&self, cell: usize) -> bool {
        self.wall.get(cell).copied().unwrap_or(true)
            || self.shut_door(cell).is_some()
            || self.unmapped.get(&self.raster, cell)
    }

    pub(crate) fn is_passable(&self, cell: usize) -> bool {
        self.cost[cell].is_finite()
    }

    /// Cost of a metre through a cell, 1 or more; infinite when it cannot be flown through.
    pub(crate) fn cost(&self, cell: usize) -> f32 {
        self.cost[cell]
    }

    /// As [`Costmap::cost`], by the clearance of the very place.
    pub(crate) fn cost_at(&self, x: f32, y: f32) -> f32 {
        match self.raster.cell(x, y) {
            Some(cell) if self.is_passable(cell) => self.free_cost(cell, self.clearance(x, y)),
            _ => f32::INFINITY,
        }
    }

    pub(crate) fn mapped(&self, cell: usize) -> f32 {
        self.mapped[cell]
    }

    pub(crate) fn surface(&self, cell: usize) -> f32 {
        self.surface[cell]
    }

    pub(crate) fn cell_clearance(&self, cell: usize) -> f32 {
        self.mapped[cell].min(self.unmapped_clearance[cell])
    }

    /// Width of the mapped passage at a cell: the shortest straight line through it from wall to wall,
    /// metres. The clearance at grid points would make an even number of cells narrower than it is.
    pub(crate) fn passage_width(&self, cell: usize) -> f32 {
        let (x, y) = self.raster.centre(cell);
        let run = |angle: f32| {
            let (sin, cos) = angle.sin_cos();
            let mut length = 0.0;
            // Never farther than the nearest wall allows, until it is reached.
            while length < CAP_M {
                let free = self.field.distance(x + length * cos, y + length * sin);
                if free < 0.001 {
                    break;
                }
                length += free.max(0.001);
            }
            length
        };
        let directions = (0..16).map(|k| std::f32::consts::PI * k as f32 / 16.0);
        directions.map(|angle| run(angle) + run(angle + std::f32::consts::PI)).fold(f32::INFINITY, f32::min)
    }

    pub(crate) fn field(&self) -> &DistanceField {
        &self.field
    }

    /// The shut door that fills a cell.
    pub(crate) fn shut_door(&self, cell: usize) -> Option<usize> {
        let door = usize::from(*self.door.get(cell)?);
        self.closed.get(door).is_some_and(|closed| *closed).then_some(door)
    }

    /// Whether something unmapped stands too near to pass.
    pub(crate) fn is_obstructed(&self, cell: usize) -> bool {
        self.unmapped_clearance[cell] < self.limits.unmapped_clearance_m() - SLACK_M
    }

    /// Whether the plan leaves too little room.
    pub(crate) fn is_narrow(&self, cell: usize) -> bool {
        self.mapped[cell] < self.limits.clearance_m() - SLACK_M
    }

    fn refresh(&mut self, cell: usize) {
        let blocked = self.is_narrow(cell)
            || self.is_obstructed(cell)
            || !self.floor[cell]
            || self.shut_door(cell).is_some();
        let clearance = self.cell_clearance(cell);
        self.cost[cell] = if blocked { f32::INFINITY } else { self.free_cost(cell, clearance) };
    }

    fn free_cost(&self, cell: usize, clearance: f32) -> f32 {
        let (least, comfort) = (self.limits.clearance_m(), self.limits.comfort_m);
        let near = ((comfort - clearance) / (comfort - least).max(0.01)).max(0.0);
        let far = if self.surface[cell] > self.limits.horizon_m { FAR_WEIGHT } else { 0.0 };
        1.0 + CLEARANCE_WEIGHT * near * near + far
    }

    /// Writes the clearance around a marked cell.
    fn stamp(&mut self, cell: usize) {
        let raster = self.raster;
        let reach = (self.limits.comfort_m / raster.cell_m).ceil() as i32 + 1;
        for rows in -reach..=reach {
            for columns in -reach..=reach {
                let Some(other) = raster.shifted(cell, columns, rows) else { continue };
                let between = (columns as f32).hypot(rows as f32);
                let clearance = ((between - 0.5) * raster.cell_m).max(0.0);
                if clearance < self.unmapped_clearance[other] {
                    self.unmapped_clearance[other] = clearance;
                    self.refresh(other);
                }
            }
        }
    }
}

/// How many plan cells of each kind a cell of the raster holds.
struct Content {
    free: Vec<u16>,
    occupied: Vec<u16>,
    all: Vec<u16>,
}

impl Content {
    fn new(plan: &Plan, raster: &Raster) -> Self {
        let zero = vec![0; raster.len()];
        let mut content = Self { free: zero.clone(), occupied: zero.clone(), all: zero };
        for iy in 0..plan.height() {
            for ix in 0..plan.width() {
                let (x, y) = plan.centre(ix, iy);
                let Some(cell) = raster.cell(x, y) else { continue };
                content.all[cell] = content.all[cell].saturating_add(1);
                match plan.cell(ix, iy) {
                    Cell::Free => content.free[cell] = content.free[cell].saturating_add(1),
                    Cell::Occupied => content.occupied[cell] = content.occupied[cell].saturating_add(1),
                    Cell::Unknown => {}
                }
            }
        }
        content
    }

    /// Half is enough: a wall of one plan cell hides what is behind it.
    fn is_wall(&self, cell: usize) -> bool {
        self.all[cell] == 0 || 2 * self.occupied[cell] >= self.all[cell]
    }

    fn is_floor(&self, cell: usize) -> bool {
        !self.is_wall(cell) && 2 * self.free[cell] >= self.all[cell]
    }
}
