//! In navigation's place: asks for what the programs say.

use super::{Around, Program, STREAMS, stream_at};
use control::{Vector, wrap_angle};
use floorplan::DistanceField;
use ipc_types::{Grid, PilotState, Pose, Setpoint, SetpointKind, SonarRanges, Truth};
use navigation::config::NavigationConfig;
use navigation::core::Core;
use navigation::steer::Craft;
use runtime::{ConfigError, Guard, Input, Output, Ports, Service, Start, StartError, Validate};
use std::sync::Arc;

/// Walls farther than this are no target, metres.
const WALLS_M: f32 = 2.0;
/// An echo older than this is none, nanoseconds.
const FRESH_NS: u64 = 500_000_000;
/// As long as navigation's own setpoints hold, nanoseconds.
const HOLDS_NS: u64 = 300_000_000;

/// Seeds of the programs.
#[derive(Clone, Debug, Default, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// One a stream.
    pub seeds: Vec<u64>,
}

impl Validate for Config {
    fn validate(&self) -> Result<(), ConfigError> {
        if self.seeds.len() == STREAMS {
            Ok(())
        } else {
            Err(ConfigError::range("seeds", self.seeds.len(), STREAMS.to_string()))
        }
    }
}

/// The service. It keeps the certainty grid as navigation does, with navigation's own core.
pub struct Commander {
    core: Core,
    programs: Vec<Program>,
    walls: Arc<DistanceField>,
    gaps: [f32; 8],
    truth: Input<Truth>,
    pose: Input<Pose>,
    ranges: Input<SonarRanges>,
    pilot: Input<PilotState>,
    last_grid: Input<Grid>,
    grid: Output<Grid>,
    setpoint: Output<Setpoint>,
    known: Option<Guard<Grid>>,
    took_off_s: Option<f64>,
    now_truth: Option<Truth>,
    echoes: [Option<(u64, f32, f32)>; ipc_types::MAX_SONARS],
}

impl Service for Commander {
    const NAME: &'static str = "navigation";
    type Config = Config;

    fn start(config: Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let vehicle = &start.vehicle;
        let limits = vehicle.limits;
        let craft = Craft { radius_m: vehicle.body.radius_m, cruise_m_s: limits.cruise_m_s };
        let settings = NavigationConfig::default();
        let height_m = limits.height_m.unwrap_or(settings.height_m);
        let core = Core::new(settings, craft, navigation::atlas_of(start)?).map_err(|error| {
            ConfigError::range("radius_m", error, "a radius that avoidance can work with")
        })?;
        let plan = start.plan()?;
        let walls = start.shared("streams walls", || Ok(DistanceField::new(&plan, WALLS_M)))?;
        let program = |seed: &u64| Program::draw(*seed, limits.cruise_m_s, height_m);
        let mut axes: Vec<f32> =
            vehicle.sonars.iter().filter(|s| !s.looks_down()).map(|s| s.bearing_rad).collect();
        axes.sort_by(f32::total_cmp);
        let gaps = core::array::from_fn(|k| {
            let (a, b) = (axes[k % axes.len()], axes[(k + 1) % axes.len()]);
            wrap_angle(a + 0.5 * wrap_angle(b - a))
        });
        Ok(Self {
            core,
            programs: config.seeds.iter().map(program).collect(),
            walls,
            gaps,
            truth: ports.input()?,
            pose: ports.input()?,
            ranges: ports.input()?,
            pilot: ports.input()?,
            last_grid: ports.input()?,
            grid: ports.output()?,
            setpoint: ports.output()?,
            known: None,
            took_off_s: None,
            now_truth: None,
            echoes: [None; ipc_types::MAX_SONARS],
        })
    }

    fn step(&mut self, now: u64) {
        while let Some(message) = self.pose.receive() {
            self.core.pose(&message);
        }
        while let Some(message) = self.ranges.receive() {
            self.core.ranges(&message);
            for reading in message.filled().iter().filter(|reading| !reading.looks_down()) {
                if let Some(echo) = self.echoes.get_mut(usize::from(reading.sensor)) {
                    *echo = reading.range().map(|range| (reading.ping_ns, range, reading.bearing_rad));
                }
            }
        }
        while let Some(message) = self.pilot.receive() {
            self.core.pilot(&message);
        }
        if let Some(truth) = self.truth.latest() {
            if truth.armed != 0 && truth.on_ground == 0 {
                self.took_off_s.get_or_insert(truth.time_s);
            }
            self.now_truth = Some(*truth);
        }
        if let Some(grid) = self.last_grid.latest() {
            self.known = Some(grid);
        }
        if let Some(mut next) = self.grid.loan()
            && self.core.map(now, self.known.as_deref(), &mut next)
        {
            next.send();
        }
        let wish = self.wish(now);
        self.setpoint.publish(&wish);
    }
}

impl Commander {
    fn wish(&mut self, now: u64) -> Setpoint {
        let hover = Setpoint {
            expiry_ns: now + HOLDS_NS,
            heading_rad: f32::NAN,
            hold_x_m: f32::NAN,
            hold_y_m: f32::NAN,
            kind: SetpointKind::Hover.code().into(),
            ..Setpoint::default()
        };
        let (Some(truth), Some(took_off_s)) = (self.now_truth, self.took_off_s) else { return hover };
        let flown_s = truth.time_s - took_off_s;
        let around = self.around(now, &truth);
        let Some(stream) = stream_at(flown_s) else { return hover };
        let Some(program) = self.programs.get_mut(stream) else { return hover };
        let wish = program.ask(flown_s - super::FIRST_S - stream as f64 * super::PERIOD_S, &around);
        Setpoint {
            velocity_x_m_s: wish.velocity.x,
            velocity_y_m_s: wish.velocity.y,
            heading_rad: wish.heading,
            height_m: wish.height_m,
            kind: SetpointKind::Velocity.code().into(),
            ..hover
        }
    }

    fn around(&self, now: u64, truth: &Truth) -> Around {
        let fresh = self.echoes.iter().flatten().filter(|(at, ..)| now.saturating_sub(*at) < FRESH_NS);
        let nearest = fresh.min_by(|a, b| a.1.total_cmp(&b.1));
        Around {
            heading: truth.yaw_rad,
            echo: nearest.map(|(_, _, bearing)| wrap_angle(truth.yaw_rad + bearing)),
            wall: self.wall(Vector::new(truth.x_m, truth.y_m)),
            gaps: self.gaps,
        }
    }

    /// Where the distance to the walls falls fastest.
    fn wall(&self, place: Vector) -> Option<f32> {
        const STEP_M: f32 = 0.1;
        let at = |dx: f32, dy: f32| self.walls.distance(place.x + dx, place.y + dy);
        let fall = Vector::new(at(-STEP_M, 0.0) - at(STEP_M, 0.0), at(0.0, -STEP_M) - at(0.0, STEP_M));
        (fall.norm() > 1e-3).then(|| fall.angle())
    }
}
