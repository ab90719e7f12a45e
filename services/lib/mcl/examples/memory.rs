//! What the tables of a plan take in memory: the cone table when every free place was asked about, the distance field, and the
//! places of the search.
//!
//! `cargo run --release -p mcl --example memory -- PLAN.yaml...`
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use floorplan::{Cell, ConeModel, ConeTable, DistanceField, Plan, PlanHeader};
use mcl::Lattice;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;

/// Radius of the vehicle `watchman`, metres.
const RADIUS_M: f32 = 0.225;

fn main() -> Result<(), Box<dyn Error>> {
    for name in std::env::args().skip(1) {
        let plan = Arc::new(load(&name)?);
        let megabytes = |bytes: usize| bytes as f64 / 1e6;
        let (width, height) = (plan.width(), plan.height());
        println!("{name}: {width} x {height} cells of {} m", plan.resolution());
        let table = ConeTable::new(Arc::clone(&plan), ConeModel::default())?;
        println!("  cone table, nothing asked yet: {:.1} MB", megabytes(table.memory_bytes()));
        let began = std::time::Instant::now();
        let mut free = 0u32;
        for iy in 0..height {
            for ix in 0..width {
                if plan.cell(ix, iy) == Cell::Free {
                    let (x0, y0) = plan.origin();
                    let at = |origin: f32, index: usize| origin + (index as f32 + 0.5) * plan.resolution();
                    table.range(at(x0, ix), at(y0, iy), 0.0);
                    free += 1;
                }
            }
        }
        println!(
            "  cone table, all {free} free cells asked: {:.1} MB in {:.1} s",
            megabytes(table.memory_bytes()),
            began.elapsed().as_secs_f64()
        );
        let field = DistanceField::new(&plan, 2.0);
        println!("  distance field: {:.1} MB", megabytes(width * height * size_of_val(&field.at_cell(0, 0))));
        let lattice = Lattice::new(&plan, RADIUS_M);
        let places = lattice.places();
        println!("  search: {} places, {:.2} MB", places.len(), megabytes(size_of_val(places)));
    }
    Ok(())
}

fn load(name: &str) -> Result<Plan, Box<dyn Error>> {
    let file = Path::new(name);
    let header = PlanHeader::parse(name, &std::fs::read(file)?)?;
    let image = std::fs::read(file.parent().unwrap_or(Path::new(".")).join(&header.image))?;
    Ok(Plan::load(name, &header, &image)?)
}
