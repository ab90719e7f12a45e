//! A rigid-body quadrotor with four motors in X; the only way in is four motor commands.
//!
//! Frames by REP-103: world x right, y up the plan, z up; body x forward, y left, z up. With these axes a
//! positive roll has the right side down and a positive pitch the nose down.

mod battery;
mod compass;
mod contact;
mod flow;
mod gust;
mod imu;
mod noise;
mod shape;

pub use battery::{Battery, Pack, Wear};
pub use compass::Compass;
pub use contact::{Push, TOUCH_LIMIT_M_S, TOUCH_LIMIT_RAD};
pub use flow::{FlowSensor, FlowSettings, Ground, MSP2_SENSOR_OPTIC_FLOW, MSP2_SENSOR_RANGEFINDER};
pub use imu::Inertial;
pub use shape::{Cover, Shape, Variation};

pub(crate) use noise::{normal, within};

use gust::Gust;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::Rng;

/// Standard gravity.
pub const GRAVITY_M_S2: f64 = 9.806_65;

/// Rotor drag in the rotor plane, 1/s: about what small craft with propeller guards show (a terminal speed
/// of several metres a second at ten degrees of tilt).
const DRAG_PLANE_PER_S: f64 = 0.30;
/// The same along the rotor axis, where the body's cross-section is what counts.
const DRAG_AXIS_PER_S: f64 = 0.10;
/// Drag that grows with the square of the speed, 1/m.
const DRAG_SQUARE_PER_M: f64 = 0.05;
/// Damping of rotation by the propellers' discs, 1/s.
const ANGULAR_DAMPING_PER_S: f64 = 0.6;
/// Climb speed at which a fixed-pitch propeller would lose all its thrust, m/s: pitch times hover speed.
const CLIMB_NO_THRUST_M_S: f64 = 14.0;
/// Torque of a propeller over its thrust, metres, as a share of the propeller's radius: torque and thrust
/// coefficients of small propellers, C_Q / C_T, are 0.15 to 0.2 radii.
const TORQUE_SHARE: f64 = 0.17;
/// Computer, sensors, camera: watts.
const AVIONICS_W: f64 = 7.0;
/// Bounds that no flight reaches: a crash must tumble, not blow up the integration.
const SPEED_BOUND_M_S: f64 = 20.0;
const RATE_BOUND_RAD_S: f64 = 35.0;
/// Period of the gust process, in steps: it moves over tenths of seconds.
const GUST_STEPS: u32 = 10;

/// What stands around the airframe during one step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// Height of the highest surface under the airframe (floor, pad, table).
    pub surface_m: f64,
    /// Horizontal distance to the nearest wall.
    pub wall_m: f64,
    /// A solid that the airframe has run into.
    pub push: Option<Push>,
}

/// Position and motion.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Of the centre of mass, world frame, metres.
    pub position: Vector3<f64>,
    /// World frame, m/s.
    pub velocity: Vector3<f64>,
    /// Body to world.
    pub attitude: UnitQuaternion<f64>,
    /// Body frame, rad/s.
    pub rates: Vector3<f64>,
    /// What an ideal accelerometer feels, body frame, m/s^2: +g on z at rest.
    pub specific_force: Vector3<f64>,
}

impl Motion {
    /// Roll (right side down), pitch (nose down), yaw (counter-clockwise), radians.
    #[must_use]
    pub fn angles(&self) -> (f64, f64, f64) {
        self.attitude.euler_angles()
    }

    /// Angle between the body's and the world's vertical.
    #[must_use]
    pub fn tilt(&self) -> f64 {
        let q = self.attitude.as_ref();
        let up = 1.0 - 2.0 * (q.i * q.i + q.j * q.j);
        up.clamp(-1.0, 1.0).acos()
    }
}

/// The flying thing.
#[derive(Clone, Debug)]
pub struct Quadrotor {
    shape: Shape,
    motion: Motion,
    /// Motor speeds over the speed at full command and full battery.
    speeds: [f64; 4],
    battery: Battery,
    gust: Gust,
    steps: u32,
    touching: bool,
    /// Share of its thrust that each motor still gives.
    motor_shares: [f64; 4],
    /// Wind on top of the gusts, world frame, m/s^2.
    wind: Option<Vector3<f64>>,
}

