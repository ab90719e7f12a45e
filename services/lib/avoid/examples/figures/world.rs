//! A small world drawn in characters, and a drone that flies in it as an avoider tells it: exact rays, no wind. What the
//! figures show and the tests assert are the same flights. Up on the page is +y; angles are counter-clockwise.

use avoid::grid::{Faded, insert, scroll};
use avoid::{Avoider, Beam, CELLS, Decision, Echo, GridRules, Histogram, Reason, SECTORS, Situation, Window};
use std::f32::consts::TAU;

/// Side of a character of the map, metres.
pub const TILE: f32 = 0.2;
/// Between two decisions, seconds.
pub const STEP_S: f32 = 0.05;
/// Rays of a sweep.
const RAYS: usize = 16;
/// Reach of a ray, metres.
const REACH_M: f32 = 4.0;
/// The drone's heading swings to either side by this, radians, in this time there and back, seconds: navigation's
/// `scan_deg` and `scan_s`.
const SCAN_RAD: f32 = 8.0 * std::f32::consts::PI / 180.0;
const SCAN_S: f32 = 1.4;
/// The target is reached within this, metres.
const ARRIVED_M: f32 = 0.1;

/// Solid tiles (`#`) and marks.
pub struct World {
    rows: Vec<Vec<u8>>,
}

impl World {
    pub fn new(rows: &[&str]) -> Self {
        Self { rows: rows.iter().rev().map(|r| r.bytes().collect()).collect() }
    }

    /// Width and height, metres.
    pub fn size(&self) -> (f32, f32) {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        (columns as f32 * TILE, self.rows.len() as f32 * TILE)
    }

    /// Lower left corners of the solid tiles and how many of them stand in a row, metres.
    pub fn solids(&self) -> Vec<(f32, f32, f32)> {
        let mut all = Vec::new();
        for (iy, row) in self.rows.iter().enumerate() {
            let mut ix = 0;
            while ix < row.len() {
                let run = row[ix..].iter().take_while(|c| **c == b'#').count();
                if run > 0 {
                    all.push((ix as f32 * TILE, iy as f32 * TILE, run as f32 * TILE));
                }
                ix += run.max(1);
            }
        }
        all
    }

    pub fn solid(&self, x: f32, y: f32) -> bool {
        if x < 0.0 || y < 0.0 {
            return false;
        }
        self.rows.get((y / TILE) as usize).and_then(|r| r.get((x / TILE) as usize)) == Some(&b'#')
    }

    /// Middle of the tile with this mark.
    pub fn find(&self, mark: u8) -> (f32, f32) {
        for (iy, row) in self.rows.iter().enumerate() {
            if let Some(ix) = row.iter().position(|c| *c == mark) {
                return ((ix as f32 + 0.5) * TILE, (iy as f32 + 0.5) * TILE);
            }
        }
        unreachable!("mark not on the map")
    }

    pub fn cast(&self, x: f32, y: f32, angle: f32, reach: f32) -> Option<f32> {
        (1..(reach / 0.01) as usize)
            .map(|i| i as f32 * 0.01)
            .find(|r| self.solid(x + r * angle.cos(), y + r * angle.sin()))
    }

    /// The nearest surface in a cone of this half-angle: what a sonar answers (FACTS 2).
    pub fn cone(&self, x: f32, y: f32, angle: f32, half: f32) -> Option<f32> {
        (-10..=10)
            .filter_map(|i| self.cast(x, y, angle + half * i as f32 / 10.0, REACH_M))
            .min_by(f32::total_cmp)
    }

    /// To the nearest surface, at most 3 m.
    pub fn distance(&self, x: f32, y: f32) -> f32 {
        (0..72).filter_map(|k| self.cast(x, y, k as f32 * TAU / 72.0, 3.0)).fold(3.0, f32::min)
    }
}

/// How a world is flown.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    pub rules: GridRules,
    /// At most so long.
    pub seconds: f32,
    /// Speed in free space, metres a second.
    pub cruise_m_s: f32,
    /// Decisions until a wish is acted upon, and time constant with which the velocity then follows it, seconds.
    pub dead_steps: usize,
    pub lag_s: f32,
    /// Decisions from one sweep of all rays to the next.
    pub sweep_every: usize,
    /// Whether the heading swings and the rays with it, so that they leave no gaps between them.
    pub scans: bool,
}

impl Default for Trial {
    fn default() -> Self {
        Self {
            rules: GridRules::default(),
            seconds: 60.0,
            cruise_m_s: 0.5,
            dead_steps: 0,
            lag_s: 0.0,
            sweep_every: 1,
            scans: false,
        }
    }
}

impl Trial {
    /// The grid of the thesis and its sweep of 0.3 s (FACTS 2).
    pub fn thesis() -> Self {
        Self { rules: GridRules::thesis(), sweep_every: 6, scans: true, ..Self::default() }
    }

    /// A drone that reacts 0.35 s late (FACTS 2): two decisions until something happens, the rest in tilting.
    pub fn late(self) -> Self {
        Self { dead_steps: 2, lag_s: 0.25, ..self }
    }
}

/// Most decisions that a wish can wait.
const MOST_DEAD: usize = 8;

/// What came of it.
pub struct Run {
    pub path: Vec<(f32, f32)>,
    pub decisions: Vec<Decision>,
    /// Nearest to a surface, metres; 0 when one was flown into.
    pub nearest: f32,
    pub arrived: bool,
    /// Flown into something: the run ends there.
    pub hit: bool,
    /// The grid at the end.
    pub cells: Vec<u8>,
    pub window: Window,
}

impl Run {
    pub fn has(&self, reason: Reason) -> bool {
        self.decisions.iter().any(|decision| decision.reason == reason)
    }

