//! What faults do to a flight.

use super::Simulation;
use super::displacement::Displacement;
use super::faults::{Change, Fault, FaultError, Faults};
use crate::acoustics::MAX_SENSORS;
use crate::controller::Controller;

/// The flight controller's supply, and what its count of the charge does not know.
#[derive(Clone, Debug, Default)]
pub(super) struct Power {
    /// When the controller was switched on, simulated nanoseconds.
    pub(super) since_ns: u64,
    /// Off until then.
    off_until_ns: Option<u64>,
    /// The controller as it comes out of a boot.
    fresh: Option<Box<Controller>>,
    /// Charge that is gone and was not counted, milliampere-hours.
    pub(super) uncounted_mah: f64,
}

impl Simulation {
    /// The flight with faults, to be given before it begins.
    ///
    /// # Errors
    /// A sonar that the vehicle does not have, a door that the plan does not have.
    pub fn with_faults(
        mut self,
        faults: &[Fault],
        vehicle: &manifest::Vehicle,
        seed: u64,
    ) -> Result<Self, FaultError> {
        if !faults.is_empty() {
            self.faults = Some(Box::new(Faults::new(faults, vehicle, &self.world, seed)?));
            self.power.fresh = Some(Box::new(self.controller.clone()));
            // What is broken from the start is broken before the first step.
            self.suffer();
        }
        Ok(self)
    }

    pub(super) fn is_powered(&self) -> bool {
        self.power.off_until_ns.is_none()
    }

    /// Lets faults begin and end, and does what they do.
    pub(super) fn suffer(&mut self) {
        let now_ns = self.now_ns;
        if self.power.off_until_ns.is_some_and(|until| now_ns >= until) {
            self.boot();
        }
        // Taken out and put back: what happens concerns the whole flight.
        let Some(mut faults) = self.faults.take() else { return };
        let airborne = self.controller.is_armed() && !self.touch.on_ground();
        let effects = faults.advance(now_ns, airborne, |change| self.happen(&change));
        if let Some(effects) = effects {
            self.effects = effects;
            self.craft.battery_mut().set_wear(effects.wear);
            self.craft.set_motor_shares(effects.motor_shares);
            self.craft.set_wind(effects.wind);
        }
        while let Some(byte) = faults.to.next(now_ns) {
            if self.is_powered() {
                self.controller.write(now_ns - self.power.since_ns, &[byte]);
            }
        }
        self.faults = Some(faults);
    }

    fn happen(&mut self, change: &Change) {
        match change {
            Change::Turn { sensors, angle_rad } => {
                (0..MAX_SENSORS)
                    .filter(|sensor| sensors & (1 << sensor) != 0)
                    .for_each(|sensor| self.acoustics.turn(sensor, *angle_rad));
            }
            Change::Charge(charge) => {
                let battery = self.craft.battery_mut();
                let before_mah = battery.drawn_mah();
                battery.sink_to(*charge);
                self.power.uncounted_mah += battery.drawn_mah() - before_mah;
            }
            Change::Reboot { seconds } => {
                self.power.off_until_ns = Some(self.now_ns + (seconds * 1e9) as u64);
            }
            Change::Carry { metres, direction_rad } => {
                self.displacement = Some(Displacement::at_once(*metres, *direction_rad));
            }
            // The name was looked up before the flight.
            Change::Door { name, shut } => {
                self.world.set_door(name, *shut);
            }
            Change::Enter { name, place, m_s, up_to_m } => {
                self.world.people_mut().enter(name, *place, *m_s, *up_to_m);
            }
            Change::Leave { name } => self.world.people_mut().leave(name),
        }
    }

    /// Boots the controller anew: disarmed, its receiver empty, its count of the charge at zero.
    fn boot(&mut self) {
        self.power.off_until_ns = None;
        self.power.since_ns = self.now_ns;
        self.power.uncounted_mah = self.craft.battery().drawn_mah();
        if let Some(fresh) = &self.power.fresh {
            self.controller.clone_from(fresh);
        }
    }

    /// Bytes from the controller over a sound line.
    pub(super) fn hear(&mut self, out: &mut [u8]) -> usize {
        if !self.is_powered() {
            return 0;
        }
        self.controller.read(self.now_ns - self.power.since_ns, out)
    }

    /// Bytes from the controller over a line in trouble.
    pub(super) fn hear_troubled(&mut self, out: &mut [u8]) -> usize {
        let mut chunk = [0; 256];
        loop {
            let count = self.hear(&mut chunk);
            let Some(faults) = self.faults.as_mut().filter(|_| count > 0) else { break };
            faults.hear(self.now_ns, chunk.get(..count).unwrap_or_default());
        }
        let Some(faults) = &mut self.faults else { return 0 };
        let mut count = 0;
        for place in out {
            let Some(byte) = faults.from.next(self.now_ns) else { break };
            *place = byte;
            count += 1;
        }
        count
    }
}
