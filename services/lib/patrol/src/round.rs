use std::collections::VecDeque;

use crate::cover::{Choice, Cover};
use crate::refine::Refine;
use crate::search::Search;
use crate::tour::Tour;
use crate::{Bits, Costmap, Obstacle, RoutePlanner, Seen, Step, Wishes};

/// A room is entered when this share of its floor can be flown over.
const ENTERED_SHARE: f32 = 0.05;
/// A room that cannot be entered is not left out when this share of its floor can be seen from outside.
const SEEN_SHARE: f32 = 0.9;
/// How often the tour is shortened and put in order again.
const REFINEMENTS: usize = 2;
/// The start may stand this far from a place that can be flown to, metres.
const START_SNAP_M: f32 = 0.8;

/// A place of the round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Plan frame, metres.
    pub x: f32,
    /// Plan frame, metres.
    pub y: f32,
    /// The room it lies in.
    pub room: Option<usize>,
    /// A place to look from; the way back to the pad is none.
    pub look: bool,
    /// Which of the wished points it is.
    pub point: Option<usize>,
}

/// What the round does about one room.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoomPlan {
    /// Floor of the room by the plan, cells.
    pub floor: usize,
    /// Floor that can be flown over, cells.
    pub reached: usize,
    /// Floor that can be seen from where the vehicle can go, cells.
    pub to_see: usize,
    /// Why it is left out.
    pub skipped: Option<Obstacle>,
}

/// What a slice of planning came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// Not ready: call again.
    Working,
    /// The stops are ready.
    Done,
    /// The start is nowhere from where the vehicle can fly.
    Failed,
}

/// Works out a round, in slices: what can be reached and seen, from where to look at it, in which order.
///
/// It is planned from where the vehicle is, for what is not seen yet: the same serves at the start and
/// after a door was found shut.
#[derive(Clone, Debug)]
pub struct Round {
    pad: (f32, f32),
    start: usize,
    stage: Stage,
    reached: Vec<bool>,
    queue: VecDeque<u32>,
    cover: Cover,
    choice: Option<Choice>,
    tour: Option<Tour>,
    refine: Option<Refine>,
    search: Search,
    /// Blocks of the tour, the first one that of the start, the last one that of the pad.
    blocks: Vec<usize>,
    refinements: usize,
    seen: Vec<bool>,
    to_see: Bits,
    planner: RoutePlanner,
    asked: bool,
    rooms: Vec<RoomPlan>,
    stops: Vec<Stop>,
    wishes: Wishes,
    /// Of the wished points that can be reached: which, the cell, the block.
    points: Vec<(usize, usize, usize)>,
    /// Wished points that cannot be reached.
    barred: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Reach,
    Look,
    Choose,
    Order,
    Refine,
    Rooms { room: usize },
    Done,
    Failed,
}

impl Round {
    /// Asks for a round over `rooms` rooms, from a place back to the pad, of what is not `seen` and was not wished away.
    pub fn new(
        map: &Costmap,
        rooms: usize,
        from: (f32, f32),
        pad: (f32, f32),
        seen: &Seen,
        wishes: &Wishes,
    ) -> Self {
        let raster = map.raster();
        let start = start_cell(map, from);
        let mut reached = vec![false; raster.len()];
        let mut queue = VecDeque::new();
        if let Some(start) = start {
            reached[start] = true;
            queue.push_back(start as u32);
        }
        let mut plans = vec![RoomPlan::default(); rooms];
        for cell in 0..raster.len() {
            if map.is_floor(cell)
                && let Some(plan) = map.room_of(cell).and_then(|room| plans.get_mut(room))
            {
                plan.floor += 1;
            }
        }
        Self {
            pad,
            start: start.unwrap_or(0),
            stage: if start.is_some() { Stage::Reach } else { Stage::Failed },
            reached,
            queue,
            cover: Cover::new(map),
            choice: None,
            tour: None,
            refine: None,
            search: Search::new(raster.len()),
            blocks: Vec::new(),
            refinements: 0,
            seen: (0..raster.len())
                .map(|cell| seen.bits().get(raster, cell) || wishes.leaves_out(map.room_of(cell)))
                .collect(),
            to_see: Bits::default(),
            planner: RoutePlanner::new(map),
            asked: false,
            rooms: plans,
            stops: Vec::new(),
            wishes: wishes.clone(),
            points: Vec::new(),
            barred: Vec::new(),
        }
    }

