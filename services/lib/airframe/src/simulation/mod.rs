//! One flight: the world, the vehicle, its flight controller and sensors, driven by bytes, pings and time.
//!
//! All randomness comes from one seed, in separate streams for what the flight draws, for the motion, for
//! the sonars and for the flow sensor: asking one sensor more often does not change what another one sees.

mod displacement;
pub mod faults;
mod ground;
mod mishap;
mod options;
mod safety;
mod touch;
mod truth;

#[cfg(test)]
mod tests;

use crate::acoustics::{Acoustics, Echo, Echoes, GIVE_UP_S, Mount, Pose6};
use crate::controller::{Controller, Senses};
use crate::radio::SafetyPilot;
use crate::vehicle::{
    Compass, FlowSensor, FlowSettings, Ground, Inertial, Quadrotor, Shape, Surroundings, Variation, normal,
    within,
};
use crate::world::draw::stream;
use crate::world::{PadPlace, World, WorldError, WorldFile};
use displacement::Displacement;
use faults::{Effects, Faults};
use floorplan::{Plan, Sidecar};
use ground::GroundWatch;
use mishap::Power;
use nalgebra::Vector3;
pub use options::{Options, StartPlace};
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;
use std::collections::VecDeque;
use touch::Touch;
pub use truth::TruthState;

/// One step of physics and of the flight controller's loops.
pub const STEP_NS: u64 = 1_000_000;
const STEP_S: f64 = 1e-3;
/// How often people move, the radio sends, the compass is read and the battery is measured, in steps.
const SLOW_STEPS: u64 = 20;
/// Free space that a start in a room needs around the airframe's own radius, metres.
const START_CLEARANCE_M: f32 = 0.4;
/// What can be flown to from the pad: with this beside the airframe, metres.
const PASSAGE_M: f32 = 0.1;
/// Noise of the voltage and share of the current that the board measures wrongly.
const VOLTS_NOISE: f64 = 0.03;
const AMPS_NOISE: f64 = 0.03;
/// Ping groups that may be under way at once; the oldest answer is lost beyond.
const ECHOES: usize = 8;

/// Purposes of the random streams; the world uses the first few.
const DRAWS: u64 = 101;
const MOTION: u64 = 102;
const SONAR: u64 = 103;
const FLOW: u64 = 104;
const START: u64 = 105;
const GYRO: u64 = 106;
/// Scale error of a gyro that turns a heading without compass: the tolerance of the MPU-6000 family's data sheet, 3 %.
const GYRO_SCALE: f64 = 0.03;
const DISPLACEMENT: u64 = 107;

/// What one ping group brought back.
#[derive(Clone, Copy, Debug)]
pub struct PingAnswer {
    /// The number that [`Simulation::ping`] was given.
    pub ping: u32,
    /// When it left, simulated nanoseconds.
    pub ping_ns: u64,
    ready_ns: u64,
    dead: u32,
    echoes: Echoes,
}

impl PingAnswer {
    /// Each sensor that was fired: its echo, and whether it answered at all.
    pub fn readings(&self) -> impl Iterator<Item = (Echo, bool)> + '_ {
        self.echoes.as_slice().iter().map(|echo| (*echo, self.dead & (1 << echo.sensor) == 0))
    }
}

/// One flight.
#[derive(Clone, Debug)]
pub struct Simulation {
    world: World,
    craft: Quadrotor,
    controller: Controller,
    inertial: Inertial,
    compass: Compass,
    acoustics: Acoustics,
    flow: Option<FlowSensor>,
    motion_random: Xoshiro256PlusPlus,
    sonar_random: Xoshiro256PlusPlus,
    flow_random: Xoshiro256PlusPlus,
    now_ns: u64,
    step: u64,
    senses: Senses,
    /// What the gyro tells of a turn, over the turn; one with a compass, which corrects it.
    turn_scale: f64,
    radio: Option<SafetyPilot>,
    /// The system asks the safety pilot to arm.
    asked_to_arm: bool,
    ground: GroundWatch,
    touch: Touch,
    wall_m: f64,
    dead_sonars: u32,
    answers: VecDeque<PingAnswer>,
    displacement: Option<Displacement>,
    /// `None` on a flight without faults, which is nearly every one.
    faults: Option<Box<Faults>>,
    effects: Effects,
    power: Power,
}

impl Simulation {
    /// Builds the world of the seed and puts the drone into it.
    ///
    /// # Errors
    /// What [`World::build`] refuses.
    pub fn new(
        plan: &Plan,
        side: &Sidecar,
        file: &WorldFile,
        vehicle: &manifest::Vehicle,
        options: &Options,
    ) -> Result<Self, WorldError> {
        let world = World::build(plan, side, file, options.clutter, options.seed)?;
        Ok(Self::in_world(world, vehicle, options))
    }

