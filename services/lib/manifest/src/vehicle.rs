//! What is flown: body, motors, battery, limits and where the sonars look.

use crate::error::{VehicleError, line_of, one_line};
use serde::Deserialize;
use std::f32::consts::FRAC_PI_2;

/// Standard gravity, m/s2.
const GRAVITY: f32 = 9.806_65;
/// Two sonars closer than this see the same wall: a third of the cone's half-angle (FACTS 2).
const LEAST_APART_DEG: f32 = 5.0;

/// The cylinder that must not touch anything, propellers included.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Radius over the propeller guards, metres.
    pub radius_m: f32,
    /// Height from skids to top, metres.
    pub height_m: f32,
    /// Take-off mass, kilograms.
    pub mass_kg: f32,
}

/// Four equal motors with propellers.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motors {
    /// Thrust of each at full command and full battery, newtons.
    pub max_thrust_n: f32,
    /// First-order lag of thrust behind the command, seconds.
    #[serde(default = "default_lag")]
    pub lag_s: f32,
    /// Command of an armed idle motor as a fraction of full.
    #[serde(default = "default_idle")]
    pub idle_fraction: f32,
    /// Distance of a motor from the centre, metres.
    #[serde(default = "default_arm")]
    pub arm_m: f32,
    /// Current of each at full thrust, amperes.
    #[serde(default = "default_current")]
    pub max_current_a: f32,
    /// Factor on the firmware's default PID numbers: what whoever built it has tuned its flight controller to. For the
    /// simulator; a real controller knows its own.
    #[serde(default = "default_pid_scale")]
    pub pid_scale: f32,
}

fn default_lag() -> f32 {
    0.05
}
fn default_idle() -> f32 {
    0.055
}
fn default_arm() -> f32 {
    0.11
}
fn default_current() -> f32 {
    12.0
}
fn default_pid_scale() -> f32 {
    1.0
}

/// The battery.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// Cells in series.
    pub cells: u32,
    /// Capacity, milliampere hours.
    pub capacity_mah: f32,
    /// Internal resistance of the whole pack, ohms.
    pub resistance_ohm: f32,
    /// Voltage of a full cell at rest.
    #[serde(default = "default_full")]
    pub full_cell_v: f32,
    /// Voltage of an empty cell at rest.
    #[serde(default = "default_empty")]
    pub empty_cell_v: f32,
}

fn default_full() -> f32 {
    4.2
}
fn default_empty() -> f32 {
    3.3
}

/// What the pilot may ask of this body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Speed in the open, m/s.
    pub cruise_m_s: f32,
    /// Largest commanded tilt, radians (degrees in the file).
    pub max_tilt_rad: f32,
    /// Largest climb, m/s.
    pub climb_m_s: f32,
    /// Largest descent, m/s.
    pub descend_m_s: f32,
    /// Height above the floor at which this vehicle is flown, metres: goes before what the configurations of pilot and
    /// navigation say. `None`: they decide.
    pub height_m: Option<f32>,
}

/// A down-looking optical flow sensor with its own range finder (MSP v2 0x1F02 and 0x1F01, FACTS 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowSensor {
    /// Frames a second.
    pub rate_hz: f32,
    /// Angle that one count stands for, radians (degrees in the file).
    pub count_rad: f32,
    /// Mounting angle about the body's z axis, counter-clockwise, radians (degrees in the file).
    pub yaw_rad: f32,
    /// Height over ground below which it sees nothing, metres.
    pub min_height_m: f32,
    /// Height over ground beyond which it sees nothing, metres.
    pub max_height_m: f32,
}

/// Where the camera sits and looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMount {
    /// Position forward of the centre of mass, metres.
    pub x_m: f32,
    /// Position left of the centre of mass, metres.
    pub y_m: f32,
    /// Position above the centre of mass, metres.
    pub z_m: f32,
    /// Direction above the body's plane, radians (degrees in the file).
    pub elevation_rad: f32,
    /// Angle from the left to the right edge of its picture, radians (degrees in the file).
    pub field_of_view_rad: f32,
}

