//! The sensor against a picture of its own: a point of the ground is followed through the tilted body's frame,
//! without any of the equations that are tested.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::f64::consts::TAU;

use flow::{Config, Motion, Sensor};
use ipc_types::{Attitude, FlowMotion};
use msp::messages::{FlowFrame, RangeFrame};
use msp::{Version, encode_request};
use proptest::prelude::*;

const MS: u64 = 1_000_000;
const SENSOR: Sensor =
    Sensor { rate_hz: 25.0, count_rad: 0.000_2, yaw_rad: 0.0, min_height_m: 0.08, max_height_m: 3.0 };

#[derive(Clone, Copy)]
struct Pose {
    position: [f64; 3],
    roll: f64,
    pitch: f64,
}

impl Pose {
    /// Axes of the body (forward, left, up) in the world; yaw is zero.
    fn axes(&self) -> [[f64; 3]; 3] {
        let ((sr, cr), (sp, cp)) = (self.roll.sin_cos(), self.pitch.sin_cos());
        // First the nose goes down about the left axis, then the right side about the nose.
        [[cp, 0.0, -sp], [sp * sr, cr, cp * sr], [sp * cr, -sr, cp * cr]]
    }

    fn seen(&self, point: [f64; 3]) -> [f64; 3] {
        let delta: Vec<f64> = (0..3).map(|i| point[i] - self.position[i]).collect();
        self.axes().map(|axis| axis.iter().zip(&delta).map(|(a, d)| a * d).sum())
    }

    /// Where the axis of the sensor meets the floor, and how far along it.
    fn spot(&self) -> ([f64; 3], f64) {
        let down = self.axes()[2].map(|c| -c);
        let distance = -self.position[2] / down[2];
        (std::array::from_fn(|i| self.position[i] + distance * down[i]), distance)
    }
}

/// The image motion (of the craft over the ground) between two poses, radians.
fn image_motion(a: &Pose, b: &Pose) -> [f64; 2] {
    let (spot, distance) = a.spot();
    let (before, after) = (a.seen(spot), b.seen(spot));
    [-(after[0] - before[0]) / distance, -(after[1] - before[1]) / distance]
}

fn sent<R: msp::Request>(request: &R) -> Vec<u8> {
    let mut out = [0; 64];
    let length = encode_request(&mut out, Version::V2, request).unwrap();
    out[..length].to_vec()
}

/// Flies `pose(t)` for half a second before the sensor and returns what came out, attitudes at 30 a second.
fn fly(sensor: Sensor, quality: u8, with_range: bool, pose: impl Fn(f64) -> Pose) -> Vec<FlowMotion> {
    let mut motion = Motion::new(&Config::default(), sensor);
    let mut out = Vec::new();
    let mut sums = [0.0; 2];
    for ms in 1..=600u64 {
        let (t0, t1) = ((ms - 1) as f64 * 1e-3, ms as f64 * 1e-3);
        let (a, b) = (pose(t0), pose(t1));
        let step = image_motion(&a, &b);
        // The sensor's own axes are the body's, turned by its mounting angle.
        let (sin, cos) = f64::from(sensor.yaw_rad).sin_cos();
        sums[0] += cos * step[0] + sin * step[1];
        sums[1] += cos * step[1] - sin * step[0];
        if ms % 33 == 0 {
            motion.attitude(&Attitude {
                sampled_ns: ms * MS,
                roll_rad: b.roll as f32,
                pitch_rad: b.pitch as f32,
                ..Attitude::default()
            });
        }
        if ms % 40 == 0 {
            let counts = sums.map(|sum| (sum / f64::from(sensor.count_rad)).round() as i32);
            sums = [0.0; 2];
            let flow = FlowFrame { quality, motion_x: counts[0], motion_y: counts[1] };
            let distance_mm = if with_range { (b.spot().1 * 1000.0).round() as i32 } else { -1 };
            // The bytes are through 4 ms after the end of the interval.
            motion.receive((ms + 4) * MS, &sent(&flow));
            motion.receive((ms + 4) * MS, &sent(&RangeFrame { quality: 255, distance_mm }));
        }
        if ms % 5 == 0 {
            out.extend(std::iter::from_fn(|| motion.next((ms + 4) * MS)));
        }
    }
    out
}

fn last(motions: &[FlowMotion]) -> FlowMotion {
    *motions.last().unwrap()
}

#[test]
fn forward_is_positive_x_and_left_is_positive_y() {
    let level =
        |vx: f64, vy: f64| move |t: f64| Pose { position: [vx * t, vy * t, 1.2], roll: 0.0, pitch: 0.0 };
    let ahead = last(&fly(SENSOR, 120, true, level(0.5, 0.0)));
    assert!((ahead.velocity_x_m_s - 0.5).abs() < 0.01 && ahead.velocity_y_m_s.abs() < 0.01, "{ahead:?}");
    assert!(ahead.raw_x_rad_s > 0.0);
    let left = last(&fly(SENSOR, 120, true, level(0.0, 0.4)));
    assert!((left.velocity_y_m_s - 0.4).abs() < 0.01 && left.velocity_x_m_s.abs() < 0.01, "{left:?}");
    // A sensor mounted a quarter turn round says the same.
    let turned = Sensor { yaw_rad: std::f32::consts::FRAC_PI_2, ..SENSOR };
    let left = last(&fly(turned, 120, true, level(0.2, 0.4)));
    assert!((left.velocity_y_m_s - 0.4).abs() < 0.01 && (left.velocity_x_m_s - 0.2).abs() < 0.01, "{left:?}");
}

