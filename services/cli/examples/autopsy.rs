//! Flies rounds in lockstep and prints, for each that touched something, its last seconds: what was touched,
//! and ten times a second the gap, the speeds towards it (wished by navigation, allowed by the shield's
//! channels, believed, true) and what steering said.
//!
//! `cargo run --release -p cli --example autopsy -- FIRST LAST CLUTTER VEHICLE [LINES] [DEPLOY]`
#![allow(clippy::print_stdout, reason = "printing is what it is for")]

use anyhow::Result;
use cli::flight::{Flight, Setup, vehicle_body};
use cli::witness::touched;
use ipc_types::{
    Channels, FlowMotion, Grid, MAX_SONARS, Phase, PilotState, Polar, Pose, Setpoint, SonarRanges,
    SteeringReason, Truth, Verb,
};
use std::collections::VecDeque;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Clone, Copy)]
struct Line {
    truth: Truth,
    pose: Pose,
    setpoint: Setpoint,
    polar: Polar,
    channels: Channels,
    pilot: PilotState,
    flow: FlowMotion,
    off_m: f32,
    /// Gap to what the grid holds, by sides of 30 degrees.
    seen_m: [f32; SIDES],
    /// What each sonar said last.
    heard_m: [f32; MAX_SONARS],
}

/// Gaps whose undershoots are counted, metres: near misses, of which there are enough to compare settings by.
const NEAR_M: [f32; 2] = [0.05, 0.1];
/// An undershoot is over when the gap has grown by this, metres.
const AWAY_M: f32 = 0.05;
/// A height that errs by more is counted as wrong, metres.
const HEIGHT_OFF_M: f32 = 0.15;
/// Landings are not counted, metres.
const ALOFT_M: f32 = 0.8;

/// Sides that the grid is looked at.
const SIDES: usize = 12;

fn main() -> Result<()> {
    let mut words = std::env::args().skip(1);
    let first: u64 = words.next().map_or(Ok(1), |word| word.parse())?;
    let last: u64 = words.next().map_or(Ok(20), |word| word.parse())?;
    let clutter = words.next().unwrap_or_else(|| "full".to_owned());
    let vehicle = words.next().unwrap_or_else(|| "watchman".to_owned());
    let lines: usize = words.next().map_or(Ok(25), |word| word.parse())?;
    let deploy =
        words.next().map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy"), Into::into);
    let setup = Setup::simulated(&deploy, &vehicle, clutter, 1500.0)?;
    let next = AtomicU64::new(first);
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let told = std::sync::Mutex::new(Vec::<(u64, String)>::new());
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed > last {
                        break;
                    }
                    let text = fly(&setup, seed, lines).unwrap_or_else(|error| format!("{error:#}"));
                    told.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((seed, text));
                }
            });
        }
    });
    let mut told = told.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    told.sort();
    for (seed, text) in told {
        println!("== seed {seed}: {text}");
    }
    Ok(())
}

