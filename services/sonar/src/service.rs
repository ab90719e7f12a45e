//! The service: slots, readings, health.

use crate::driver::{Answer, Collected, SonarDriver};
use crate::health::SensorHealth;
use crate::range::Converter;
use crate::schedule::{Schedule, Slot};
use crate::simulated::Simulated;
use crate::{HealthRules, SonarConfig};
use ipc_types::{MAX_SONARS, SonarHealth, SonarRanges, SonarReading, Text};
use manifest::SonarMount;
use runtime::{Output, Ports, Service, Start, StartError};
use std::fmt::Write;

/// A tick that comes so much before the slot's end is taken for it: ticks jitter, and a tick later would
/// stretch the slot by 5 ms each time.
const EARLY_NS: u64 = 1_000_000;

/// Fires the groups one after another and publishes `sonar/ranges`.
pub struct Sonar {
    ranges: Output<SonarRanges>,
    driver: Box<dyn SonarDriver>,
    sonars: Vec<SonarMount>,
    health: Vec<SensorHealth>,
    rules: HealthRules,
    schedule: Schedule,
    converter: Converter,
    slot_ns: u64,
    turn: usize,
    open: Option<Open>,
    due_ns: u64,
    late: u64,
}

/// A slot that waits for its echoes.
#[derive(Clone, Copy)]
struct Open {
    slot: Slot,
    triggered_ns: u64,
}

impl Service for Sonar {
    const NAME: &'static str = "sonar";
    type Config = SonarConfig;

    fn start(config: SonarConfig, ports: &mut Ports, start: &Start) -> Result<Self, StartError> {
        if !start.simulated {
            return Err(StartError::invalid(
                "sonar: only simulated sonars can be fired by this build; start the system with its simulation overlay",
            ));
        }
        let sonars = start.vehicle.sonars.clone();
        Ok(Self {
            ranges: ports.output()?,
            driver: Box::new(Simulated::new(ports, start.incarnation)?),
            schedule: Schedule::new(&sonars).map_err(StartError::invalid)?,
            health: vec![SensorHealth::default(); sonars.len()],
            rules: config.health_rules(),
            converter: Converter::new(config.temperature_c),
            slot_ns: u64::from(config.slot_ms) * 1_000_000,
            sonars,
            turn: 0,
            open: None,
            due_ns: 0,
            late: 0,
        })
    }

    fn step(&mut self, now: u64) {
        if let Some(open) = self.open
            && let Some(collected) = self.driver.collect(now)
        {
            self.publish(open.slot, &collected);
            self.open = None;
        }
        if now + EARLY_NS < self.due_ns {
            return;
        }
        if let Some(open) = self.open.take() {
            // The slot is over and the driver has said nothing: that is a fault of every sensor in it.
            self.late += 1;
            let nothing = Collected { ping_ns: open.triggered_ns, answers: [None; MAX_SONARS] };
            self.publish(open.slot, &nothing);
        }
        let slot = self.schedule.slot(self.turn);
        self.turn = (self.turn + 1) % self.schedule.len();
        self.due_ns = now + self.slot_ns;
        self.driver.trigger(slot.sensors, now);
        self.open = Some(Open { slot, triggered_ns: now });
    }

    fn status(&self, text: &mut Text<96>) {
        let mut bad = 0;
        for (sonar, health) in self.sonars.iter().zip(&self.health) {
            let verdict = health.verdict(&self.rules);
            if verdict != SonarHealth::Good {
                // A text that is full is full.
                let _ = write!(text, "{}{} {verdict}", if bad > 0 { ", " } else { "" }, sonar.name);
                bad += 1;
            }
        }
        if bad == 0 {
            let _ = write!(text, "{} sonars good, {} slots late", self.sonars.len(), self.late);
        }
    }

    fn refused(&self) -> u64 {
        self.driver.refused()
    }
}

impl Sonar {
    fn publish(&mut self, slot: Slot, collected: &Collected) {
        let all_moves = self.health.iter().fold(0u32, |sum, h| sum.wrapping_add(h.moves()));
        let mut message = self.ranges.loan();
        let mut count = 0;
        for (i, (sonar, health)) in self.sonars.iter().zip(&mut self.health).enumerate() {
            if slot.sensors >> i & 1 == 0 {
                continue;
            }
            let answer = collected.answers[i].unwrap_or(Answer::Silent);
            let converted = self.converter.convert(answer, sonar.min_range_m, sonar.max_range_m);
            health.take(converted.status, converted.range_m, all_moves, &self.rules);
            if let Some(message) = &mut message {
                message.readings[count] = SonarReading {
                    ping_ns: collected.ping_ns,
                    range_m: converted.range_m,
                    bearing_rad: sonar.bearing_rad,
                    elevation_rad: sonar.elevation_rad,
                    mount_x_m: sonar.x_m,
                    mount_y_m: sonar.y_m,
                    mount_z_m: sonar.z_m,
                    sensor: i as u8,
                    status: converted.status.code(),
                    health: health.verdict(&self.rules).code(),
                    reserved: [0; 5],
                };
            }
            count += 1;
        }
        if let Some(mut message) = message {
            message.count = count as u32;
            message.group = slot.group;
            message.sweep_s = self.schedule.len() as f32 * self.slot_ns as f32 * 1e-9;
            message.sensors = self.sonars.len() as u32;
            message.readings[count..].fill(SonarReading::default());
            message.send();
        }
    }
}
