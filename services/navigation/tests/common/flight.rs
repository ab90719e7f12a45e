//! A small building with three rooms, and a drone that flies rounds in it with ideal dynamics and ideal sonars: everything
//! but the ports.

use super::{Drone, RADIUS_M, STEP_NS, World, world};
use floorplan::{Door, Rooms, Sidecar};
use ipc_types::{
    COMMAND_LIFE_NS, Command, Grid, LocalizationState, MAX_SONARS, Patrol, PatrolState, Phase, PilotState,
    Polar, Pose, Setpoint, SetpointKind, SonarRanges, Verb,
};
use navigation::atlas::Atlas;
use navigation::config::NavigationConfig;
use navigation::core::Core;
use navigation::steer::Craft;
use std::sync::Arc;

pub const PAD: (f32, f32) = (1.2, 1.2);

/// Three rooms of 4 m, in 10 cm characters: West on the left over the whole height, South and North on the right.
/// Doors of 0.9 m: West-South low, West-North high, South-North between. `shut` doors are closed in truth
/// only; boxes stand there in truth only.
pub fn building(shut: &[usize], boxes: &[(usize, usize, usize, usize)]) -> (Vec<String>, Sidecar) {
    let (width, height) = (81, 61);
    let mut cells = vec![vec![b' '; width]; height];
    for (y, row) in cells.iter_mut().enumerate() {
        for (x, cell) in row.iter_mut().enumerate() {
            let edge = x == 0 || y == 0 || x == width - 1 || y == height - 1;
            if edge || x == 40 || (y == 30 && x > 40) {
                *cell = b'#';
            }
        }
    }
    let doors = [(40, 10, 40, 18), (40, 42, 40, 50), (56, 30, 64, 30)];
    for (i, (x0, y0, x1, y1)) in doors.iter().enumerate() {
        for row in &mut cells[*y0..=*y1] {
            row[*x0..=*x1].fill(if shut.contains(&i) { b'o' } else { b' ' });
        }
    }
    for (x0, y0, x1, y1) in boxes {
        for row in &mut cells[*y0..=*y1] {
            row[*x0..=*x1].fill(b'o');
        }
    }
    let rows = cells.iter().rev().map(|row| String::from_utf8(row.clone()).unwrap()).collect();
    let yaml = "pad: {x: 1.2, y: 1.2}
doors:
  - {name: South door, a: [4.05, 1.0], b: [4.05, 1.9]}
  - {name: North door, a: [4.05, 4.2], b: [4.05, 5.1]}
  - {name: Inner door, a: [5.6, 3.05], b: [6.5, 3.05]}
rooms:
  - {name: West, rectangle: [0.1, 0.1, 4.0, 6.0]}
  - {name: South, rectangle: [4.1, 0.1, 8.0, 3.0]}
  - {name: North, rectangle: [4.1, 3.1, 8.0, 6.0]}
";
    let sidecar = Sidecar::parse("test.rooms.yaml", yaml.as_bytes()).unwrap();
    assert!(sidecar.doors.iter().all(|door: &Door| (door.width() - 0.9).abs() < 0.01));
    (rows, sidecar)
}

pub struct Flight {
    pub world: World,
    pub atlas: Arc<Atlas>,
    pub core: Core,
    pub drone: Drone,
    pub now: u64,
    pub grid: Option<Box<Grid>>,
    pub phase: Phase,
    pub landing_since: Option<u64>,
    pub setpoint: Setpoint,
    pub least_gap: f32,
    pub commands: u32,
    /// Errors of pose and sonars as in a real flight; the state of a small generator.
    pub errors: Option<u64>,
}

impl Flight {
    pub fn new(shut: &[usize], boxes: &[(usize, usize, usize, usize)]) -> Self {
        let (rows, sidecar) = building(shut, boxes);
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let world = world(&rows, 0.1);
        let rooms = Rooms::of("test", &sidecar, &world.plan).unwrap();
        let atlas = Arc::new(Atlas::new(Arc::new(world.plan.clone()), rooms, &sidecar, RADIUS_M));
        Self {
            core: Self::core(&atlas),
            atlas,
            world,
            drone: Drone::at(PAD),
            now: 10_000_000_000,
            grid: None,
            phase: Phase::Grounded,
            landing_since: None,
            setpoint: Setpoint::default(),
            least_gap: f32::MAX,
            commands: 0,
            errors: None,
        }
    }

    pub fn core(atlas: &Arc<Atlas>) -> Core {
        let craft = Craft { radius_m: RADIUS_M, cruise_m_s: 0.5 };
        Core::new(NavigationConfig::default(), craft, Arc::clone(atlas)).unwrap()
    }

