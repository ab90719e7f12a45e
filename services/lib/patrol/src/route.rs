use crate::gates::straightened;
use crate::search::Search;
use crate::smooth::Smoother;
use crate::{Costmap, Obstacle};

/// A start that stands too near to something is left over cells within this, metres.
const ESCAPE_M: f32 = 0.6;
/// Cost of a metre of such cells: out by the shortest way.
const ESCAPE_COST: f32 = 30.0;
/// Less clearance than this is a wall even then, metres.
const ESCAPE_CLEARANCE_M: f32 = 0.1;
/// A goal that cannot be flown to is moved to a place that can within this, metres.
const GOAL_SNAP_M: f32 = 0.5;
/// What entering a cell costs that cannot be flown through, to find out why there is no way. A thousand
/// metres and more: any honest way is cheaper.
const DOOR_COST: f32 = 6_000.0;
const OBSTRUCTED_COST: f32 = 2_000.0;
const NARROW_COST: f32 = 1_000.0;

/// What a slice of planning came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Not ready: call again.
    Working,
    /// [`RoutePlanner::route`] holds the way.
    Found,
    /// There is none: [`RoutePlanner::obstacle`] says why.
    None,
}

/// A way: corners from the start to the goal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Route {
    /// Plan frame, metres; the first is the start.
    pub points: Vec<(f32, f32)>,
    /// Metres.
    pub length_m: f32,
    /// Least clearance at any corner or between, metres.
    pub clearance_m: f32,
}

/// Finds the way from one place to another, in slices (A*, Hart, Nilsson and Raphael 1968).
#[derive(Clone, Debug)]
pub struct RoutePlanner {
    search: Search,
    stage: Stage,
    from: (f32, f32),
    to: (f32, f32),
    start: usize,
    goal: usize,
    smoother: Smoother,
    route: Route,
    obstacle: Option<Obstacle>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Search,
    Smooth,
    Found,
    None,
}

impl RoutePlanner {
    /// A planner for grids as large as `map`; its memory is kept from route to route.
    pub fn new(map: &Costmap) -> Self {
        Self {
            search: Search::new(map.raster().len()),
            stage: Stage::None,
            from: (0.0, 0.0),
            to: (0.0, 0.0),
            start: 0,
            goal: 0,
            smoother: Smoother::default(),
            route: Route::default(),
            obstacle: None,
        }
    }

    /// Asks for a way; the last one is dropped. Places outside the plan have none.
    pub fn begin(&mut self, map: &Costmap, from: (f32, f32), to: (f32, f32)) {
        self.route = Route::default();
        self.obstacle = None;
        self.from = from;
        let raster = map.raster();
        let (Some(start), Some(goal)) = (raster.cell(from.0, from.1), raster.cell(to.0, to.1)) else {
            self.give_up(Obstacle::NoWay);
            return;
        };
        self.start = start;
        self.goal = goal;
        self.to = to;
        if !map.is_passable(goal) {
            let reach = (GOAL_SNAP_M / raster.cell_m) as i32;
            let near = (-reach..=reach).flat_map(|rows| (-reach..=reach).map(move |columns| (columns, rows)));
            let best = near
                .filter_map(|(columns, rows)| raster.shifted(goal, columns, rows))
                .filter(|cell| map.is_passable(*cell) && raster.between(*cell, goal) <= GOAL_SNAP_M)
                .min_by(|a, b| raster.between(*a, goal).total_cmp(&raster.between(*b, goal)));
            if let Some(cell) = best {
                self.goal = cell;
                self.to = raster.centre(cell);
            }
        }
        self.search.begin(start);
        self.stage = Stage::Search;
    }

    /// Works on for at most `max_nodes` cells (about 0.1 us each).
    pub fn advance(&mut self, map: &Costmap, max_nodes: usize) -> Step {
        let mut left = max_nodes.max(1);
        while left > 0 {
            match self.stage {
                Stage::Search => left = self.look_on(map, left),
                Stage::Smooth => {
                    left = self.smoother.advance(map, left);
                    if self.smoother.is_done() {
                        self.finish(map);
                    }
                }
                Stage::Found => return Step::Found,
                Stage::None => return Step::None,
            }
        }
        match self.stage {
            Stage::Found => Step::Found,
            Stage::None => Step::None,
            _ => Step::Working,
        }
    }

    /// The way found last; empty without one.
    pub fn route(&self) -> &Route {
        &self.route
    }

    /// Where the way that was asked for last ends.
    pub fn goal(&self) -> (f32, f32) {
        self.to
    }

    /// Why there is no way.
    pub fn obstacle(&self) -> Option<Obstacle> {
        self.obstacle
    }

