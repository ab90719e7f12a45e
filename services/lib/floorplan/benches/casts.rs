//! Casts a second: rays and cones worked out exactly, and the table that flies; and how often the table is off.
//!
//! `SERENO_BENCH_PLAN` names a plan (the full path of a map_server header) and `SERENO_BENCH_AT` (`x,y`) a free
//! place on it. Without them it is the scanned hall that is developed against, where it is at hand, or else a drawn one with
//! pillars, and the place by lot.
#![allow(clippy::print_stdout, reason = "measurements")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use floorplan::{Cell, ConeModel, ConeTable, Plan, PlanHeader, cast_cone};
use std::f32::consts::{FRAC_PI_4, TAU};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

/// Poses asked about: their places in the table are more than the first-level cache holds.
const POSES: usize = 10_000;
/// Particles of a drone that knows where it is lie about so far around it, metres and radians.
const CLUSTER_M: f32 = 0.15;
const CLUSTER_RAD: f32 = 0.05;

fn named_plan() -> Option<(String, Plan)> {
    let depot = || {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/maps/depot.yaml");
        file.is_file().then(|| file.display().to_string())
    };
    let file = std::env::var("SERENO_BENCH_PLAN").ok().or_else(depot)?;
    let read = || {
        let header = PlanHeader::parse(&file, &std::fs::read(&file).ok()?).ok()?;
        let image = std::fs::read(Path::new(&file).parent()?.join(&header.image)).ok()?;
        Plan::load(&file, &header, &image).ok()
    };
    let plan = read();
    if plan.is_none() {
        println!("{file} is no plan that can be read: a drawn hall is measured instead");
    }
    let name = Path::new(&file).file_stem().map_or_else(String::new, |stem| stem.display().to_string());
    plan.map(|plan| (name, plan))
}

fn drawn_hall() -> (String, Plan) {
    let edge = |i: usize| i == 0 || i == 399;
    let pillar = |i: usize| i % 50 / 6 == 4;
    let solid = |ix, iy| edge(ix) || edge(iy) || (pillar(ix) && pillar(iy));
    let row = |iy| (0..400).map(|ix| if solid(ix, iy) { '#' } else { ' ' }).collect();
    let rows: Vec<String> = (0..400).map(row).collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    ("drawn hall".to_owned(), Plan::from_ascii(&rows, 0.05))
}

/// xorshift64*, Vigna 2016: the same poses every time without a dependency.
struct Lot(u64);

impl Lot {
    /// 0..1.
    fn draw(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// Mean 0, deviation 1 (Irwin and Hall).
    fn draw_normal(&mut self) -> f32 {
        (0..12).map(|_| self.draw()).sum::<f32>() - 6.0
    }

    fn draw_free(&mut self, plan: &Plan) -> (f32, f32) {
        let (width, height) = (plan.width() as f32, plan.height() as f32);
        loop {
            let x = plan.origin().0 + self.draw() * width * plan.resolution();
            let y = plan.origin().1 + self.draw() * height * plan.resolution();
            if plan.cell_at(x, y) == Cell::Free {
                return (x, y);
            }
        }
    }
}

/// Poses in columns, as particles come.
#[derive(Default)]
struct Poses {
    x: Vec<f32>,
    y: Vec<f32>,
    angle: Vec<f32>,
    cos: Vec<f32>,
    sin: Vec<f32>,
}

impl Poses {
    fn push(&mut self, (x, y): (f32, f32), angle: f32) {
        self.x.push(x);
        self.y.push(y);
        self.angle.push(angle);
        self.cos.push(angle.cos());
        self.sin.push(angle.sin());
    }

    /// Anywhere free, looking anywhere: a drone that is lost.
    fn uniform(plan: &Plan, lot: &mut Lot) -> Self {
        let mut poses = Self::default();
        for _ in 0..POSES {
            let place = lot.draw_free(plan);
            poses.push(place, lot.draw() * TAU);
        }
        poses
    }

