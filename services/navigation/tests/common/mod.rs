//! A drone that flies exactly as told, and sonars that hear exactly what their cones meet, in an ASCII world.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::panic,
    clippy::unwrap_used,
    reason = "shared by several test binaries"
)]

pub mod flight;

use avoid::grid::{insert, scroll};
use avoid::{CELLS, GridRules, Histogram, SECTORS, WallLayer, Window, wrap};
use floorplan::{Cell, DistanceField, Plan};
use ipc_types::{SonarReading, SonarStatus, SteeringReason};
use navigation::config::{Method, NavigationConfig};
use navigation::place::Place;
use navigation::senses::Senses;
use navigation::steer::{Craft, Scene, Steer, Steering};
use navigation::track::Track;

pub const RADIUS_M: f32 = 0.225;
pub const STEP_NS: u64 = 50_000_000;
/// Eight around, opposite pairs together, 60 ms a group: as `watchman`.
const GROUP_NS: u64 = 60_000_000;

/// The true world and what the plan says of it.
pub struct World {
    pub truth: Plan,
    pub plan: Plan,
    pub field: DistanceField,
    solid: DistanceField,
    /// People, where they stand now.
    pub people: Vec<(f32, f32)>,
}

/// Shoulders and a coat.
pub const PERSON_M: f32 = 0.25;

/// Reads a map: `#` wall, `o` stands there but is not on the plan; everything else is free.
pub fn world(rows: &[&str], resolution: f64) -> World {
    let with = |keep: &str| -> Plan {
        let rows: Vec<String> = rows
            .iter()
            .map(|r| r.chars().map(|c| if keep.contains(c) { '#' } else { ' ' }).collect())
            .collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        Plan::from_ascii(&rows, resolution)
    };
    let (truth, plan) = (with("#o"), with("#"));
    let field = DistanceField::of_not_free(&plan, 2.0);
    let solid = DistanceField::new(&truth, 2.0);
    World { truth, plan, field, solid, people: Vec::new() }
}

/// The middle of the character `mark`, metres.
pub fn find(rows: &[&str], mark: char, resolution: f32) -> (f32, f32) {
    for (row, line) in rows.iter().rev().enumerate() {
        if let Some(column) = line.chars().position(|c| c == mark) {
            return ((column as f32 + 0.5) * resolution, (row as f32 + 0.5) * resolution);
        }
    }
    panic!("no {mark} on the map");
}

impl World {
    /// Metres between the airframe and the nearest thing.
    pub fn gap(&self, x: f32, y: f32) -> f32 {
        let people = self.people.iter().map(|person| (person.0 - x).hypot(person.1 - y) - PERSON_M);
        people.fold(self.solid.distance(x, y), f32::min) - RADIUS_M
    }

    /// What the sonar at this body bearing hears.
    pub fn reading(&self, now: u64, sensor: u8, x: f32, y: f32, heading: f32) -> SonarReading {
        let bearing = wrap(f32::from(sensor) * std::f32::consts::FRAC_PI_4);
        let (mx, my) = (0.2 * bearing.cos(), 0.2 * bearing.sin());
        let angle = heading + bearing;
        let (fx, fy) = (x + 0.2 * angle.cos(), y + 0.2 * angle.sin());
        let nearest = (-7..=7)
            .filter_map(|k| self.truth.cast_ray(fx, fy, angle + (k as f32 * 15.0 / 7.0).to_radians(), 4.0))
            .filter(|hit| hit.incidence_rad < 30.0_f32.to_radians())
            .map(|hit| hit.range_m)
            .fold(f32::INFINITY, f32::min);
        let heard = |person: &(f32, f32)| {
            let (dx, dy) = (person.0 - fx, person.1 - fy);
            let aside = wrap(dy.atan2(dx) - angle).abs() - (PERSON_M / dx.hypot(dy)).min(1.0).asin();
            (aside < 15.0_f32.to_radians()).then(|| (dx.hypot(dy) - PERSON_M).max(0.02))
        };
        let nearest = self.people.iter().filter_map(heard).fold(nearest, f32::min);
        let status = if nearest.is_finite() { SonarStatus::Ok } else { SonarStatus::NoEcho };
        SonarReading {
            ping_ns: now,
            range_m: if nearest.is_finite() { nearest.max(0.02) } else { f32::NAN },
            bearing_rad: bearing,
            mount_x_m: mx,
            mount_y_m: my,
            sensor,
            status: status.code(),
            ..SonarReading::default()
        }
    }

    /// The readings that came in the step before `now`.
    pub fn readings(&self, now: u64, x: f32, y: f32, heading: f32) -> Vec<SonarReading> {
        let mut all = Vec::new();
        for slot in (now - STEP_NS) / GROUP_NS + 1..=now / GROUP_NS {
            let group = (slot % 4) as u8;
            for sensor in [group, group + 4] {
                all.push(self.reading(slot * GROUP_NS, sensor, x, y, heading));
            }
        }
        all
    }

    pub fn is_free(&self, x: f32, y: f32) -> bool {
        self.plan.cell_at(x, y) == Cell::Free
    }
}