    /// Works on for about `units` (a cell looked at each, 2 to 5 ns); the map and what is seen must be those
    /// of [`Round::new`].
    pub fn advance(&mut self, map: &Costmap, seen: &Seen, units: usize) -> Progress {
        let mut left = units.max(1);
        while left > 0 {
            left = match self.stage {
                Stage::Reach => self.reach(map, left),
                Stage::Look => self.look(map, seen, left),
                Stage::Choose => self.choose(map, left),
                Stage::Order => self.order(map, left),
                Stage::Refine => self.shorten(map, left),
                Stage::Rooms { room } => self.ask_for(map, room, left),
                Stage::Done => return Progress::Done,
                Stage::Failed => return Progress::Failed,
            };
        }
        match self.stage {
            Stage::Done => Progress::Done,
            Stage::Failed => Progress::Failed,
            _ => Progress::Working,
        }
    }

    /// The stops in order, the pad last; empty until done.
    pub fn stops(&self) -> &[Stop] {
        &self.stops
    }

    /// One entry a room.
    pub fn rooms(&self) -> &[RoomPlan] {
        &self.rooms
    }

    /// Everything that can be seen from where the vehicle can go, and what was seen before.
    pub fn to_see(&self) -> &Bits {
        &self.to_see
    }

    /// Wished points that cannot be reached, by their index.
    pub fn barred(&self) -> &[usize] {
        &self.barred
    }

