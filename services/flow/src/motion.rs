//! From the sensor's bytes to velocity: bytes in, motion out, time as an argument.

use crate::config::Config;
use crate::tilt::TiltHistory;
use ipc_types::{Attitude, FlowMotion};
use msp::messages::{FlowFrame, RangeFrame};
use msp::{Decoder, Frame, Layout, Reader, Request};

/// Frames of less quality show nothing at all.
const LEAST_QUALITY: u8 = 10;
/// Noise of a refused frame over that of a good one: the counts come from a few weak features.
const DIM_NOISE: f32 = 3.0;
/// A frame of 18 bytes at 115200 baud, and half a tick of 5 ms until it is read.
const ON_THE_WAY_NS: u64 = 4_000_000;
/// A frame waits so long for an attitude from after its end, then goes with what there is.
const WAIT_NS: u64 = 60_000_000;
/// A range older than this says nothing about the ground below now.
const RANGE_OLD_NS: u64 = 200_000_000;
/// Half a frame and then nothing for so long: the rest will not come.
const QUIET_NS: u64 = 50_000_000;
/// Image motion beyond the sensor's own limit (PMW3901 datasheet: 7.4 rad/s) is cut off by it.
const FASTEST_RAD_S: f32 = 7.0;
/// Share of the turning rate that stays as error after compensation.
const TURN_SHARE: f32 = 0.12;
/// Share of the velocity: scale of the sensor and of the range.
const SCALE_SHARE: f32 = 0.03;
/// Share of the velocity when the range is the sonar's, which sits elsewhere.
const SONAR_SHARE: f32 = 0.1;
/// Frames that wait for an attitude.
const WAITING: usize = 4;

/// The sensor, from the vehicle file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Frames a second.
    pub rate_hz: f32,
    /// Angle of one count, radians.
    pub count_rad: f32,
    /// Mounting angle about body z, counter-clockwise, radians.
    pub yaw_rad: f32,
    /// It sees nothing nearer to the ground, metres.
    pub min_height_m: f32,
    /// It sees nothing farther from the ground, metres.
    pub max_height_m: f32,
}

#[derive(Debug, Clone, Copy, Default)]
struct Waiting {
    end_ns: u64,
    frame: FlowFrame,
}

/// The whole of `flow` without ports.
#[derive(Debug, Clone)]
pub struct Motion {
    config: Config,
    sensor: Sensor,
    decoder: Decoder<128>,
    byte_ns: u64,
    tilts: TiltHistory,
    waiting: [Waiting; WAITING],
    count: usize,
    range: Option<(u64, f32)>,
    sonar: Option<(u64, f32)>,
    refused: u32,
}

impl Motion {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(config: &Config, sensor: Sensor) -> Self {
        Self {
            config: *config,
            sensor,
            decoder: Decoder::new(),
            byte_ns: 0,
            tilts: TiltHistory::default(),
            waiting: [Waiting::default(); WAITING],
            count: 0,
            range: None,
            sonar: None,
            refused: 0,
        }
    }

    /// An attitude; false when it makes no sense.
    pub fn attitude(&mut self, attitude: &Attitude) -> bool {
        self.tilts.push(attitude)
    }

    /// An echo of the down sonar: stands in when the sensor's own range is missing.
    pub fn down_sonar(&mut self, now: u64, range_m: f32) {
        self.sonar = Some((now, range_m));
    }

    /// The port was opened again.
    pub fn reopened(&mut self) {
        self.decoder.clear();
    }

    /// Bytes from the sensor; empty when none have come.
    pub fn receive(&mut self, now: u64, bytes: &[u8]) {
        let mut decoder = core::mem::take(&mut self.decoder);
        if bytes.is_empty() {
            if decoder.in_frame() && now.saturating_sub(self.byte_ns) >= QUIET_NS {
                decoder.abandon();
                while let Some(frame) = decoder.pending() {
                    self.frame(now, &frame);
                }
            }
        } else {
            self.byte_ns = now;
            let before = decoder.refused();
            decoder.feed(bytes, |frame| self.frame(now, &frame));
            let after = decoder.refused();
            let broken = after
                .checksum
                .wrapping_sub(before.checksum)
                .wrapping_add(after.oversize.wrapping_sub(before.oversize));
            self.refused = self.refused.wrapping_add(broken);
        }
        self.decoder = decoder;
    }

    fn frame(&mut self, now: u64, frame: &Frame<'_>) {
        let mut reader = Reader::new(frame.payload);
        match frame.code {
            FlowFrame::CODE => match FlowFrame::read(&mut reader) {
                Ok(flow) => self.wait(Waiting { end_ns: now.saturating_sub(ON_THE_WAY_NS), frame: flow }),
                Err(_) => self.refused = self.refused.wrapping_add(1),
            },
            RangeFrame::CODE => match RangeFrame::read(&mut reader) {
                Ok(range) if range.distance_mm > 0 => {
                    self.range = Some((now, range.distance_mm as f32 * 1e-3));
                }
                Ok(_) => self.range = None,
                Err(_) => self.refused = self.refused.wrapping_add(1),
            },
            _ => {}
        }
    }

