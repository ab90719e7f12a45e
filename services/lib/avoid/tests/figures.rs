//! The situations of thesis figures 3.8 to 3.12, in small: exact rays into an ASCII world, a drone that flies
//! exactly as told. Up on the page is +y; angles are counter-clockwise (the thesis counts clockwise).
#![allow(clippy::unwrap_used, reason = "tests")]

use avoid::grid::{Faded, insert, scroll};
use avoid::{
    Avoider, Beam, CELLS, Decision, Echo, GridRules, Histogram, Reason, SECTORS, Situation, Vfh, VfhConfig,
};
use avoid::{Window, wrap};
use std::f32::consts::TAU;

/// Side of a character of the map, metres.
const TILE: f32 = 0.2;

struct World {
    rows: Vec<Vec<u8>>,
}

impl World {
    fn new(rows: &[&str]) -> Self {
        Self { rows: rows.iter().rev().map(|r| r.bytes().collect()).collect() }
    }
    fn solid(&self, x: f32, y: f32) -> bool {
        if x < 0.0 || y < 0.0 {
            return false;
        }
        self.rows.get((y / TILE) as usize).and_then(|r| r.get((x / TILE) as usize)) == Some(&b'#')
    }
    fn find(&self, mark: u8) -> (f32, f32) {
        for (iy, row) in self.rows.iter().enumerate() {
            if let Some(ix) = row.iter().position(|c| *c == mark) {
                return ((ix as f32 + 0.5) * TILE, (iy as f32 + 0.5) * TILE);
            }
        }
        unreachable!("mark not on the map")
    }
    fn cast(&self, x: f32, y: f32, angle: f32, reach: f32) -> Option<f32> {
        (1..(reach / 0.01) as usize)
            .map(|i| i as f32 * 0.01)
            .find(|r| self.solid(x + r * angle.cos(), y + r * angle.sin()))
    }
    fn distance(&self, x: f32, y: f32) -> f32 {
        (0..72).filter_map(|k| self.cast(x, y, k as f32 * TAU / 72.0, 3.0)).fold(3.0, f32::min)
    }
}

struct Flight {
    path: Vec<(f32, f32)>,
    reasons: Vec<Reason>,
    nearest: f32,
    arrived: bool,
}

fn decide(vfh: &mut Vfh, cells: &[u8], target_rad: f32, target_m: f32) -> (Decision, [u8; SECTORS]) {
    let (mut raw, mut smoothed, mut blocked) = ([0.0; SECTORS], [0.0; SECTORS], [0; SECTORS]);
    let decision = vfh.decide(
        &Situation { cells, walls: &[], target_rad, target_m, max_speed_m_s: 0.5 },
        &mut Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked },
    );
    (decision, blocked)
}

/// Sixteen rays every 50 ms, from S to T, for at most `seconds`.
fn fly(world: &World, config: VfhConfig, seconds: f32) -> Flight {
    let mut vfh = Vfh::new(config).unwrap();
    let rules = GridRules::default();
    let (mut x, mut y) = world.find(b'S');
    let (tx, ty) = world.find(b'T');
    let mut window = Window::around(x, y).unwrap();
    let mut cells = vec![0u8; CELLS];
    let mut next = vec![0u8; CELLS];
    let mut flight = Flight { path: vec![(x, y)], reasons: Vec::new(), nearest: f32::MAX, arrived: false };
    for _ in 0..(seconds / 0.05) as usize {
        let to = Window::around(x, y).unwrap();
        scroll(&cells, &window, &mut next, &to, Faded::default());
        std::mem::swap(&mut cells, &mut next);
        window = to;
        for ray in 0..16 {
            let angle_rad = ray as f32 * TAU / 16.0;
            let echo = world.cast(x, y, angle_rad, 4.0).map_or(Echo::Silence(4.0), Echo::Obstacle);
            insert(&mut cells, &window, &rules, &Beam { x_m: x, y_m: y, angle_rad, echo });
        }
        let (dx, dy) = (tx - x, ty - y);
        let (decision, _) = decide(&mut vfh, &cells, dy.atan2(dx), dx.hypot(dy));
        flight.reasons.push(decision.reason);
        if let Some(direction) = decision.direction_rad {
            x += 0.05 * decision.speed_m_s * direction.cos();
            y += 0.05 * decision.speed_m_s * direction.sin();
        }
        flight.path.push((x, y));
        flight.nearest = flight.nearest.min(world.distance(x, y));
        if (tx - x).hypot(ty - y) < 0.1 {
            flight.arrived = true;
            break;
        }
    }
    flight
}

