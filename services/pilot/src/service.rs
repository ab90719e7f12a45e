//! The pilot's ports.

use crate::config::PilotConfig;
use crate::core::{Craft, PilotCore};
use floorplan::DistanceField;
use ipc_types::{
    Attitude, Channels, Command, FlightState, FlowMotion, Grid, Patrol, PilotState, Pose, Power, Setpoint,
    SonarRanges, Sticks, Text,
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
    grid: Input<Grid>,
    pose: Input<Pose>,
    ranges: Input<SonarRanges>,
    flow: Input<FlowMotion>,
    attitude: Input<Attitude>,
    state: Input<FlightState>,
    power: Input<Power>,
    command: Input<Command>,
    sticks: Input<Sticks>,
    channels: Output<Channels>,
    report: Output<PilotState>,
    said_ns: Option<u64>,
}

impl Service for Pilot {
    const NAME: &'static str = "pilot";
    type Config = PilotConfig;

    fn start(config: PilotConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let config = config.at_height(start.vehicle.limits.height_m)?;
        let plan = start.plan()?;
        let walls = start.shared("pilot walls", || Ok(DistanceField::new(&plan, WALLS_M)))?;
        let mut core = PilotCore::new(config, Craft::of(start), Some((&plan, walls)));
        if let Some(zones) = plan.within(&start.sidecar()?.no_fly) {
            let (width, resolution, origin) = (plan.width(), plan.resolution(), plan.origin());
            core = core.forbid(start.shared("pilot no-fly zones", || {
                Ok(DistanceField::from_blocked(&zones, width, resolution, origin, WALLS_M))
            })?);
        }
        Ok(Self {
            core,
            setpoint: ports.input()?,
            patrol: ports.input()?,
            grid: ports.input()?,
            pose: ports.input()?,
            ranges: ports.input()?,
            flow: ports.input()?,
            attitude: ports.input()?,
            state: ports.input()?,
            power: ports.input()?,
            command: ports.input()?,
            sticks: ports.input()?,
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
        if let Some(message) = self.grid.latest() {
            core.grid(&message);
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
        while let Some(message) = self.sticks.receive() {
            core.sticks(now, &message);
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