fn fly(setup: &Setup, seed: u64, keep: usize) -> Result<String> {
    let mut flight = Flight::start(setup, seed)?;
    let body = vehicle_body(&setup.manifest, &setup.root, &setup.cache)?;
    let mut ports = flight.bus.tool("cli");
    let mut setpoints = ports.input::<Setpoint>()?;
    let mut poses = ports.input::<Pose>()?;
    let mut grids = ports.input::<Grid>()?;
    let mut ranges = ports.input::<SonarRanges>()?;
    let mut polars = ports.input::<Polar>()?;
    let mut channels = ports.input::<Channels>()?;
    let mut flows = ports.input::<FlowMotion>()?;
    let mut kept: VecDeque<Line> = VecDeque::new();
    let mut line: Line = Line {
        truth: Truth::default(),
        pose: Pose::default(),
        setpoint: Setpoint::default(),
        polar: Polar::default(),
        channels: Channels::default(),
        pilot: PilotState::default(),
        flow: FlowMotion::default(),
        off_m: f32::NAN,
        seen_m: [f32::NAN; SIDES],
        heard_m: [f32::INFINITY; MAX_SONARS],
    };
    flight.run_for(6.0);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    let mut hovers = String::new();
    let mut cause = 0;
    let mut context = String::new();
    let (mut aloft, mut wrong, mut worst) = (0u32, 0u32, 0.0f32);
    // Squares of the velocity's error and their number, with a floor that the flow sensor sees and without.
    let mut swerves = [(0.0f32, 0u32); 2];
    let mut misses = NEAR_M.map(|near| (near, false, 0u32));
    while (flight.bus.now() as f64 * 1e-9) < setup.patience_s {
        flight.run_for(0.1);
        let Some(truth) = flight.witness.last_truth else { continue };
        line.truth = truth;
        line.pose = poses.latest().map_or(line.pose, |new| *new);
        line.setpoint = setpoints.latest().map_or(line.setpoint, |new| *new);
        line.flow = flows.latest().map_or(line.flow, |new| *new);
        line.seen_m = grids.latest().map_or(line.seen_m, |grid| gaps(&grid, &line.pose));
        while let Some(group) = ranges.receive() {
            for reading in group.filled() {
                if let Some(heard) = line.heard_m.get_mut(reading.sensor as usize) {
                    *heard = reading.range().unwrap_or(f32::NAN);
                }
            }
        }
        line.polar = polars.latest().map_or(line.polar, |new| *new);
        line.channels = channels.latest().map_or(line.channels, |new| *new);
        line.pilot = flight.witness.last_pilot.unwrap_or_default();
        line.off_m = flight.witness.error_m().unwrap_or(f32::NAN);
        if truth.z_m > ALOFT_M {
            let off = (line.pilot.height_m - truth.z_m).abs();
            aloft += 1;
            wrong += u32::from(off > HEIGHT_OFF_M);
            worst = worst.max(off);
            let (x, y) = (
                line.pose.velocity_x_m_s - truth.velocity_x_m_s,
                line.pose.velocity_y_m_s - truth.velocity_y_m_s,
            );
            let (sum, count) = &mut swerves[usize::from(line.flow.quality < 60)];
            *sum += x * x + y * y;
            *count += 1;
        }
        for (near, within, count) in &mut misses {
            let now = truth.z_m > ALOFT_M && truth.clearance_m < *near + if *within { AWAY_M } else { 0.0 };
            if now && !*within {
                *count += 1;
                let (name, _) = touched(&flight.world, &truth, body);
                let reason = SteeringReason::from_code(line.polar.reason);
                let speed = line.setpoint.velocity_x_m_s.hypot(line.setpoint.velocity_y_m_s);
                let route = line.polar.target_rad.is_finite();
                write!(
                    context,
                    "\n   miss {near:.2} {name} | {reason:?} | phase {:?} | wish {speed:.1} | route {route} | at {:.1} {:.1} | off {:.2} flow {} vel {:.2}",
                    Phase::from_code(line.pilot.phase),
                    truth.x_m,
                    truth.y_m,
                    line.off_m,
                    line.flow.quality,
                    (truth.velocity_x_m_s - line.pose.velocity_x_m_s)
                        .hypot(truth.velocity_y_m_s - line.pose.velocity_y_m_s)
                )?;
            }
            *within = now;
        }
        if kept.len() == keep {
            kept.pop_front();
        }
        kept.push_back(line);
        if let Some(PilotState { cause: now, text, .. }) = flight.witness.last_pilot
            && now != cause
        {
            cause = now;
            write!(hovers, " [{:.0} s {:.1} {:.1}: {text}]", truth.time_s, truth.x_m, truth.y_m)?;
        }
        if flight.witness.contacts() > 0 || flight.witness.landed() {
            break;
        }
    }
    let truth = line.truth;
    let phase = flight.witness.last_pilot.and_then(|pilot| Phase::from_code(pilot.phase));
    let mut out = String::new();
    write!(
        out,
        "{:.0} s, {} contacts, least gap {:.2}, phase {phase:?}",
        truth.time_s, truth.contacts, truth.min_clearance_m
    )?;
    for (near, _, count) in misses {
        write!(out, ", {count} times within {near:.2}")?;
    }
    let share = 100.0 * f64::from(wrong) / f64::from(aloft.max(1));
    write!(out, ", height off {worst:.2} at worst and {share:.1} % of the time")?;
    let [seen, blind] = swerves.map(|(sum, count)| (sum / count.max(1) as f32).sqrt());
    write!(
        out,
        ", velocity off {seen:.3} m/s rms, {blind:.3} in the {:.1} % without flow",
        100.0 * f64::from(swerves[1].1) / f64::from(aloft.max(1))
    )?;
    write!(out, ", {}{hovers}{context}", flight.witness.round.text)?;
    if truth.contacts == 0 {
        return Ok(out);
    }
    let (name, bearing) = touched(&flight.world, &truth, body);
    write!(
        out,
        "\n   touched {name} at {:.2} {:.2}, bearing {:.0} deg",
        truth.x_m,
        truth.y_m,
        bearing.to_degrees()
    )?;
    let sonars = line.heard_m.iter().rposition(|heard| !heard.is_infinite()).map_or(0, |last| last + 1);
    let towards = |x: f32, y: f32| x * bearing.cos() + y * bearing.sin();
    for line in kept {
        let t = line.truth;
        write!(
            out,
            "\n   {:6.1} at {:6.2} {:6.2} {:4.2} yaw {:4.0} gap {:5.2} seen {:5.2} | to it: wish {:5.2} believed {:5.2} true {:5.2} | speeds wish {:4.2} shield {:4.2} true {:4.2} {:5.2} | tilt {:4.1} {:4.1} sp {} {} src {} {:?} dir {:4.0} target {:4.0} | off {:.2} sigma {:.2} p {:.2} | flow {} thr {} h {:.2} | heard {:.2?}",
            t.time_s,
            t.x_m,
            t.y_m,
            t.z_m,
            t.yaw_rad.to_degrees(),
            t.clearance_m,
            [-0.5, 0.0, 0.5]
                .map(|turn| line.seen_m[side_of(bearing + turn)])
                .into_iter()
                .fold(f32::INFINITY, f32::min),
            towards(line.setpoint.velocity_x_m_s, line.setpoint.velocity_y_m_s),
            towards(line.pose.velocity_x_m_s, line.pose.velocity_y_m_s),
            towards(t.velocity_x_m_s, t.velocity_y_m_s),
            line.setpoint.velocity_x_m_s.hypot(line.setpoint.velocity_y_m_s),
            line.pilot.shield_speed_m_s,
            t.velocity_x_m_s.hypot(t.velocity_y_m_s),
            t.velocity_z_m_s,
            t.roll_rad.to_degrees(),
            t.pitch_rad.to_degrees(),
            line.setpoint.kind,
            if line.setpoint.hold_x_m.is_finite() { "hold" } else { "go" },
            line.channels.source,
            SteeringReason::from_code(line.polar.reason),
            line.polar.chosen_rad.to_degrees(),
            line.polar.target_rad.to_degrees(),
            line.off_m,
            line.pose.sigma_m(),
            line.pose.p_lost,
            line.flow.quality,
            line.channels.channels_us[2],
            line.pilot.height_m,
            &line.heard_m[..sonars],
        )?;
    }
    Ok(out)
}

/// The side of the grid that an angle of the plan frame falls into.
fn side_of(angle: f32) -> usize {
    ((angle / core::f32::consts::TAU * SIDES as f32).round() as i32).rem_euclid(SIDES as i32) as usize
}

/// Gap between the airframe, where it is believed, and the nearest thing that the grid holds on each side, metres.
fn gaps(grid: &Grid, pose: &Pose) -> [f32; SIDES] {
    let mut gaps = [f32::INFINITY; SIDES];
    for (index, _) in
        grid.cells.iter().enumerate().filter(|(_, cell)| **cell >= navigation::steer::STANDS_CERTAINTY)
    {
        let (column, row) = (index % ipc_types::GRID_SIDE, index / ipc_types::GRID_SIDE);
        let dx = grid.origin_x_m + (column as f32 + 0.5) * grid.cell_m - pose.x_m;
        let dy = grid.origin_y_m + (row as f32 + 0.5) * grid.cell_m - pose.y_m;
        let gap = &mut gaps[side_of(dy.atan2(dx))];
        *gap = gap.min(dx.hypot(dy) - 0.225);
    }
    gaps
}
