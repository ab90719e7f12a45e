//! One avoidance step: scroll, eight beams, walls, histogram, decision (target: 20 us); the same where the first decision
//! finds no way and a second one is made with less room, as navigation does; and side by side the decisions alone of our
//! histogram, the thesis's and the potential field, on the same grid.
#![allow(clippy::unwrap_used, missing_docs, reason = "bench")]

use avoid::grid::{Faded, insert, scroll};
use avoid::{
    Avoider, Beam, CELLS, Echo, GridRules, Histogram, PotentialConfig, PotentialField, SECTORS, Situation,
    Smoothing, Vfh, VfhConfig, WallLayer, Window,
};
use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use std::f32::consts::TAU;
use std::hint::black_box;
use std::time::Duration;

/// A corridor 2.2 m wide along x with doors, walls 15 cm thick.
fn solid(x: f32, y: f32) -> bool {
    (1.1..1.25).contains(&y.abs()) && x.rem_euclid(3.0) > 0.9
}

fn step(c: &mut Criterion) {
    for squeezing in [false, true] {
        step_of(c, squeezing);
    }
}

fn step_of(c: &mut Criterion, squeezing: bool) {
    let mut roomy = Vfh::new(VfhConfig::flight(0.225)).unwrap();
    let mut tight = Vfh::new(VfhConfig::tight(0.225)).unwrap();
    let rules = GridRules::default();
    let mut walls = WallLayer::new();
    let mut window = Window::around(0.0, 0.0).unwrap();
    let (mut cells, mut next) = (vec![0u8; CELLS], vec![0u8; CELLS]);
    let (mut raw, mut smoothed, mut blocked) = ([0.0; SECTORS], [0.0; SECTORS], [0; SECTORS]);
    let mut x = 0.0f32;
    let name = if squeezing { "vfh_step_81x81_two_decisions" } else { "vfh_step_81x81_flight" };
    c.bench_function(name, |b| {
        b.iter(|| {
            // 0.5 m/s at 20 Hz.
            x = (x + 0.025) % 100.0;
            let to = Window::around(x, 0.0).unwrap();
            scroll(&cells, &window, &mut next, &to, Faded { far: 1, near: 1, cells: 14 });
            std::mem::swap(&mut cells, &mut next);
            window = to;
            walls.follow(&window, solid);
            for k in 0..8 {
                let echo = if k % 3 == 0 { Echo::Obstacle(0.9 + 0.1 * k as f32) } else { Echo::Mapped(1.1) };
                let beam = Beam { x_m: x, y_m: 0.0, angle_rad: k as f32 * TAU / 8.0, echo };
                insert(&mut cells, &window, &rules, &beam);
            }
            let situation = Situation {
                cells: &cells,
                walls: walls.cells(),
                target_rad: 0.1,
                target_m: 1.2,
                max_speed_m_s: 0.5,
            };
            let mut histogram = Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked };
            if squeezing {
                black_box(roomy.decide(&situation, &mut histogram));
                tight.decide(&situation, &mut histogram)
            } else {
                roomy.decide(&situation, &mut histogram)
            }
        });
    });
}

/// In the corridor, with as many certain cells as a wall layer has there, and in the open with a thing in sight.
fn decisions(c: &mut Criterion) {
    let window = Window::around(0.0, 0.0).unwrap();
    let mut walls = WallLayer::new();
    walls.follow(&window, solid);
    let mut cells = vec![0u8; CELLS];
    for k in 0..8 {
        let echo = Echo::Obstacle(0.9 + 0.1 * k as f32);
        let beam = Beam { x_m: 0.0, y_m: 0.0, angle_rad: k as f32 * TAU / 8.0, echo };
        insert(&mut cells, &window, &GridRules::default(), &beam);
    }
    let vfh = |config| Vfh::new(config).unwrap();
    let thesis_13 = VfhConfig { smoothing: Smoothing::Triangle, ..VfhConfig::thesis() };
    let mut methods: [(&str, Box<dyn Avoider>); 4] = [
        ("ours", Box::new(vfh(VfhConfig::flight(0.225)))),
        ("thesis", Box::new(vfh(VfhConfig::thesis()))),
        ("thesis_equation_13", Box::new(vfh(thesis_13))),
        ("potential", Box::new(PotentialField::new(PotentialConfig::flight(0.225)).unwrap())),
    ];
    for (place, walls) in [("corridor", walls.cells()), ("open", &[][..])] {
        let mut group = c.benchmark_group(format!("decision_81x81_{place}"));
        // Many short samples: on a loaded machine their median (`-- --verbose`) is that of those that ran undisturbed.
        group
            .sampling_mode(SamplingMode::Flat)
            .sample_size(2000)
            .measurement_time(Duration::from_millis(200));
        for (name, avoider) in &mut methods {
            let (mut raw, mut smoothed, mut blocked) = ([0.0; SECTORS], [0.0; SECTORS], [0; SECTORS]);
            group.bench_function(*name, |b| {
                b.iter(|| {
                    let situation = Situation {
                        cells: black_box(&cells),
                        walls: black_box(walls),
                        target_rad: 0.1,
                        target_m: 1.2,
                        max_speed_m_s: 0.5,
                    };
                    let mut histogram =
                        Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked };
                    avoider.decide(&situation, &mut histogram)
                });
            });
        }
    }
}

criterion_group!(benches, step, decisions);
criterion_main!(benches);