    fn wait(&mut self, frame: Waiting) {
        if self.count == WAITING {
            self.waiting.copy_within(1.., 0);
            self.count -= 1;
            self.refused = self.refused.wrapping_add(1);
        }
        self.waiting[self.count] = frame;
        self.count += 1;
    }

    /// The next frame whose time has come: with velocity, or refused (velocity NaN).
    pub fn next(&mut self, now: u64) -> Option<FlowMotion> {
        let first = *self.waiting.get(..self.count)?.first()?;
        let covered = self.tilts.newest_ns().is_some_and(|newest| newest >= first.end_ns);
        if !covered && now.saturating_sub(first.end_ns) < WAIT_NS {
            return None;
        }
        self.waiting.copy_within(1.., 0);
        self.count -= 1;
        let motion = self.motion(now, &first);
        if !motion.velocity_x_m_s.is_finite() {
            self.refused = self.refused.wrapping_add(1);
        }
        Some(FlowMotion { refused: self.refused, ..motion })
    }

    /// Distance along the axis, and the share of it that may be wrong.
    fn distance(&self, now: u64, upright: f32) -> Option<(f32, f32)> {
        let recent =
            |value: Option<(u64, f32)>| value.filter(|(at, _)| now.saturating_sub(*at) < RANGE_OLD_NS);
        recent(self.range)
            .map(|(_, range)| (range, SCALE_SHARE))
            .or_else(|| recent(self.sonar).map(|(_, height)| (height / upright, SONAR_SHARE)))
            .filter(|(distance, _)| (self.sensor.min_height_m..=self.sensor.max_height_m).contains(distance))
    }

    fn motion(&self, now: u64, waiting: &Waiting) -> FlowMotion {
        let frame = &waiting.frame;
        let period_s = 1.0 / self.sensor.rate_hz;
        let period_ns = (f64::from(period_s) * 1e9) as u64;
        let start_ns = waiting.end_ns.saturating_sub(period_ns);
        // From counts to radians a second, turned from the sensor's frame into the body's.
        let scale = self.sensor.count_rad / period_s;
        let (x, y) = (frame.motion_x as f32 * scale, frame.motion_y as f32 * scale);
        let (sin, cos) = self.sensor.yaw_rad.sin_cos();
        let (raw_x, raw_y) = (cos * x - sin * y, sin * x + cos * y);
        let mut motion = FlowMotion {
            sampled_ns: start_ns + period_ns / 2,
            ranged_ns: self.range.map_or(0, |(heard_ns, _)| heard_ns.saturating_sub(ON_THE_WAY_NS)),
            velocity_x_m_s: f32::NAN,
            velocity_y_m_s: f32::NAN,
            sigma_m_s: f32::NAN,
            dim_x_m_s: f32::NAN,
            dim_y_m_s: f32::NAN,
            raw_x_rad_s: raw_x,
            raw_y_rad_s: raw_y,
            range_m: self.range.map_or(f32::NAN, |(_, range)| range),
            quality: frame.quality.into(),
            ..FlowMotion::default()
        };
        let good = frame.quality >= self.config.min_quality;
        let told = frame.quality >= LEAST_QUALITY && raw_x.hypot(raw_y) < FASTEST_RAD_S;
        let Some(tilt) = self.tilts.between(start_ns, waiting.end_ns).filter(|_| told) else { return motion };
        let upright = tilt.roll_rad.cos() * tilt.pitch_rad.cos();
        if upright < (self.config.max_tilt_deg as f32).to_radians().cos() {
            return motion;
        }
        let Some((distance, share)) = self.distance(now, upright) else { return motion };
        let forward = distance * (raw_x + tilt.pitch_rate) / tilt.pitch_rad.cos();
        let left = distance * (raw_y - tilt.roll_rate) / tilt.roll_rad.cos();
        let turning = tilt.roll_rate.hypot(tilt.pitch_rate);
        let unsure = if tilt.extrapolated { 3.0 * TURN_SHARE } else { TURN_SHARE };
        let angular = distance * (self.config.noise_rad_s as f32).hypot(unsure * turning);
        if good {
            (motion.velocity_x_m_s, motion.velocity_y_m_s) = (forward, left);
        } else {
            (motion.dim_x_m_s, motion.dim_y_m_s) = (forward, left);
        }
        let angular = if good { angular } else { DIM_NOISE * angular };
        motion.sigma_m_s = angular.hypot(share * forward.hypot(left));
        motion
    }

    /// Frames refused since start.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.refused
    }
}
