//! Prints one line every half second of a flight in lockstep: truth, estimate, phase and intentions.
//!
//! `cargo run --release -p cli --example trace_flight -- SEED SECONDS CLUTTER VEHICLE`
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use anyhow::Result;
use cli::flight::{Flight, Setup};
use ipc_types::{FlightState, Pose, Setpoint, Verb};
use std::path::Path;

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let seed: u64 = words.next().map_or(Ok(1), |word| word.parse())?;
    let seconds: f64 = words.next().map_or(Ok(60.0), |word| word.parse())?;
    let clutter = words.next().unwrap_or_else(|| "full".to_owned());
    let vehicle = words.next().unwrap_or_else(|| "watchman".to_owned());
    let deploy = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy");
    let setup = Setup::simulated(&deploy, &vehicle, clutter, seconds)?;
    let began = std::time::Instant::now();
    let mut flight = Flight::start(&setup, seed)?;
    println!("started in {:.2} s", began.elapsed().as_secs_f64());
    let mut ports = flight.bus.tool("cli");
    let mut controller = ports.input::<FlightState>()?;
    let mut setpoint = ports.input::<Setpoint>()?;
    let mut poses = ports.input::<Pose>()?;
    let (mut controller_said, mut wished, mut pose) =
        (FlightState::default(), Setpoint::default(), Pose::default());
    let began = std::time::Instant::now();
    let mut ordered = false;
    for half_second in 1..=(2.0 * seconds) as u64 {
        flight.run_for(0.5);
        if half_second >= 12 && !ordered {
            ordered = true;
            flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
        }
        if let Some(new) = controller.latest() {
            controller_said = *new;
        }
        if let Some(new) = setpoint.latest() {
            wished = *new;
        }
        if let Some(new) = poses.latest() {
            pose = *new;
        }
        let Some(truth) = flight.witness.last_truth else { continue };
        let pilot = flight.witness.last_pilot.unwrap_or_default();
        println!(
            "{:6.1} true {:6.2} {:6.2} {:5.2} v {:5.2} {:5.2} {:5.2} tilt {:5.1} {:5.1} yaw {:4.0} | off {:5.2} head {:4.0} v {:5.2} {:5.2} sigma {:.2} n {} lost {:.2} state {} | {} h {:.2} | wish {} {:5.2} {:5.2} | thr {} | near {:.2} c {} | {} | {} | {}",
            truth.time_s,
            truth.x_m,
            truth.y_m,
            truth.z_m,
            truth.velocity_x_m_s,
            truth.velocity_y_m_s,
            truth.velocity_z_m_s,
            truth.roll_rad.to_degrees(),
            truth.pitch_rad.to_degrees(),
            truth.yaw_rad.to_degrees(),
            flight.witness.error_m().unwrap_or(f32::NAN),
            pose.heading_rad.to_degrees(),
            pose.velocity_x_m_s,
            pose.velocity_y_m_s,
            pose.sigma_m(),
            pose.particles,
            pose.p_lost,
            pose.state,
            flight.witness.phase(),
            pilot.height_m,
            wished.kind,
            wished.velocity_x_m_s,
            wished.velocity_y_m_s,
            controller_said.channels_us[2],
            truth.clearance_m,
            truth.contacts,
            pilot.text,
            flight.witness.round.text,
            controller_said.reason,
        );
        if flight.witness.landed() {
            break;
        }
    }
    println!("{:.0} times real time", flight.bus.now() as f64 * 1e-9 / began.elapsed().as_secs_f64());
    for service in ["flight", "sonar", "flow", "pilot", "localization", "navigation", "simulator"] {
        println!("{service}: {} (refused {})", flight.bus.status(service), flight.bus.refused(service));
    }
    println!("{}", serde_json::to_string_pretty(&flight.finish().report)?);
    Ok(())
}
