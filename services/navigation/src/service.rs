//! [`Core`] with the ports of the runtime.

use crate::atlas::Atlas;
use crate::config::NavigationConfig;
use crate::core::Core;
use crate::mission::Heard;
use crate::steer::Craft;
use ::core::fmt::Write;
use floorplan::Rooms;
use ipc_types::{Answer, Command, Grid, Patrol, PilotState, Polar, Pose, Setpoint, SonarRanges, Text};
use runtime::{ConfigError, Guard, Input, Output, Ports, Service, Start, StartError};
use std::sync::Arc;

/// The retained state of the round is said this often, nanoseconds: twice a second.
const PATROL_NS: u64 = 500_000_000;

/// The service.
pub struct Navigation {
    core: Core,
    pose: Input<Pose>,
    ranges: Input<SonarRanges>,
    pilot: Input<PilotState>,
    command: Input<Command>,
    last_grid: Input<Grid>,
    grid: Output<Grid>,
    polar: Output<Polar>,
    setpoint: Output<Setpoint>,
    patrol: Output<Patrol>,
    /// The newest grid: the working memory of the next step.
    known: Option<Guard<Grid>>,
    retained: Option<Box<Patrol>>,
    said_ns: Option<u64>,
    /// State, command and answer that were said last: what differs from them is said at once.
    said: (u8, Heard),
    resumed: bool,
}

/// What navigation knows of the building, worked out once and shared between flights.
///
/// # Errors
/// When plan or side file are missing or wrong.
pub fn atlas_of(start: &Start) -> Result<Arc<Atlas>, StartError> {
    let radius_m = start.vehicle.body.radius_m;
    // Before the other: what is built for sharing may not ask for something shared.
    let plan = start.plan()?;
    let pad = start.pad()?;
    // Radius and pad are in the key: vehicles of one rehearsal may differ.
    start.shared(&format!("navigation atlas {} {radius_m} {pad:?}", start.system.plan), || {
        let sidecar = floorplan::Sidecar { pad, ..start.sidecar()? };
        let rooms = Rooms::of(&start.system.plan, &sidecar, &plan).map_err(StartError::invalid)?;
        Ok(Atlas::new(Arc::clone(&plan), rooms, &sidecar, radius_m))
    })
}

impl Service for Navigation {
    const NAME: &'static str = "navigation";
    type Config = NavigationConfig;

    fn start(config: NavigationConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let vehicle = &start.vehicle;
        let config = config.at_height(vehicle.limits.height_m);
        let cruise = if config.cruise_m_s > 0.0 { config.cruise_m_s } else { vehicle.limits.cruise_m_s };
        let craft = Craft { radius_m: vehicle.body.radius_m, cruise_m_s: cruise };
        let core = Core::new(config, craft, atlas_of(start)?).map_err(|error| {
            ConfigError::range("radius_m", error, "a radius that avoidance can work with")
        })?;
        Ok(Self {
            core,
            pose: ports.input()?,
            ranges: ports.input()?,
            pilot: ports.input()?,
            command: ports.input()?,
            last_grid: ports.input()?,
            grid: ports.output()?,
            polar: ports.output()?,
            setpoint: ports.output()?,
            patrol: ports.output()?,
            known: None,
            retained: ports.retained()?,
            said_ns: None,
            said: (u8::MAX, Heard { sequence: 0, stamp_ns: 0, answer: Answer::None }),
            resumed: false,
        })
    }

    fn step(&mut self, now: u64) {
        let core = &mut self.core;
        if !self.resumed {
            self.resumed = true;
            if let Some(patrol) = self.retained.take() {
                core.resume(now, &patrol);
            }
        }
        while let Some(message) = self.pose.receive() {
            core.pose(&message);
        }
        while let Some(message) = self.ranges.receive() {
            core.ranges(&message);
        }
        while let Some(message) = self.pilot.receive() {
            core.pilot(&message);
        }
        while let Some(message) = self.command.receive() {
            core.command(now, &message);
        }
        if let Some(grid) = self.last_grid.latest() {
            self.known = Some(grid);
        }

        let mut grid = self.grid.loan();
        let mapped = grid.as_mut().is_some_and(|next| core.map(now, self.known.as_deref(), next));
        let grid = grid.filter(|_| mapped);
        // Without a place in shared memory for it the decision is still made, unseen.
        let mut unseen = Polar::default();
        let mut polar = self.polar.loan();
        let setpoint = core.decide(now, grid.as_deref(), polar.as_deref_mut().unwrap_or(&mut unseen));
        self.setpoint.publish(&setpoint);
        if let Some(grid) = grid {
            grid.send();
        }
        if let Some(polar) = polar {
            polar.send();
        }
        let news = (core.mission().state().code(), core.mission().heard());
        let due = self.said_ns.is_none_or(|said| now.saturating_sub(said) >= PATROL_NS);
        if (due || news != self.said)
            && let Some(mut patrol) = self.patrol.loan()
        {
            core.write_patrol(&mut patrol);
            patrol.send();
            self.said_ns = Some(now);
            self.said = news;
        }
        // Last, so that planning never delays a setpoint.
        core.plan_on(now);
    }

    fn status(&self, text: &mut Text<96>) {
        // What does not fit is cut.
        let _ = write!(text, "{}: {}", self.core.mission().state(), self.core.text());
    }

    fn refused(&self) -> u64 {
        self.core.refused()
    }
}
