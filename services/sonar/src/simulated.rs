//! The driver of simulated sonars: a trigger is a message, and so is the echo.

use crate::driver::{Answer, Collected, SonarDriver};
use ipc_types::{Echo, MAX_SONARS, Ping};
use runtime::{Input, Output, Ports, StartError};

/// `sim/ping` out, `sim/echo` in.
pub(crate) struct Simulated {
    pings: Output<Ping>,
    echoes: Input<Echo>,
    group: u32,
    ping: u32,
    triggered_ns: u64,
    refused: u64,
}

impl Simulated {
    pub(crate) fn new(ports: &mut Ports, incarnation: u32) -> Result<Self, StartError> {
        Ok(Self {
            pings: ports.output()?,
            echoes: ports.input()?,
            group: 0,
            // An echo to a ping of the process before this one must not be taken for ours.
            ping: incarnation.wrapping_mul(0x0010_0000),
            triggered_ns: 0,
            refused: 0,
        })
    }

    /// The answers in a message; `None` when it makes no sense.
    fn read(&self, echo: &Echo, now: u64) -> Option<Collected> {
        let mut answers = [None; MAX_SONARS];
        for reading in echo.readings.get(..echo.count as usize)? {
            let sensor = usize::from(reading.sensor);
            if sensor >= MAX_SONARS || self.group >> sensor & 1 == 0 {
                return None;
            }
            answers[sensor] = Some(match reading.answered {
                0 => Answer::Silent,
                _ if reading.pulse_s.is_nan() => Answer::NoEcho,
                _ => Answer::Pulse(reading.pulse_s),
            });
        }
        // The ping left after it was ordered and before now, whatever the other clock says.
        Some(Collected { ping_ns: echo.ping_ns.clamp(self.triggered_ns, now), answers })
    }
}

impl SonarDriver for Simulated {
    fn trigger(&mut self, group: u32, now: u64) -> bool {
        self.ping = self.ping.wrapping_add(1);
        self.group = group;
        self.triggered_ns = now;
        let Some(mut ping) = self.pings.loan() else { return false };
        ping.sensors = group;
        ping.ping = self.ping;
        ping.send();
        true
    }

    fn collect(&mut self, now: u64) -> Option<Collected> {
        while let Some(echo) = self.echoes.receive() {
            // An echo that comes after its slot was given up is no news.
            if echo.ping != self.ping {
                continue;
            }
            if let Some(collected) = self.read(&echo, now) {
                return Some(collected);
            }
            self.refused += 1;
        }
        None
    }

    fn refused(&self) -> u64 {
        self.refused
    }
}