    pub fn order(&mut self, verb: Verb, x_m: f32, y_m: f32) {
        self.commands += 1;
        let mut command = Command {
            verb: u32::from(verb.code()),
            expiry_ns: self.now + COMMAND_LIFE_NS,
            command_sequence: self.commands,
            x_m,
            y_m,
            ..Command::default()
        };
        command.header.stamp_ns = self.now;
        self.core.command(self.now, &command);
        if self.phase == Phase::Grounded {
            self.phase = Phase::Autonomous;
        }
    }

    /// Uniform in 0..1 (Knuth's MMIX generator).
    pub fn draw(&mut self) -> f32 {
        let Some(state) = &mut self.errors else { return 1.0 };
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f32 / (1u32 << 24) as f32
    }

    pub fn step(&mut self) {
        self.now += STEP_NS;
        let now = self.now;
        let t = now as f32 * 1e-9;
        let size = if self.errors.is_some() { 1.0 } else { 0.0 };
        let wrong =
            (0.06 * size * (0.31 * t).sin(), 0.06 * size * (0.23 * t).cos(), 0.03 * size * (0.17 * t).sin());
        self.core.pose(&Pose {
            estimated_ns: now,
            x_m: self.drone.x + wrong.0,
            y_m: self.drone.y + wrong.1,
            heading_rad: avoid::wrap(self.drone.heading + wrong.2),
            velocity_x_m_s: self.drone.vx,
            velocity_y_m_s: self.drone.vy,
            variance_x_m2: 0.001,
            variance_y_m2: 0.001,
            state: u32::from(LocalizationState::Tracking.code()),
            ..Pose::default()
        });
        let mut ranges = SonarRanges::default();
        for mut reading in self.world.readings(now, self.drone.x, self.drone.y, self.drone.heading) {
            let (dropped, odd) = (self.draw() < 0.05, self.draw() < 0.01);
            if dropped {
                reading.status = ipc_types::SonarStatus::NoEcho.code();
            } else if odd {
                reading.range_m = 0.1 + 2.0 * self.draw();
                reading.status = ipc_types::SonarStatus::Ok.code();
            } else if self.errors.is_some() {
                reading.range_m += 0.02 * (self.draw() - 0.5);
            }
            assert!((ranges.count as usize) < MAX_SONARS);
            ranges.readings[ranges.count as usize] = reading;
            ranges.count += 1;
        }
        self.core.ranges(&ranges);
        self.core.pilot(&PilotState { phase: self.phase.code(), automatic: 1, ..PilotState::default() });

        let mut next = Box::<Grid>::default();
        assert!(self.core.map(now, self.grid.as_deref(), &mut next));
        next.header.stamp_ns = now;
        let mut polar = Polar::default();
        self.setpoint = self.core.decide(now, Some(&next), &mut polar);
        self.core.plan_on(now);
        self.grid = Some(next);

        let setpoint = &self.setpoint;
        let velocity = match SetpointKind::from_code(setpoint.kind as u8).unwrap() {
            SetpointKind::Velocity => (setpoint.velocity_x_m_s, setpoint.velocity_y_m_s),
            _ if setpoint.hold_x_m.is_finite() => {
                let (dx, dy) = (setpoint.hold_x_m - self.drone.x, setpoint.hold_y_m - self.drone.y);
                (dx.clamp(-0.2, 0.2), dy.clamp(-0.2, 0.2))
            }
            _ => (0.0, 0.0),
        };
        if self.phase == Phase::Autonomous {
            self.drone.fly(velocity, setpoint.heading_rad);
            if setpoint.kind == u32::from(SetpointKind::Land.code()) {
                let since = *self.landing_since.get_or_insert(now);
                if now - since > 2_000_000_000 {
                    self.phase = Phase::Grounded;
                }
            }
        }
        self.least_gap = self.least_gap.min(self.world.gap(self.drone.x, self.drone.y));
    }

    pub fn report(&mut self) -> Box<Patrol> {
        let mut patrol = Box::<Patrol>::default();
        self.core.write_patrol(&mut patrol);
        patrol
    }

    /// Until the round ends, at most this long; seconds flown.
    pub fn fly(&mut self, most_s: f32) -> f32 {
        let mut seconds = 0.0;
        while seconds < most_s
            && !matches!(self.core.mission().state(), PatrolState::Done | PatrolState::Failed)
        {
            self.step();
            seconds += 0.05;
        }
        seconds
    }

    pub fn off_pad(&self) -> f32 {
        (self.drone.x - PAD.0).hypot(self.drone.y - PAD.1)
    }
}

pub fn room<'a>(patrol: &'a Patrol, name: &str) -> &'a ipc_types::RoomProgress {
    patrol.rooms.iter().find(|room| room.name.as_str() == name).unwrap()
}