impl Quadrotor {
    /// Stands at rest with its lowest point on `surface_m`.
    #[must_use]
    pub fn new(shape: Shape, pack: Pack, x: f64, y: f64, yaw: f64, surface_m: f64) -> Self {
        let motion = Motion {
            position: Vector3::new(x, y, surface_m + shape.foot_drop_m),
            velocity: Vector3::zeros(),
            attitude: UnitQuaternion::from_euler_angles(0.0, 0.0, yaw),
            rates: Vector3::zeros(),
            specific_force: Vector3::new(0.0, 0.0, GRAVITY_M_S2),
        };
        Self {
            shape,
            motion,
            speeds: [0.0; 4],
            battery: Battery::new(pack),
            gust: Gust::default(),
            steps: 0,
            touching: true,
            motor_shares: [1.0; 4],
            wind: None,
        }
    }

    /// Goes on with motors that give these shares of their thrust.
    pub(crate) fn set_motor_shares(&mut self, shares: [f64; 4]) {
        self.motor_shares = shares;
    }

    /// Goes on in a wind, world frame, m/s^2.
    pub(crate) fn set_wind(&mut self, wind: Option<Vector3<f64>>) {
        self.wind = wind;
    }

    /// Takes it as it flies to another place, metres: what no sensor of motion feels.
    pub(crate) fn carry_to(&mut self, x: f64, y: f64) {
        (self.motion.position.x, self.motion.position.y) = (x, y);
    }

    /// Where it is and how it moves.
    #[must_use]
    pub fn motion(&self) -> &Motion {
        &self.motion
    }
    /// The drawn airframe.
    #[must_use]
    pub fn shape(&self) -> &Shape {
        &self.shape
    }
    /// The pack.
    #[must_use]
    pub fn battery(&self) -> &Battery {
        &self.battery
    }
    /// The pack, to start from another charge.
    pub fn battery_mut(&mut self) -> &mut Battery {
        &mut self.battery
    }
    /// Whether a foot presses on something.
    #[must_use]
    pub fn touching(&self) -> bool {
        self.touching
    }
    /// Motor speeds over the speed at full command and full battery.
    #[must_use]
    pub fn motor_speeds(&self) -> [f64; 4] {
        self.speeds
    }
    /// Height of the lowest point of the airframe's cylinder above the world's zero.
    #[must_use]
    pub fn lowest_m(&self) -> f64 {
        let tilt = self.motion.tilt();
        self.motion.position.z - self.shape.foot_drop_m * tilt.cos().abs() - self.shape.radius_m * tilt.sin()
    }

    /// Puts the airframe somewhere without flying it there.
    #[cfg(test)]
    pub(crate) fn motion_mut(&mut self) -> &mut Motion {
        &mut self.motion
    }

    /// The upright cylinder that the tilted airframe just fits into.
    #[must_use]
    pub fn cover(&self) -> Cover {
        self.shape.cover(self.motion.position.z, self.motion.tilt())
    }