fn length(path: &[(f32, f32)]) -> f32 {
    path.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum()
}

#[test]
fn figure_3_8_a_wide_valley_beside_an_obstacle_is_flown_along_its_near_border() {
    let world = World::new(&[
        "                     ",
        "                     ",
        "                     ",
        "         ##          ",
        "         ##          ",
        "S        ##         T",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
    ]);
    let flight = fly(&world, VfhConfig::tight(0.225), 60.0);
    assert!(flight.arrived, "{:?}", flight.path.last());
    assert!(flight.reasons.contains(&Reason::WideValley));
    assert!(flight.nearest > 0.225, "{}", flight.nearest);
    // Round the upper, nearer end: never below the start.
    let lowest = flight.path.iter().map(|p| p.1).fold(f32::MAX, f32::min);
    assert!(lowest > world.find(b'S').1 - 0.3, "{lowest}");
}

#[test]
fn figure_3_9_equation_15_alone_circles_a_target_in_a_free_sector() {
    let world = World::new(&["            ", "  S      T  ", "            "]);
    let straight = fly(&world, VfhConfig { continuity: 0, ..VfhConfig::thesis() }, 60.0);
    let alone =
        fly(&world, VfhConfig { straight_at_target: false, continuity: 0, ..VfhConfig::thesis() }, 60.0);
    let distance = 7.0 * TILE;
    assert!(straight.arrived && alone.arrived);
    assert!(length(&straight.path) < 1.02 * distance);
    // A course held s_max / 2 = 37.5 degrees off the target is a spiral, longer by 1 / cos(37.5 degrees).
    assert!(length(&alone.path) > 1.2 * (distance - 0.1), "{}", length(&alone.path));
    let turned: f32 = alone
        .path
        .windows(3)
        .map(|p| {
            let a = (p[1].1 - p[0].1).atan2(p[1].0 - p[0].0);
            wrap((p[2].1 - p[1].1).atan2(p[2].0 - p[1].0) - a).abs()
        })
        .sum();
    assert!(turned > 1.0, "turned {turned} rad");
}

#[test]
fn figure_3_10_a_narrow_valley_is_flown_in_its_middle() {
    // A gap of 1 m below the straight line to the target.
    let world = World::new(&[
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
        "S        ##         T",
        "                     ",
        "                     ",
        "                     ",
        "                     ",
        "                     ",
        "         ##          ",
        "         ##          ",
        "         ##          ",
    ]);
    let flight = fly(&world, VfhConfig::tight(0.225), 60.0);
    assert!(flight.arrived, "{:?}", flight.path.last());
    assert!(flight.nearest > 0.225, "{}", flight.nearest);
    let crossing: Vec<f32> = flight.path.iter().filter(|p| (1.8..2.2).contains(&p.0)).map(|p| p.1).collect();
    let middle = 5.5 * TILE;
    assert!(crossing.iter().all(|y| (y - middle).abs() < 0.2), "{crossing:?}");
}

/// Nearest approach to a wall across the way, with the speed that the density leaves.
fn nearest_with_threshold(threshold: f32) -> f32 {
    let world = World::new(&[
        "            ###   ",
        "            ###   ",
        "            ###   ",
        "            ###   ",
        "  S         ###  T",
        "            ###   ",
        "            ###   ",
        "            ###   ",
        "            ###   ",
    ]);
    let config = VfhConfig {
        threshold_high: threshold,
        threshold_low: threshold,
        // Always at full speed, so that only the threshold decides when it turns away.
        slow_density: 1e6,
        ..VfhConfig::tight(0.225)
    };
    fly(&world, config, 12.0).nearest
}

#[test]
fn figure_3_11_a_threshold_far_too_high_sees_the_obstacle_too_late() {
    assert!(nearest_with_threshold(20_000.0) < 0.1);
    assert!(nearest_with_threshold(2.5) > 0.225);
}

/// A gap of 1 m between two certain posts, 1 m ahead.
fn gap() -> Vec<u8> {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut cells = vec![0u8; CELLS];
    for i in 0..20 {
        for side in [-1.0, 1.0] {
            cells[window.index(1.01, 0.01 + side * (0.5 + 0.05 * i as f32)).unwrap()] = 40;
        }
    }
    cells
}

