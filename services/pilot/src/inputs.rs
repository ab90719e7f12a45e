//! What the pilot hears.

use crate::core::PilotCore;
use crate::senses::{SetpointSeen, age_s};
use control::{Echo, GridView, Look, Tilt, Vector, wrap_angle};
use ipc_types::{
    Attitude, FlightState, FlowMotion, GRID_SIDE, Grid, Patrol, PatrolState, Phase, Pose, Power, Setpoint,
    SonarHealth, SonarRanges, SonarStatus,
};

/// Speed of sound at 20 C, m/s, to place an echo in time.
const SOUND_M_S: f32 = 343.0;

/// A pose farther from the place than this is another place, metres: no correction is as large, and no gust moves the
/// drone so far between two poses.
const JUMP_M: f32 = 0.5;

/// What an accelerometer's scale may be off by, m/s2: 3 % by the sensors' data sheets, and as much by its calibration.
const MOST_SCALE_M_S2: f32 = 0.6;

/// Standard deviation of the place up to which a wall of the plan must be heard, metres.
const SURE_M: f32 = 0.25;

impl PilotCore {
    /// Takes an attitude.
    pub fn attitude(&mut self, message: &Attitude) {
        if !self.attitude.take(message) {
            self.refused += 1;
            return;
        }
        if self.phase == Phase::Grounded && !self.flight.armed {
            // On the ground gravity is all that the controller's accelerometer feels: about a second's mean.
            let share = if self.ground.seen == 0 { 1.0 } else { 0.03 };
            self.ground.seen = self.ground.seen.saturating_add(1);
            let (old, new) = (self.ground.tilt, self.attitude.tilt);
            self.ground.tilt = Tilt {
                roll: old.roll + share * (new.roll - old.roll),
                pitch: old.pitch + share * (new.pitch - old.pitch),
            };
            if let Some(lifted) = self.attitude.lifted.take() {
                let lifted = lifted.clamp(-MOST_SCALE_M_S2, MOST_SCALE_M_S2);
                self.ground.lifted += share * (lifted - self.ground.lifted);
            }
        }
    }

    /// Takes a pose.
    pub fn pose(&mut self, message: &Pose) {
        let before = self.pose.at.map(|_| (self.pose.heading_offset, self.motion.place()));
        let Some((at, place, velocity)) = self.pose.take(message) else {
            self.refused += 1;
            return;
        };
        if let Some((offset, last)) = before
            && (place - last).norm() > JUMP_M
        {
            self.follow_jump(wrap_angle(self.pose.heading_offset - offset));
        }
        self.motion.correct(at, place, velocity);
    }

    /// Localization has found another place: what was noted in the plan's frame lies elsewhere, and turned.
    fn follow_jump(&mut self, turned: f32) {
        self.hold = None;
        self.looks_from = None;
        self.shield.forget();
        self.hold_heading = self.hold_heading.map(|heading| wrap_angle(heading + turned));
        let learned = self.velocity.learned();
        self.velocity.set_learned(learned.rotated(turned));
    }

    /// Takes what the controller and its link are doing.
    pub fn flight_state(&mut self, message: &FlightState) {
        if !self.flight.take_state(message) {
            self.refused += 1;
        }
    }

    /// Takes the battery.
    pub fn power(&mut self, message: &Power) {
        self.flight.take_power(message, self.craft.cells);
    }

    /// Takes a setpoint of navigation.
    pub fn setpoint(&mut self, message: &Setpoint) {
        match SetpointSeen::read(message) {
            Some(setpoint) => self.setpoint = Some(setpoint),
            None => self.refused += 1,
        }
    }

    /// Takes the pad from navigation's round, to know the way home.
    pub fn patrol(&mut self, message: &Patrol) {
        let known = u8::try_from(message.state).ok().and_then(PatrolState::from_code);
        let pad = Vector::new(message.pad_x_m, message.pad_y_m);
        let flies =
            !matches!(known, None | Some(PatrolState::Idle | PatrolState::Done | PatrolState::Failed));
        if self.resumed && self.phase == Phase::TakeOff && flies && self.automatic {
            // What the interrupted take-off was for: navigation remembers its round.
            self.after_take_off = Phase::Autonomous;
        }
        // Without a round the pad is where the drone took off, which it knows better, unless it has forgotten.
        let forgotten = self.airborne() && self.way_home.as_ref().is_some_and(|way| way.home().is_none());
        let asked = known.is_some_and(|state| state != PatrolState::Idle);
        if (asked || (known.is_some() && forgotten)) && pad.is_finite() {
            self.set_home(pad);
        }
    }

