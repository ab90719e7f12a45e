//! Each figure of thesis chapters 3.1 as a picture, from the code that flies.

use crate::scenes;
use crate::svg::{BLUE, GREEN, GREY, ORANGE, Panel, RED, Svg};
use crate::world::{Look, Run, World};
use avoid::grid::UNITS_PER_READING;
use avoid::potential::{attraction, repulsion};
use avoid::{CELL_M, Decision, Reason, SECTOR_RAD, SECTORS, Smoothing, VfhConfig, bearing};

/// File name and contents of every figure.
pub fn all() -> Vec<(&'static str, String)> {
    vec![
        ("figure-3-01.svg", attraction_gradient()),
        ("figure-3-02.svg", repulsion_gradient()),
        ("figure-3-03.svg", local_minimum()),
        ("figure-3-04.svg", oscillation()),
        ("figure-3-05.svg", probability()),
        ("figure-3-06.svg", angles()),
        ("figure-3-07.svg", density()),
        ("figure-3-08.svg", wide_valley()),
        ("figure-3-09.svg", circling()),
        ("figure-3-10.svg", narrow_valley()),
        ("figure-3-11.svg", threshold_too_high()),
        ("figure-3-12.svg", threshold_too_low()),
    ]
}

/// Constants of figures 3.1 and 3.2 (FACTS 7): agent, goal and obstacles in squares, epsilon, eta and rho.
const AGENT: (f32, f32) = (10.0, 12.0);
const GOAL: (f32, f32) = (0.0, 0.0);
const OBSTACLES: [(f32, f32); 4] = [(3.0, 2.0), (5.0, 5.0), (9.0, 12.0), (10.0, 11.0)];
const EPSILON: f32 = 1.0 / 16.0;
const ETA: f32 = 5.0;
const RHO: f32 = 5.0;

/// Arrows of a field over the board of 15 squares. The longest are drawn as one square.
fn field(svg: &mut Svg, panel: &Panel, colour: &str, longest: f32, at: impl Fn(f32, f32) -> (f32, f32)) {
    for (x, y) in (0..15).flat_map(|y| (0..15).map(move |x| (x as f32, y as f32))) {
        let (fx, fy) = at(x, y);
        let force = fx.hypot(fy);
        if force > 1e-3 {
            let length = (force / longest).min(1.0) * 0.95;
            svg.arrow(panel, (x, y), (x + fx / force * length, y + fy / force * length), colour);
        }
    }
}

fn attraction_gradient() -> String {
    let mut svg = Svg::new();
    let panel = svg.panel("Figure 3.1: pull of the goal", (360.0, 360.0), (-1.0, 15.0), (-1.0, 15.0));
    svg.axes(&panel, "x, squares", "y, squares", (2.0, 2.0));
    field(&mut svg, &panel, BLUE, 1.3, |x, y| attraction(EPSILON, (GOAL.0 - x, GOAL.1 - y)));
    svg.dot(&panel, GOAL, 5.0, GREEN);
    svg.dot(&panel, AGENT, 5.0, RED);
    let (fx, fy) = attraction(EPSILON, (GOAL.0 - AGENT.0, GOAL.1 - AGENT.1));
    svg.finish(&format!(
        "Equation 5, epsilon 1/16. At the agent (10, 12): ({fx:.3}, {fy:.3}), length {:.3}.",
        fx.hypot(fy)
    ))
}

fn repulsion_gradient() -> String {
    let mut svg = Svg::new();
    let panel = svg.panel("Figure 3.2: push of the obstacles", (360.0, 360.0), (-1.0, 15.0), (-1.0, 15.0));
    svg.axes(&panel, "x, squares", "y, squares", (2.0, 2.0));
    let push = |x: f32, y: f32| {
        OBSTACLES.iter().fold((0.0, 0.0), |sum, (ox, oy)| {
            let (px, py) = repulsion(ETA, RHO, 0.0, 0.05, (ox - x, oy - y));
            (sum.0 + px, sum.1 + py)
        })
    };
    field(&mut svg, &panel, ORANGE, 1.0, push);
    for obstacle in OBSTACLES {
        svg.dot(&panel, obstacle, 5.0, "#000");
    }
    svg.dot(&panel, AGENT, 5.0, RED);
    let (fx, fy) = push(AGENT.0, AGENT.1);
    svg.finish(&format!(
        "Equation 7, eta 5, rho 5; arrows are cut off at 1. At the agent (10, 12): ({fx:.2}, {fy:.2})."
    ))
}

