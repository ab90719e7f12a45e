//! What the simulator may be told.

use airframe::camera::Light;
use airframe::controller::{FailsafeSettings, Firmware};
use airframe::radio::SafetyPilot;
use airframe::simulation::faults::Fault;
use airframe::simulation::{Options, StartPlace};
use airframe::world::ClutterLevel;
use runtime::{ConfigError, Validate, within};

/// The simulator's configuration file.
#[derive(Clone, Debug, PartialEq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// What the plan does not show: `none`, `light` or `full`.
    pub clutter: String,
    /// Where the drone stands at first: `pad` or `room` (anywhere, any heading).
    pub start: String,
    /// Which firmware the flight controller plays: a name of [`Firmware`].
    pub firmware: String,
    /// Whether the flight controller has a magnetometer; without, its heading drifts with the gyro.
    pub magnetometer: bool,
    /// Its receiver: `msp`, or `radio` (a safety pilot with a radio, for the `override` profile of `flight`).
    pub receiver: String,
    /// Seconds after which the safety pilot takes the sticks back that he lent, whatever he sees; 0: never.
    pub take_back_s: f64,
    /// How its failsafe is set: `factory` (the aircraft falls) or `level-descent` (FACTS 1, mitigation).
    pub failsafe: String,
    /// Share of the battery's charge at the start.
    pub charge: f64,
    /// Names of sonars that never answer.
    pub dead_sonars: Vec<String>,
    /// Once in flight the drone is suddenly so far from where it was, metres, and nothing on board has felt it; 0: never.
    pub displaced_m: f64,
    /// What the camera sees by, and what is drawn over its picture.
    pub camera: CameraConfig,
    /// What breaks in flight, and when; kinds and keys: [`Fault`].
    pub faults: Vec<Fault>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            clutter: "full".to_owned(),
            start: "pad".to_owned(),
            firmware: Firmware::default().name().to_owned(),
            magnetometer: true,
            receiver: MSP.to_owned(),
            take_back_s: 0.0,
            failsafe: "factory".to_owned(),
            charge: 1.0,
            dead_sonars: Vec::new(),
            displaced_m: 0.0,
            camera: CameraConfig::default(),
            faults: Vec::new(),
        }
    }
}

/// The simulated camera.
#[derive(Clone, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraConfig {
    /// `day` (the lamps of the building) or `night` (the drone's infra-red ring).
    pub light: String,
    /// Whether the time of capture is drawn into the corner of the picture, as a code that survives encoding.
    pub bar_code: bool,
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self { light: DAY.to_owned(), bar_code: false }
    }
}

impl CameraConfig {
    pub(crate) fn is_night(&self) -> bool {
        self.light == NIGHT
    }

    pub(crate) fn light(&self) -> Light {
        if self.is_night() { Light::Night } else { Light::Day }
    }
}

const DAY: &str = "day";
const NIGHT: &str = "night";

impl Validate for Config {
    fn validate(&self) -> Result<(), ConfigError> {
        if ClutterLevel::from_word(&self.clutter).is_none() {
            return Err(ConfigError::range("clutter", &self.clutter, "none, light, full"));
        }
        if start_place(&self.start).is_none() {
            return Err(ConfigError::range("start", &self.start, "pad, room"));
        }
        if Firmware::by_name(&self.firmware).is_none() {
            return Err(ConfigError::range("firmware", &self.firmware, Firmware::names()));
        }
        if !RECEIVERS.contains(&self.receiver.as_str()) {
            return Err(ConfigError::range("receiver", &self.receiver, RECEIVERS.join(", ")));
        }
        // Longer than any battery lasts.
        within("take_back_s", self.take_back_s, 0.0..=3600.0)?;
        if !FAILSAFES.contains(&self.failsafe.as_str()) {
            return Err(ConfigError::range("failsafe", &self.failsafe, FAILSAFES.join(", ")));
        }
        if ![DAY, NIGHT].contains(&self.camera.light.as_str()) {
            return Err(ConfigError::range("camera.light", &self.camera.light, "day, night"));
        }
        within("displaced_m", self.displaced_m, 0.0..=20.0)?;
        within("charge", self.charge, 0.05..=1.0)
    }
}

const MSP: &str = "msp";
const RADIO: &str = "radio";
const RECEIVERS: [&str; 2] = [MSP, RADIO];
const FACTORY: &str = "factory";
const LEVEL_DESCENT: &str = "level-descent";
const FAILSAFES: [&str; 2] = [FACTORY, LEVEL_DESCENT];
/// The failsafe throttle under the hover throttle: sinks at a few tenths of a metre a second.
const UNDER_HOVER_US: f32 = 25.0;

