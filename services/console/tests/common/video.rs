//! Video as the bridge sends it: access units that the drone's own encoder has made.

use super::drone::Drone;
use ipc_types::{Field, Format, Header, Video};
use std::mem::offset_of;

pub static SMALL: &[u8] = include_bytes!("../data/small.units");
pub static LARGE: &[u8] = include_bytes!("../data/large.units");
/// Between two pictures, nanoseconds.
pub const FRAME_NS: u64 = 66_666_667;

pub fn encoding() -> String {
    format!("application/octet-stream;schema=sereno/Video/{:016x}", Video::LAYOUT)
}

/// A camera: the units of a recording again and again, each at its time.
pub struct Camera {
    size: (u32, u32),
    units: Vec<&'static [u8]>,
    pub sequence: u64,
    pub capture_ns: u64,
    at: usize,
}

impl Camera {
    pub fn new(units: &'static [u8]) -> Self {
        let mut camera =
            Self { size: (0, 0), units: Vec::new(), sequence: 0, capture_ns: 5_000_000_000, at: 0 };
        camera.film(units);
        camera
    }

    /// Another size of the picture, from its key frame on.
    pub fn film(&mut self, mut units: &'static [u8]) {
        self.size = if std::ptr::eq(units, LARGE) { (480, 360) } else { (320, 240) };
        self.units.clear();
        self.at = 0;
        while let Some((length, rest)) = units.split_first_chunk::<4>() {
            let (unit, rest) = rest.split_at(u32::from_be_bytes(*length) as usize);
            self.units.push(unit);
            units = rest;
        }
    }

    /// The next message.
    pub fn next(&mut self) -> Vec<u8> {
        let unit = self.units[self.at];
        self.at = (self.at + 1) % self.units.len();
        self.sequence += 1;
        self.capture_ns += FRAME_NS;
        let mut bytes = vec![0; offset_of!(Video, bytes)];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        put(offset_of!(Video, header) + offset_of!(Header, sequence), &self.sequence.to_le_bytes());
        put(offset_of!(Video, capture_ns), &self.capture_ns.to_le_bytes());
        let format = offset_of!(Video, format);
        put(format + offset_of!(Format, width), &self.size.0.to_le_bytes());
        put(format + offset_of!(Format, height), &self.size.1.to_le_bytes());
        put(format + offset_of!(Format, fps), &15_u32.to_le_bytes());
        put(format + offset_of!(Format, bitrate), &150_000_u32.to_le_bytes());
        put(offset_of!(Video, length), &(unit.len() as u32).to_le_bytes());
        bytes.extend_from_slice(unit);
        bytes
    }

    /// Sends so many pictures, faster than they were taken.
    pub async fn send(&mut self, drone: &Drone, count: usize) {
        for _ in 0..count {
            let message = self.next();
            send(drone, message, &encoding()).await;
            tokio::time::sleep(std::time::Duration::from_millis(2)).await;
        }
    }
}

pub async fn send(drone: &Drone, bytes: Vec<u8>, encoding: &str) {
    let key = format!("sereno/{}/telemetry/camera/video", drone.name);
    drone.session.put(key, bytes).encoding(encoding).await.unwrap();
}
