//! Faults of one flight as time goes on.

use super::echoes::{Does, Memory, Spoilt};
use super::line::Way;
use super::{Direction, Fault, FaultError, FaultKind, LineFault, SonarFault};
use crate::acoustics::Echo;
use crate::vehicle::Wear;
use crate::world::World;
use crate::world::draw::stream;
use nalgebra::Vector3;
use rand::rngs::Xoshiro256PlusPlus;

/// Sonars that look farther up or down than this are no side sonars, radians (45 degrees).
const SIDE_RAD: f32 = std::f32::consts::FRAC_PI_4;

/// All that holds at one moment and lasts.
#[derive(Clone, Copy, Debug)]
pub(in crate::simulation) struct Effects {
    pub(in crate::simulation) compass_rad: f64,
    pub(in crate::simulation) wear: Wear,
    pub(in crate::simulation) motor_shares: [f64; 4],
    pub(in crate::simulation) wind: Option<Vector3<f64>>,
    pub(in crate::simulation) flow_silent: bool,
    pub(in crate::simulation) flow_contrast: f64,
}

impl Default for Effects {
    fn default() -> Self {
        Self {
            compass_rad: 0.0,
            wear: Wear::default(),
            motor_shares: [1.0; 4],
            wind: None,
            flow_silent: false,
            flow_contrast: 1.0,
        }
    }
}

/// Something that happens once, when a fault begins or ends.
#[derive(Clone, Debug)]
pub(in crate::simulation) enum Change {
    Turn { sensors: u32, angle_rad: f32 },
    Charge(f64),
    Reboot { seconds: f64 },
    Carry { metres: f64, direction_rad: f64 },
    Door { name: String, shut: bool },
    Enter { name: String, place: (f32, f32), m_s: f32, up_to_m: f32 },
    Leave { name: String },
}

/// The faults of one flight.
#[derive(Clone, Debug)]
pub(in crate::simulation) struct Faults {
    list: Vec<Fault>,
    spoilt: Vec<Option<Spoilt>>,
    on: Vec<bool>,
    /// When it took off.
    airborne_ns: Option<u64>,
    random: Xoshiro256PlusPlus,
    memory: Memory,
    sonars_now: Vec<Spoilt>,
    to_now: Vec<LineFault>,
    from_now: Vec<LineFault>,
    pub(in crate::simulation) to: Way,
    pub(in crate::simulation) from: Way,
}

/// Purpose of the random stream; those of the simulation are 101 and up.
const FAULTS: u64 = 120;

impl Faults {
    /// # Errors
    /// A sonar that the vehicle does not have, a door that the plan does not have.
    pub(in crate::simulation) fn new(
        list: &[Fault],
        vehicle: &manifest::Vehicle,
        world: &World,
        seed: u64,
    ) -> Result<Self, FaultError> {
        let names: Vec<&str> = vehicle.sonars.iter().map(|sonar| sonar.name.as_str()).collect();
        let mut spoilt = Vec::with_capacity(list.len());
        for fault in list {
            let unknown = |field, value: &str, known: &[&str]| FaultError::Range {
                kind: "with names".to_owned(),
                field,
                value: value.to_owned(),
                allowed: known.join(", "),
            };
            spoilt.push(match &fault.kind {
                FaultKind::Sonars { sonars, does } => {
                    let mut mask = 0;
                    for name in sonars {
                        mask |= sensors(vehicle, name).ok_or_else(|| unknown("sonars", name, &names))?;
                    }
                    let index = |name: &str| names.iter().position(|known| *known == name);
                    let missing = |does: &SonarFault| match does {
                        SonarFault::Crosstalk { hears } => unknown("hears", hears, &names),
                        _ => unknown("sonars", "?", &names),
                    };
                    let does = Does::new(does, index).ok_or_else(|| missing(does))?;
                    Some(Spoilt { sensors: mask, does })
                }
                FaultKind::DoorShuts { name } | FaultKind::DoorOpens { name } => {
                    let doors: Vec<&str> = world.doors().iter().map(|door| door.name.as_str()).collect();
                    if !doors.contains(&name.as_str()) {
                        return Err(unknown("name", name, &doors));
                    }
                    None
                }
                _ => None,
            });
        }
        Ok(Self {
            on: vec![false; list.len()],
            list: list.to_vec(),
            airborne_ns: None,
            random: stream(seed, FAULTS),
            memory: Memory::default(),
            sonars_now: Vec::with_capacity(spoilt.len()),
            to_now: Vec::with_capacity(spoilt.len()),
            from_now: Vec::with_capacity(spoilt.len()),
            spoilt,
            to: Way::default(),
            from: Way::default(),
        })
    }

    /// Lets the faults of this moment begin and end, and says what changed; `None` when nothing did.
    pub(in crate::simulation) fn advance(
        &mut self,
        now_ns: u64,
        airborne: bool,
        mut act: impl FnMut(Change),
    ) -> Option<Effects> {
        if self.airborne_ns.is_none() && airborne {
            self.airborne_ns = Some(now_ns);
        }
        let since_s = self.airborne_ns.map(|from| (now_ns - from) as f64 * 1e-9);
        let mut changed = false;
        for ((fault, on), spoilt) in self.list.iter().zip(&mut self.on).zip(&self.spoilt) {
            let now_on = fault.holds(since_s);
            if now_on != *on {
                *on = now_on;
                changed = true;
                if let Some(change) = change(fault, *spoilt, now_on) {
                    act(change);
                }
            }
        }
        changed.then(|| self.effects())
    }

