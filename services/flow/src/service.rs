//! [`Motion`] with the ports of the runtime.

use crate::config::Config;
use crate::motion::{Motion, Sensor};
use core::fmt::Write;
use ipc_types::{Attitude, FlowMotion, SonarRanges, Text};
use runtime::{ByteDevice, Input, Output, Ports, Service, Start, StartError};

/// Time between two attempts to open the port.
const RETRY_NS: u64 = 500_000_000;
/// Without a frame for so long the sensor counts as silent.
const SILENT_NS: u64 = 500_000_000;

/// The sensor and its port.
struct Fitted {
    motion: Motion,
    device: Box<dyn ByteDevice>,
    /// The device said itself that it is open, and the decoder starts anew.
    open: bool,
    retry_ns: u64,
    closed_because: Text<96>,
    heard_ns: Option<u64>,
}

/// The service.
pub struct Flow {
    fitted: Option<Fitted>,
    attitudes: Input<Attitude>,
    ranges: Input<SonarRanges>,
    output: Output<FlowMotion>,
    now: u64,
    quality: u32,
    nonsense: u64,
}

impl Service for Flow {
    const NAME: &'static str = "flow";
    type Config = Config;

    fn start(config: Config, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        let fitted = match &start.vehicle.flow {
            Some(sensor) => Some(Fitted {
                motion: Motion::new(
                    &config,
                    Sensor {
                        rate_hz: sensor.rate_hz,
                        count_rad: sensor.count_rad,
                        yaw_rad: sensor.yaw_rad,
                        min_height_m: sensor.min_height_m,
                        max_height_m: sensor.max_height_m,
                    },
                ),
                device: ports.device("flow")?,
                open: false,
                retry_ns: 0,
                closed_because: Text::new("not opened yet"),
                heard_ns: None,
            }),
            None => None,
        };
        Ok(Self {
            fitted,
            attitudes: ports.input()?,
            ranges: ports.input()?,
            output: ports.output()?,
            now: 0,
            quality: 0,
            nonsense: 0,
        })
    }

    fn step(&mut self, now: u64) {
        self.now = now;
        let Some(fitted) = &mut self.fitted else {
            // Taken all the same, so that nothing counts as lost.
            while self.attitudes.receive().is_some() {}
            while self.ranges.receive().is_some() {}
            return;
        };
        while let Some(attitude) = self.attitudes.receive() {
            self.nonsense += u64::from(!fitted.motion.attitude(&attitude));
        }
        while let Some(ranges) = self.ranges.receive() {
            let down = ranges.filled().iter().filter(|reading| reading.looks_down());
            for range in down.filter_map(ipc_types::SonarReading::range) {
                fitted.motion.down_sonar(now, range);
            }
        }
        fitted.read(now);
        while let Some(motion) = fitted.motion.next(now) {
            fitted.heard_ns = Some(now);
            self.quality = motion.quality;
            self.output.publish(&motion);
        }
    }

    fn status(&self, text: &mut Text<96>) {
        let _ = match &self.fitted {
            None => text.write_str("idle: this vehicle has no flow sensor"),
            Some(fitted) if !fitted.open => write!(text, "port closed: {}", fitted.closed_because),
            Some(fitted) => match fitted.heard_ns {
                Some(at) if self.now.saturating_sub(at) < SILENT_NS => {
                    write!(text, "quality {}, {} refused", self.quality, fitted.motion.refused())
                }
                _ => text.write_str("sensor silent"),
            },
        };
    }

    fn refused(&self) -> u64 {
        self.nonsense
    }
}

impl Fitted {
    fn read(&mut self, now: u64) {
        if !self.open {
            if now < self.retry_ns {
                return;
            }
            match self.device.open() {
                Ok(()) => {
                    self.open = true;
                    self.motion.reopened();
                }
                Err(error) => return self.lost(now, &error.0),
            }
        }
        let mut buffer = [0; 256];
        match self.device.read(&mut buffer) {
            Ok(count) => self.motion.receive(now, buffer.get(..count).unwrap_or(&[])),
            Err(error) => self.lost(now, &error.0),
        }
    }

    fn lost(&mut self, now: u64, reason: &str) {
        self.device.close();
        self.open = false;
        self.closed_because.set(reason);
        self.retry_ns = now + RETRY_NS;
    }
}

impl core::fmt::Debug for Flow {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let motion = self.fitted.as_ref().map(|fitted| &fitted.motion);
        f.debug_struct("Flow").field("motion", &motion).finish_non_exhaustive()
    }
}