/// A run on its world, with where it began, ended and wanted to.
fn track(svg: &mut Svg, panel: &Panel, world: &World, run: &Run, colour: &str) {
    svg.path(panel, &run.path, colour, 1.6);
    svg.dot(panel, world.find(b'S'), 3.5, colour);
    svg.dot(panel, world.find(b'T'), 4.5, GREEN);
    svg.dot(panel, run.end(), if run.hit { 5.0 } else { 3.0 }, if run.hit { RED } else { colour });
}

/// What became of a run, in words.
fn fate(run: &Run) -> String {
    let seconds = run.decisions.len() as f32 * crate::world::STEP_S;
    if run.arrived {
        format!("arrives after {seconds:.1} s")
    } else if run.hit {
        format!("flies into it after {seconds:.1} s")
    } else if run.decisions.last().is_some_and(|decision| decision.reason == Reason::Blocked) {
        "stops and says that the way is blocked".to_owned()
    } else {
        format!("has not arrived after {seconds:.0} s")
    }
}

fn local_minimum() -> String {
    let world = scenes::concave();
    let mut svg = Svg::new();
    let mut words = Vec::new();
    for (name, run, colour) in [
        ("Potential field", scenes::concave_potential(), ORANGE),
        ("Our histogram", scenes::concave_ours(), BLUE),
        ("Thesis, equation 13", scenes::concave_thesis(), GREY),
    ] {
        let panel = svg.plan(&format!("Figure 3.3: {}", name.to_lowercase()), 48.0, &world);
        track(&mut svg, &panel, &world, &run, colour);
        words.push(format!("{name} {}", fate(&run)));
    }
    svg.finish(&format!("{}.", words.join("; ")))
}

fn oscillation() -> String {
    let world = scenes::corridor();
    let mut svg = Svg::new();
    let panel = svg.plan("Figure 3.4: a corridor of 1 m, reaction 0.35 s late", 100.0, &world);
    let (field, ours) = (scenes::corridor_potential(0.5), scenes::corridor_ours(0.5));
    track(&mut svg, &panel, &world, &ours, BLUE);
    track(&mut svg, &panel, &world, &field, ORANGE);
    let (turns, widest) = field.swings(scenes::SETTLED_M, scenes::SWING_M);
    svg.finish(&format!(
        "At 0.5 m/s the potential field (orange) turns back {turns} times, swings of up to {:.0} cm; our histogram (blue) \
         {} times.",
        100.0 * widest,
        ours.swings(scenes::SETTLED_M, scenes::SWING_M).0
    ))
}

fn probability() -> String {
    let world = scenes::pole();
    let mut svg = Svg::new();
    let panel = svg.plan("Figure 3.5: one cell a reading", 110.0, &world);
    let (cells, window, path) = scenes::readings(&world);
    let most = cells.iter().copied().max().unwrap_or(1).max(1);
    let mut filled = 0;
    for (index, certainty) in cells.iter().enumerate().filter(|(_, c)| **c > 0) {
        let (x, y) = window.centre(index);
        let dark = 225 - (f32::from(*certainty) / f32::from(most) * 200.0) as u8;
        let half = 0.5 * CELL_M;
        svg.rect(&panel, (x - half, y - half), (x + half, y + half), &format!("#e0{dark:02x}{dark:02x}"));
        filled += 1;
    }
    svg.path(&panel, &path, BLUE, 1.5);
    svg.finish(&format!(
        "A sonar of 30 degrees looks to the left while the drone passes: {filled} cells, at most {} readings in one.",
        most / UNITS_PER_READING
    ))
}

