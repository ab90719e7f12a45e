//! `flight` on the simulator's virtual flight controller: an airframe in an empty room, bytes over a line of 115200 baud, a
//! pilot that knows the truth and, where there is a radio, a human who reads what `flight` says.
#![allow(dead_code, clippy::unwrap_used, reason = "tests; each file uses a part")]

use airframe::controller::{FailsafeSettings, Firmware};
use airframe::radio::SafetyPilot;
use airframe::simulation::{Options, Simulation};
use airframe::world::{ClutterLevel, WorldFile};
use control::stick;
use flight::{Config, Core, Profile};
use floorplan::{Plan, Sidecar};
use ipc_types::{ARM_WITH_THE_RADIO, Attitude, Channels, Header};

pub(crate) const MS: u64 = 1_000_000;
/// `flight`'s clock when the simulation begins: no clock starts at zero.
pub(crate) const T0: u64 = 10_000 * MS;
/// Where it is flown, metres: the middle of the room.
const HOME: (f64, f64) = (5.0, 5.0);

fn room() -> Plan {
    let mut rows = vec![format!("#{}#", " ".repeat(48)); 50];
    rows[0] = "#".repeat(50);
    rows[49] = "#".repeat(50);
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    Plan::from_ascii(&rows, 0.2)
}

/// Sticks by a height loop and a place loop over the truth, in the law that pilots speak.
pub(crate) struct Pilot {
    pub(crate) arm: bool,
    /// Height to fly at; `None`: throttle low.
    pub(crate) height_m: Option<f64>,
    pub(crate) throttle_us: f64,
}

impl Pilot {
    pub(crate) const IDLE: Self = Self { arm: false, height_m: None, throttle_us: 1450.0 };

    fn message(&mut self, now: u64, flight: &Simulation) -> Channels {
        let truth = flight.truth();
        let mut channels_us = [1000; 18];
        channels_us[..6].copy_from_slice(&[1500, 1500, 1000, 1500, 1000, 2000]);
        if let Some(height_m) = self.height_m {
            let v = truth.velocity_m_s.map(f64::from);
            let climb = (0.8 * (height_m - f64::from(truth.z_m))).clamp(-0.4, 0.4);
            self.throttle_us = (self.throttle_us + 3.0 * (climb - v[2])).clamp(1100.0, 1800.0);
            let throttle = (self.throttle_us + 150.0 * (climb - v[2])).clamp(1000.0, 1900.0);
            let ax = 0.5 * (HOME.0 - f64::from(truth.x_m)) - 0.9 * v[0];
            let ay = 0.5 * (HOME.1 - f64::from(truth.y_m)) - 0.9 * v[1];
            let (sin, cos) = f64::from(truth.yaw_rad).sin_cos();
            let (forward, left) = (cos * ax + sin * ay, cos * ay - sin * ax);
            let tilt = |a: f64| stick::channel(stick::of_angle((a / 9.81).clamp(-0.15, 0.15) as f32), 1500);
            channels_us[..4].copy_from_slice(&[tilt(-left), tilt(forward), throttle.round() as u16, 1500]);
        }
        channels_us[4] = if self.arm { 2000 } else { 1000 };
        Channels {
            header: Header { stamp_ns: now, ..Header::default() },
            expiry_ns: now + 100 * MS,
            channels_us,
            count: 6,
            arm: u8::from(self.arm),
            level_roll_us: 1500.0,
            level_pitch_us: 1500.0,
            hover_throttle_us: self.throttle_us as f32,
            height_m: truth.z_m,
            climb_m_s: truth.velocity_m_s[2],
            on_ground: u16::from(self.height_m.is_none()),
            ..Channels::default()
        }
    }
}

/// What a bad line makes of bytes; true: on their way to the controller.
pub(crate) type Spoil = Box<dyn FnMut(bool, Vec<u8>) -> Vec<u8>>;

pub(crate) struct Rig {
    pub(crate) firmware: Firmware,
    config: Config,
    pub(crate) core: Core,
    pub(crate) flight: Simulation,
    pub(crate) pilot: Pilot,
    pub(crate) connected: bool,
    pub(crate) pilot_speaks: bool,
    /// When each command went out, and its code.
    pub(crate) commands: Vec<(u64, u16)>,
    pub(crate) reader: msp::Decoder<1024>,
    pub(crate) attitudes: Vec<Attitude>,
    pub(crate) powers: usize,
    pub(crate) spoil: Option<Spoil>,
}

impl Rig {
    pub(crate) fn new(firmware: Firmware) -> Self {
        Self::with(firmware, Profile::Receiver, None)
    }

    /// With a radio in a safety pilot's hands.
    pub(crate) fn beside_a_radio(firmware: Firmware, take_back_s: Option<f64>) -> Self {
        Self::with(firmware, Profile::Override, Some(SafetyPilot::new(take_back_s)))
    }