    /// One step of `dt` seconds (1 ms) with motor `commands` 0..=1 in the order rear right, front right,
    /// rear left, front left.
    pub fn step(&mut self, dt: f64, commands: &[f64; 4], around: &Surroundings, random: &mut impl Rng) {
        let shape = &self.shape;
        let body = self.motion.attitude.to_rotation_matrix();
        let velocity_body = body.inverse_transform_vector(&self.motion.velocity);

        if self.steps.is_multiple_of(GUST_STEPS) {
            self.gust.advance(dt * f64::from(GUST_STEPS), around.wall_m, random);
        }
        self.steps = self.steps.wrapping_add(1);

        // Thrust and torque of the motors.
        let rotor_height = self.motion.position.z + shape.rotor_rise_m - around.surface_m;
        let cushion = ground_effect(shape.rotor_radius_m, rotor_height);
        let inflow = (1.0 - velocity_body.z / CLIMB_NO_THRUST_M_S).clamp(0.6, 1.3);
        let supply = self.battery.ratio();
        let keep = (-dt / shape.lag_s).exp();
        let mut thrust = 0.0;
        let mut torque = Vector3::zeros();
        let mut watts = AVIONICS_W;
        for (i, command) in commands.iter().enumerate() {
            let wanted = command.clamp(0.0, 1.0) * supply;
            let before = self.speeds[i];
            let speed = wanted + (before - wanted) * keep;
            self.speeds[i] = speed;
            let plain = shape.max_thrust_n[i] * self.motor_shares[i] * speed * speed;
            let force = plain * cushion * inflow;
            thrust += force;
            let (x, y) = shape.motor_place[i];
            let spin_up = shape.rotor_inertia_kg_m2 * shape.max_speed_rad_s * (speed - before) / dt;
            torque.x += y * force;
            torque.y -= x * force;
            torque.z += shape.reaction[i] * (TORQUE_SHARE * shape.rotor_radius_m * plain + spin_up);
            // Momentum theory: power goes with thrust to the 1.5, and thrust with speed squared.
            watts += shape.max_power_w * speed * speed * speed;
        }
        self.battery.draw(watts, dt);

        // Forces on the body.
        let mass = shape.mass_kg;
        let speed = self.motion.velocity.norm();
        let drag = Vector3::new(
            velocity_body.x * DRAG_PLANE_PER_S,
            velocity_body.y * DRAG_PLANE_PER_S,
            velocity_body.z * DRAG_AXIS_PER_S,
        ) * shape.drag_factor
            + velocity_body * (DRAG_SQUARE_PER_M * speed);
        let mut acceleration = body * (Vector3::new(0.0, 0.0, thrust / mass) - drag);
        let mut angular = torque.component_div(&shape.inertia_kg_m2);
        angular += shape.imbalance_rad_s2(thrust);

        // Standing on something, the feet's friction holds against moving air.
        let airborne = if self.touching { 0.1 } else { 1.0 };
        acceleration += self.gust.acceleration() * airborne;
        angular += self.gust.angular_acceleration() * airborne;
        if let Some(wind) = self.wind {
            acceleration += wind * airborne;
        }

        let (push, twist, touching) = contact::react(shape, &self.motion, &body, around);
        self.touching = touching;
        acceleration += push / mass;
        angular += twist.component_div(&shape.inertia_kg_m2);
        self.motion.specific_force = body.inverse_transform_vector(&acceleration);

        // Semi-implicit Euler: velocities first, then places with the new velocities.
        let motion = &mut self.motion;
        acceleration += GRAVITY;
        motion.velocity += acceleration * dt;
        let momentum = motion.rates.component_mul(&shape.inertia_kg_m2);
        angular -= motion.rates.cross(&momentum).component_div(&shape.inertia_kg_m2);
        angular -= motion.rates * ANGULAR_DAMPING_PER_S;
        motion.rates += angular * dt;
        motion.velocity = bounded(&motion.velocity, SPEED_BOUND_M_S);
        motion.rates = bounded(&motion.rates, RATE_BOUND_RAD_S);
        motion.position += motion.velocity * dt;
        let half = motion.rates * (0.5 * dt);
        let turn = Quaternion::new(1.0, half.x, half.y, half.z);
        motion.attitude = UnitQuaternion::new_normalize(motion.attitude.quaternion() * turn);
    }
}

/// As an acceleration, world frame.
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -GRAVITY_M_S2);

/// Cheeseman and Bennett (1955): thrust over that far from the ground, 1 / (1 - (R / 4z)^2), held to what
/// is measured on multirotors near the floor.
fn ground_effect(rotor_radius_m: f64, height_m: f64) -> f64 {
    // Four rotors feel the ground as one about 1.6 times as wide.
    let ratio = 1.6 * rotor_radius_m / (4.0 * height_m.max(0.02));
    if ratio > 0.45 { 1.25 } else { 1.0 / (1.0 - ratio * ratio) }
}

/// The vector, shortened to `bound`; zero when it is not a number.
fn bounded(vector: &Vector3<f64>, bound: f64) -> Vector3<f64> {
    let square = vector.norm_squared();
    if square <= bound * bound {
        *vector
    } else if square.is_finite() {
        vector * (bound / square.sqrt())
    } else {
        Vector3::zeros()
    }
}

#[cfg(test)]
mod tests;
