//! One step: from phase and wishes to sticks.

use crate::core::{Decided, PilotCore};
use crate::phases::{BLIND_M_S, BLIND_SHORT};
use crate::senses::{UNSEEN_S, age_s};
use control::{
    Action, Asking, Cause, Flown, Source, Surroundings, Tilt, Vector, VerticalWish, Wish, arbitrate,
    hold_velocity, stick, wrap_angle, yaw_rate,
};
use core::f32::consts::TAU;
use ipc_types::{ChannelSource, Phase, SetpointKind};

/// Near the ground tilts stay small, so that no skid touches first: clearance in metres, most tilt in radians.
const NEAR_GROUND: [(f32, f32); 3] = [(0.06, 0.035), (0.15, 0.07), (0.35, 0.12)];
/// Most of the level trim with the learned disturbance, radians (5 degrees).
const MOST_TRIM_RAD: f32 = 0.087;
/// Time over which the trim that `flight` would hold level with is averaged, seconds.
const TRIM_S: f32 = 6.0;
/// Below this clearance a landing learns no hover throttle: the ground carries, by air or by skids.
const LEARN_CLEARANCE_M: f32 = 0.35;
/// A velocity that is less certain is not flown by, m/s.
const MOST_VELOCITY_SIGMA: f32 = 0.6;
/// Standard deviation of the velocity up to which the full gain is flown, m/s: with optical flow it is 0.04 to 0.07.
const SURE_VELOCITY: f32 = 0.075;
/// An older pose only reckons the velocity on, seconds: three of them are missing.
const FRESH_POSE_S: f32 = 0.15;
/// A draught of which no pose tells any more dies away in this time, seconds: that of the localization's own model.
const AIR_S: f32 = 1.0;
/// No wish is flown faster than this many times the vehicle's cruise speed.
const FASTEST: f32 = 1.2;
/// Nearer than this to the place that it holds it was there a moment ago, metres.
const BACK_M: f32 = 0.4;
/// A velocity is reckoned on by tilt alone for so long, seconds.
const RECKON_S: f32 = 1.5;
/// To and fro by so much, radians, once in so many seconds: the sonars look 45 degrees apart, all around is heard in five
/// seconds, and a turn of 28 degrees a second moves no cone by a third of its width between two pings.
const LOOK_RAD: f32 = 0.785;
const LOOK_S: f32 = 10.0;
/// Growth and fall of the wished height, m/s.
const HEIGHT_SLEW_M_S: f32 = 0.3;

impl PilotCore {
    /// One step. [`Self::fills_channels`] tells whether there is something to fly.
    pub fn step(&mut self, now: u64) {
        let dt = self.last_step_ns.map_or(0.02, |last| age_s(Some(last), now)).clamp(0.001, 0.1);
        self.last_step_ns = Some(now);
        self.adopt(now);
        self.carry(now, dt);
        self.watch_hand(now);
        self.judge(now);
        self.mind_the_table(now);
        self.advance(now, dt);
        self.decided = match self.phase {
            Phase::Grounded | Phase::Cut => Decided::NEUTRAL,
            Phase::Arming => Decided { arm: true, source: ChannelSource::Pilot, ..self.levelled(1000.0) },
            Phase::TakeOff if self.spool.is_some() => {
                Decided { arm: true, source: ChannelSource::Pilot, ..self.levelled(self.climb.throttle_us()) }
            }
            _ => self.fly(now, dt),
        };
    }

    /// Carries place, velocity and height to now.
    fn carry(&mut self, now: u64, dt: f32) {
        let tilt = self.tilt();
        if self.airborne() {
            let acceleration = tilt.acceleration(self.heading()) + self.velocity.learned() + self.air(now);
            self.motion.predict(now, acceleration.limited(4.0));
            self.freeze(now);
            let own = self.climb.expected_acceleration(dt, tilt.magnitude(), self.height.climb_m_s());
            // Whoever else flies comes down steadily, with a throttle that is not known.
            let vertical = if self.flight.alone { 0.0 } else { own };
            if let Some(lifted) = self.attitude.lifted.take() {
                self.height.feel(now, lifted - self.ground.lifted - vertical);
            }
            self.height.predict(now, vertical);
            self.remember_floor(now, dt);
        } else {
            self.floor.forget();
            self.frozen = false;
            self.motion.predict(now, Vector::ZERO);
            self.height.set(now, 0.0, 0.0, 0.0);
        }
    }

