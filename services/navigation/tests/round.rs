//! Whole rounds in a small building, with ideal dynamics and ideal sonars: everything but the ports.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{Drone, STEP_NS, World, world};
use floorplan::{Door, Rooms, Sidecar};
use ipc_types::{
    COMMAND_LIFE_NS, Command, Grid, LocalizationState, MAX_SONARS, Patrol, PatrolState, Phase, PilotState,
    Polar, Pose, RoomState, Setpoint, SetpointKind, SonarRanges, Verb,
};
use navigation::atlas::Atlas;
use navigation::config::NavigationConfig;
use navigation::core::Core;
use navigation::steer::Craft;
use std::sync::Arc;

const PAD: (f32, f32) = (1.2, 1.2);

/// Three rooms of 4 m, in 10 cm characters: West on the left over the whole height, South and North on the right.
/// Doors of 0.9 m: West-South low, West-North high, South-North between. `shut` doors are closed in truth
/// only; boxes stand there in truth only.
fn building(shut: &[usize], boxes: &[(usize, usize, usize, usize)]) -> (Vec<String>, Sidecar) {
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

struct Flight {
    world: World,
    atlas: Arc<Atlas>,
    core: Core,
    drone: Drone,
    now: u64,
    grid: Option<Box<Grid>>,
    phase: Phase,
    landing_since: Option<u64>,
    setpoint: Setpoint,
    least_gap: f32,
    commands: u32,
    /// Errors of pose and sonars as in a real flight; the state of a small generator.
    errors: Option<u64>,
}

impl Flight {
    fn new(shut: &[usize], boxes: &[(usize, usize, usize, usize)]) -> Self {
        let (rows, sidecar) = building(shut, boxes);
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let world = world(&rows, 0.1);
        let rooms = Rooms::of("test", &sidecar, &world.plan).unwrap();
        let atlas = Arc::new(Atlas::new(Arc::new(world.plan.clone()), rooms, &sidecar, common::RADIUS_M));
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

    fn core(atlas: &Arc<Atlas>) -> Core {
        let craft = Craft { radius_m: common::RADIUS_M, cruise_m_s: 0.5 };
        Core::new(NavigationConfig::default(), craft, Arc::clone(atlas)).unwrap()
    }

    fn order(&mut self, verb: Verb, x_m: f32, y_m: f32) {
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
    fn draw(&mut self) -> f32 {
        let Some(state) = &mut self.errors else { return 1.0 };
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 40) as f32 / (1u32 << 24) as f32
    }

    fn step(&mut self) {
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
        self.core.pilot(&PilotState { phase: self.phase.code(), ..PilotState::default() });

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

    fn report(&mut self) -> Box<Patrol> {
        let mut patrol = Box::<Patrol>::default();
        self.core.write_patrol(&mut patrol);
        patrol
    }

    /// Until the round ends, at most this long; seconds flown.
    fn fly(&mut self, most_s: f32) -> f32 {
        let mut seconds = 0.0;
        while seconds < most_s
            && !matches!(self.core.mission().state(), PatrolState::Done | PatrolState::Failed)
        {
            self.step();
            seconds += 0.05;
        }
        seconds
    }

    fn off_pad(&self) -> f32 {
        (self.drone.x - PAD.0).hypot(self.drone.y - PAD.1)
    }
}

fn room<'a>(patrol: &'a Patrol, name: &str) -> &'a ipc_types::RoomProgress {
    patrol.rooms.iter().find(|room| room.name.as_str() == name).unwrap()
}

#[test]
fn a_round_sees_everything_and_ends_on_the_pad() {
    let mut flight = Flight::new(&[], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    let seconds = flight.fly(200.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    let patrol = flight.report();
    assert!(patrol.coverage > 0.97, "{}", patrol.coverage);
    assert!(flight.off_pad() < 0.12, "{}", flight.off_pad());
    assert!(flight.least_gap > 0.1, "{}", flight.least_gap);
    assert!(seconds < 120.0, "{seconds}");
    for name in ["West", "South", "North"] {
        assert_eq!(room(&patrol, name).state, u32::from(RoomState::Seen.code()), "{name}");
    }
}

#[test]
fn what_cannot_be_reached_is_known_before_the_flight() {
    let left_out = |rows: Vec<String>| {
        let (_, sidecar) = building(&[], &[]);
        let plan = floorplan::Plan::from_ascii(&rows.iter().map(String::as_str).collect::<Vec<_>>(), 0.1);
        let rooms = Rooms::of("test", &sidecar, &plan).unwrap();
        let atlas = Atlas::new(Arc::new(plan), rooms, &sidecar, common::RADIUS_M);
        let found = atlas.left_out().unwrap();
        found.into_iter().map(|(room, reason)| format!("{room}: {reason}")).collect::<Vec<_>>()
    };
    let (rows, _) = building(&[], &[]);
    assert!(left_out(rows).is_empty());
    // The two doors to North walled up on the plan itself.
    let (rows, _) = building(&[1, 2], &[]);
    let walled = rows.iter().map(|row| row.replace('o', "#")).collect();
    assert_eq!(left_out(walled), ["North: no way to it on the plan"]);
}

#[test]
fn a_shut_door_is_waited_for_then_gone_round() {
    let mut flight = Flight::new(&[0], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    flight.fly(300.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    let patrol = flight.report();
    assert!(patrol.coverage > 0.95, "{}", patrol.coverage);
    assert!(flight.least_gap > 0.1, "{}", flight.least_gap);
    assert!(!flight.core.journey().map().door_closed(1));
    assert_eq!(room(&patrol, "South").state, u32::from(RoomState::Seen.code()));
}

#[test]
fn rooms_behind_shut_doors_are_skipped_by_name_with_the_reason() {
    let mut flight = Flight::new(&[0, 1], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    // Both doors are tried thrice: 427 s.
    flight.fly(500.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    assert!(flight.off_pad() < 0.12);
    let patrol = flight.report();
    for name in ["South", "North"] {
        let room = room(&patrol, name);
        assert_eq!(room.state, u32::from(RoomState::Skipped.code()), "{name}");
        assert!(room.reason.as_str().starts_with("door closed"), "{}", room.reason);
    }
    assert_eq!(room(&patrol, "West").state, u32::from(RoomState::Seen.code()));
}

/// A partition that no plan shows cuts the upper half of West off; its other door is shut.
#[test]
fn a_room_seen_in_part_is_reported_so_with_share_and_reason() {
    let mut flight = Flight::new(&[1], &[(1, 30, 39, 31)]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    flight.fly(900.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    let patrol = flight.report();
    let west = room(&patrol, "West");
    assert!((0.3..0.95).contains(&west.seen), "{}", west.seen);
    assert_eq!(west.state, u32::from(RoomState::PartlySeen.code()), "{} {}", west.state, west.reason);
    assert!(!west.reason.as_str().is_empty());
    assert_eq!(room(&patrol, "South").state, u32::from(RoomState::Seen.code()));
}

/// Somebody stands in the North door three times that the drone comes by, and is gone afterwards; the South door stays shut.
#[test]
fn while_most_of_the_building_lies_behind_them_doors_are_tried_again() {
    let mut flight = Flight::new(&[0, 1], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    let (mut found_shut, mut before) = (0, false);
    for _ in 0..8000 {
        flight.step();
        if matches!(flight.core.mission().state(), PatrolState::Done | PatrolState::Failed) {
            break;
        }
        let shut = flight.core.journey().map().door_closed(1);
        found_shut += u32::from(shut && !before);
        before = shut;
        if found_shut == 3 && shut {
            let (rows, _) = building(&[0], &[]);
            flight.world = world(&rows.iter().map(String::as_str).collect::<Vec<_>>(), 0.1);
        }
    }
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    assert!(found_shut >= 3, "{found_shut}");
    assert!(flight.report().coverage > 0.95, "{}", flight.report().coverage);
    assert!(flight.least_gap > 0.1, "{}", flight.least_gap);
}

#[test]
fn boxes_that_are_not_on_the_plan_are_flown_around() {
    let mut flight = Flight::new(&[], &[(20, 25, 24, 29), (55, 10, 58, 14), (60, 42, 62, 48)]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    flight.fly(400.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    assert!(flight.least_gap > 0.05, "{}", flight.least_gap);
    assert!(flight.report().coverage > 0.93, "{}", flight.report().coverage);
}

#[test]
fn errors_of_the_size_of_real_ones_are_flown_with() {
    // Fixed seeds: pose 6 cm and 2 degrees off, 5 % of the echoes lost, 1 % anywhere (FACTS 8).
    for seed in 1..=4 {
        let mut flight = Flight::new(&[], &[(20, 25, 24, 29)]);
        flight.errors = Some(seed);
        flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
        flight.fly(400.0);
        assert_eq!(flight.core.mission().state(), PatrolState::Done, "seed {seed}: {}", flight.core.text());
        assert!(flight.least_gap > 0.03, "seed {seed}: {}", flight.least_gap);
        assert!(flight.report().coverage > 0.95, "seed {seed}: {}", flight.report().coverage);
        for door in 0..3 {
            assert!(!flight.core.journey().map().door_closed(door), "seed {seed}: door {door} is open");
        }
    }
}

#[test]
fn a_restart_in_the_middle_goes_on_with_the_round() {
    let mut flight = Flight::new(&[0], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    let mut restarts = 0;
    for _ in 0..8000 {
        flight.step();
        if matches!(flight.core.mission().state(), PatrolState::Done | PatrolState::Failed) {
            break;
        }
        if (flight.now / STEP_NS).is_multiple_of(300) {
            let retained = flight.report();
            flight.core = Flight::core(&flight.atlas);
            flight.core.resume(flight.now, &retained);
            flight.grid = None;
            restarts += 1;
            let again = flight.report();
            assert_eq!(again.seen, retained.seen);
            assert_eq!(again.unmapped, retained.unmapped);
            assert_eq!(again.command_sequence, retained.command_sequence);
        }
    }
    assert!(restarts >= 3);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    assert!(flight.report().coverage > 0.95, "{}", flight.report().coverage);
    assert!(flight.least_gap > 0.1, "{}", flight.least_gap);
}

#[test]
fn a_retained_message_that_makes_no_sense_is_refused() {
    let mut flight = Flight::new(&[], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    for _ in 0..100 {
        flight.step();
    }
    let good = flight.report();
    let spoil: [fn(&mut Patrol); 6] = [
        |p| p.plan ^= 1,
        |p| p.waypoints_used = u32::MAX,
        |p| p.rooms_used = 49,
        |p| p.state = 99,
        |p| p.seen_cell_m = f32::NAN,
        |p| p.seen_origin_x_m = 3.0,
    ];
    for (i, spoil) in spoil.iter().enumerate() {
        let mut bad = good.clone();
        spoil(&mut bad);
        let mut core = Flight::core(&flight.atlas);
        core.resume(0, &bad);
        assert_eq!((core.refused(), core.mission().state()), (1, PatrolState::Idle), "{i}");
    }
}

#[test]
fn goto_home_and_a_place_in_a_wall() {
    let mut flight = Flight::new(&[], &[]);
    flight.order(Verb::GoTo, 6.0, 1.5);
    flight.fly(40.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Idle);
    assert!((flight.drone.x - 6.0).hypot(flight.drone.y - 1.5) < 0.15);
    flight.order(Verb::GoTo, -50.0, 1.5);
    for _ in 0..100 {
        flight.step();
    }
    assert_eq!(flight.core.mission().state(), PatrolState::Idle, "no way there");
    assert!((flight.drone.x - 6.0).hypot(flight.drone.y - 1.5) < 0.2, "and it stays where it is");
    flight.order(Verb::Home, f32::NAN, f32::NAN);
    flight.fly(60.0);
    assert_eq!(flight.core.mission().state(), PatrolState::Done, "{}", flight.core.text());
    assert!(flight.off_pad() < 0.12);
}

#[test]
fn without_a_pose_or_echoes_it_stands() {
    let mut flight = Flight::new(&[], &[]);
    flight.order(Verb::PatrolStart, f32::NAN, f32::NAN);
    for _ in 0..200 {
        flight.step();
    }
    assert_eq!(flight.setpoint.kind, u32::from(SetpointKind::Velocity.code()));
    let mut polar = Polar::default();
    let later = flight.now + 600_000_000;
    let setpoint = flight.core.decide(later, None, &mut polar);
    assert_eq!(setpoint.kind, u32::from(SetpointKind::Hover.code()));
    assert!(setpoint.hold_x_m.is_nan());
    assert_eq!(polar.reason, ipc_types::SteeringReason::Blind.code());
    assert!(setpoint.expiry_ns.abs_diff(later + 300_000_000) < 1000);
}
