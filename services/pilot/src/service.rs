//! The pilot's ports.

use crate::config::PilotConfig;
use crate::core::{Craft, PilotCore};
use control::Vector;
use floorplan::DistanceField;
use ipc_types::{
    Attitude, Channels, Command, FlightState, FlowMotion, Patrol, PilotState, Pose, Power, Setpoint,
    SonarRanges, Text,
};
use runtime::{Input, Output, Ports, Service, Start, StartError};

/// The state is said this often when nothing changes, nanoseconds: five times a second.
const STATE_NS: u64 = 200_000_000;
/// Walls farther than this do not matter to the shield, metres.
const WALLS_M: f32 = 2.0;

/// The service.
pub struct Pilot {
    core: PilotCore,
    retained: Option<Box<PilotState>>,
    setpoint: Input<Setpoint>,
    patrol: Input<Patrol>,
    pose: Input<Pose>,
    ranges: Input<SonarRanges>,
    flow: Input<FlowMotion>,
    attitude: Input<Attitude>,
    state: Input<FlightState>,
    power: Input<Power>,
    command: Input<Command>,
    channels: Output<Channels>,
    report: Output<PilotState>,
    said_ns: Option<u64>,
}

/// What the pilot needs of the vehicle.
fn craft(start: &Start) -> Craft {
    let v = &start.vehicle;
    let down = v.sonars.iter().find(|sonar| sonar.looks_down());
    // Thrust goes with the square of the command, which runs from idle to full as the throttle from 1000 to 2000.
    let load = v.body.mass_kg * control::GRAVITY_M_S2 / (4.0 * v.motors.max_thrust_n);
    let idle = v.motors.idle_fraction.clamp(0.0, 0.3);
    let share = (load.clamp(0.02, 0.9).sqrt() - idle) / (1.0 - idle);
    Craft {
        radius_m: v.body.radius_m,
        sides: v
            .sonars
            .iter()
            .enumerate()
            .filter(|(_, sonar)| !sonar.looks_down())
            .map(|(index, sonar)| (index, sonar.bearing_rad, Vector::new(sonar.x_m, sonar.y_m)))
            .collect(),
        has_down: down.is_some(),
        // The middle of the cylinder is half its height above the skids.
        rest_m: down.map_or(0.0, |sonar| (0.5 * v.body.height_m + sonar.z_m).clamp(0.0, 0.3)),
        beam_rest_m: 0.5 * v.body.height_m,
        hover_us: 1000.0 + 1000.0 * share,
        cells: v.battery.cells,
        capacity_mah: v.battery.capacity_mah,
        cruise_m_s: v.limits.cruise_m_s,
        max_tilt_rad: v.limits.max_tilt_rad,
    }
}

impl Service for Pilot {
    const NAME: &'static str = "pilot";
    type Config = PilotConfig;

    fn start(config: PilotConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let plan = start.plan()?;
        let walls = start.shared("pilot walls", || Ok(DistanceField::new(&plan, WALLS_M)))?;
        Ok(Self {
            core: PilotCore::new(config, craft(start), Some((&plan, walls))),
            setpoint: ports.input()?,
            patrol: ports.input()?,
            pose: ports.input()?,
            ranges: ports.input()?,
            flow: ports.input()?,
            attitude: ports.input()?,
            state: ports.input()?,
            power: ports.input()?,
            command: ports.input()?,
            channels: ports.output()?,
            report: ports.output()?,
            retained: ports.retained()?,
            said_ns: None,
        })
    }

    fn step(&mut self, now: u64) {
        let core = &mut self.core;
        if let Some(retained) = self.retained.take() {
            core.resume(now, &retained);
        }
        while let Some(message) = self.attitude.receive() {
            core.attitude(&message);
        }
        while let Some(message) = self.state.receive() {
            core.flight_state(&message);
        }
        if let Some(message) = self.power.latest() {
            core.power(&message);
        }
        while let Some(message) = self.pose.receive() {
            core.pose(&message);
        }
        while let Some(message) = self.flow.receive() {
            core.flow(&message);
        }
        while let Some(message) = self.ranges.receive() {
            core.ranges(&message);
        }
        if let Some(message) = self.patrol.latest() {
            core.patrol(&message);
        }
        if let Some(message) = self.setpoint.latest() {
            core.setpoint(&message);
        }
        while let Some(message) = self.command.receive() {
            core.command(now, &message);
        }
        core.step(now);
        if core.fills_channels()
            && let Some(mut loan) = self.channels.loan()
        {
            core.write_channels(now, &mut loan);
            loan.send();
        }
        let due = self.said_ns.is_none_or(|said| now.saturating_sub(said) >= STATE_NS);
        if (core.take_changed() || due)
            && let Some(mut loan) = self.report.loan()
        {
            core.write_state(&mut loan);
            loan.send();
            self.said_ns = Some(now);
        }
    }

    fn status(&self, text: &mut Text<96>) {
        self.core.write_status(text);
    }

    fn refused(&self) -> u64 {
        self.core.refused()
    }
}
