//! The virtual controller on a quadrotor over a flat floor, reached by MSP bytes only.

mod firmwares;
mod flying;
mod link;
mod protocol;
mod silence;

use super::*;
use crate::vehicle::{Compass, Inertial, Quadrotor, Shape, Surroundings, Variation};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

const DT: f64 = 0.001;
const STEP_NS: u64 = 1_000_000;
const MS: u64 = 1_000_000;

struct Bench {
    craft: Quadrotor,
    controller: Controller,
    inertial: Inertial,
    compass: Compass,
    random: Xoshiro256PlusPlus,
    now: u64,
    received: Vec<u8>,
    /// Frames at 50 Hz while `Some`.
    channels: Option<Vec<u16>>,
    /// What a radio sends at 50 Hz while `Some`.
    radio: Option<[u16; 8]>,
    /// When the last frame of `channels` was sent.
    sent: u64,
}

/// Roll, pitch, throttle, yaw, AUX1, AUX2: receiver order.
const IDLE: [u16; 6] = [1500, 1500, 1000, 1500, 1000, 2000];
const ARM: [u16; 6] = [1500, 1500, 1000, 1500, 2000, 2000];

impl Bench {
    fn new(seed: u64, height: f64, failsafe: FailsafeSettings) -> Self {
        Self::with(Firmware::Betaflight2025_12, seed, height, failsafe)
    }

    fn with(firmware: Firmware, seed: u64, height: f64, failsafe: FailsafeSettings) -> Self {
        Self::on(&crate::testing::watchman(), firmware, seed, height, failsafe)
    }

    fn on(
        vehicle: &manifest::Vehicle,
        firmware: Firmware,
        seed: u64,
        height: f64,
        failsafe: FailsafeSettings,
    ) -> Self {
        let (shape, pack) = Shape::new(vehicle, &Variation::NONE);
        Self {
            craft: Quadrotor::new(shape, pack, 0.0, 0.0, 0.0, height),
            controller: Controller::new(
                firmware,
                failsafe,
                f64::from(vehicle.motors.idle_fraction),
                seed * 7_300_000,
            )
            .tuned(f64::from(vehicle.motors.pid_scale)),
            inertial: Inertial::levelled([0.0; 2]),
            compass: Compass::undisturbed(0.0),
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
            now: 0,
            received: Vec::new(),
            channels: None,
            radio: None,
            sent: 0,
        }
    }