/// The table of figure 3.6: rows from the top, `None` where it shows nothing. Clockwise positive, as in the thesis.
pub fn angle_table() -> Vec<Vec<Option<String>>> {
    let shown = |right: i32, up: i32| right != 0 || up != 0;
    let on_a_line = |right: i32, up: i32| right == 0 || up == 0 || right.abs() == up.abs();
    let words = |right: i32, up: i32| {
        let clockwise = -bearing(right, up).to_degrees().round() as i32;
        if clockwise.abs() == 180 { "±180".to_owned() } else { clockwise.to_string() }
    };
    (-3..=3)
        .rev()
        .map(|up| {
            let cell = |right| (shown(right, up) && on_a_line(right, up)).then(|| words(right, up));
            (-3..=3).map(cell).collect()
        })
        .collect()
}

fn angles() -> String {
    let mut svg = Svg::new();
    let panel =
        svg.panel("Figure 3.6: angles of the cells, clockwise", (350.0, 350.0), (0.0, 7.0), (0.0, 7.0));
    for (row, line) in angle_table().iter().enumerate() {
        for (column, cell) in line.iter().enumerate() {
            let (x, y) = (column as f32, 6.0 - row as f32);
            svg.path(&panel, &[(x, y), (x + 1.0, y), (x + 1.0, y + 1.0), (x, y + 1.0), (x, y)], GREY, 0.7);
            if let Some(words) = cell {
                svg.label(&panel, (x + 0.25, y + 0.4), "#000", words);
            }
        }
    }
    svg.dot(&panel, (3.5, 3.5), 5.0, RED);
    svg.finish("Degrees, equation 8 by atan2. In the code they are counter-clockwise.")
}

/// Bars of a histogram, its smoothed form and its threshold, over the sectors.
fn histogram(svg: &mut Svg, title: &str, look: &Look, smoothed_colour: &str) {
    let most = look.raw.iter().chain(&look.smoothed).fold(1.0f32, |most, h| most.max(*h)) * 1.05;
    let panel = svg.panel(title, (520.0, 240.0), (0.0, SECTORS as f32), (0.0, most));
    svg.axes(&panel, "sector of 5 degrees, counter-clockwise", "density", (9.0, step(most)));
    let line = |h: &[f32; SECTORS]| -> Vec<(f32, f32)> {
        h.iter().enumerate().map(|(k, h)| (k as f32, *h)).collect()
    };
    svg.path(&panel, &line(&look.raw), BLUE, 1.2);
    svg.path(&panel, &line(&look.smoothed), smoothed_colour, 2.0);
    let threshold = look.decision.threshold_high;
    svg.path(&panel, &[(0.0, threshold), (SECTORS as f32, threshold)], RED, 0.8);
}

/// A round number of which about five make `most`.
fn step(most: f32) -> f32 {
    let rough = (most / 5.0).max(1.0);
    let decade = 10f32.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|n| n * decade).into_iter().find(|s| *s >= rough).unwrap_or(rough)
}

fn density() -> String {
    let mut svg = Svg::new();
    for (smoothing, name) in [(Smoothing::Hann, "equation 14"), (Smoothing::Triangle, "equation 13")] {
        let config = VfhConfig { smoothing, ..VfhConfig::thesis() };
        let look = scenes::look_at_gap(&config);
        histogram(
            &mut svg,
            &format!("Figure 3.7: polar obstacle density, smoothed by {name}"),
            &look,
            ORANGE,
        );
    }
    svg.finish(
        "0.7 m before the gap of figure 3.10. Blue: raw. Orange: smoothed. Red: threshold, in proportion to the smoother's gain.",
    )
}

/// Radius of a fan, metres.
const FAN_M: f32 = 0.5;

/// Every free sector as a pale fan, and the chosen direction.
fn fans(svg: &mut Svg, panel: &Panel, place: (f32, f32), blocked: &[u8; SECTORS], decision: &Decision) {
    for k in (0..SECTORS).filter(|k| blocked[*k] == 0) {
        let middle = k as f32 * SECTOR_RAD;
        svg.fan(panel, place, FAN_M, (middle - 0.5 * SECTOR_RAD, middle + 0.5 * SECTOR_RAD), "#7fbf7f");
    }
    if let Some(direction) = decision.direction_rad {
        let tip = (place.0 + 1.3 * FAN_M * direction.cos(), place.1 + 1.3 * FAN_M * direction.sin());
        svg.arrow(panel, place, tip, RED);
    }
}

