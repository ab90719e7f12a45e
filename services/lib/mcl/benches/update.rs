//! One update of the particle set: motion with flow, eight ranges, weights, estimate; and beside it the thesis's plain
//! filter on the same plan, ranges and number of particles.
//!
//! The target is 10 000 particles in 1 ms on one core. The table is warm: a place is asked about for the
//! first time once in a building's life.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use floorplan::{ConeModel, ConeTable, Plan, PlanHeader};
use mcl::thesis::{self, CentreRay, Moved, PosesMut, PosesRef, Scan};
use mcl::{Config, Echo, Filter, Flow, Generator, Motion, ParticlesMut, ParticlesRef, Reading, Start, Sweep};
use std::f32::consts::FRAC_PI_4;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

/// Places on the depot's plan: between shelves, in the open, near a corner.
const DEPOT_AT: [(f32, f32); 3] = [(8.0, 5.0), (15.0, 8.0), (5.0, 5.0)];
/// A place in the drawn hall, from where some cones meet pillars.
const HALL_AT: [(f32, f32); 1] = [(5.0, 5.6)];

fn read(file: &Path) -> Option<Plan> {
    let name = file.display().to_string();
    let header = PlanHeader::parse(&name, &std::fs::read(file).ok()?).ok()?;
    let image = std::fs::read(file.parent()?.join(&header.image)).ok()?;
    Plan::load(&name, &header, &image).ok()
}

/// The scanned hall that is developed against, where it is at hand, or a drawn hall with pillars.
fn plan() -> (&'static str, Plan, &'static [(f32, f32)]) {
    let depot = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../../shared/maps/depot.yaml");
    if let Some(plan) = read(&depot) {
        return ("depot", plan, &DEPOT_AT);
    }
    let rows: Vec<String> = (0..200)
        .map(|iy| {
            let solid = |ix: usize| {
                [0, 199].contains(&ix) || [0, 199].contains(&iy) || (ix % 50 / 6 == 4 && iy % 50 / 6 == 4)
            };
            (0..200).map(|ix| if solid(ix) { '#' } else { ' ' }).collect()
        })
        .collect();
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    ("drawn hall", Plan::from_ascii(&rows, 0.05), &HALL_AT)
}

struct Columns([Vec<f32>; 8]);

impl Columns {
    fn read(&self) -> ParticlesRef<'_> {
        let [x, y, velocity_x, velocity_y, heading_offset, level_roll, level_pitch, weight] = &self.0;
        ParticlesRef { x, y, velocity_x, velocity_y, heading_offset, level_roll, level_pitch, weight }
    }
    fn write(&mut self) -> ParticlesMut<'_> {
        let [x, y, velocity_x, velocity_y, heading_offset, level_roll, level_pitch, weight] = &mut self.0;
        ParticlesMut { x, y, velocity_x, velocity_y, heading_offset, level_roll, level_pitch, weight }
    }
}

fn start(x: f32, y: f32) -> Start {
    Start {
        x,
        y,
        sigma: 0.1,
        heading_offset: 0.3,
        heading_sigma: 0.1,
        level_roll: 0.0,
        level_pitch: 0.0,
        level_sigma: 0.01,
        velocity: [0.0; 2],
        p_lost: 0.0,
    }
}

/// What eight sonars hear from a place, looking along 0.3 rad.
fn readings(table: &ConeTable, (x, y): (f32, f32)) -> Vec<Reading> {
    let heard = |k: u8| {
        let bearing_rad = f32::from(k) * FRAC_PI_4;
        let (sin, cos) = bearing_rad.sin_cos();
        let range = table.range(x + 0.2 * cos, y + 0.2 * sin, bearing_rad + 0.3);
        let echo = if range.is_finite() { Echo::Range(range) } else { Echo::Nothing };
        Reading { echo, bearing_rad, elevation_rad: 0.0, mount_x: 0.2 * cos, mount_y: 0.2 * sin }
    };
    (0..8).map(heard).collect()
}

fn update(c: &mut Criterion) {
    let (name, plan, places) = plan();
    let Ok(table) = ConeTable::new(Arc::new(plan), ConeModel::default()) else { return };
    let table = Arc::new(table);
    for (x, y) in places {
        update_at(c, name, &table, (*x, *y));
        plain_update_at(c, name, &table, (*x, *y));
    }
}

fn update_at(c: &mut Criterion, name: &str, table: &Arc<ConeTable>, (x, y): (f32, f32)) {
    let mut group = c.benchmark_group(format!("update, 8 ranges, {name} at {x}, {y}"));
    for count in [500, 2_000, 10_000, 50_000] {
        let mut config = Config::default();
        config.population.min = count;
        config.population.max = count;
        let Ok(mut filter) = Filter::new(config, Arc::clone(table), count) else { return };
        let mut generator = Generator::new(1);
        let columns = || Columns(std::array::from_fn(|_| vec![0.0; count]));
        let (mut old, mut new) = (columns(), columns());
        let start = start(x, y);
        let mut memory = filter.start_at(&start, old.write(), &mut generator).memory;
        let readings = readings(table, (x, y));
        let sweep = Sweep {
            readings: &readings,
            roll_rad: 0.0,
            pitch_rad: 0.0,
            yaw_rad: 0.0,
            news: 1.0,
            familiar: 0,
            doors: 0,
        };
        let motion = Motion {
            dt_s: 0.06,
            flow: Some(Flow { velocity_x: 0.0, velocity_y: 0.0, sigma: 0.08 }),
            ..Motion::default()
        };
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter(|| {
                let out = filter.update(
                    old.read(),
                    &memory,
                    &motion,
                    Some(black_box(&sweep)),
                    new.write(),
                    &mut generator,
                );
                memory = out.memory;
                std::mem::swap(&mut old, &mut new);
                out.estimate.x
            });
        });
    }
    group.finish();
}

/// The thesis's filter, whose population has come down to `count` and stays there.
fn plain_update_at(c: &mut Criterion, name: &str, table: &Arc<ConeTable>, (x, y): (f32, f32)) {
    let mut group = c.benchmark_group(format!("plain update, 8 ranges, {name} at {x}, {y}"));
    for count in [500, 2_000, 10_000] {
        let config = thesis::Config { least: count, ..thesis::Config::default() };
        let ray = CentreRay::new(Arc::clone(table.plan()), config.max_range);
        let resolution = table.plan().resolution();
        let Ok(mut filter) = thesis::Filter::new(config, ray, resolution, count) else { return };
        let mut generator = Generator::new(1);
        let columns = || [(); 4].map(|()| vec![0.0f32; count]);
        let (mut old, mut new) = (columns(), columns());
        fn write([x, y, heading, weight]: &mut [Vec<f32>; 4]) -> PosesMut<'_> {
            PosesMut { x, y, heading, weight }
        }
        let start = start(x, y);
        let mut memory = filter.start_around(&start, count, write(&mut old), &mut generator).memory;
        let readings = readings(table, (x, y));
        let scan = Scan { readings: &readings, reference_rad: 0.0 };
        let moved = Moved::default();
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter(|| {
                let [x, y, heading, weight] = &old;
                let out = filter.update(
                    PosesRef { x, y, heading, weight },
                    &memory,
                    0.06,
                    Some(&moved),
                    Some(black_box(&scan)),
                    write(&mut new),
                    &mut generator,
                );
                memory = out.memory;
                std::mem::swap(&mut old, &mut new);
                out.estimate.x
            });
        });
    }
    group.finish();
}

criterion_group!(benches, update);
criterion_main!(benches);