    /// Metres flown.
    pub fn length(&self) -> f32 {
        self.path.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum()
    }

    pub fn end(&self) -> (f32, f32) {
        self.path[self.path.len() - 1]
    }

    /// How far from the last place the last `seconds` went, metres.
    pub fn stir(&self, seconds: f32) -> f32 {
        let (x, y) = self.end();
        let last = self.path.len().saturating_sub((seconds / STEP_S) as usize);
        self.path[last..].iter().map(|p| (p.0 - x).hypot(p.1 - y)).fold(0.0, f32::max)
    }

    /// From x = `from` on: how often the way turns from left to right or back, by at least `least` metres between two
    /// turning points, and the widest way across between two, metres.
    pub fn swings(&self, from: f32, least: f32) -> (usize, f32) {
        let mut across = self.path.iter().filter(|p| p.0 > from).map(|p| p.1);
        let Some(mut turned_at) = across.next() else { return (0, 0.0) };
        let (mut farthest, mut turns, mut widest) = (turned_at, 0, 0.0f32);
        for y in across {
            // On in the same direction as from the last turning point, or back by enough.
            if (y - farthest) * (farthest - turned_at) >= 0.0 {
                farthest = y;
            } else if (y - farthest).abs() >= least {
                turns += usize::from((farthest - turned_at).abs() >= least);
                (turned_at, farthest) = (farthest, y);
            }
            widest = widest.max((farthest - turned_at).abs());
        }
        (turns, widest)
    }
}

/// A decision with the histogram that it was made by.
pub struct Look {
    pub decision: Decision,
    pub raw: [f32; SECTORS],
    pub smoothed: [f32; SECTORS],
    pub blocked: [u8; SECTORS],
}

/// One decision.
pub fn look(
    avoider: &mut dyn Avoider,
    cells: &[u8],
    target_rad: f32,
    target_m: f32,
    cruise_m_s: f32,
) -> Look {
    let (mut raw, mut smoothed, mut blocked) = ([0.0; SECTORS], [0.0; SECTORS], [0; SECTORS]);
    let decision = avoider.decide(
        &Situation { cells, walls: &[], target_rad, target_m, max_speed_m_s: cruise_m_s },
        &mut Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked },
    );
    Look { decision, raw, smoothed, blocked }
}

/// All rays, if it is their turn.
fn sweep(world: &World, trial: &Trial, step: usize, (x, y): (f32, f32), window: &Window, cells: &mut [u8]) {
    if !step.is_multiple_of(trial.sweep_every.max(1)) {
        return;
    }
    let phase = step as f32 * STEP_S / SCAN_S;
    let aside = if trial.scans { SCAN_RAD * (TAU * phase).sin() } else { 0.0 };
    for ray in 0..RAYS {
        let angle_rad = ray as f32 * TAU / RAYS as f32 + aside;
        let echo = world.cast(x, y, angle_rad, REACH_M).map_or(Echo::Silence(REACH_M), Echo::Obstacle);
        insert(cells, window, &trial.rules, &Beam { x_m: x, y_m: y, angle_rad, echo });
    }
}

/// The grid of a drone that has stood at a place for `seconds`.
pub fn stand(world: &World, (x, y): (f32, f32), trial: &Trial, seconds: f32) -> Vec<u8> {
    let mut cells = vec![0u8; CELLS];
    if let Some(window) = Window::around(x, y) {
        for step in 0..(seconds / STEP_S) as usize {
            sweep(world, trial, step, (x, y), &window, &mut cells);
        }
    }
    cells
}

/// From S to T.
pub fn fly(world: &World, avoider: &mut dyn Avoider, trial: &Trial) -> Run {
    let (mut x, mut y) = world.find(b'S');
    let (tx, ty) = world.find(b'T');
    let (mut vx, mut vy) = (0.0, 0.0);
    let mut wishes = [(0.0, 0.0); MOST_DEAD];
    let Some(mut window) = Window::around(x, y) else { unreachable!("S lies on the map") };
    let mut next = vec![0u8; CELLS];
    let mut run = Run {
        path: vec![(x, y)],
        decisions: Vec::new(),
        nearest: f32::MAX,
        arrived: false,
        hit: false,
        cells: vec![0u8; CELLS],
        window,
    };
    for step in 0..(trial.seconds / STEP_S) as usize {
        let Some(to) = Window::around(x, y) else { break };
        scroll(&run.cells, &window, &mut next, &to, Faded::default());
        std::mem::swap(&mut run.cells, &mut next);
        window = to;
        sweep(world, trial, step, (x, y), &window, &mut run.cells);
        let (dx, dy) = (tx - x, ty - y);
        let decision = look(avoider, &run.cells, dy.atan2(dx), dx.hypot(dy), trial.cruise_m_s).decision;
        run.decisions.push(decision);
        wishes.rotate_right(1);
        wishes[0] = decision
            .direction_rad
            .map_or((0.0, 0.0), |d| (decision.speed_m_s * d.cos(), decision.speed_m_s * d.sin()));
        let (wx, wy) = wishes[trial.dead_steps.min(MOST_DEAD - 1)];
        let share = if trial.lag_s > STEP_S { STEP_S / trial.lag_s } else { 1.0 };
        (vx, vy) = (vx + share * (wx - vx), vy + share * (wy - vy));
        (x, y) = (x + STEP_S * vx, y + STEP_S * vy);
        run.path.push((x, y));
        run.hit = world.solid(x, y);
        run.nearest = run.nearest.min(if run.hit { 0.0 } else { world.distance(x, y) });
        run.arrived = (tx - x).hypot(ty - y) < ARRIVED_M;
        if run.arrived || run.hit {
            break;
        }
    }
    run.window = window;
    run
}
