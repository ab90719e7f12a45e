//! Faults as they stand in configuration files: flat tables of a kind, its times and its few values.

use super::{Direction, Fault, FaultKind, LineFault, SonarFault};
use serde::Deserialize;
use thiserror::Error;

/// What is wrong with a fault.
#[derive(Debug, Error, PartialEq)]
pub enum FaultError {
    /// A value out of its range, or a name that there is not.
    #[error("fault {kind}: {field} is {value}; allowed: {allowed}")]
    Range {
        /// Kind of the fault.
        kind: String,
        /// The key.
        field: &'static str,
        /// What it says.
        value: String,
        /// What it may say.
        allowed: String,
    },
    /// A kind that there is not.
    #[error("fault kind {kind}; allowed: {allowed}")]
    Kind {
        /// What it says.
        kind: String,
        /// What it may say.
        allowed: String,
    },
    /// A key that this kind needs.
    #[error("fault {kind}: {field} is missing")]
    Missing {
        /// Kind of the fault.
        kind: String,
        /// The key.
        field: &'static str,
    },
    /// A key that this kind does not have.
    #[error("fault {kind}: it has no {field}")]
    Stray {
        /// Kind of the fault.
        kind: String,
        /// The key.
        field: &'static str,
    },
}

/// Every key that a fault may have. Which ones it must have is its kind's affair.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Entry {
    kind: String,
    from_s: Option<f64>,
    until_s: Option<f64>,
    sonars: Option<Vec<String>>,
    hears: Option<String>,
    line: Option<String>,
    motor: Option<String>,
    name: Option<String>,
    share: Option<f64>,
    metres: Option<f64>,
    degrees: Option<f64>,
    seconds: Option<f64>,
    ohm: Option<f64>,
    charge: Option<f64>,
    m_s2: Option<f64>,
    m_s: Option<f64>,
    x_m: Option<f64>,
    y_m: Option<f64>,
    up_to_m: Option<f64>,
}

/// Motors in the order of the commands.
const MOTORS: [&str; 4] = ["rear-right", "front-right", "rear-left", "front-left"];
const KINDS: [&str; 25] = [
    "sonar-dead",
    "sonar-deaf",
    "sonar-stuck",
    "sonar-spikes",
    "sonar-crosstalk",
    "sonar-taped",
    "sonar-turned",
    "compass-swing",
    "battery-sag",
    "battery-charge",
    "battery-cell",
    "motor-weak",
    "gust",
    "controller-reboot",
    "serial-flipped",
    "serial-lost",
    "serial-doubled",
    "serial-delayed",
    "serial-silent",
    "flow-silent",
    "flow-poor",
    "carried-off",
    "door-shuts",
    "door-opens",
    "person-comes",
];
/// A flight is over long before.
const LONGEST_S: f64 = 3600.0;
/// Ranges that a sonar can say, metres.
const RANGE_M: (f64, f64) = (0.02, 4.0);

impl TryFrom<Entry> for Fault {
    type Error = FaultError;

    fn try_from(mut entry: Entry) -> Result<Self, FaultError> {
        let from_s = entry.optional("from_s", |e| &mut e.from_s, 0.0, LONGEST_S)?;
        let until_s = entry.optional("until_s", |e| &mut e.until_s, from_s.unwrap_or(0.0), LONGEST_S)?;
        let kind = entry.kind()?;
        entry.nothing_left()?;
        Ok(Self { from_s, until_s, kind })
    }
}

impl Entry {
    fn kind(&mut self) -> Result<FaultKind, FaultError> {
        Ok(match self.kind.as_str() {
            "sonar-dead" => self.sonars(SonarFault::Dead)?,
            "sonar-deaf" => self.sonars(SonarFault::Deaf)?,
            "sonar-stuck" => {
                let metres = self.optional("metres", |e| &mut e.metres, RANGE_M.0, RANGE_M.1)?;
                self.sonars(SonarFault::Stuck { metres })?
            }
            "sonar-spikes" => {
                let share = self.share()?;
                self.sonars(SonarFault::Spikes { share })?
            }
            "sonar-crosstalk" => {
                let hears = self.word("hears", |e| &mut e.hears)?;
                self.sonars(SonarFault::Crosstalk { hears })?
            }
            "sonar-taped" => self.sonars(SonarFault::Taped)?,
            "sonar-turned" => {
                let degrees = self.degrees()?;
                self.sonars(SonarFault::Turned { degrees })?
            }
            "compass-swing" => FaultKind::CompassSwing { degrees: self.degrees()? },
            "battery-sag" => FaultKind::BatterySag { ohm: self.number("ohm", |e| &mut e.ohm, 0.0, 0.5)? },
            "battery-charge" => {
                FaultKind::BatteryCharge { charge: self.number("charge", |e| &mut e.charge, 0.0, 1.0)? }
            }
            "battery-cell" => FaultKind::BatteryCell,
            "motor-weak" => {
                let name = self.word("motor", |e| &mut e.motor)?;
                let motor = MOTORS.iter().position(|known| *known == name);
                let motor = motor.ok_or_else(|| self.range("motor", &name, MOTORS.join(", ")))?;
                FaultKind::MotorWeak { motor, share: self.share()? }
            }
            "gust" => FaultKind::Gust {
                m_s2: self.number("m_s2", |e| &mut e.m_s2, 0.0, 5.0)?,
                degrees: self.degrees()?,
            },
            "controller-reboot" => FaultKind::ControllerReboot {
                seconds: self.number("seconds", |e| &mut e.seconds, 0.1, 60.0)?,
            },
            "serial-flipped" => {
                let share = self.share()?;
                self.serial(LineFault::Flipped { share })?
            }
            "serial-lost" => {
                let share = self.share()?;
                self.serial(LineFault::Lost { share })?
            }
            "serial-doubled" => {
                let share = self.share()?;
                self.serial(LineFault::Doubled { share })?
            }
            "serial-delayed" => {
                let seconds = self.number("seconds", |e| &mut e.seconds, 0.001, 5.0)?;
                self.serial(LineFault::Delayed { seconds })?
            }
            "serial-silent" => self.serial(LineFault::Silent)?,
            "flow-silent" => FaultKind::FlowSilent,
            "flow-poor" => FaultKind::FlowPoor { share: self.share()? },
            "carried-off" => FaultKind::CarriedOff {
                metres: self.number("metres", |e| &mut e.metres, 0.05, 20.0)?,
                degrees: self.degrees()?,
            },
            "door-shuts" => FaultKind::DoorShuts { name: self.word("name", |e| &mut e.name)? },
            "door-opens" => FaultKind::DoorOpens { name: self.word("name", |e| &mut e.name)? },
            "person-comes" => {
                let x = self.number("x_m", |e| &mut e.x_m, -1000.0, 1000.0)?;
                let y = self.number("y_m", |e| &mut e.y_m, -1000.0, 1000.0)?;
                let up_to_m = self.number("up_to_m", |e| &mut e.up_to_m, 0.3, 3.0)?;
                FaultKind::PersonComes {
                    place: (x as f32, y as f32),
                    m_s: self.number("m_s", |e| &mut e.m_s, 0.1, 2.0)? as f32,
                    up_to_m: up_to_m as f32,
                }
            }
            _ => {
                return Err(FaultError::Kind { kind: self.kind.clone(), allowed: KINDS.join(", ") });
            }
        })
    }