/// Thesis and ours on one world, the valley of the thesis halfway through what was flown for `reason`.
fn valley(title: &str, world: &World, thesis: &Run, ours: &Run, reason: Reason) -> String {
    let mut svg = Svg::new();
    let panel = svg.plan(title, 110.0, world);
    let flown: Vec<(usize, &Decision)> =
        thesis.decisions.iter().enumerate().filter(|(_, decision)| decision.reason == reason).collect();
    let mut words = String::new();
    if let Some((step, decision)) = flown.get(flown.len() / 2)
        && let Some((first, last)) = decision.valley
    {
        let mut blocked = [1; SECTORS];
        let mut k = first as usize;
        let mut width = 1;
        while k != last as usize {
            blocked[k] = 0;
            k = (k + 1) % SECTORS;
            width += 1;
        }
        blocked[k] = 0;
        fans(&mut svg, &panel, thesis.path[*step], &blocked, decision);
        words = format!(" Green: its valley of {width} sectors; red: equation 15.");
    }
    track(&mut svg, &panel, world, thesis, GREY);
    track(&mut svg, &panel, world, ours, BLUE);
    svg.finish(&format!(
        "Grey: the thesis's point comes as near as {:.2} m. Blue: ours, {:.2} m.{words}",
        thesis.nearest, ours.nearest
    ))
}

fn wide_valley() -> String {
    valley(
        "Figure 3.8: a wide valley",
        &scenes::wide_valley(),
        &scenes::wide_valley_thesis(),
        &scenes::wide_valley_ours(),
        Reason::WideValley,
    )
}

fn narrow_valley() -> String {
    valley(
        "Figure 3.10: a narrow valley",
        &scenes::narrow_valley(),
        &scenes::narrow_valley_thesis(),
        &scenes::narrow_valley_ours(),
        Reason::NarrowValley,
    )
}

fn circling() -> String {
    let world = scenes::free();
    let mut svg = Svg::new();
    let (alone, straight) = (scenes::free_thesis(false), scenes::free_thesis(true));
    for (title, run, colour) in
        [("equation 15 alone", &alone, ORANGE), ("straight at a target in a free sector", &straight, BLUE)]
    {
        let panel = svg.plan(&format!("Figure 3.9: {title}"), 130.0, &world);
        track(&mut svg, &panel, &world, run, colour);
    }
    svg.finish(&format!(
        "{:.2} m flown by equation 15 alone, {:.2} m with the rule.",
        alone.length(),
        straight.length()
    ))
}

fn threshold_too_high() -> String {
    let world = scenes::wall_across();
    let mut svg = Svg::new();
    let mut words = Vec::new();
    for (speed, colour) in [(scenes::SLOW_M_S, BLUE), (scenes::FAST_M_S, ORANGE)] {
        let run = scenes::threshold_too_high(speed);
        let panel = svg.plan(&format!("Figure 3.11: threshold far too high, {speed} m/s"), 90.0, &world);
        track(&mut svg, &panel, &world, &run, colour);
        words.push(format!("At {speed} m/s it {}", fate(&run)));
    }
    svg.finish(&format!("Threshold {} instead of 2, equation 13. {}.", scenes::HIGH, words.join(". ")))
}

fn threshold_too_low() -> String {
    let world = scenes::passage();
    let mut svg = Svg::new();
    let mut words = Vec::new();
    for (threshold, colour) in [(2.0, BLUE), (scenes::LOW, ORANGE)] {
        let run = scenes::passage_with_threshold(threshold);
        let panel = svg.plan(&format!("Figure 3.12: threshold {threshold}"), 80.0, &world);
        let (place, look) = scenes::look_at_passage(threshold);
        fans(&mut svg, &panel, place, &look.blocked, &look.decision);
        track(&mut svg, &panel, &world, &run, colour);
        words.push(format!("With {threshold} it {}", fate(&run)));
    }
    svg.finish(&format!(
        "A passage of 1 m, equation 13; green: free sectors 1 m before it. {}.",
        words.join(". ")
    ))
}
