//! The flights that figures show and tests assert.

use crate::world::{Look, Run, Trial, World, fly, look, stand};
use avoid::grid::insert;
use avoid::{
    Beam, CELLS, Echo, GridRules, PotentialConfig, PotentialField, Smoothing, Vfh, VfhConfig, Window,
};

/// Radius of the watchman, propeller guards included, metres.
pub const RADIUS_M: f32 = 0.225;
/// The histogram with as little room as we allow.
pub fn ours() -> Vfh {
    vfh(VfhConfig::tight(RADIUS_M))
}

pub fn vfh(config: VfhConfig) -> Vfh {
    Vfh::new(config).unwrap()
}

pub fn potential() -> PotentialField {
    PotentialField::new(PotentialConfig::flight(RADIUS_M)).unwrap()
}

/// Figure 3.3: a box that is open towards the drone, the target behind it.
pub fn concave() -> World {
    World::new(&[
        "                         ",
        "                         ",
        "                         ",
        "                         ",
        "          ########       ",
        "          ########       ",
        "                ##       ",
        "                ##       ",
        "                ##       ",
        "                ##       ",
        "  S             ##     T ",
        "                ##       ",
        "                ##       ",
        "                ##       ",
        "                ##       ",
        "          ########       ",
        "          ########       ",
        "                         ",
        "                         ",
        "                         ",
        "                         ",
    ])
}

/// Figure 3.4: a corridor of one metre, entered beside its middle.
pub fn corridor() -> World {
    World::new(&[
        "##########################################",
        "##########################################",
        "                                          ",
        "  S                                       ",
        "                                       T  ",
        "                                          ",
        "                                          ",
        "##########################################",
        "##########################################",
    ])
}

/// A corridor of 0.8 m.
pub fn narrow_corridor() -> World {
    World::new(&[
        "##########################################",
        "##########################################",
        "                                          ",
        "  S                                       ",
        "                                       T  ",
        "                                          ",
        "##########################################",
        "##########################################",
    ])
}

/// A corridor of 1.8 m.
pub fn wide_corridor() -> World {
    World::new(&[
        "##########################################",
        "##########################################",
        "                                          ",
        "                                          ",
        "                                          ",
        "  S                                       ",
        "                                       T  ",
        "                                          ",
        "                                          ",
        "                                          ",
        "                                          ",
        "##########################################",
        "##########################################",
    ])
}

/// A lone obstacle, a little above the straight way.
pub fn post() -> World {
    World::new(&[
        "                              ",
        "                              ",
        "                              ",
        "                              ",
        "                              ",
        "               ##             ",
        "               ##             ",
        "  S            ##          T  ",
        "                              ",
        "                              ",
        "                              ",
        "                              ",
        "                              ",
    ])
}

/// Figure 3.5: what a sonar that looks to the left passes.
pub fn pole() -> World {
    World::new(&[
        "                    ",
        "                    ",
        "         ##         ",
        "         ##         ",
        "                    ",
        "                    ",
        "                    ",
        "                    ",
        "                    ",
    ])
}

/// Figure 3.8: an obstacle that ends above the straight way, and open space beyond.
pub fn wide_valley() -> World {
    World::new(&[
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
    ])
}

/// Figure 3.9: nothing but a target.
pub fn free() -> World {
    World::new(&[
        "            ",
        "            ",
        "            ",
        "  S      T  ",
        "            ",
        "            ",
        "            ",
    ])
}

/// Figure 3.10: a gap of one metre below the straight way.
pub fn narrow_valley() -> World {
    World::new(&[
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
    ])
}

/// Height of the middle of that gap, metres.
pub const GAP_MIDDLE_M: f32 = 1.1;

/// Figure 3.11: a wall across the way.
pub fn wall_across() -> World {
    World::new(&[
        "                     ",
        "                     ",
        "                     ",
        "                     ",
        "            ###      ",
        "            ###      ",
        "            ###      ",
        "            ###      ",
        "  S         ###  T   ",
        "            ###      ",
        "            ###      ",
        "            ###      ",
        "            ###      ",
        "                     ",
        "                     ",
        "                     ",
        "                     ",
    ])
}

/// Figure 3.12: a passage of one metre straight ahead.
pub fn passage() -> World {
    World::new(&[
        "            #        ",
        "            #        ",
        "            #        ",
        "            #        ",
        "            #        ",
        "            #        ",
        "                     ",
        "                     ",
        "  S                T ",
        "                     ",
        "                     ",
        "            #        ",
        "            #        ",
        "            #        ",
        "            #        ",
        "            #        ",
        "            #        ",
    ])
}

/// The thesis's histogram, smoothed by equation 13.
pub fn thesis_13() -> VfhConfig {
    VfhConfig { smoothing: Smoothing::Triangle, ..VfhConfig::thesis() }
}