    /// Remembers what was below along the way, in the compass's frame: it does not turn when the place is found anew.
    fn remember_floor(&mut self, now: u64, dt: f32) {
        if age_s(self.pose.at, now) >= RECKON_S {
            self.floor.forget();
            return;
        }
        let blind = self.height.silent_s(now) > self.config.failsafe.height_hold_s;
        let level =
            self.below.edge_m(now).map_or(self.height.surface_m(), |edge| edge.max(self.height.surface_m()));
        let velocity = self.motion.velocity().rotated(-self.pose.heading_offset);
        self.floor.go(dt, velocity, (!blind).then_some(level));
    }

    /// Whether the velocity may be flown by. Who is lost comes down level, but for the drift that the floor itself shows.
    pub(crate) fn velocity_known(&self, now: u64) -> bool {
        age_s(self.pose.at, now) < RECKON_S
            && self.pose.velocity_sigma < MOST_VELOCITY_SIGMA
            && (self.judged.action != Action::Descend || self.pose.velocity_sigma < SURE_VELOCITY)
    }

    /// What others fly teaches nothing. Who is followed again begins at the throttle that was flown, and what the height
    /// did meanwhile was none of its thrust's doing.
    fn freeze(&mut self, now: u64) {
        let frozen = self.flight.alone || age_s(self.attitude.at, now) > UNSEEN_S;
        if self.frozen && !frozen {
            self.height.take_bias(1.0);
            self.climb.set_throttle(f32::from(self.flight.throttle_us));
        }
        self.frozen = frozen;
    }

    /// What the air does, as far as the newest pose tells: it dies away.
    fn air(&self, now: u64) -> Vector {
        self.pose.air * (-age_s(self.pose.at, now) / AIR_S).exp()
    }

    /// Sticks that hold the body level at a throttle.
    fn levelled(&self, throttle_us: f32) -> Decided {
        Decided {
            roll_us: stick::of_angle(self.trim.roll),
            pitch_us: stick::of_angle(self.trim.pitch),
            throttle_us,
            ..Decided::NEUTRAL
        }
    }

    /// The attitude on the ground tells the level error, before the localization can know it.
    pub(crate) fn seed_level(&mut self) {
        let level = self.level();
        if self.ground.seen >= 10 && self.ground.tilt.magnitude() < MOST_TRIM_RAD {
            let more = Tilt {
                roll: self.ground.tilt.roll - level.roll,
                pitch: self.ground.tilt.pitch - level.pitch,
            };
            self.velocity.set_learned(-more.acceleration(self.heading()));
            self.trim = self.ground.tilt;
        } else {
            self.velocity.set_learned(Vector::ZERO);
            self.trim = level;
        }
    }

    /// The horizontal wish (plan frame), whose it is, and when it expires.
    fn wish(&mut self, now: u64) -> (Wish, Source, u64) {
        let setpoint = self.fresh_setpoint(now).filter(|_| self.phase == Phase::Autonomous);
        let sticks = self.followed();
        let asking = Asking {
            airborne: true,
            navigation: setpoint.is_some(),
            sticks: sticks.is_some(),
            failsafe: self.judged.action,
        };
        let source = arbitrate(&asking);
        let place = self.place_known();
        let mut expiry_ns = u64::MAX;
        if let (Source::Navigation, Some(setpoint)) = (source, setpoint) {
            expiry_ns = setpoint.expiry_ns;
            if let Some(heading) = setpoint.heading {
                self.hold_heading = Some(heading);
            }
            if let Some(height) = setpoint.height_m {
                self.height_wish_m = height;
            }
            match (setpoint.kind, setpoint.hold) {
                (SetpointKind::Velocity, _) => {
                    self.hold = None;
                    return (Wish::to(setpoint.velocity), source, expiry_ns);
                }
                (_, Some(hold)) => self.hold = Some(hold),
                (_, None) => self.settle(),
            }
        } else if let (Source::Manual, Some(sticks)) = (source, sticks) {
            expiry_ns = self.flown_until(&sticks);
            if let Some(velocity) = self.asked_velocity(&sticks) {
                self.hold = None;
                return (Wish::to(velocity), source, expiry_ns);
            }
            self.settle();
        } else if self.phase == Phase::Manual {
            self.settle();
        } else if source == Source::Failsafe && self.phase == Phase::Autonomous {
            // Standing still where it stopped, not where navigation last wanted it.
            if self.hold.is_some_and(|hold| (hold - self.motion.place()).norm() > 0.5) {
                self.hold = None;
            }
            self.settle();
            self.look_around(now);
        }
        if source != Source::Failsafe {
            self.looks_from = None;
        }
        if let Some(place) = self.lands_at {
            let way = self.floor.way_to(place).rotated(self.pose.heading_offset);
            return (Wish::to(hold_velocity(&self.config.hold, way, Vector::ZERO)), source, expiry_ns);
        }
        let wish = match self.hold {
            Some(hold) if place => Wish {
                velocity: hold_velocity(&self.config.hold, hold, self.motion.place()),
                back: (hold - self.motion.place()).norm() < BACK_M,
            },
            _ => Wish::default(),
        };
        (wish, source, expiry_ns)
    }

