//! `flight` on the simulator's virtual flight controller, with every firmware that it plays: an airframe in an empty room,
//! bytes over a line of 115200 baud, and a pilot that knows the truth.
#![allow(clippy::unwrap_used, reason = "tests")]

use airframe::controller::{FailsafeSettings, Firmware};
use airframe::simulation::{Options, Simulation};
use airframe::world::{ClutterLevel, WorldFile};
use control::stick;
use flight::{Config, Core};
use floorplan::{Plan, Sidecar};
use ipc_types::{Attitude, Channels, Header, LinkState};

const MS: u64 = 1_000_000;
/// `flight`'s clock when the simulation begins: no clock starts at zero.
const T0: u64 = 10_000 * MS;
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
struct Pilot {
    arm: bool,
    /// Height to fly at; `None`: throttle low.
    height_m: Option<f64>,
    throttle_us: f64,
}

impl Pilot {
    const IDLE: Self = Self { arm: false, height_m: None, throttle_us: 1450.0 };

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
            on_ground: u32::from(self.height_m.is_none()),
            ..Channels::default()
        }
    }
}

struct Rig {
    firmware: Firmware,
    core: Core,
    flight: Simulation,
    pilot: Pilot,
    connected: bool,
    /// When each command went out, and its code.
    commands: Vec<(u64, u16)>,
    reader: msp::Decoder<1024>,
    attitudes: Vec<Attitude>,
    powers: usize,
}

impl Rig {
    fn new(firmware: Firmware) -> Self {
        let vehicle =
            manifest::Vehicle::parse("watchman.toml", include_str!("../../../deploy/vehicles/watchman.toml"))
                .unwrap();
        let pad = format!("pad = {{ x_m = {}, y_m = {}, heading_deg = 90.0 }}", HOME.0, HOME.1);
        let options = Options {
            seed: 5,
            firmware,
            failsafe: FailsafeSettings::factory(firmware),
            clutter: ClutterLevel::None,
            ..Options::default()
        };
        let file = WorldFile::parse("room.toml", &pad).unwrap();
        let flight = Simulation::new(&room(), &Sidecar::default(), &file, &vehicle, &options).unwrap();
        let mut core = Core::new(&Config::default(), 4);
        core.opened(T0);
        Self {
            firmware,
            core,
            flight,
            pilot: Pilot::IDLE,
            connected: true,
            commands: Vec::new(),
            reader: msp::Decoder::new(),
            attitudes: Vec::new(),
            powers: 0,
        }
    }

    fn now(&self) -> u64 {
        T0 + self.flight.now_ns()
    }

    /// Ticks of 5 ms; the pilot speaks at every fourth.
    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 200.0).round() as u64 {
            let next = self.flight.now_ns() + 5 * MS;
            self.flight.advance_to(next);
            let now = self.now();
            if next.is_multiple_of(20 * MS) {
                let message = self.pilot.message(now, &self.flight);
                self.core.pilot(now, &message);
            }
            let mut bytes = [0; 1024];
            let count = self.flight.controller_read(&mut bytes);
            if self.connected {
                self.core.receive(now, &bytes[..count]);
            }
            self.core.step(now);
            if self.connected {
                let out = self.core.waiting().to_vec();
                self.core.taken(out.len());
                self.flight.controller_write(&out);
                let commands = &mut self.commands;
                self.reader.feed(&out, |frame| commands.push((now, frame.code)));
            }
            self.attitudes.extend(self.core.take_attitude());
            self.powers += usize::from(self.core.take_power().is_some());
        }
    }

    fn armed(&self) -> bool {
        self.flight.controller().is_armed()
    }

    fn height_m(&self) -> f32 {
        self.flight.truth().z_m
    }

    fn reason(&self) -> String {
        self.core.state(self.now()).reason.as_str().to_owned()
    }

    /// Booted, armed by the rules, and hovering.
    fn hovering(firmware: Firmware) -> Self {
        let mut rig = Self::new(firmware);
        rig.run(6.0);
        rig.pilot.arm = true;
        rig.run(2.5);
        assert!(rig.armed(), "{}: {}", firmware.name(), rig.reason());
        rig.pilot.height_m = Some(1.2);
        rig.run(10.0);
        rig.expect_hover();
        rig
    }

    fn expect_hover(&self) {
        let truth = self.flight.truth();
        let aside = (f64::from(truth.x_m) - HOME.0).hypot(f64::from(truth.y_m) - HOME.1);
        let name = self.firmware.name();
        assert!((truth.z_m - 1.2).abs() < 0.25 && aside < 0.8, "{name}: {truth:?} {}", self.reason());
        assert!(truth.armed && truth.contacts == 0, "{name}: {truth:?}");
    }

    fn count(&self, from: u64, to: u64, code: Option<u16>) -> usize {
        let counted = |(at, seen): &&(u64, u16)| *at > from && *at <= to && code.is_none_or(|c| c == *seen);
        self.commands.iter().filter(counted).count()
    }
}