    /// Where a flight with these options starts in its world: for whoever has to know it before the flight.
    #[must_use]
    pub fn start_place(world: &World, vehicle: &manifest::Vehicle, options: &Options) -> PadPlace {
        let radius = vehicle.body.radius_m;
        match options.start {
            StartPlace::Pad => world.pad(),
            StartPlace::Room => world.draw_start(
                radius + PASSAGE_M,
                radius + START_CLEARANCE_M,
                &mut stream(options.seed, START),
            ),
        }
    }

    /// Puts the drone into a world that stands already.
    #[must_use]
    pub fn in_world(world: World, vehicle: &manifest::Vehicle, options: &Options) -> Self {
        let mut draws = stream(options.seed, DRAWS);
        let (shape, pack) = Shape::new(vehicle, &Variation::draw(&mut draws));
        let inertial = Inertial::draw(&mut draws);
        let compass = Compass::draw(&mut draws);
        let phase_ns = draws.random_range(0..1_000_000_000);
        let mounts: Vec<Mount> = vehicle.sonars.iter().map(mount).collect();
        let acoustics = Acoustics::new(&mounts, &mut draws);
        let flow = vehicle.flow.as_ref().map(|s| FlowSensor::draw(FlowSettings::from(s), &mut draws));

        let place = Self::start_place(&world, vehicle, options);
        let idle = f64::from(vehicle.motors.idle_fraction);
        let ground = GroundWatch::new(&world, place);
        let touch = Touch::new();
        let mut craft = put_down(shape, pack, place, ground.surface_m());
        craft.battery_mut().set_charge(options.charge);
        let (x, y) = (f64::from(place.x), f64::from(place.y));
        let mut motion_random = stream(options.seed, MOTION);
        let heading = compass.read(x, y, f64::from(place.heading), &mut motion_random);
        let senses = Senses {
            gyro: Vector3::zeros(),
            accelerometer: craft.motion().specific_force,
            heading_rad: heading,
            volts: craft.battery().volts(),
            amps: 0.0,
            drawn_mah: 0.0,
        };
        let mut controller = Controller::new(options.firmware, options.failsafe, idle, phase_ns)
            .tuned(f64::from(vehicle.motors.pid_scale));
        let mut turn_scale = 1.0;
        if !options.magnetometer {
            controller = controller.without_magnetometer();
            turn_scale += within(&mut stream(options.seed, GYRO), GYRO_SCALE);
        }
        if options.radio.is_some() {
            controller = controller.with_radio();
        }
        Self {
            world,
            craft,
            controller,
            inertial,
            compass,
            acoustics,
            flow,
            motion_random,
            sonar_random: stream(options.seed, SONAR),
            flow_random: stream(options.seed, FLOW),
            now_ns: 0,
            step: 0,
            senses,
            turn_scale,
            radio: options.radio,
            asked_to_arm: false,
            ground,
            touch,
            wall_m: 10.0,
            dead_sonars: options.dead_sonars,
            answers: VecDeque::with_capacity(ECHOES),
            displacement: Displacement::draw(options.displaced_m, &mut stream(options.seed, DISPLACEMENT)),
            faults: None,
            effects: Effects::default(),
            power: Power::default(),
        }
    }

    /// Moves the world on to `now_ns` of simulated time, in whole steps of 1 ms.
    pub fn advance_to(&mut self, now_ns: u64) {
        while self.now_ns + STEP_NS <= now_ns {
            self.advance_step();
        }
    }

    fn advance_step(&mut self) {
        if self.step.is_multiple_of(SLOW_STEPS) && self.radio.is_some() {
            self.radio_sends();
        }
        if self.faults.is_some() {
            self.suffer();
        }
        let powered = self.is_powered();
        let random = &mut self.motion_random;
        if self.step.is_multiple_of(SLOW_STEPS) {
            let motion = self.craft.motion();
            let (x, y) = (motion.position.x, motion.position.y);
            self.world.advance(self.now_ns as f64 * 1e-9, (x as f32, y as f32));
            self.wall_m = f64::from(self.world.wall_distance(x as f32, y as f32));
            let heading = self.compass.read(x, y, motion.angles().2, random);
            self.senses.heading_rad = heading + self.effects.compass_rad;
            let battery = self.craft.battery();
            self.senses.volts = battery.volts() + VOLTS_NOISE * normal(random);
            self.senses.amps = battery.amps() * (1.0 + AMPS_NOISE * normal(random));
            self.senses.drawn_mah = battery.drawn_mah() - self.power.uncounted_mah;
        }
        if let Some(displacement) = &mut self.displacement
            && let Some((x, y)) = displacement.due(&self.world, &self.craft, self.touch.on_ground(), STEP_S)
        {
            self.craft.carry_to(x, y);
            self.displacement = None;
        }
        self.step += 1;
        self.now_ns += STEP_NS;

        let shake = self.craft.motor_speeds().iter().sum::<f64>() * 0.25;
        (self.senses.gyro, self.senses.accelerometer) =
            self.inertial.sample(self.craft.motion(), shake, random);
        self.senses.gyro.z *= self.turn_scale;
        let commands = if powered {
            self.controller.step(self.now_ns - self.power.since_ns, STEP_S, &self.senses)
        } else {
            [0.0; 4]
        };

        self.ground.look(&self.world, &self.craft, self.step);
        self.touch.look(&self.world, &self.craft, self.ground.surface_m(), self.step);
        let around =
            Surroundings { surface_m: self.ground.surface_m(), wall_m: self.wall_m, push: self.touch.push() };
        self.craft.step(STEP_S, &commands, &around, random);
        if let Some(flow) = &mut self.flow {
            let ground = Ground { contrast: self.effects.flow_contrast, ..self.ground.under_flow() };
            flow.step(self.now_ns, STEP_S, self.craft.motion(), &ground, &mut self.flow_random);
        }
    }