#[test]
fn figure_3_12_a_threshold_far_too_low_closes_a_gap() {
    let config = |threshold| VfhConfig {
        threshold_high: threshold,
        threshold_low: threshold,
        smoothing: Smoothing13,
        ..VfhConfig::tight(0.225)
    };
    #[expect(non_upper_case_globals, reason = "the equation's number reads better")]
    const Smoothing13: avoid::Smoothing = avoid::Smoothing::Triangle;
    let (open, free) = decide(&mut Vfh::new(config(40.0)).unwrap(), &gap(), 0.0, 3.0);
    let (shut, closed) = decide(&mut Vfh::new(config(0.05)).unwrap(), &gap(), 0.0, 3.0);
    assert_eq!(open.reason, Reason::TargetSafe);
    assert_ne!(shut.reason, Reason::TargetSafe);
    let count = |blocked: [u8; SECTORS]| blocked.iter().filter(|b| **b == 1).count();
    assert!(count(closed) > count(free));
}

#[test]
fn the_same_gap_is_open_to_the_flight_configuration_and_shut_to_a_wider_vehicle() {
    let (decision, _) = decide(&mut Vfh::new(VfhConfig::tight(0.225)).unwrap(), &gap(), 0.0, 1.2);
    assert_eq!(decision.reason, Reason::TargetSafe);
    let (decision, blocked) = decide(&mut Vfh::new(VfhConfig::tight(0.5)).unwrap(), &gap(), 0.0, 1.2);
    assert_eq!(blocked[0], 1);
    assert_ne!(decision.reason, Reason::TargetSafe);
}

#[test]
fn walled_in_all_round_is_blocked() {
    let window = Window::around(0.0, 0.0).unwrap();
    let mut cells = vec![0u8; CELLS];
    for k in 0..360 {
        let a = (k as f32).to_radians();
        cells[window.index(0.7 * a.cos(), 0.7 * a.sin()).unwrap()] = 40;
    }
    let (decision, _) = decide(&mut Vfh::new(VfhConfig::tight(0.225)).unwrap(), &cells, 1.0, 2.0);
    assert_eq!((decision.direction_rad, decision.speed_m_s, decision.reason), (None, 0.0, Reason::Blocked));
}

#[test]
fn the_threshold_has_hysteresis() {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut vfh = Vfh::new(VfhConfig::tight(0.225)).unwrap();
    let mut blocked_with = |certainty: u8| {
        let mut cells = vec![0u8; CELLS];
        cells[window.index(0.51, 0.01).unwrap()] = certainty;
        decide(&mut vfh, &cells, 0.0, 2.0).1[0] == 1
    };
    assert!(!blocked_with(14), "between the thresholds, from below");
    assert!(blocked_with(24));
    assert!(blocked_with(14), "between the thresholds, from above");
    assert!(!blocked_with(6));
}

#[test]
fn the_valley_flown_last_is_kept_while_two_are_nearly_equal() {
    // A post straight ahead; the target wanders a little around it.
    let window = Window::around(0.01, 0.01).unwrap();
    let mut cells = vec![0u8; CELLS];
    for i in 0..5 {
        cells[window.index(0.71, -0.09 + 0.05 * i as f32).unwrap()] = 60;
    }
    let mut vfh = Vfh::new(VfhConfig::tight(0.225)).unwrap();
    let mut sides = Vec::new();
    for step in 0..20 {
        let target = 0.1 * if step % 2 == 0 { 1.0 } else { -1.0 };
        sides.push(decide(&mut vfh, &cells, target, 2.0).0.direction_rad.unwrap() > 0.0);
    }
    assert!(sides.iter().all(|s| *s == sides[0]), "{sides:?}");
}

#[test]
fn speed_falls_with_the_density_ahead() {
    let window = Window::around(0.01, 0.01).unwrap();
    let mut last = f32::MAX;
    for certainty in [0u8, 8, 10, 12, 14] {
        let mut cells = vec![0u8; CELLS];
        cells[window.index(0.51, 0.01).unwrap()] = certainty;
        let (decision, _) = decide(&mut Vfh::new(VfhConfig::tight(0.225)).unwrap(), &cells, 0.0, 2.0);
        assert_eq!(decision.reason, Reason::TargetSafe);
        assert!(decision.speed_m_s < last, "{certainty}");
        last = decision.speed_m_s;
    }
    assert!(last > 0.2 && last < 0.45, "{last}");
}

#[test]
fn a_parameter_out_of_range_is_refused_by_name() {
    let error = Vfh::new(VfhConfig { reach_m: f32::NAN, ..VfhConfig::thesis() }).unwrap_err();
    assert_eq!(error.field, "reach_m");
    assert!(Vfh::new(VfhConfig { threshold_low: 3.0, ..VfhConfig::tight(0.2) }).is_err());
    assert!(Vfh::new(VfhConfig { s_max: 0, ..VfhConfig::tight(0.2) }).is_err());
}
