use std::collections::VecDeque;

use crate::{Cell, DistanceField, Plan, PlanError, Sidecar};

/// Most rooms of a plan: what the report of a round holds.
pub const MAX_ROOMS: usize = 48;

/// Clearance in metres that a place must have to be the core of a room: half of a 1.2 m door and a little,
/// so that doors separate rooms and a corridor 1.4 m wide is one.
const CORE_M: f32 = 0.68;
/// Smallest core that makes a room, square metres: less is a niche.
const CORE_AREA_M2: f32 = 0.8;
const NO_ROOM: u8 = u8::MAX;

/// Which room each cell belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct Rooms {
    /// The rooms' names, in the order of their indices.
    pub names: Vec<String>,
    /// Room of each cell as in [`Plan::cells`], or [`NO_ROOM`].
    of_cell: Vec<u8>,
    width: usize,
    height: usize,
    resolution: f32,
    origin: (f32, f32),
}

impl Rooms {
    /// The rooms of a sidecar file; without any, those found by [`Rooms::segment`].
    ///
    /// # Errors
    /// As [`Sidecar::parse`], and a room without a free cell.
    pub fn parse(file: &str, yaml: &[u8], plan: &Plan) -> Result<Self, PlanError> {
        Self::of(file, &Sidecar::parse(file, yaml)?, plan)
    }

    /// As [`Rooms::parse`], from a sidecar that was read already.
    ///
    /// # Errors
    /// A room without a free cell.
    pub fn of(file: &str, sidecar: &Sidecar, plan: &Plan) -> Result<Self, PlanError> {
        if sidecar.rooms.is_empty() {
            return Ok(Self::segment(plan));
        }
        let mut of_cell = vec![NO_ROOM; plan.cells().len()];
        let mut cells = vec![0_usize; sidecar.rooms.len()];
        for (index, cell) in of_cell.iter_mut().enumerate() {
            if plan.cells()[index] != Cell::Free {
                continue;
            }
            let (x, y) = plan.centre(index % plan.width(), index / plan.width());
            if let Some(room) = sidecar.rooms.iter().take(MAX_ROOMS).position(|room| room.area.contains(x, y))
            {
                *cell = room as u8;
                cells[room] += 1;
            }
        }
        if let Some(empty) = cells.iter().take(MAX_ROOMS).position(|count| *count == 0) {
            let field = format!("rooms: {}", sidecar.rooms[empty].name);
            return Err(PlanError::range(
                file,
                &field,
                &"without a free cell of the plan",
                "an area with free cells",
            ));
        }
        let names = sidecar.rooms.iter().take(MAX_ROOMS).map(|room| room.name.clone()).collect();
        Ok(Self::with(plan, names, of_cell))
    }

    /// Finds rooms by their shape: the parts into which the free space falls when everything nearer than
    /// [`CORE_M`] to a wall is taken away, each grown back until they meet (in the doors). Numbered from
    /// the top left, `Room 1`, `Room 2` and so on.
    pub fn segment(plan: &Plan) -> Self {
        let field = DistanceField::of_not_free(plan, 2.0 * CORE_M);
        let core: Vec<bool> = (0..plan.cells().len())
            .map(|k| field.at_cell(k % plan.width(), k / plan.width()) > CORE_M)
            .collect();
        let mut cores = components(plan, &core);
        let cell_m2 = plan.resolution() * plan.resolution();
        cores.retain(|cells| cells.len() as f32 * cell_m2 >= CORE_AREA_M2);
        if cores.is_empty() {
            // A place too narrow to have a core anywhere is one room for each part of it, specks left out.
            let free: Vec<bool> = plan.cells().iter().map(|cell| *cell == Cell::Free).collect();
            cores = components(plan, &free);
            let largest = cores.iter().map(Vec::len).max().unwrap_or(0) as f32 * cell_m2;
            cores.retain(|cells| cells.len() as f32 * cell_m2 >= CORE_AREA_M2.min(largest));
        }
        if cores.len() > MAX_ROOMS {
            cores.sort_by_key(|cells| std::cmp::Reverse(cells.len()));
            cores.truncate(MAX_ROOMS);
        }
        // Reading order: the highest row first, then the leftmost column.
        let width = plan.width();
        cores.sort_by_key(|cells| {
            cells.iter().map(|k| (std::cmp::Reverse(k / width), k % width)).min().unwrap_or_default()
        });
        let mut of_cell = vec![NO_ROOM; plan.cells().len()];
        let mut queue = VecDeque::new();
        for (room, cells) in cores.iter().enumerate() {
            for cell in cells {
                of_cell[*cell] = room as u8;
                queue.push_back(*cell);
            }
        }
        while let Some(cell) = queue.pop_front() {
            for next in neighbours(plan, cell) {
                if of_cell[next] == NO_ROOM && plan.cells()[next] == Cell::Free {
                    of_cell[next] = of_cell[cell];
                    queue.push_back(next);
                }
            }
        }
        let names = (1..=cores.len()).map(|number| format!("Room {number}")).collect();
        Self::with(plan, names, of_cell)
    }

    fn with(plan: &Plan, names: Vec<String>, of_cell: Vec<u8>) -> Self {
        Self {
            names,
            of_cell,
            width: plan.width(),
            height: plan.height(),
            resolution: plan.resolution(),
            origin: plan.origin(),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// The room's name; empty for an index that is none.
    pub fn name(&self, room: usize) -> &str {
        self.names.get(room).map_or("", String::as_str)
    }

    /// The room at a place in the plan frame; `None` in walls, outside, and between named areas.
    pub fn room_at(&self, x: f32, y: f32) -> Option<usize> {
        let fx = ((x - self.origin.0) / self.resolution).floor();
        let fy = ((y - self.origin.1) / self.resolution).floor();
        let inside = fx >= 0.0 && fy >= 0.0 && fx < self.width as f32 && fy < self.height as f32;
        inside.then(|| self.room_of(fx as usize, fy as usize)).flatten()
    }

    /// The room of a cell of the plan.
    pub fn room_of(&self, ix: usize, iy: usize) -> Option<usize> {
        if ix >= self.width || iy >= self.height {
            return None;
        }
        self.of_cell.get(iy * self.width + ix).filter(|room| **room != NO_ROOM).map(|room| usize::from(*room))
    }
}

/// The connected parts (over sides) of the marked cells.
pub(crate) fn components(plan: &Plan, marked: &[bool]) -> Vec<Vec<usize>> {
    let mut seen = vec![false; marked.len()];
    let mut parts = Vec::new();
    for start in 0..marked.len() {
        if seen[start] || !marked[start] {
            continue;
        }
        seen[start] = true;
        let mut part = vec![start];
        let mut next = 0;
        while let Some(&cell) = part.get(next) {
            next += 1;
            for other in neighbours(plan, cell) {
                if marked[other] && !seen[other] {
                    seen[other] = true;
                    part.push(other);
                }
            }
        }
        parts.push(part);
    }
    parts
}

fn neighbours(plan: &Plan, cell: usize) -> impl Iterator<Item = usize> {
    let (width, height) = (plan.width(), plan.height());
    let (x, y) = (cell % width, cell / width);
    [
        (x > 0).then(|| cell - 1),
        (x + 1 < width).then(|| cell + 1),
        (y > 0).then(|| cell - width),
        (y + 1 < height).then(|| cell + width),
    ]
    .into_iter()
    .flatten()
}