    fn effects(&mut self) -> Effects {
        let mut all = Effects::default();
        self.sonars_now.clear();
        self.to_now.clear();
        self.from_now.clear();
        for ((fault, on), spoilt) in self.list.iter().zip(&self.on).zip(&self.spoilt) {
            if !on {
                continue;
            }
            self.sonars_now.extend(spoilt);
            match &fault.kind {
                FaultKind::CompassSwing { degrees } => all.compass_rad += degrees.to_radians(),
                FaultKind::BatterySag { ohm } => all.wear.extra_ohm += ohm,
                FaultKind::BatteryCell => all.wear.lost_cells += 1,
                FaultKind::MotorWeak { motor, share } => {
                    if let Some(left) = all.motor_shares.get_mut(*motor) {
                        *left *= 1.0 - share;
                    }
                }
                FaultKind::Gust { m_s2, degrees } => {
                    let (sin, cos) = degrees.to_radians().sin_cos();
                    let wind = Vector3::new(m_s2 * cos, m_s2 * sin, 0.0);
                    all.wind = Some(all.wind.unwrap_or_else(Vector3::zeros) + wind);
                }
                FaultKind::Serial { line, does } => {
                    if *line != Direction::From {
                        self.to_now.push(*does);
                    }
                    if *line != Direction::To {
                        self.from_now.push(*does);
                    }
                }
                FaultKind::FlowSilent => all.flow_silent = true,
                FaultKind::FlowPoor { share } => all.flow_contrast *= share,
                FaultKind::Sonars { .. }
                | FaultKind::BatteryCharge { .. }
                | FaultKind::ControllerReboot { .. }
                | FaultKind::CarriedOff { .. }
                | FaultKind::DoorShuts { .. }
                | FaultKind::DoorOpens { .. }
                | FaultKind::PersonComes { .. } => {}
            }
        }
        all
    }

    /// Spoils what a ping group has heard; answers the sensors that say nothing at all.
    pub(in crate::simulation) fn spoil(&mut self, echoes: &mut [Echo]) -> u32 {
        self.memory.spoil(echoes, &self.sonars_now, &mut self.random)
    }

    /// Bytes on their way to the controller; false when nothing happens to them, and none were taken.
    pub(in crate::simulation) fn send(&mut self, now_ns: u64, bytes: &[u8]) -> bool {
        let troubled = !self.to_now.is_empty() || !self.to.is_empty();
        if troubled {
            self.to.take(now_ns, bytes, &self.to_now, &mut self.random);
        }
        troubled
    }

    /// Whether bytes from the controller go through [`Self::hear`].
    pub(in crate::simulation) fn listens(&self) -> bool {
        !self.from_now.is_empty() || !self.from.is_empty()
    }

    /// Bytes that come from the controller.
    pub(in crate::simulation) fn hear(&mut self, now_ns: u64, bytes: &[u8]) {
        self.from.take(now_ns, bytes, &self.from_now, &mut self.random);
    }
}

/// What happens once when a fault begins (`on`) or ends.
fn change(fault: &Fault, spoilt: Option<Spoilt>, on: bool) -> Option<Change> {
    if let Some(Spoilt { sensors, does: Does::Turned(angle) }) = spoilt {
        return Some(Change::Turn { sensors, angle_rad: if on { angle } else { -angle } });
    }
    match &fault.kind {
        FaultKind::BatteryCharge { charge } if on => Some(Change::Charge(*charge)),
        FaultKind::ControllerReboot { seconds } if on => Some(Change::Reboot { seconds: *seconds }),
        FaultKind::CarriedOff { metres, degrees } if on => {
            Some(Change::Carry { metres: *metres, direction_rad: degrees.to_radians() })
        }
        FaultKind::DoorShuts { name } => Some(Change::Door { name: name.clone(), shut: on }),
        FaultKind::DoorOpens { name } => Some(Change::Door { name: name.clone(), shut: !on }),
        FaultKind::PersonComes { place, m_s, up_to_m } => {
            // Two who come are told apart by where from.
            let name = format!("visitor from {:.2} {:.2}", place.0, place.1);
            Some(if on {
                Change::Enter { name, place: *place, m_s: *m_s, up_to_m: *up_to_m }
            } else {
                Change::Leave { name }
            })
        }
        _ => None,
    }
}

/// The sensors of a name; `None` for a name that the vehicle does not have.
fn sensors(vehicle: &manifest::Vehicle, name: &str) -> Option<u32> {
    let mask = |wanted: &dyn Fn(&manifest::SonarMount) -> bool| {
        vehicle
            .sonars
            .iter()
            .enumerate()
            .filter(|(_, sonar)| wanted(sonar))
            .fold(0, |mask, (index, _)| mask | 1 << index)
    };
    let mask = match name {
        "all" => mask(&|_| true),
        "sides" => mask(&|sonar| sonar.elevation_rad.abs() < SIDE_RAD),
        _ => mask(&|sonar| sonar.name == name),
    };
    (mask != 0).then_some(mask)
}