fn start_place(word: &str) -> Option<StartPlace> {
    match word {
        "pad" => Some(StartPlace::Pad),
        "room" => Some(StartPlace::Room),
        _ => None,
    }
}

impl Config {
    pub(crate) fn clutter(&self) -> ClutterLevel {
        ClutterLevel::from_word(&self.clutter).unwrap_or(ClutterLevel::Full)
    }

    /// What `airframe` is told. A sonar name that the vehicle does not have is refused.
    pub(crate) fn options(&self, vehicle: &manifest::Vehicle, seed: u64) -> Result<Options, ConfigError> {
        let mut dead_sonars = 0;
        for name in &self.dead_sonars {
            let names = || vehicle.sonars.iter().map(|sonar| sonar.name.as_str());
            let index = names().position(|known| known == name).ok_or_else(|| {
                ConfigError::range("dead_sonars", name, names().collect::<Vec<_>>().join(", "))
            })?;
            dead_sonars |= 1 << index;
        }
        let firmware = Firmware::by_name(&self.firmware).unwrap_or_default();
        let failsafe = if self.failsafe == LEVEL_DESCENT {
            let low_us = f32::from(firmware.personality().low_throttle_us);
            FailsafeSettings::level_descent((hover_us(vehicle, low_us) - UNDER_HOVER_US) as u16)
        } else {
            FailsafeSettings::factory(firmware)
        };
        Ok(Options {
            clutter: self.clutter(),
            seed,
            firmware,
            magnetometer: self.magnetometer,
            radio: (self.receiver == RADIO)
                .then(|| SafetyPilot::new(Some(self.take_back_s).filter(|wait_s| *wait_s > 0.0))),
            failsafe,
            start: start_place(&self.start).unwrap_or_default(),
            charge: self.charge,
            dead_sonars,
            displaced_m: self.displaced_m,
        })
    }
}

/// Hover throttle on a half-full battery by the vehicle file: what an installer would find out.
/// `low_us`: where the firmware's throttle begins.
fn hover_us(vehicle: &manifest::Vehicle, low_us: f32) -> f32 {
    const HALF_FULL: f32 = 0.92;
    let idle = vehicle.motors.idle_fraction;
    let command = vehicle.hover_fraction().sqrt() / HALF_FULL;
    low_us + (2000.0 - low_us) * ((command - idle) / (1.0 - idle)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_nonsense_is_refused_by_name() {
        assert_eq!(Config::default().validate(), Ok(()));
        for (config, word) in [
            (Config { clutter: "some".into(), ..Config::default() }, "clutter"),
            (Config { start: "roof".into(), ..Config::default() }, "start"),
            (Config { firmware: "inav".into(), ..Config::default() }, "firmware"),
            (Config { receiver: "telepathy".into(), ..Config::default() }, "receiver"),
            (Config { take_back_s: -1.0, ..Config::default() }, "take_back_s"),
            (Config { failsafe: "hope".into(), ..Config::default() }, "failsafe"),
            (
                Config {
                    camera: CameraConfig { light: "dusk".into(), ..CameraConfig::default() },
                    ..Config::default()
                },
                "camera.light",
            ),
            (Config { displaced_m: -1.0, ..Config::default() }, "displaced_m"),
            (Config { charge: f64::NAN, ..Config::default() }, "charge"),
        ] {
            let error = config.validate().unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("allowed"), "{error}");
        }
    }
    #[test]
    fn a_fault_with_a_wrong_key_or_value_is_refused_with_its_file() {
        let parse = |text: &str| runtime::parse_config::<Config>("simulator.toml", text);
        let good = "[[faults]]\nkind = \"sonar-dead\"\nsonars = [\"down\"]\nfrom_s = 8\nuntil_s = 9\n";
        assert_eq!(parse(good).unwrap().faults.len(), 1);
        for (text, word) in [
            (good.replace("until_s", "till_s"), "till_s"),
            (good.replace("until_s = 9", "until_s = 7"), "until_s is 7; allowed: 8..="),
            (good.replace("sonar-dead", "sonar-sleepy"), "sonar-sleepy"),
        ] {
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.contains(word) && error.contains("simulator.toml"), "{error}");
        }
    }
}