    pub(crate) fn set_home(&mut self, home: Vector) {
        if let Some(way) = &mut self.way_home
            && way.home().is_none_or(|known| (known - home).norm() > 0.3)
        {
            way.set_home(home);
        }
    }

    /// Takes navigation's grid, while the place that it is drawn around is believed.
    pub fn grid(&mut self, message: &Grid) {
        if !self.place_known() {
            return;
        }
        let origin = Vector::new(message.origin_x_m, message.origin_y_m);
        let view = GridView { origin, cell_m: message.cell_m, side: GRID_SIDE, cells: &message.cells };
        self.shield.see(message.header.stamp_ns, self.motion.place(), &view);
    }

    /// Takes a ping group.
    pub fn ranges(&mut self, message: &SonarRanges) {
        if message.count as usize > ipc_types::MAX_SONARS {
            self.refused += 1;
            return;
        }
        self.shield.set_sweep(message.sweep_s);
        let newest = message.filled().iter().map(|reading| reading.ping_ns).max();
        if let (Some(now), Some(ping_ns)) = (self.last_step_ns, newest) {
            self.delay.ping(now, age_s(Some(ping_ns), now));
        }
        for reading in message.filled() {
            let (Some(status), Some(health)) =
                (SonarStatus::from_code(reading.status), SonarHealth::from_code(reading.health))
            else {
                self.refused += 1;
                continue;
            };
            let good = health == SonarHealth::Good && status != SonarStatus::Fault;
            if reading.looks_down() {
                self.down.ping_ns = Some(reading.ping_ns);
                self.down.good = good;
                self.down.range_m = reading.range().filter(|_| good);
                if let Some(range) = self.down.range_m {
                    self.hear_ground(reading.ping_ns, range);
                }
            } else if good {
                let echo = match status {
                    SonarStatus::Ok => Echo::Range(reading.range_m),
                    _ => Echo::Nothing,
                };
                let look = Look {
                    at_ns: reading.ping_ns,
                    heading: self.heading(),
                    place: self.place_at(reading.ping_ns),
                    echo,
                };
                let sensor = usize::from(reading.sensor);
                if !self.shield.hear(sensor, look) {
                    self.refused += 1;
                } else if let Some(walls) = self.walls.as_deref().filter(|_| self.pose.sigma_m < SURE_M) {
                    self.shield.compare(sensor, walls);
                }
            }
        }
    }

    /// Takes the range of the flow sensor's beam.
    pub fn flow(&mut self, message: &FlowMotion) {
        if !self.below.range(message.header.stamp_ns, message.ranged_ns, message.range_m) {
            return;
        }
        if self.phase == Phase::Grounded && !self.flight.armed {
            self.below.stand(message.range_m);
        } else if self.spool.is_none() && self.airborne() {
            let tilt = self.tilt().magnitude();
            self.height.measure_beam(message.ranged_ns, message.range_m, self.below.rest_m(), tilt);
        }
    }

    fn hear_ground(&mut self, ping_ns: u64, range_m: f32) {
        let at = ping_ns.saturating_add((range_m / SOUND_M_S * 1e9) as u64);
        if let Some(spool) = &mut self.spool {
            spool.hear(at, range_m - self.height.rest_m());
        } else if self.airborne() && self.below.sees(ping_ns) {
            let heard = self.height.height_m() - (range_m - self.height.rest_m());
            self.below.hear(at, heard, self.height.surface_m());
        } else if self.airborne() {
            let tilt = self.tilt().magnitude();
            self.height.measure(at, range_m, tilt);
        } else if self.phase == Phase::Grounded {
            self.down.stand(range_m);
        }
    }
}