/// Where a sonar sits and looks.
#[derive(Debug, Clone, PartialEq)]
pub struct SonarMount {
    /// Name, as shown to people.
    pub name: String,
    /// Direction in the body's plane, counter-clockwise from forward, radians (degrees in the file).
    pub bearing_rad: f32,
    /// Direction above the body's plane, -90 degrees is down, radians (degrees in the file).
    pub elevation_rad: f32,
    /// Position forward of the centre, metres.
    pub x_m: f32,
    /// Position left of the centre, metres.
    pub y_m: f32,
    /// Position above the centre, metres.
    pub z_m: f32,
    /// Sonars of one group are fired together.
    pub group: u32,
    /// Blind below this range, metres.
    pub min_range_m: f32,
    /// Silent beyond this range, metres.
    pub max_range_m: f32,
}

impl SonarMount {
    /// Looks down within 30 degrees: serves height, not position.
    #[must_use]
    pub fn looks_down(&self) -> bool {
        self.elevation_rad < -FRAC_PI_2 * 2.0 / 3.0
    }

    /// Unit vector of its axis, body frame.
    #[must_use]
    pub fn axis(&self) -> [f32; 3] {
        let (sin_e, cos_e) = self.elevation_rad.sin_cos();
        let (sin_b, cos_b) = self.bearing_rad.sin_cos();
        [cos_e * cos_b, cos_e * sin_b, sin_e]
    }
}