/// Velocity with a lag, heading at once within its rate.
pub struct Drone {
    pub x: f32,
    pub y: f32,
    pub heading: f32,
    pub vx: f32,
    pub vy: f32,
}

impl Drone {
    pub fn at((x, y): (f32, f32)) -> Self {
        Self { x, y, heading: 0.0, vx: 0.0, vy: 0.0 }
    }

    pub fn place(&self, now: u64) -> Place {
        Place {
            stamp_ns: now,
            x: self.x,
            y: self.y,
            heading: self.heading,
            vx: self.vx,
            vy: self.vy,
            turn: 0.0,
            sigma: 0.03,
            velocity_sigma: 0.05,
            tracking: true,
            searching: false,
        }
    }

    pub fn fly(&mut self, velocity: (f32, f32), heading: f32) {
        // Ten small steps of a 0.3 s lag.
        for _ in 0..10 {
            self.vx += (velocity.0 - self.vx) * 0.005 / 0.3;
            self.vy += (velocity.1 - self.vy) * 0.005 / 0.3;
            self.x += self.vx * 0.005;
            self.y += self.vy * 0.005;
        }
        if heading.is_finite() {
            self.heading = wrap(self.heading + wrap(heading - self.heading).clamp(-0.06, 0.06));
        }
    }
}

/// The grid, the walls and the steering, as the service holds them.
pub struct Bench {
    pub config: NavigationConfig,
    pub steering: Steering,
    pub senses: Senses,
    pub track: Track,
    walls: WallLayer,
    cells: Vec<u8>,
    next: Vec<u8>,
    window: Option<Window>,
    rules: GridRules,
}

impl Bench {
    pub fn new() -> Self {
        Self::by(Method::Vfh)
    }

    pub fn by(method: Method) -> Self {
        Self {
            config: NavigationConfig { avoid: method, ..NavigationConfig::default() },
            steering: Steering::new(Craft { radius_m: RADIUS_M, cruise_m_s: 0.5 }, method).unwrap(),
            senses: Senses::default(),
            track: Track::new(),
            walls: WallLayer::new(),
            cells: vec![0; CELLS],
            next: vec![0; CELLS],
            window: None,
            rules: method.grid_rules(),
        }
    }

    pub fn step(&mut self, world: &World, drone: &Drone, now: u64) -> Steer {
        let place = drone.place(now);
        let to = Window::around(place.x, place.y).unwrap();
        let from = self.window.unwrap_or(to);
        scroll(&self.cells, &from, &mut self.next, &to, self.rules.faded(now - STEP_NS, now));
        std::mem::swap(&mut self.cells, &mut self.next);
        self.window = Some(to);
        for reading in world.readings(now, drone.x, drone.y, drone.heading) {
            if let Some(beam) = self.senses.take(&reading, &place, &world.plan) {
                insert(&mut self.cells, &to, &self.rules, &beam);
            }
        }
        self.walls.follow(&to, |x, y| !world.is_free(x, y));
        self.track.advance(place.x, place.y);
        let aim = self.steering.aim(&self.config, &world.field, &place, &self.track);
        let (mut raw, mut smoothed, mut blocked) = ([0.0; SECTORS], [0.0; SECTORS], [0; SECTORS]);
        let scene = Scene {
            now,
            place,
            window: to,
            cells: &self.cells,
            walls: self.walls.cells(),
            field: &world.field,
            senses: &self.senses,
            dt_s: 0.05,
        };
        let mut histogram = Histogram { raw: &mut raw, smoothed: &mut smoothed, blocked: &mut blocked };
        self.steering.step(&self.config, &scene, aim, &mut histogram)
    }
}

/// What came of following one line.
pub struct Flown {
    pub seconds: f32,
    pub arrived: bool,
    pub least_gap: f32,
    pub most_aside: f32,
    pub reasons: Vec<SteeringReason>,
    pub path: Vec<(f32, f32)>,
}

pub fn follow(world: &World, line: &[(f32, f32)], seconds: f32) -> Flown {
    follow_by(Method::Vfh, world, line, seconds)
}

pub fn follow_by(method: Method, world: &World, line: &[(f32, f32)], seconds: f32) -> Flown {
    let mut bench = Bench::by(method);
    bench.track.set(line.iter().copied());
    let mut drone = Drone::at(line[0]);
    let mut flown = Flown {
        seconds: 0.0,
        arrived: false,
        least_gap: f32::MAX,
        most_aside: 0.0,
        reasons: Vec::new(),
        path: Vec::new(),
    };
    let mut now = 10_000_000_000;
    while flown.seconds < seconds {
        let steer = bench.step(world, &drone, now);
        flown.reasons.push(steer.reason);
        drone.fly(steer.velocity, steer.heading);
        flown.least_gap = flown.least_gap.min(world.gap(drone.x, drone.y));
        flown.most_aside = flown.most_aside.max(bench.track.aside());
        flown.path.push((drone.x, drone.y));
        now += STEP_NS;
        flown.seconds += 0.05;
        if bench.track.remaining() < 0.15 {
            flown.arrived = true;
            break;
        }
    }
    flown
}
