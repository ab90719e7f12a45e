//! Prints every sonar reading between two times of a flight beside what the plan promises at the true place.
//!
//! `cargo run --release -p cli --example echoes -- SEED FROM TO CLUTTER VEHICLE`
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use anyhow::Result;
use cli::flight::{Flight, Setup};
use floorplan::{ConeModel, cast_cone};
use ipc_types::{FlowMotion, Pose, SonarRanges, Verb};
use std::path::Path;

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let seed: u64 = words.next().map_or(Ok(1), |word| word.parse())?;
    let from: f64 = words.next().map_or(Ok(20.0), |word| word.parse())?;
    let to: f64 = words.next().map_or(Ok(30.0), |word| word.parse())?;
    let clutter = words.next().unwrap_or_else(|| "full".to_owned());
    let vehicle = words.next().unwrap_or_else(|| "watchman".to_owned());
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    let setup = Setup::simulated(&deploy, &vehicle, clutter, to)?;
    let start = runtime::Start::new(
        setup.manifest.system.clone(),
        &setup.root,
        0,
        0,
        true,
        runtime::Cache::default(),
    )?;
    let plan = start.plan()?;
    let mut flight = Flight::start(&setup, seed)?;
    let mut ports = flight.bus.tool("cli");
    let mut ranges = ports.input::<SonarRanges>()?;
    let mut flows = ports.input::<FlowMotion>()?;
    let mut poses = ports.input::<Pose>()?;
    flight.run_for(6.0);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    flight.run_for(from - 6.0);
    ranges.latest();
    flows.latest();
    while (flight.bus.now() as f64) * 1e-9 < to {
        flight.run_for(0.02);
        let Some(truth) = flight.witness.last_truth else { continue };
        while let Some(flow) = flows.receive() {
            let (sin, cos) = truth.yaw_rad.sin_cos();
            println!(
                "    flow {:5.2} {:5.2} true {:5.2} {:5.2} quality {} range {:.2}",
                flow.velocity_x_m_s,
                flow.velocity_y_m_s,
                cos * truth.velocity_x_m_s + sin * truth.velocity_y_m_s,
                cos * truth.velocity_y_m_s - sin * truth.velocity_x_m_s,
                flow.quality,
                flow.range_m
            );
        }
        while let Some(group) = ranges.receive() {
            let pose = poses.latest().map(|pose| *pose).unwrap_or_default();
            print!(
                "{:7.2} {:6.2} {:6.2} yaw {:4.0} off {:5.2} {:5.2} sigma {:.2} n {} eff {:.0} lost {:.2}:",
                truth.time_s,
                truth.x_m,
                truth.y_m,
                truth.yaw_rad.to_degrees(),
                pose.x_m - truth.x_m,
                pose.y_m - truth.y_m,
                pose.sigma_m(),
                pose.particles,
                pose.effective_particles,
                pose.p_lost
            );
            for reading in group.filled().iter().filter(|reading| !reading.looks_down()) {
                let (sin, cos) = truth.yaw_rad.sin_cos();
                let x = truth.x_m + cos * reading.mount_x_m - sin * reading.mount_y_m;
                let y = truth.y_m + sin * reading.mount_x_m + cos * reading.mount_y_m;
                let promised =
                    cast_cone(&plan, &ConeModel::default(), x, y, truth.yaw_rad + reading.bearing_rad);
                print!(
                    "  {:4.0}: {:.2} ({:.2})",
                    reading.bearing_rad.to_degrees(),
                    reading.range_m,
                    promised.unwrap_or(f32::NAN)
                );
            }
            println!();
        }
    }
    Ok(())
}