    fn step(&mut self) {
        if let Some(channels) = &self.channels
            && self.now.is_multiple_of(20 * MS)
        {
            let payload: Vec<u8> = channels.iter().flat_map(|c| c.to_le_bytes()).collect();
            let bytes = v1(200, &payload);
            self.controller.write(self.now, &bytes);
            self.sent = self.now;
        }
        if let Some(radio) = &self.radio
            && self.now.is_multiple_of(20 * MS)
        {
            self.controller.radio(self.now, radio);
        }
        let (gyro, accelerometer) = {
            let speeds = self.craft.motor_speeds();
            let shake = speeds.iter().sum::<f64>() / 4.0;
            self.inertial.sample(self.craft.motion(), shake, &mut self.random)
        };
        let m = self.craft.motion();
        let heading_rad = self.compass.read(m.position.x, m.position.y, m.angles().2, &mut self.random);
        let senses = Senses {
            gyro,
            accelerometer,
            heading_rad,
            volts: self.craft.battery().volts(),
            amps: self.craft.battery().amps(),
            drawn_mah: self.craft.battery().drawn_mah(),
        };
        let commands = self.controller.step(self.now, DT, &senses);
        let around = Surroundings { surface_m: 0.0, wall_m: 10.0, push: None };
        self.craft.step(DT, &commands, &around, &mut self.random);
        let mut chunk = [0; 256];
        let count = self.controller.read(self.now, &mut chunk);
        self.received.extend_from_slice(&chunk[..count]);
        self.now += STEP_NS;
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1000.0).round() as u64 {
            self.step();
        }
    }

    /// Runs until `done`, at most `seconds`; how long it took.
    fn until(&mut self, seconds: f64, done: impl Fn(&Self) -> bool) -> Option<f64> {
        let start = self.now;
        for _ in 0..(seconds * 1000.0) as u64 {
            if done(self) {
                return Some((self.now - start) as f64 * 1e-9);
            }
            self.step();
        }
        None
    }

    fn send(&mut self, channels: &[u16]) {
        self.channels = Some(channels.to_vec());
    }

    /// Sends a request and returns direction and payload of its answer.
    fn ask(&mut self, code: u8, payload: &[u8]) -> (u8, Vec<u8>) {
        let channels = self.channels.take();
        self.run(0.03);
        self.received.clear();
        self.controller.write(self.now, &v1(code, payload));
        self.run(0.06);
        self.channels = channels;
        let r = &self.received;
        assert_eq!(&r[..2], b"$M", "{r:02x?}");
        assert_eq!(r[4], code);
        let length = usize::from(r[3]);
        assert_eq!(r.len(), length + 6);
        let sum = r[3..r.len() - 1].iter().fold(0, |a, b| a ^ b);
        assert_eq!(sum, r[r.len() - 1]);
        (r[2], r[5..5 + length].to_vec())
    }

    fn blocks(&self) -> u32 {
        self.controller.arming_blocks()
    }

    /// Powered up, past the grace, armed, and flown to `height` with a height loop on the truth.
    fn armed(seed: u64, failsafe: FailsafeSettings) -> Self {
        Self::armed_with(Firmware::Betaflight2025_12, seed, failsafe)
    }

    fn armed_with(firmware: Firmware, seed: u64, failsafe: FailsafeSettings) -> Self {
        Self::with(firmware, seed, 0.0, failsafe).arm()
    }

    fn arm(mut self) -> Self {
        self.send(&IDLE);
        self.run(5.2);
        self.send(&ARM);
        self.run(0.3);
        assert!(self.controller.is_armed(), "blocks {:#x}", self.blocks());
        self
    }

    /// Flies `seconds` at `height` with cascaded proportional loops on the truth: the throttle returned is
    /// the mean of the last half.
    fn hover(&mut self, height: f64, seconds: f64) -> f64 {
        let mut integral = 1500.0;
        let (mut sum, mut count) = (0.0, 0.0);
        let steps = (seconds * 50.0) as u64;
        for i in 0..steps {
            let m = *self.craft.motion();
            let climb = (0.8 * (height - m.position.z)).clamp(-0.4, 0.4);
            integral += (climb - m.velocity.z) * 3.0;
            let throttle = (integral + 150.0 * (climb - m.velocity.z)).clamp(1000.0, 1900.0);
            let yaw = m.angles().2;
            let (sin, cos) = yaw.sin_cos();
            let want = |place: f64, speed: f64| -0.5 * place - 0.9 * speed;
            let (ax, ay) = (want(m.position.x, m.velocity.x), want(m.position.y, m.velocity.y));
            let forward = cos * ax + sin * ay;
            let left = cos * ay - sin * ax;
            let law = self.controller.personality.stick;
            let pitch = 1500.0 + stick(&law, forward / 9.81);
            let roll = 1500.0 + stick(&law, -left / 9.81);
            let channels = [roll, pitch, throttle, 1500.0, 2000.0, 2000.0].map(|c: f64| c.round() as u16);
            self.send(&channels);
            self.run(0.02);
            if i > steps / 2 {
                sum += throttle;
                count += 1.0;
            }
        }
        sum / count
    }
}

/// Inverse of the stick law, as a companion would have it: at most 13 degrees, found by halving.
fn stick(law: &StickLaw, angle_rad: f64) -> f64 {
    let wanted = angle_rad.to_degrees().abs().min(13.0);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let x = 0.5 * (low + high);
        if law.largest_angle_deg() * law.angle_share(x) < wanted {
            low = x;
        } else {
            high = x;
        }
    }
    500.0 * low * angle_rad.signum()
}

fn v1(code: u8, payload: &[u8]) -> Vec<u8> {
    let mut frame = vec![b'$', b'M', b'<', payload.len() as u8, code];
    frame.extend_from_slice(payload);
    frame.push(frame[3..].iter().fold(0, |a, b| a ^ b));
    frame
}