    /// Who stands and is not sure of its place turns to and fro: from the same heading it hears the same again.
    fn look_around(&mut self, now: u64) {
        let hovers =
            self.judged.action == Action::Hover && self.judged.causes & Cause::PoseUncertain.bit() != 0;
        if !hovers || age_s(self.pose.at, now) > FRESH_POSE_S {
            self.looks_from = None;
            return;
        }
        let here = self.hold_heading.unwrap_or_else(|| self.heading());
        let (since, from) = *self.looks_from.get_or_insert((now, here));
        let phase = TAU * age_s(Some(since), now) / LOOK_S;
        self.hold_heading = Some(wrap_angle(from + LOOK_RAD * phase.sin()));
    }

    fn fly(&mut self, now: u64, dt: f32) -> Decided {
        let (wish, source, expiry_ns) = self.wish(now);
        let clearance = self.height.clearance_m();
        let heading = self.heading();
        let wish = Wish { velocity: wish.velocity.limited(FASTEST * self.craft.cruise_m_s), ..wish };
        let plan = Surroundings { walls: self.walls.as_deref(), zones: self.zones.as_deref() };
        self.delay.attitude(now, age_s(self.attitude.sampled, now));
        self.shield.set_delay(self.delay.more_s(now));
        let guarded = self.shield.guard(now, wish, &self.footing(), &plan);
        let velocity = self.velocity_known(now).then(|| self.motion.velocity());
        let trust = if self.frozen || age_s(self.pose.at, now) > FRESH_POSE_S {
            0.0
        } else {
            SURE_VELOCITY / self.pose.velocity_sigma.max(SURE_VELOCITY)
        };
        let most = NEAR_GROUND
            .iter()
            .find(|(height, _)| clearance < *height)
            .map_or(self.craft.max_tilt_rad, |(_, tilt)| *tilt);
        let flown = Flown {
            velocity,
            trust,
            air: self.air(now),
            tilt: self.tilt(),
            tilt_age_s: age_s(self.attitude.sampled, now),
            heading,
            most_tilt_rad: most,
        };
        let tilt = self.velocity.step(dt, guarded.velocity, &flown);
        let level = self.level();
        if !self.frozen {
            self.learn_trim(dt, level, heading);
        }
        let bound = |angle: f32| angle.clamp(-MOST_TRIM_RAD - most, MOST_TRIM_RAD + most);
        let (roll, pitch) = (bound(tilt.roll + level.roll), bound(tilt.pitch + level.pitch));

        let throttle_us = self.throttle(now, dt);
        let wanted = *self.hold_heading.get_or_insert(heading);
        let seen = age_s(self.attitude.at, now) < UNSEEN_S;
        let turn = match self.asked_turn().filter(|_| source == Source::Manual) {
            _ if !seen => 0.0,
            Some(turn) => turn,
            None => yaw_rate(&self.config.heading, wanted, heading),
        };
        Decided {
            arm: true,
            source: match source {
                Source::Neutral => ChannelSource::Neutral,
                Source::Pilot => ChannelSource::Pilot,
                Source::Navigation => ChannelSource::Navigation,
                Source::Manual => ChannelSource::Manual,
                Source::Failsafe => ChannelSource::Failsafe,
            },
            roll_us: stick::of_angle(roll),
            pitch_us: stick::of_angle(pitch),
            throttle_us,
            yaw_us: stick::of_yaw_rate(turn),
            shield_speed_m_s: guarded.allowed_m_s,
            expiry_ns,
        }
    }

