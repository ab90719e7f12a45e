//! The airframe in numbers: what the vehicle file says and what one flight draws around it.

use super::battery::Pack;
use super::noise::within;
use nalgebra::Vector3;
use rand::Rng;

/// Share by which the mass of one flight may differ from the file (DESIGN 6).
const MASS_SHARE: f64 = 0.10;
/// Share by which each motor may differ (DESIGN 6).
const MOTOR_SHARE: f64 = 0.05;
/// Share by which the drag may differ: nobody measures it.
const DRAG_SHARE: f64 = 0.20;
/// Largest offset of the centre of mass from the centre of thrust, metres: where the battery was strapped.
const BALANCE_M: f64 = 0.004;
/// Moment of inertia about roll and pitch over m r^2, of small quadrotors whose mass sits in the middle.
const INERTIA_SHARE: f64 = 0.18;
/// The same about yaw, over that about roll.
const YAW_INERTIA: f64 = 1.7;
/// Moment of inertia of a propeller of `ROTOR_REFERENCE_M` with its motor's bell, kg m^2 (6 g of blades
/// and 15 g of bell).
const ROTOR_INERTIA: f64 = 1.5e-5;
const ROTOR_REFERENCE_M: f64 = 0.081;
/// Tip speed at full command: half the speed of sound, where such propellers are used.
const TIP_SPEED_M_S: f64 = 155.0;

/// What one flight draws around the vehicle file, unknown to the drone.
#[derive(Clone, Copy, Debug)]
pub struct Variation {
    /// Factor on the mass.
    pub mass: f64,
    /// Factor on the thrust of each motor.
    pub motors: [f64; 4],
    /// Factor on the drag.
    pub drag: f64,
    /// Offset of the centre of mass, body x and y, metres.
    pub balance_m: [f64; 2],
}

impl Variation {
    /// Exactly as the file says.
    pub const NONE: Self = Self { mass: 1.0, motors: [1.0; 4], drag: 1.0, balance_m: [0.0; 2] };

    /// One flight's draw, uniform within the bounds.
    pub fn draw(random: &mut impl Rng) -> Self {
        Self {
            mass: 1.0 + within(random, MASS_SHARE),
            motors: std::array::from_fn(|_| 1.0 + within(random, MOTOR_SHARE)),
            drag: 1.0 + within(random, DRAG_SHARE),
            balance_m: std::array::from_fn(|_| within(random, BALANCE_M)),
        }
    }
}

/// One flight's airframe.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Of the cylinder, propeller guards included.
    pub radius_m: f64,
    /// Of the cylinder.
    pub height_m: f64,
    /// Kilograms.
    pub mass_kg: f64,
    /// About body x, y, z.
    pub inertia_kg_m2: Vector3<f64>,
    /// From the lowest point up to the centre of mass.
    pub foot_drop_m: f64,
    /// From the centre of mass up to the rotors.
    pub rotor_rise_m: f64,
    /// Of one propeller.
    pub rotor_radius_m: f64,
    /// Thrust of each motor at full command and full battery.
    pub max_thrust_n: [f64; 4],
    /// Electrical power of each motor at full command and full battery.
    pub max_power_w: f64,
    /// First-order lag of the motors.
    pub lag_s: f64,
    /// Body x and y of each motor: rear right, front right, rear left, front left.
    pub motor_place: [(f64, f64); 4],
    /// Sign of each motor's reaction on the body about z: +1 for one that turns clockwise from above.
    pub reaction: [f64; 4],
    /// Propeller and bell, about the shaft.
    pub rotor_inertia_kg_m2: f64,
    /// Rotor speed at full command and full battery.
    pub max_speed_rad_s: f64,
    /// Factor on the drag.
    pub drag_factor: f64,
    /// Offset of the centre of mass, body x and y.
    pub balance_m: [f64; 2],
}

/// An upright cylinder about the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover {
    /// Its lowest point above the floor, metres.
    pub bottom_m: f64,
    /// Metres.
    pub height_m: f64,
    /// Metres.
    pub radius_m: f64,
}

impl Shape {
    /// The upright cylinder that an airframe at this height of its centre (metres) and with this tilt (radians) just
    /// fits into: from its lowest rim to its highest, as wide as it reaches to the side it leans to.
    #[must_use]
    pub fn cover(&self, centre_m: f64, tilt_rad: f64) -> Cover {
        let (sin, cos) = (tilt_rad.sin().abs(), tilt_rad.cos().abs());
        let half = 0.5 * self.height_m;
        let rise = half * cos + self.radius_m * sin;
        // Of the rim's points x = r cos p cos t + h/2 sin t, y = r sin p the farthest from the centre lies on the side it
        // leans to while the lean is small, and beside it later, where it is as far as the rim is from the centre in space.
        let reach = if self.radius_m * sin < half * cos {
            self.radius_m * cos + half * sin
        } else {
            self.radius_m.hypot(half)
        };
        Cover { bottom_m: centre_m - rise, height_m: 2.0 * rise, radius_m: reach }
    }

    /// The airframe of a vehicle file as one flight finds it, and its pack.
    #[must_use]
    pub fn new(vehicle: &manifest::Vehicle, variation: &Variation) -> (Self, Pack) {
        let (body, motors, battery) = (&vehicle.body, &vehicle.motors, &vehicle.battery);
        let radius = f64::from(body.radius_m);
        let height = f64::from(body.height_m);
        let mass = f64::from(body.mass_kg) * variation.mass;
        let arm = f64::from(motors.arm_m);
        // As large as the guards on the one side and the neighbours on the other leave room for.
        let rotor = (radius - arm).min(0.68 * arm).max(0.02);
        let side = arm * std::f64::consts::FRAC_1_SQRT_2;
        let roll_inertia = INERTIA_SHARE * mass * radius * radius;
        let pack = Pack {
            cells: battery.cells,
            capacity_mah: f64::from(battery.capacity_mah),
            resistance_ohm: f64::from(battery.resistance_ohm),
            full_cell_v: f64::from(battery.full_cell_v),
        };
        let full_v = pack.full_cell_v * f64::from(pack.cells);
        let shape = Self {
            radius_m: radius,
            height_m: height,
            mass_kg: mass,
            inertia_kg_m2: Vector3::new(roll_inertia, roll_inertia, YAW_INERTIA * roll_inertia),
            foot_drop_m: 0.5 * height,
            rotor_rise_m: 0.2 * height,
            rotor_radius_m: rotor,
            max_thrust_n: variation.motors.map(|factor| factor * f64::from(motors.max_thrust_n)),
            max_power_w: f64::from(motors.max_current_a) * full_v,
            lag_s: f64::from(motors.lag_s),
            motor_place: [(-side, -side), (side, -side), (-side, side), (side, side)],
            reaction: [1.0, -1.0, -1.0, 1.0],
            rotor_inertia_kg_m2: ROTOR_INERTIA * (rotor / ROTOR_REFERENCE_M).powi(4),
            max_speed_rad_s: TIP_SPEED_M_S / rotor,
            drag_factor: variation.drag,
            balance_m: variation.balance_m,
        };
        (shape, pack)
    }

    /// Angular acceleration by thrust that does not pass through the centre of mass.
    pub(super) fn imbalance_rad_s2(&self, thrust_n: f64) -> Vector3<f64> {
        // Thrust acts at -balance from the centre of mass: r x F with F along z.
        Vector3::new(
            -self.balance_m[1] * thrust_n / self.inertia_kg_m2.x,
            self.balance_m[0] * thrust_n / self.inertia_kg_m2.y,
            0.0,
        )
    }
}