#[test]
fn turning_on_the_spot_is_no_motion() {
    // Nose and side rock by 8 degrees, a period of one second: up to 0.9 rad/s, 1 m/s uncompensated.
    let rock = |t: f64| Pose {
        position: [0.0, 0.0, 1.2],
        roll: 0.1 * (TAU * t).sin(),
        pitch: 0.14 * (TAU * t + 1.0).sin(),
    };
    let motions = fly(SENSOR, 120, true, rock);
    let settled = &motions[3..];
    let most = settled.iter().map(|m| m.velocity_x_m_s.hypot(m.velocity_y_m_s)).fold(0.0, f32::max);
    let raw = settled.iter().map(|m| m.raw_x_rad_s.abs()).fold(0.0, f32::max);
    assert!(settled.len() >= 9 && most < 0.08, "{most}");
    assert!(raw * 1.2 > 0.7, "the test turns enough to matter: {raw}");
}

#[test]
fn tilted_flight_is_levelled() {
    let pose = |t: f64| Pose { position: [0.6 * t, -0.3 * t, 1.0], roll: 0.12, pitch: 0.15 };
    let m = last(&fly(SENSOR, 120, true, pose));
    assert!((m.velocity_x_m_s - 0.6).abs() < 0.02 && (m.velocity_y_m_s + 0.3).abs() < 0.02, "{m:?}");
    assert!(m.sigma_m_s > 0.02 && m.sigma_m_s < 0.15, "{}", m.sigma_m_s);
    // The middle of the interval of the last whole frame.
    assert_eq!(m.sampled_ns % (40 * MS), 20 * MS);
}

#[test]
fn what_cannot_be_trusted_is_refused_and_counted() {
    let pose = |t: f64| Pose { position: [0.5 * t, 0.0, 1.2], roll: 0.0, pitch: 0.0 };
    for (quality, with_range) in [(5, true), (120, false)] {
        let motions = fly(SENSOR, quality, with_range, pose);
        assert!(motions.len() > 10);
        let silent = |m: &FlowMotion| [m.velocity_x_m_s, m.dim_x_m_s, m.sigma_m_s].iter().all(|v| v.is_nan());
        assert!(motions.iter().all(silent));
        assert_eq!(last(&motions).refused as usize, motions.len());
    }
    // A poor picture is refused as well, but what it shows is told apart from nothing, and less surely.
    let (poor, good) = (fly(SENSOR, 40, true, pose), fly(SENSOR, 120, true, pose));
    let (poor, good) = (last(&poor), last(&good));
    assert!(poor.velocity_x_m_s.is_nan() && poor.velocity_y_m_s.is_nan() && good.dim_x_m_s.is_nan());
    assert!((poor.dim_x_m_s - good.velocity_x_m_s).abs() < 1e-3, "{poor:?}");
    assert!(poor.refused > 10 && poor.sigma_m_s > 2.0 * good.sigma_m_s, "{poor:?}");
    // Too near to the ground for the sensor, and tilted too far.
    let low = |t: f64| Pose { position: [0.1 * t, 0.0, 0.05], roll: 0.0, pitch: 0.0 };
    assert!(last(&fly(SENSOR, 120, true, low)).velocity_x_m_s.is_nan());
    let steep = |t: f64| Pose { position: [0.1 * t, 0.0, 1.2], roll: 0.6, pitch: 0.0 };
    assert!(last(&fly(SENSOR, 120, true, steep)).velocity_x_m_s.is_nan());
}

#[test]
fn the_down_sonar_stands_in_for_the_range() {
    let mut motion = Motion::new(&Config::default(), SENSOR);
    for i in 1..20 {
        motion.attitude(&Attitude { sampled_ns: i * 30 * MS, ..Attitude::default() });
    }
    motion.down_sonar(500 * MS, 1.0);
    // 0.5 rad/s.
    let flow = FlowFrame { quality: 120, motion_x: 100, motion_y: 0 };
    motion.receive(510 * MS, &sent(&flow));
    let m = motion.next(510 * MS).unwrap();
    assert!((m.velocity_x_m_s - 0.5).abs() < 1e-3 && m.range_m.is_nan(), "{m:?}");
}

#[test]
fn without_attitude_a_frame_waits_and_is_then_refused() {
    let mut motion = Motion::new(&Config::default(), SENSOR);
    motion.receive(100 * MS, &sent(&RangeFrame { quality: 255, distance_mm: 1000 }));
    motion.receive(100 * MS, &sent(&FlowFrame { quality: 120, motion_x: 100, motion_y: 0 }));
    assert!(motion.next(120 * MS).is_none());
    assert!(motion.next(160 * MS).unwrap().velocity_x_m_s.is_nan());
    assert!(motion.next(400 * MS).is_none());
}

proptest! {
    #[test]
    fn garbage_is_harmless(bytes in proptest::collection::vec(any::<u8>(), 0..600), x: i32, y: i32, roll: f32, at: u64) {
        let mut motion = Motion::new(&Config::default(), SENSOR);
        motion.attitude(&Attitude { sampled_ns: at, roll_rad: roll, ..Attitude::default() });
        motion.attitude(&Attitude { sampled_ns: 90 * MS, roll_rad: roll, ..Attitude::default() });
        motion.attitude(&Attitude { sampled_ns: 120 * MS, ..Attitude::default() });
        motion.receive(100 * MS, &bytes);
        motion.receive(101 * MS, &sent(&FlowFrame { quality: 255, motion_x: x, motion_y: y }));
        motion.receive(300 * MS, &[]);
        while let Some(m) = motion.next(300 * MS) {
            prop_assert!(m.velocity_x_m_s.is_nan() || m.velocity_x_m_s.is_finite());
        }
    }
}