    fn with(firmware: Firmware, profile: Profile, radio: Option<SafetyPilot>) -> Self {
        let vehicle = manifest::Vehicle::parse(
            "watchman.toml",
            include_str!("../../../../deploy/vehicles/watchman.toml"),
        )
        .unwrap();
        let pad = format!("pad = {{ x_m = {}, y_m = {}, heading_deg = 90.0 }}", HOME.0, HOME.1);
        let options = Options {
            seed: 5,
            firmware,
            failsafe: FailsafeSettings::factory(firmware),
            clutter: ClutterLevel::None,
            radio,
            ..Options::default()
        };
        let file = WorldFile::parse("room.toml", &pad).unwrap();
        let flight = Simulation::new(&room(), &Sidecar::default(), &file, &vehicle, &options).unwrap();
        let config = Config { profile, ..Config::default() };
        let mut core = Core::new(&config, 4);
        core.opened(T0);
        Self {
            firmware,
            config,
            core,
            flight,
            pilot: Pilot::IDLE,
            connected: true,
            pilot_speaks: true,
            commands: Vec::new(),
            reader: msp::Decoder::new(),
            attitudes: Vec::new(),
            powers: 0,
            spoil: None,
        }
    }

    pub(crate) fn now(&self) -> u64 {
        T0 + self.flight.now_ns()
    }

    /// Ticks of 5 ms; the pilot speaks at every fourth.
    pub(crate) fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 200.0).round() as u64 {
            let next = self.flight.now_ns() + 5 * MS;
            self.flight.advance_to(next);
            let now = self.now();
            if next.is_multiple_of(100 * MS) {
                // The down sonar, without its noise: the ladder's own tests have that.
                let range = (self.height_m() + 0.05 < 4.0).then_some(self.height_m() + 0.05);
                self.core.down_sonar(now, now - 30 * MS, range);
            }
            if self.pilot_speaks && next.is_multiple_of(20 * MS) {
                let message = self.pilot.message(now, &self.flight);
                self.core.pilot(now, &message);
            }
            let mut bytes = [0; 1024];
            let count = self.flight.controller_read(&mut bytes);
            let bytes = self.spoil(false, bytes[..count].to_vec());
            if self.connected {
                self.core.receive(now, &bytes);
            }
            self.core.step(now);
            if self.connected {
                let out = self.core.waiting().to_vec();
                self.core.taken(out.len());
                let arriving = self.spoil(true, out.clone());
                self.flight.controller_write(&arriving);
                let commands = &mut self.commands;
                self.reader.feed(&out, |frame| commands.push((now, frame.code)));
            }
            let state = self.core.state(now);
            self.flight.ask_to_arm(state.reason.as_str().starts_with(ARM_WITH_THE_RADIO));
            self.attitudes.extend(self.core.take_attitude());
            self.powers += usize::from(self.core.take_power().is_some());
        }
    }

    fn spoil(&mut self, to: bool, bytes: Vec<u8>) -> Vec<u8> {
        match &mut self.spoil {
            Some(spoil) => spoil(to, bytes),
            None => bytes,
        }
    }

    pub(crate) fn armed(&self) -> bool {
        self.flight.controller().is_armed()
    }

    pub(crate) fn height_m(&self) -> f32 {
        self.flight.truth().z_m
    }

    pub(crate) fn reason(&self) -> String {
        self.core.state(self.now()).reason.as_str().to_owned()
    }

    /// `flight` is killed, and started again after so many seconds; it knows nothing then.
    pub(crate) fn restart(&mut self, dead_s: f64) {
        self.connected = false;
        self.core.closed("killed");
        self.run(dead_s);
        self.core = Core::new(&self.config, 4);
        self.core.opened(self.now());
        self.connected = true;
    }

    /// Booted, armed by the rules, and hovering.
    pub(crate) fn hovering(firmware: Firmware) -> Self {
        Self::new(firmware).hover()
    }

    pub(crate) fn hover(mut self) -> Self {
        let firmware = self.firmware;
        let rig = &mut self;
        rig.run(6.0);
        rig.pilot.arm = true;
        rig.run(2.5);
        assert!(rig.armed(), "{}: {}", firmware.name(), rig.reason());
        rig.pilot.height_m = Some(1.2);
        rig.run(10.0);
        rig.expect_hover();
        self
    }

    pub(crate) fn expect_hover(&self) {
        let truth = self.flight.truth();
        let aside = (f64::from(truth.x_m) - HOME.0).hypot(f64::from(truth.y_m) - HOME.1);
        let name = self.firmware.name();
        assert!((truth.z_m - 1.2).abs() < 0.25 && aside < 0.8, "{name}: {truth:?} {}", self.reason());
        assert!(truth.armed && truth.contacts == 0, "{name}: {truth:?}");
    }

    pub(crate) fn count(&self, from: u64, to: u64, code: Option<u16>) -> usize {
        let counted = |(at, seen): &&(u64, u16)| *at > from && *at <= to && code.is_none_or(|c| c == *seen);
        self.commands.iter().filter(counted).count()
    }
}
