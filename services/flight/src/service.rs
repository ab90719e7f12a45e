//! [`Core`] with the ports of the runtime.

use crate::config::Config;
use crate::core::Core;
use core::fmt::Write;
use ipc_types::{Attitude, Channels, FlightState, Ladder, Power, SonarHealth, SonarRanges, Text};
use runtime::{ByteDevice, Input, Output, Ports, Service, Start, StartError};

/// A port that vanished in the air is wanted back at once; one that has been away is not.
const RETRY_SOON_NS: u64 = 50_000_000;
const RETRY_LATER_NS: u64 = 500_000_000;
const SOON_FOR_NS: u64 = 2_000_000_000;
/// Time between two reports of an unchanged state.
const STATE_NS: u64 = 200_000_000;

/// The service.
pub struct Flight {
    core: Core,
    device: Box<dyn ByteDevice>,
    channels: Input<Channels>,
    ranges: Input<SonarRanges>,
    attitude: Output<Attitude>,
    state: Output<FlightState>,
    power: Output<Power>,
    /// When the port was lost; the first step, before it ever was open.
    lost_ns: Option<u64>,
    retry_ns: u64,
    reported_ns: Option<u64>,
    reported: (u8, u8, u8),
    now: u64,
    nonsense: u64,
}

impl Service for Flight {
    const NAME: &'static str = "flight";
    type Config = Config;

    fn start(config: Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        Ok(Self {
            core: Core::new(&config, start.vehicle.battery.cells),
            device: ports.device("controller")?,
            channels: ports.input()?,
            ranges: ports.input()?,
            attitude: ports.output()?,
            state: ports.output()?,
            power: ports.output()?,
            lost_ns: None,
            retry_ns: 0,
            reported_ns: None,
            reported: (0, 0, 0),
            now: 0,
            nonsense: 0,
        })
    }

    fn step(&mut self, now: u64) {
        self.now = now;
        while let Some(message) = self.channels.receive() {
            self.core.pilot(now, &message);
        }
        while let Some(message) = self.ranges.receive() {
            self.hear(now, &message);
        }
        self.open(now);
        self.read(now);
        self.core.step(now);
        self.write(now);
        self.publish(now);
    }

    fn status(&self, text: &mut Text<96>) {
        let link = self.core.link_state(self.now);
        let step = Ladder::from_code(self.reported.1).map_or("", Ladder::word);
        let _ = write!(text, "{link}, {step}");
        let mut reason = Text::<128>::default();
        let _ = self.core.write_reason(self.now, &mut reason);
        if !reason.as_str().is_empty() {
            let _ = write!(text, "; {reason}");
        }
    }

    fn refused(&self) -> u64 {
        self.core.refused() + self.nonsense
    }
}

impl Flight {
    fn hear(&mut self, now: u64, message: &SonarRanges) {
        if message.count as usize > ipc_types::MAX_SONARS {
            self.nonsense += 1;
            return;
        }
        for reading in message.filled().iter().filter(|reading| reading.looks_down()) {
            let range = reading.range().filter(|_| reading.health == SonarHealth::Good.code());
            self.core.down_sonar(now, reading.ping_ns, range);
        }
    }

    fn open(&mut self, now: u64) {
        if self.core.is_open() || now < self.retry_ns {
            return;
        }
        match self.device.open() {
            Ok(()) => self.core.opened(now),
            Err(error) => self.lost(now, &error.0),
        }
    }

    fn lost(&mut self, now: u64, reason: &str) {
        if self.core.is_open() {
            self.lost_ns = Some(now);
        }
        self.device.close();
        self.core.closed(reason);
        // Started again in the air, it may find the port still claimed by the process that was killed.
        let soon = now.saturating_sub(*self.lost_ns.get_or_insert(now)) < SOON_FOR_NS;
        self.retry_ns = now + if soon { RETRY_SOON_NS } else { RETRY_LATER_NS };
    }

    fn read(&mut self, now: u64) {
        let mut buffer = [0; 512];
        // Two full buffers are what a step of 5 ms can bring at 115200 baud, ten times over.
        for _ in 0..2 {
            if !self.core.is_open() {
                return;
            }
            match self.device.read(&mut buffer) {
                Ok(count) => {
                    self.core.receive(now, buffer.get(..count).unwrap_or(&[]));
                    if count < buffer.len() {
                        return;
                    }
                }
                Err(error) => self.lost(now, &error.0),
            }
        }
    }

    fn write(&mut self, now: u64) {
        while self.core.is_open() && !self.core.waiting().is_empty() {
            match self.device.write(self.core.waiting()) {
                Ok(0) => return,
                Ok(count) => self.core.taken(count),
                Err(error) => self.lost(now, &error.0),
            }
        }
    }

    fn publish(&mut self, now: u64) {
        if let Some(attitude) = self.core.take_attitude() {
            self.attitude.publish(&attitude);
        }
        if let Some(power) = self.core.take_power() {
            self.power.publish(&power);
        }
        let shape = self.core.shape(now);
        let due = self.reported_ns.is_none_or(|last| now.saturating_sub(last) >= STATE_NS);
        if due || shape != self.reported {
            self.state.publish(&self.core.state(now));
            self.reported_ns = Some(now);
            self.reported = shape;
        }
    }
}

impl core::fmt::Debug for Flight {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Flight").field("core", &self.core).finish_non_exhaustive()
    }
}