/// From power-up over arming and hovering to disarmed on the floor; within what the controller's task can answer.
#[test]
fn flight_flies_every_firmware() {
    for firmware in Firmware::ALL {
        let name = firmware.name();
        let mut rig = Rig::hovering(firmware);
        let (now, expected) = (rig.now(), firmware.personality());
        let state = rig.core.state(now);
        assert_eq!(rig.core.link_state(now), LinkState::Up, "{name}");
        assert_eq!((state.variant, &state.version[..3]), (expected.variant, &expected.version[..]), "{name}");
        // ARM and ANGLE, wherever the firmware lists them.
        assert_eq!((state.armed, state.modes & 3), (1, 3), "{name}");
        // Nothing that came was broken, too short or unasked for.
        assert_eq!(state.refused, 0, "{name}");

        let second = 1_000 * MS;
        for start in (T0 + second..now - second).step_by(50_000_000) {
            let all = rig.count(start, start + second, None);
            assert!(all <= 90, "{name}: {all} commands in a second");
        }
        let frames = rig.count(now - 5 * second, now, Some(200));
        assert!((247..=253).contains(&frames), "{name}: {frames} frames in 5 s");
        // Attitude alone or with the accelerometer, whichever the firmware answers.
        let several = expected.answers_several;
        let asked = rig.count(now - 5 * second, now, Some(if several { 230 } else { 108 }));
        assert!(asked >= 140, "{name}: {asked} attitudes in 5 s");
        let told = rig.attitudes.last().unwrap();
        assert_eq!(told.force_z_m_s2.is_finite(), several, "{name}");
        assert!(rig.powers >= 30, "{name}: {} readings of the battery", rig.powers);

        rig.pilot.height_m = Some(-0.2);
        rig.run(6.0);
        assert!(rig.height_m() < 0.05, "{name}: {}", rig.height_m());
        rig.pilot.height_m = None;
        rig.pilot.arm = false;
        rig.run(0.2);
        assert!(!rig.armed(), "{name}");
    }
}

/// FACTS 1: gaps of up to 250 ms are held. The port is away for 150 ms and found again within 50 more.
#[test]
fn a_port_that_vanishes_in_flight_and_returns() {
    for firmware in Firmware::ALL {
        let mut rig = Rig::hovering(firmware);
        rig.connected = false;
        rig.core.closed("/dev/ttyX: no such port");
        rig.run(0.15);
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Closed);
        rig.connected = true;
        rig.core.opened(rig.now());
        rig.run(3.0);
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Up, "{}", firmware.name());
        rig.expect_hover();
    }
}

/// `flight` is killed in the air and started again within 120 ms: it knows nothing, not even how to speak.
#[test]
fn a_flight_that_is_started_again_in_the_air_holds_every_firmware() {
    for firmware in Firmware::ALL {
        for offset in 0..8 {
            let mut rig = Rig::hovering(firmware);
            // The moment against the controller's task and the pilot's beat.
            rig.run(0.005 * f64::from(offset));
            rig.connected = false;
            rig.core.closed("killed");
            rig.run(0.12);
            rig.core = Core::new(&Config::default(), 4);
            rig.core.opened(rig.now());
            rig.connected = true;
            rig.run(3.0);
            rig.expect_hover();
        }
    }
}

/// A board that is switched on seconds after `flight` is found, and spoken to by version 2 where it knows it.
#[test]
fn a_controller_that_comes_late_is_found() {
    for firmware in Firmware::ALL {
        let mut rig = Rig::new(firmware);
        rig.connected = false;
        for _ in 0..20 {
            // What is sent meanwhile goes nowhere.
            rig.run(0.1);
            let lost = rig.core.waiting().len();
            rig.core.taken(lost);
        }
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Silent);
        rig.connected = true;
        rig.run(6.0);
        assert_eq!(rig.core.link_state(rig.now()), LinkState::Up, "{}", firmware.name());
        rig.commands.clear();
        rig.pilot.arm = true;
        rig.run(2.5);
        assert!(rig.armed(), "{}: {}", firmware.name(), rig.reason());
    }
}