    /// Around one place, sensor by sensor: a drone that knows where it is.
    fn clustered(plan: &Plan, lot: &mut Lot) -> Self {
        let named = std::env::var("SERENO_BENCH_AT").ok().and_then(|text| {
            let (x, y) = text.split_once(',')?;
            Some((x.parse().ok()?, y.parse().ok()?))
        });
        let (x, y) = named.unwrap_or_else(|| lot.draw_free(plan));
        let mut poses = Self::default();
        for sensor in 0..8 {
            for _ in 0..POSES / 8 {
                let place = (x + CLUSTER_M * lot.draw_normal(), y + CLUSTER_M * lot.draw_normal());
                poses.push(place, sensor as f32 * FRAC_PI_4 + CLUSTER_RAD * lot.draw_normal());
            }
        }
        poses
    }

    fn ask(&self, out: &mut [f32], range: impl Fn(f32, f32, f32) -> f32) {
        for (out, ((x, y), angle)) in out.iter_mut().zip(self.x.iter().zip(&self.y).zip(&self.angle)) {
            *out = range(*x, *y, *angle);
        }
    }
}

fn exact_ray(plan: &Plan, model: &ConeModel, (x, y): (f32, f32), angle: f32) -> f32 {
    plan.cast_ray(x, y, angle, model.max_range_m).map_or(f32::INFINITY, |hit| hit.range_m)
}

fn exact_cone(plan: &Plan, model: &ConeModel, (x, y): (f32, f32), angle: f32) -> f32 {
    cast_cone(plan, model, x, y, angle).unwrap_or(f32::INFINITY)
}

/// A range jumps where a thing enters the cone, and an echo ends where a wall turns away: rounding moves those
/// borders. Both are counted. Leaves the table warm, as it is after one look at a place in a building's life.
fn say_how_often_the_table_is_off(name: &str, table: &ConeTable, poses: &Poses) {
    let (plan, model) = (table.plan(), table.model());
    let (mut exact, mut fast) = (vec![0.0; POSES], vec![0.0; POSES]);
    poses.ask(&mut exact, |x, y, angle| exact_cone(plan, model, (x, y), angle));
    poses.ask(&mut fast, |x, y, angle| table.range(x, y, angle));
    let count = |counts: &dyn Fn(f32, f32) -> bool| {
        exact.iter().zip(&fast).filter(|(exact, fast)| counts(**exact, **fast)).count() as f64
    };
    let far = 2.0 * plan.resolution();
    let ranges = count(&|exact, fast| exact.is_finite() && fast.is_finite());
    let off = count(&|exact, fast| exact.is_finite() && fast.is_finite() && (exact - fast).abs() > far);
    let one = count(&|exact, fast| exact.is_finite() != fast.is_finite());
    println!(
        "{name}: of {POSES} cones {ranges} have an echo by table and by exact casting, {one} by only one of \
         them; more than 2 cells apart are {off}: {:.2} % of the ranges, {:.2} % of the cones",
        100.0 * off / ranges,
        100.0 * off / POSES as f64
    );
}

fn casts(c: &mut Criterion) {
    let (name, plan) = named_plan().unwrap_or_else(drawn_hall);
    let plan = Arc::new(plan);
    let model = ConeModel::default();
    let Ok(table) = ConeTable::new(Arc::clone(&plan), model) else { return };
    let mut lot = Lot(0x5eed_0001);
    let sets =
        [("uniform", Poses::uniform(&plan, &mut lot)), ("clustered", Poses::clustered(&plan, &mut lot))];
    for (how, poses) in &sets {
        say_how_often_the_table_is_off(&format!("{name}, {how}"), &table, poses);
    }
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(POSES as u64));
    let mut out = vec![0.0; POSES];
    for (how, poses) in &sets {
        group.bench_function(BenchmarkId::new("exact ray", how), |b| {
            b.iter(|| poses.ask(black_box(&mut out), |x, y, angle| exact_ray(&plan, &model, (x, y), angle)));
        });
        group.bench_function(BenchmarkId::new("exact cone", how), |b| {
            b.iter(|| poses.ask(black_box(&mut out), |x, y, angle| exact_cone(&plan, &model, (x, y), angle)));
        });
        group.bench_function(BenchmarkId::new("table, one by one", how), |b| {
            b.iter(|| poses.ask(black_box(&mut out), |x, y, angle| table.range(x, y, angle)));
        });
        group.bench_function(BenchmarkId::new("table, in columns", how), |b| {
            b.iter(|| {
                table.ranges(&poses.x, &poses.y, &poses.angle, &poses.cos, &poses.sin, black_box(&mut out));
            });
        });
    }
    group.finish();
}

criterion_group!(benches, casts);
criterion_main!(benches);