    fn reach(&mut self, map: &Costmap, mut left: usize) -> usize {
        while left > 0 {
            let Some(cell) = self.queue.pop_front() else {
                self.stage = Stage::Look;
                break;
            };
            left = left.saturating_sub(8);
            for (columns, rows) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                if let Some(next) = map.raster().shifted(cell as usize, columns, rows)
                    && !self.reached[next]
                    && map.is_passable(next)
                {
                    self.reached[next] = true;
                    self.queue.push_back(next as u32);
                }
            }
        }
        left
    }

    fn look(&mut self, map: &Costmap, seen: &Seen, left: usize) -> usize {
        let (left, done) = self.cover.look(map, &self.reached, left);
        if done {
            self.to_see = self.cover.to_see().clone();
            if !self.wishes.leave_out.is_empty() {
                for cell in self.cover.to_see().cells(map.raster()) {
                    if self.wishes.leaves_out(map.room_of(cell)) {
                        self.to_see.set(map.raster(), cell, false);
                    }
                }
            }
            self.to_see.add(seen.bits());
            for cell in self.to_see.cells(map.raster()) {
                if let Some(plan) = map.room_of(cell).and_then(|room| self.rooms.get_mut(room)) {
                    plan.to_see += 1;
                    plan.reached += usize::from(self.reached[cell]);
                }
            }
            self.choice = Some(Choice::new(map, &self.cover, &self.seen));
            self.stage = Stage::Choose;
        }
        left
    }

    fn choose(&mut self, map: &Costmap, left: usize) -> usize {
        let Some(choice) = &mut self.choice else { return left };
        let (left, done) = choice.advance(map, &self.cover, left);
        if done {
            let start = self.cover.block_of(map, self.start);
            let pad = start_cell(map, self.pad).filter(|cell| self.reached[*cell]);
            let end = pad.map_or(start, |cell| self.cover.block_of(map, cell));
            self.blocks = vec![start];
            self.blocks.extend_from_slice(choice.chosen());
            for (k, point) in self.wishes.points.iter().enumerate() {
                let Some(point) = point else { continue };
                match start_cell(map, *point).filter(|cell| self.reached[*cell]) {
                    Some(cell) => self.points.push((k, cell, self.cover.block_of(map, cell))),
                    None => self.barred.push(k),
                }
            }
            let points = self.points.iter().map(|(.., block)| *block);
            let new: Vec<usize> = points.filter(|block| !self.blocks[1..].contains(block)).collect();
            for block in new {
                // Two points of one block are one place to plan by.
                if !self.blocks[1..].contains(&block) {
                    self.blocks.push(block);
                }
            }
            self.blocks.push(end);
            self.begin_order(map);
        }
        left
    }

    fn begin_order(&mut self, map: &Costmap) {
        let cells = self.blocks.iter().filter_map(|block| self.cover.place(*block)).collect::<Vec<_>>();
        let turns = cells.iter().map(|cell| self.wishes.turn(map.room_of(*cell))).collect();
        // Start and end have a place: they were reached.
        self.tour = (cells.len() == self.blocks.len()).then(|| Tour::new(cells, turns));
        self.stage = Stage::Order;
    }

    fn order(&mut self, map: &Costmap, left: usize) -> usize {
        let Some(tour) = &mut self.tour else {
            self.stage = Stage::Failed;
            return left;
        };
        let (left, done) = tour.advance(map, &mut self.search, left);
        if done {
            let ordered =
                tour.order().iter().filter_map(|k| self.blocks.get(*k).copied()).collect::<Vec<_>>();
            if self.refinements < REFINEMENTS {
                self.refinements += 1;
                let fixed = self.points.iter().map(|(.., block)| *block).collect();
                self.refine = Some(Refine::new(map, &self.cover, &self.seen, ordered, fixed));
                self.stage = Stage::Refine;
            } else {
                self.blocks = ordered;
                self.finish_stops(map);
                self.stage = Stage::Rooms { room: 0 };
            }
        }
        left
    }

    fn shorten(&mut self, map: &Costmap, left: usize) -> usize {
        let Some(refine) = &mut self.refine else { return left };
        let (left, done) = refine.advance(map, &self.cover, left);
        if done {
            self.blocks = refine.tour().to_vec();
            self.begin_order(map);
        }
        left
    }

    fn finish_stops(&mut self, map: &Costmap) {
        let middle = self.blocks.len().saturating_sub(1);
        let stop = |cell: usize, point| {
            let (x, y) = map.raster().centre(cell);
            Stop { x, y, room: map.room_of(cell), look: true, point }
        };
        self.stops.clear();
        for block in self.blocks[..middle].iter().skip(1) {
            let points = self.points.iter().filter(|(.., at)| at == block);
            let before = self.stops.len();
            self.stops.extend(points.map(|(point, cell, _)| stop(*cell, Some(*point))));
            if self.stops.len() == before {
                self.stops.extend(self.cover.place(*block).map(|cell| stop(cell, None)));
            }
        }
        let (x, y) = self.pad;
        let room = map.raster().cell(x, y).and_then(|cell| map.room_of(cell));
        self.stops.push(Stop { x, y, room, look: false, point: None });
    }

    /// Finds out why a room cannot be seen.
    fn ask_for(&mut self, map: &Costmap, room: usize, left: usize) -> usize {
        let Some(plan) = self.rooms.get(room).copied() else {
            self.stage = Stage::Done;
            return left;
        };
        let next = Stage::Rooms { room: room + 1 };
        if self.wishes.leaves_out(Some(room)) {
            self.rooms[room].skipped = Some(Obstacle::LeftOut);
            self.stage = next;
            return left.saturating_sub(1);
        }
        if plan.reached as f32 >= ENTERED_SHARE * plan.floor as f32
            || plan.to_see as f32 >= SEEN_SHARE * plan.floor as f32
        {
            self.stage = next;
            return left.saturating_sub(1);
        }
        if !self.asked {
            let cells = (0..map.raster().len()).filter(|cell| map.room_of(*cell) == Some(room));
            let roomiest = cells.max_by(|a, b| map.mapped(*a).total_cmp(&map.mapped(*b)));
            let Some(goal) = roomiest else {
                self.stage = next;
                return left;
            };
            let raster = map.raster();
            self.planner.begin(map, raster.centre(self.start), raster.centre(goal));
            self.asked = true;
            return left.saturating_sub(raster.len());
        }
        let nodes = left / 30 + 1;
        let step = self.planner.advance(map, nodes);
        if step != Step::Working {
            // A way to its middle and yet nothing to see there: it is too small to matter. But a way out of a place that is
            // walled in by things (the planner escapes from those) to where the round did not come: they bar it.
            let barred = !map
                .raster()
                .cell(self.planner.goal().0, self.planner.goal().1)
                .is_some_and(|c| self.reached[c]);
            let marked = map.unmapped().any();
            let bar = if marked { Obstacle::Unmapped } else { Obstacle::NoWay };
            self.rooms[room].skipped = self.planner.obstacle().or(barred.then_some(bar));
            self.asked = false;
            self.stage = next;
        }
        left.saturating_sub(nodes * 30)
    }
}

/// The nearest cell to a place from which the vehicle can fly.
fn start_cell(map: &Costmap, place: (f32, f32)) -> Option<usize> {
    let raster = map.raster();
    let here = raster.cell(place.0, place.1)?;
    let reach = (START_SNAP_M / raster.cell_m).ceil() as i32;
    (-reach..=reach)
        .flat_map(|rows| (-reach..=reach).map(move |columns| (columns, rows)))
        .filter_map(|(columns, rows)| raster.shifted(here, columns, rows))
        .filter(|cell| map.is_passable(*cell) && raster.between(*cell, here) <= START_SNAP_M)
        .min_by(|a, b| raster.between(*a, here).total_cmp(&raster.between(*b, here)))
}