    /// The trim that keeps the body where it is: level error and learned disturbance, slowly.
    fn learn_trim(&mut self, dt: f32, level: Tilt, heading: f32) {
        let against = Tilt::of_acceleration(-self.velocity.disturbance(), heading);
        let bound = |angle: f32| angle.clamp(-MOST_TRIM_RAD, MOST_TRIM_RAD);
        let share = dt / TRIM_S;
        self.trim.roll += share * (bound(level.roll + against.roll) - self.trim.roll);
        self.trim.pitch += share * (bound(level.pitch + against.pitch) - self.trim.pitch);
    }

    fn throttle(&mut self, now: u64, dt: f32) -> f32 {
        let c = &self.config;
        let clearance = self.height.clearance_m();
        let tilt = self.tilt().magnitude();
        let blind = self.height.silent_s(now) > c.failsafe.height_hold_s;
        let (wish, learn) = match self.phase {
            Phase::Landing | Phase::EmergencyLanding if self.lands_at.is_none() => {
                let off = match self.hold {
                    Some(hold) if self.place_known() => (hold - self.motion.place()).norm(),
                    _ => 0.0,
                };
                let aside = off > c.landing.aside_m && clearance > c.landing.slow_below_m;
                let wait = self.phase == Phase::Landing && aside && self.aside_s < c.landing.patience_s;
                if wait {
                    self.aside_s += dt;
                }
                let rate = if wait {
                    0.0
                } else if blind {
                    -BLIND_M_S
                } else if clearance < c.landing.slow_below_m {
                    -c.landing.slow_m_s
                } else {
                    -c.landing.descent_m_s
                };
                (VerticalWish::Rate(rate), clearance > LEARN_CLEARANCE_M && !blind)
            }
            _ if blind => (VerticalWish::Rate(0.0), false),
            Phase::TakeOff => {
                let left = c.height_m - self.height.height_m();
                let rate =
                    (c.climb.height_gain_per_s * left).clamp(-c.take_off.climb_m_s, c.take_off.climb_m_s);
                (VerticalWish::Rate(rate), true)
            }
            _ => {
                let below = self
                    .below
                    .edge_m(now)
                    .map_or(self.height.surface_m(), |edge| edge.max(self.height.surface_m()));
                let least = c.min_height_m.min(c.height_m);
                let (low, high) = ((below + c.min_clearance_m).clamp(least, c.max_height_m), c.max_height_m);
                let reach = HEIGHT_SLEW_M_S / c.climb.height_gain_per_s;
                let now_m = self.height.height_m();
                match self.asked_climb(low, high) {
                    Some(rate) => (VerticalWish::Rate(rate), true),
                    None => {
                        let wish = self.height_wish_m.clamp(low, high);
                        (VerticalWish::Height(wish.clamp(now_m - reach, now_m + reach)), true)
                    }
                }
            }
        };
        let throttle_us = self.climb.step(dt, wish, &mut self.height, tilt, learn && !self.frozen);
        let lands = matches!(self.phase, Phase::Landing | Phase::EmergencyLanding);
        // What is held back is not reckoned with.
        let share = if blind && lands && clearance < 0.0 { BLIND_SHORT } else { 1.0 };
        1000.0 + (throttle_us - 1000.0) * share
    }

    /// Whether there is something to fly: not before it is known whether the motors run already.
    #[must_use]
    pub fn fills_channels(&self) -> bool {
        self.phase != Phase::Grounded || self.flight.at.is_some()
    }

    /// An armed controller and no memory of a flight: in the air it is taken over, on the ground not.
    fn adopt(&mut self, now: u64) {
        let alone = self.phase == Phase::Grounded
            && self.flight.armed
            && self.decided.source == ChannelSource::Neutral;
        let Some(range) = self.down.range_m.filter(|_| alone) else { return };
        let height = range - self.height.rest_m();
        if height < 0.3 || self.flight.throttle_us < 1150 {
            return;
        }
        self.climb.set_hover(f32::from(self.flight.throttle_us));
        self.climb.set_throttle(f32::from(self.flight.throttle_us));
        self.hover_known = true;
        self.height.set(now, height, 0.0, 0.0);
        self.trim = self.level();
        self.velocity.set_learned(Vector::ZERO);
        self.hold = None;
        self.hold_heading = Some(wrap_angle(self.heading()));
        self.height_wish_m = self.config.height_m;
        self.enter(now, Phase::Hover);
        self.say("took over a flying drone");
    }
}