    fn look_on(&mut self, map: &Costmap, nodes: usize) -> usize {
        let (start, goal) = (self.start, self.goal);
        let raster = map.raster();
        for used in 0..nodes {
            let enter = |cell| price(map, start, cell);
            match self.search.settle(map, enter, |cell| raster.between(cell, goal)) {
                None => {
                    self.give_up(Obstacle::NoWay);
                    return 0;
                }
                Some(cell) if cell == goal => {
                    let path = self.search.path(goal);
                    match obstacle(map, start, &path) {
                        Some(obstacle) => self.give_up(obstacle),
                        None => {
                            self.smoother.begin(map, &path, self.from, self.to);
                            self.stage = Stage::Smooth;
                        }
                    }
                    return nodes - used - 1;
                }
                Some(_) => {}
            }
        }
        0
    }

    fn give_up(&mut self, obstacle: Obstacle) {
        self.obstacle = Some(obstacle);
        self.stage = Stage::None;
    }

    fn finish(&mut self, map: &Costmap) {
        let points = straightened(map, self.smoother.take());
        let pieces = points.windows(2);
        let length_m = pieces.map(|p| (p[0].0 - p[1].0).hypot(p[0].1 - p[1].1)).sum();
        let clearance_m = points
            .windows(2)
            .flat_map(|p| {
                let count = ((p[0].0 - p[1].0).hypot(p[0].1 - p[1].1) / map.raster().cell_m).ceil().max(1.0);
                (0..=count as usize).map(move |k| {
                    let t = k as f32 / count;
                    map.clearance(p[0].0 + t * (p[1].0 - p[0].0), p[0].1 + t * (p[1].1 - p[0].1))
                })
            })
            .fold(f32::INFINITY, f32::min);
        self.route = Route { points, length_m, clearance_m };
        self.stage = Stage::Found;
    }
}

/// Whether a cell may be used to leave a start that is too near to something.
fn escapes(map: &Costmap, start: usize, cell: usize) -> bool {
    map.mapped(cell) > ESCAPE_CLEARANCE_M
        && map.shut_door(cell).is_none()
        && map.raster().between(start, cell) <= ESCAPE_M
}

/// Cost of a metre through a cell, and of entering it.
fn price(map: &Costmap, start: usize, cell: usize) -> Option<(f32, f32)> {
    let cost = map.cost(cell);
    if cost.is_finite() {
        return Some((cost, 0.0));
    }
    if !map.is_passable(start) && escapes(map, start, cell) {
        return Some((ESCAPE_COST, 0.0));
    }
    // No gap at all: a wall.
    if map.mapped(cell) <= 0.5 * map.raster().cell_m {
        return None;
    }
    let mut once = 0.0;
    if map.shut_door(cell).is_some() {
        once += DOOR_COST;
    }
    if map.is_obstructed(cell) {
        once += OBSTRUCTED_COST;
    }
    if map.is_narrow(cell) {
        let needed = map.limits().clearance_m();
        once += NARROW_COST * (1.0 + 4.0 * (needed - map.mapped(cell)).max(0.0) / needed);
    }
    Some((1.0, once))
}

/// What makes a path impossible: a shut door before all, then what the plan shows, then what it does not.
fn obstacle(map: &Costmap, start: usize, path: &[usize]) -> Option<Obstacle> {
    let leaving = !map.is_passable(start);
    let bad: Vec<usize> = path
        .iter()
        .copied()
        .filter(|cell| *cell != start && !map.is_passable(*cell) && !(leaving && escapes(map, start, *cell)))
        .collect();
    if bad.is_empty() {
        return None;
    }
    if let Some(door) = bad.iter().find_map(|cell| map.shut_door(*cell)) {
        return Some(Obstacle::DoorClosed(door));
    }
    let narrow = bad.iter().copied().filter(|cell| map.is_narrow(*cell) && !map.is_obstructed(*cell));
    let needed_m = 2.0 * map.limits().clearance_m();
    let narrowest = narrow.min_by(|a, b| map.mapped(*a).total_cmp(&map.mapped(*b)));
    let Some(cell) = narrowest else { return Some(Obstacle::Unmapped) };
    let width_m = map.passage_width(cell);
    if width_m < needed_m {
        return Some(Obstacle::Narrow { width_m, needed_m });
    }
    // Along the wall of a passage that is wide enough leads only what something in its middle has pushed aside; where nothing
    // is marked, the passage is crooked, and as wide as there is room about its narrowest place.
    let aside = bad.iter().any(|cell| map.is_obstructed(*cell)) || map.unmapped().any();
    Some(if aside {
        Obstacle::Unmapped
    } else {
        Obstacle::Narrow { width_m: 2.0 * map.mapped(cell), needed_m }
    })
}