/// The thesis's grid with a sweep for each decision: at its own sweep of 0.3 s the smoothing of equation 14 leaves gaps
/// between the readings, and a point flies through them (a test says so).
pub fn thesis_often() -> Trial {
    Trial { sweep_every: 1, ..Trial::thesis() }
}

/// Our flight, rays swinging with the heading.
pub fn scanning() -> Trial {
    Trial { scans: true, ..Trial::default() }
}

pub fn concave_potential() -> Run {
    fly(&concave(), &mut potential(), &scanning())
}

pub fn concave_ours() -> Run {
    fly(&concave(), &mut ours(), &scanning())
}

pub fn concave_thesis() -> Run {
    fly(&concave(), &mut vfh(thesis_13()), &Trial::thesis())
}

/// Swings are counted from here on, metres: what the start leaves has died away.
pub const SETTLED_M: f32 = 2.0;
/// And count from here on, metres.
pub const SWING_M: f32 = 0.02;

pub fn corridor_potential(cruise_m_s: f32) -> Run {
    fly(&corridor(), &mut potential(), &Trial { cruise_m_s, ..scanning().late() })
}

pub fn corridor_ours(cruise_m_s: f32) -> Run {
    fly(&corridor(), &mut ours(), &Trial { cruise_m_s, ..scanning().late() })
}

/// The grid after passing the pole with a sonar of 30 degrees that looks to the left and is asked each 2 cm, and the way.
pub fn readings(world: &World) -> (Vec<u8>, Window, Vec<(f32, f32)>) {
    let half = 15.0f32.to_radians();
    let path: Vec<(f32, f32)> = (0..=150).map(|i| (0.5 + 0.02 * i as f32, 0.4)).collect();
    let window = Window::around(2.0, 1.0).unwrap();
    let mut cells = vec![0u8; CELLS];
    let angle_rad = std::f32::consts::FRAC_PI_2;
    for &(x, y) in &path {
        if let Some(range) = world.cone(x, y, angle_rad, half) {
            let beam = Beam { x_m: x, y_m: y, angle_rad, echo: Echo::Obstacle(range) };
            insert(&mut cells, &window, &GridRules::thesis(), &beam);
        }
    }
    (cells, window, path)
}

/// What a configuration of the thesis sees before the gap of figure 3.10 after two seconds.
pub fn look_at_gap(config: &VfhConfig) -> Look {
    let (world, (x, y)) = (narrow_valley(), (1.1, 1.5));
    let cells = stand(&world, (x, y), &Trial::thesis(), 2.0);
    let (tx, ty) = world.find(b'T');
    look(&mut vfh(config.clone()), &cells, (ty - y).atan2(tx - x), (tx - x).hypot(ty - y), 0.5)
}

pub fn wide_valley_thesis() -> Run {
    fly(&wide_valley(), &mut vfh(VfhConfig::thesis()), &thesis_often())
}

pub fn wide_valley_ours() -> Run {
    fly(&wide_valley(), &mut ours(), &Trial::default())
}

pub fn narrow_valley_thesis() -> Run {
    fly(&narrow_valley(), &mut vfh(VfhConfig::thesis()), &thesis_often())
}

pub fn narrow_valley_ours() -> Run {
    fly(&narrow_valley(), &mut ours(), &Trial::default())
}

pub fn free_thesis(straight_at_target: bool) -> Run {
    let config = VfhConfig { straight_at_target, ..VfhConfig::thesis() };
    fly(&free(), &mut vfh(config), &Trial::default())
}

/// Figure 3.11: ten times the threshold, and two speeds, metres a second.
pub const HIGH: f32 = 20.0;
pub const SLOW_M_S: f32 = 0.1;
pub const FAST_M_S: f32 = 0.5;

/// At full speed however dense it is ahead, so that only the threshold decides when it turns away.
pub fn threshold_too_high(cruise_m_s: f32) -> Run {
    let config = VfhConfig { threshold_high: HIGH, threshold_low: HIGH, slow_density: 1e9, ..thesis_13() };
    fly(&wall_across(), &mut vfh(config), &Trial { cruise_m_s, ..Trial::thesis() })
}

/// Figure 3.12: a threshold that nothing is below.
pub const LOW: f32 = 0.05;

fn with_threshold(threshold: f32) -> VfhConfig {
    VfhConfig { threshold_high: threshold, threshold_low: threshold, ..thesis_13() }
}

pub fn passage_with_threshold(threshold: f32) -> Run {
    fly(&passage(), &mut vfh(with_threshold(threshold)), &Trial::thesis())
}

/// One metre before the passage, after two seconds.
pub fn look_at_passage(threshold: f32) -> ((f32, f32), Look) {
    let place = (1.4, 1.7);
    let cells = stand(&passage(), place, &Trial::thesis(), 2.0);
    (place, look(&mut vfh(with_threshold(threshold)), &cells, 0.0, 2.4, 0.5))
}