    /// Simulated time, nanoseconds.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Bytes onto the serial line to the flight controller, from now on.
    pub fn controller_write(&mut self, bytes: &[u8]) {
        let troubled = self.faults.as_mut().is_some_and(|faults| faults.send(self.now_ns, bytes));
        if !troubled && self.is_powered() {
            self.controller.write(self.now_ns - self.power.since_ns, bytes);
        }
    }

    /// Bytes that have come over the serial line from the flight controller.
    pub fn controller_read(&mut self, out: &mut [u8]) -> usize {
        let troubled = self.faults.as_ref().is_some_and(|faults| faults.listens());
        if troubled { self.hear_troubled(out) } else { self.hear(out) }
    }

    /// Bytes that have come over the serial line of the flow sensor; none without one.
    pub fn flow_read(&mut self, out: &mut [u8]) -> usize {
        let count = self.flow.as_mut().map_or(0, |flow| flow.read(self.now_ns, out));
        if self.effects.flow_silent { 0 } else { count }
    }

    /// Fires the sonars whose bit is set; the answer is ready when the last echo pulse has ended.
    pub fn ping(&mut self, mask: u32, ping: u32) {
        let pose = self.pose();
        let mut echoes = self.acoustics.ping(&self.world, &pose, mask, self.now_ns, &mut self.sonar_random);
        let mut dead = self.dead_sonars;
        if let Some(faults) = &mut self.faults {
            dead |= faults.spoil(echoes.as_mut_slice());
        }
        let longest = echoes
            .as_slice()
            .iter()
            .map(|echo| if echo.pulse_s.is_finite() { echo.pulse_s } else { GIVE_UP_S })
            .fold(0.0, f32::max);
        if self.answers.len() == ECHOES {
            self.answers.pop_front();
        }
        self.answers.push_back(PingAnswer {
            ping,
            ping_ns: self.now_ns,
            ready_ns: self.now_ns + (f64::from(longest) * 1e9) as u64,
            dead,
            echoes,
        });
    }

    /// The oldest answer that is complete.
    pub fn take_echo(&mut self) -> Option<PingAnswer> {
        let ready = self.answers.front()?.ready_ns <= self.now_ns;
        if ready { self.answers.pop_front() } else { None }
    }

    fn pose(&self) -> Pose6 {
        let motion = self.craft.motion();
        let (roll, pitch, yaw) = motion.angles();
        Pose6 {
            x: motion.position.x as f32,
            y: motion.position.y as f32,
            z: motion.position.z as f32,
            roll: roll as f32,
            pitch: pitch as f32,
            yaw: yaw as f32,
        }
    }

    /// What is flown in.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }
    /// The flight controller, for what scorers and tests may know.
    #[must_use]
    pub fn controller(&self) -> &Controller {
        &self.controller
    }
    /// The vehicle, for what scorers and tests may know.
    #[must_use]
    pub fn craft(&self) -> &Quadrotor {
        &self.craft
    }
    /// Level error (roll, pitch) that this flight drew, radians.
    #[must_use]
    pub fn level_rad(&self) -> [f64; 2] {
        self.inertial.level_rad()
    }
    /// The compass that this flight drew.
    #[must_use]
    pub fn compass(&self) -> &Compass {
        &self.compass
    }
}

fn mount(sonar: &manifest::SonarMount) -> Mount {
    Mount {
        bearing_rad: sonar.bearing_rad,
        elevation_rad: sonar.elevation_rad,
        x_m: sonar.x_m,
        y_m: sonar.y_m,
        z_m: sonar.z_m,
    }
}

fn put_down(shape: Shape, pack: crate::vehicle::Pack, place: PadPlace, surface_m: f64) -> Quadrotor {
    Quadrotor::new(shape, pack, f64::from(place.x), f64::from(place.y), f64::from(place.heading), surface_m)
}