    fn sonars(&mut self, does: SonarFault) -> Result<FaultKind, FaultError> {
        let sonars = self.sonars.take().ok_or_else(|| self.missing("sonars"))?;
        if sonars.is_empty() {
            return Err(self.range("sonars", "empty", "names of sonars, all, sides".to_owned()));
        }
        Ok(FaultKind::Sonars { sonars, does })
    }

    fn serial(&mut self, does: LineFault) -> Result<FaultKind, FaultError> {
        let word = self.word("line", |e| &mut e.line)?;
        let line = match word.as_str() {
            "to" => Direction::To,
            "from" => Direction::From,
            "both" => Direction::Both,
            _ => return Err(self.range("line", &word, "to, from, both".to_owned())),
        };
        Ok(FaultKind::Serial { line, does })
    }

    fn share(&mut self) -> Result<f64, FaultError> {
        self.number("share", |e| &mut e.share, 0.0, 1.0)
    }

    fn degrees(&mut self) -> Result<f64, FaultError> {
        self.number("degrees", |e| &mut e.degrees, -360.0, 360.0)
    }

    fn word(
        &mut self,
        field: &'static str,
        key: impl Fn(&mut Self) -> &mut Option<String>,
    ) -> Result<String, FaultError> {
        key(self).take().ok_or_else(|| self.missing(field))
    }

    fn number(
        &mut self,
        field: &'static str,
        key: impl Fn(&mut Self) -> &mut Option<f64>,
        low: f64,
        high: f64,
    ) -> Result<f64, FaultError> {
        self.optional(field, key, low, high)?.ok_or_else(|| self.missing(field))
    }

    fn optional(
        &mut self,
        field: &'static str,
        key: impl Fn(&mut Self) -> &mut Option<f64>,
        low: f64,
        high: f64,
    ) -> Result<Option<f64>, FaultError> {
        match key(self).take() {
            // NaN is in no range.
            Some(value) if !(low..=high).contains(&value) => {
                Err(self.range(field, &value.to_string(), format!("{low}..={high}")))
            }
            value => Ok(value),
        }
    }

    /// What a kind has taken is gone: the rest does not belong to it.
    fn nothing_left(&self) -> Result<(), FaultError> {
        let left = [
            ("sonars", self.sonars.is_some()),
            ("hears", self.hears.is_some()),
            ("line", self.line.is_some()),
            ("motor", self.motor.is_some()),
            ("name", self.name.is_some()),
            ("share", self.share.is_some()),
            ("metres", self.metres.is_some()),
            ("degrees", self.degrees.is_some()),
            ("seconds", self.seconds.is_some()),
            ("ohm", self.ohm.is_some()),
            ("charge", self.charge.is_some()),
            ("m_s2", self.m_s2.is_some()),
            ("m_s", self.m_s.is_some()),
            ("x_m", self.x_m.is_some()),
            ("y_m", self.y_m.is_some()),
            ("up_to_m", self.up_to_m.is_some()),
        ];
        match left.iter().find(|(_, given)| *given) {
            Some(&(field, _)) => Err(FaultError::Stray { kind: self.kind.clone(), field }),
            None => Ok(()),
        }
    }

    fn missing(&self, field: &'static str) -> FaultError {
        FaultError::Missing { kind: self.kind.clone(), field }
    }

    fn range(&self, field: &'static str, value: &str, allowed: String) -> FaultError {
        FaultError::Range { kind: self.kind.clone(), field, value: value.to_owned(), allowed }
    }
}