/// A vehicle that can be flown.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    /// Name.
    pub name: String,
    /// The cylinder that must not touch anything.
    pub body: Body,
    /// Four equal motors.
    pub motors: Motors,
    /// The battery.
    pub battery: Battery,
    /// What the pilot may ask for.
    pub limits: Limits,
    /// Absent on a vehicle without one.
    pub flow: Option<FlowSensor>,
    /// Absent on a vehicle without one.
    pub camera: Option<CameraMount>,
    /// All sonars, in the order of the file: the index is the sensor's number in messages.
    pub sonars: Vec<SonarMount>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawVehicle {
    name: String,
    body: Body,
    motors: Motors,
    battery: Battery,
    limits: RawLimits,
    flow: Option<RawFlow>,
    camera: Option<RawCamera>,
    #[serde(default)]
    sonar: Vec<RawSonar>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLimits {
    cruise_m_s: f32,
    max_tilt_deg: f32,
    climb_m_s: f32,
    descend_m_s: f32,
    height_m: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawFlow {
    rate_hz: f32,
    count_deg: f32,
    yaw_deg: f32,
    min_height_m: f32,
    max_height_m: f32,
}

impl Default for RawFlow {
    /// PMW3901 class: 35 pixels over 42 degrees, one count a tenth of a pixel or so; 8 cm to 4 m with the
    /// small laser range finder that these boards carry.
    fn default() -> Self {
        Self { rate_hz: 25.0, count_deg: 0.12, yaw_deg: 0.0, min_height_m: 0.08, max_height_m: 4.0 }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawCamera {
    x_m: f32,
    y_m: f32,
    z_m: f32,
    elevation_deg: f32,
    field_of_view_deg: f32,
}

impl Default for RawCamera {
    /// Raspberry Pi camera module 2 (the thesis's NoIR is one): 62.2 degrees across, by its data sheet.
    fn default() -> Self {
        Self { x_m: 0.0, y_m: 0.0, z_m: 0.0, elevation_deg: 0.0, field_of_view_deg: 62.2 }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSonar {
    name: String,
    bearing_deg: f32,
    #[serde(default)]
    elevation_deg: f32,
    #[serde(default)]
    x_m: f32,
    #[serde(default)]
    y_m: f32,
    #[serde(default)]
    z_m: f32,
    group: u32,
    #[serde(default = "default_min_range")]
    min_range_m: f32,
    #[serde(default = "default_max_range")]
    max_range_m: f32,
}

// HC-SR04 class (FACTS 2).
fn default_min_range() -> f32 {
    0.02
}
fn default_max_range() -> f32 {
    4.0
}

impl Vehicle {
    /// Reads a vehicle file (TOML, angles in degrees) and checks that it can be flown.
    ///
    /// # Errors
    /// What is not TOML, unknown, missing, absurd, or cannot hold its height or find its place.
    pub fn parse(file: &str, text: &str) -> Result<Self, VehicleError> {
        let raw: RawVehicle = toml::from_str(text).map_err(|e| VehicleError::Syntax {
            file: file.to_owned(),
            line: line_of(text, e.span()),
            message: one_line(e.message()),
        })?;
        let check = Check { file };
        check.numbers(&raw)?;
        let vehicle = raw.into_vehicle();
        check.fits(&vehicle)?;
        Ok(vehicle)
    }

    /// The sonar that serves height: the one nearest to straight down.
    #[must_use]
    pub fn down_sonar(&self) -> Option<usize> {
        let down = self.sonars.iter().enumerate().filter(|(_, s)| s.looks_down());
        down.min_by(|a, b| a.1.elevation_rad.total_cmp(&b.1.elevation_rad)).map(|(i, _)| i)
    }

    /// Weight over the thrust of four motors: the fraction of full thrust that hovers.
    #[must_use]
    pub fn hover_fraction(&self) -> f32 {
        self.body.mass_kg * GRAVITY / (4.0 * self.motors.max_thrust_n)
    }
}

impl RawVehicle {
    fn into_vehicle(self) -> Vehicle {
        let sonars = self.sonar.into_iter().map(|s| SonarMount {
            name: s.name,
            bearing_rad: s.bearing_deg.to_radians(),
            elevation_rad: s.elevation_deg.to_radians(),
            x_m: s.x_m,
            y_m: s.y_m,
            z_m: s.z_m,
            group: s.group,
            min_range_m: s.min_range_m,
            max_range_m: s.max_range_m,
        });
        Vehicle {
            name: self.name,
            body: self.body,
            motors: self.motors,
            battery: self.battery,
            limits: Limits {
                cruise_m_s: self.limits.cruise_m_s,
                max_tilt_rad: self.limits.max_tilt_deg.to_radians(),
                climb_m_s: self.limits.climb_m_s,
                descend_m_s: self.limits.descend_m_s,
                height_m: self.limits.height_m,
            },
            flow: self.flow.map(|f| FlowSensor {
                rate_hz: f.rate_hz,
                count_rad: f.count_deg.to_radians(),
                yaw_rad: f.yaw_deg.to_radians(),
                min_height_m: f.min_height_m,
                max_height_m: f.max_height_m,
            }),
            camera: self.camera.map(|c| CameraMount {
                x_m: c.x_m,
                y_m: c.y_m,
                z_m: c.z_m,
                elevation_rad: c.elevation_deg.to_radians(),
                field_of_view_rad: c.field_of_view_deg.to_radians(),
            }),
            sonars: sonars.collect(),
        }
    }
}

struct Check<'a> {
    file: &'a str,
}

impl Check<'_> {
    fn within(&self, field: &str, value: f32, least: f32, most: f32) -> Result<(), VehicleError> {
        if (least..=most).contains(&value) {
            return Ok(());
        }
        Err(VehicleError::Range {
            file: self.file.to_owned(),
            field: field.to_owned(),
            value: value.to_string(),
            allowed: format!("{least} to {most}"),
        })
    }

    /// What the page and the messages can show.
    fn name(&self, field: &str, name: &str) -> Result<(), VehicleError> {
        if (1..=32).contains(&name.len()) && !name.chars().any(char::is_control) {
            return Ok(());
        }
        Err(VehicleError::Range {
            file: self.file.to_owned(),
            field: field.to_owned(),
            value: format!("{name:?}"),
            allowed: "1 to 32 bytes of text".to_owned(),
        })
    }

    /// Ranges of single values: from the smallest machine that carries a Pi indoors to the largest that fits
    /// through a 0.9 m door.
    fn numbers(&self, v: &RawVehicle) -> Result<(), VehicleError> {
        self.name("name", &v.name)?;
        self.within("body.radius_m", v.body.radius_m, 0.05, 0.6)?;
        self.within("body.height_m", v.body.height_m, 0.03, 0.6)?;
        self.within("body.mass_kg", v.body.mass_kg, 0.1, 5.0)?;
        self.within("motors.max_thrust_n", v.motors.max_thrust_n, 0.3, 50.0)?;
        self.within("motors.lag_s", v.motors.lag_s, 0.005, 0.3)?;
        self.within("motors.idle_fraction", v.motors.idle_fraction, 0.0, 0.2)?;
        self.within("motors.pid_scale", v.motors.pid_scale, 0.3, 4.0)?;
        self.within("motors.arm_m", v.motors.arm_m, 0.03, v.body.radius_m)?;
        self.within("motors.max_current_a", v.motors.max_current_a, 1.0, 60.0)?;
        self.within("battery.cells", v.battery.cells as f32, 1.0, 8.0)?;
        self.within("battery.capacity_mah", v.battery.capacity_mah, 200.0, 20_000.0)?;
        self.within("battery.resistance_ohm", v.battery.resistance_ohm, 0.0, 0.5)?;
        self.within("battery.full_cell_v", v.battery.full_cell_v, 3.4, 4.4)?;
        self.within("battery.empty_cell_v", v.battery.empty_cell_v, 2.5, v.battery.full_cell_v - 0.1)?;
        self.within("limits.cruise_m_s", v.limits.cruise_m_s, 0.1, 2.0)?;
        self.within("limits.max_tilt_deg", v.limits.max_tilt_deg, 3.0, 25.0)?;
        self.within("limits.climb_m_s", v.limits.climb_m_s, 0.1, 1.5)?;
        // Touching the floor faster than 0.7 m/s counts as a contact.
        self.within("limits.descend_m_s", v.limits.descend_m_s, 0.1, 0.7)?;
        if let Some(height_m) = v.limits.height_m {
            // What navigation's own setting allows; the pilot's ceiling is checked where it is known.
            self.within("limits.height_m", height_m, 0.5, 2.5)?;
        }
        if let Some(flow) = &v.flow {
            self.within("flow.rate_hz", flow.rate_hz, 5.0, 200.0)?;
            self.within("flow.count_deg", flow.count_deg, 0.001, 5.0)?;
            self.within("flow.yaw_deg", flow.yaw_deg, -360.0, 360.0)?;
            self.within("flow.min_height_m", flow.min_height_m, 0.0, 0.5)?;
            self.within("flow.max_height_m", flow.max_height_m, 1.0, 10.0)?;
        }
        if let Some(camera) = &v.camera {
            self.within("camera.x_m", camera.x_m, -v.body.radius_m, v.body.radius_m)?;
            self.within("camera.y_m", camera.y_m, -v.body.radius_m, v.body.radius_m)?;
            self.within("camera.z_m", camera.z_m, -v.body.height_m, v.body.height_m)?;
            self.within("camera.elevation_deg", camera.elevation_deg, -90.0, 90.0)?;
            // From a long lens to as wide as a flat picture can show without the corners running away.
            self.within("camera.field_of_view_deg", camera.field_of_view_deg, 20.0, 120.0)?;
        }
        if v.sonar.len() > 16 {
            // The messages carry at most this many readings.
            self.within("sonar (how many)", v.sonar.len() as f32, 1.0, 16.0)?;
        }
        for s in &v.sonar {
            self.name("sonar.name", &s.name)?;
            let field = |what: &str| format!("sonar {}: {what}", s.name);
            self.within(&field("bearing_deg"), s.bearing_deg, -360.0, 360.0)?;
            self.within(&field("elevation_deg"), s.elevation_deg, -90.0, 90.0)?;
            self.within(&field("x_m"), s.x_m, -v.body.radius_m, v.body.radius_m)?;
            self.within(&field("y_m"), s.y_m, -v.body.radius_m, v.body.radius_m)?;
            self.within(&field("z_m"), s.z_m, -v.body.height_m, v.body.height_m)?;
            self.within(&field("group"), s.group as f32, 0.0, 15.0)?;
            self.within(&field("min_range_m"), s.min_range_m, 0.0, 0.5)?;
            self.within(&field("max_range_m"), s.max_range_m, 1.0, 10.0)?;
        }
        Ok(())
    }

    /// Whether the parts make a vehicle.
    fn fits(&self, v: &Vehicle) -> Result<(), VehicleError> {
        let file = || self.file.to_owned();
        let ratio = 1.0 / v.hover_fraction();
        if ratio < 1.5 {
            return Err(VehicleError::TooHeavy { file: file(), ratio: format!("{ratio:.2}") });
        }
        for (i, b) in v.sonars.iter().enumerate() {
            for a in &v.sonars[..i] {
                if a.name == b.name {
                    return Err(VehicleError::SameName { file: file(), name: a.name.clone() });
                }
                let cosine: f32 = a.axis().iter().zip(b.axis()).map(|(p, q)| p * q).sum();
                let apart = cosine.clamp(-1.0, 1.0).acos().to_degrees();
                if apart < LEAST_APART_DEG {
                    return Err(VehicleError::SameDirection {
                        file: file(),
                        first: a.name.clone(),
                        second: b.name.clone(),
                        degrees: apart.round() as u32,
                    });
                }
            }
        }
        if v.down_sonar().is_none() {
            return Err(VehicleError::NoDownSonar { file: file() });
        }
        let around = v.sonars.iter().filter(|s| s.elevation_rad.abs() < FRAC_PI_2 / 3.0).count();
        if around < 3 {
            return Err(VehicleError::TooFewSonars { file: file(), count: around });
        }
        Ok(())
    }
}
