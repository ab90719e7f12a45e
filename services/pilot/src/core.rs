//! The pilot without ports.

use crate::command::Heard;
use crate::config::PilotConfig;
use crate::ground::Below;
use crate::manual::ByHand;
use crate::senses::{AttitudeSeen, DownSeen, FlightSeen, PoseSeen, SetpointSeen, UNSEEN_S, age_s};
use control::{
    ClimbController, Delay, Failsafe, FloorTrail, Footing, HeightEstimator, Held, Judgement, Motion, Shield,
    SpoolUp, Stage, Tilt, TouchDown, Vector, VelocityController, WayHome, wrap_angle,
};
use floorplan::{DistanceField, Plan};
use ipc_types::{ChannelSource, Phase, Text};
use runtime::Start;
use std::sync::Arc;

/// What the pilot must know about the aircraft.
#[derive(Clone, Debug, PartialEq)]
pub struct Craft {
    /// Radius of the disc, metres.
    pub radius_m: f32,
    /// Side sonars: index, azimuth of the axis, position of the face (body frame).
    pub sides: Vec<(usize, f32, Vector)>,
    /// Whether there is a down sonar.
    pub has_down: bool,
    /// What the down sonar should read on the ground, metres.
    pub rest_m: f32,
    /// What the flow sensor's beam should read on the ground, metres.
    pub beam_rest_m: f32,
    /// Throttle that should hover, microseconds.
    pub hover_us: f32,
    /// Cells in series.
    pub cells: u32,
    /// Charge of a full battery, milliampere-hours.
    pub capacity_mah: f32,
    /// Speed in the open, m/s.
    pub cruise_m_s: f32,
    /// Most tilt, radians.
    pub max_tilt_rad: f32,
}

impl Craft {
    /// What the pilot needs of the vehicle.
    #[must_use]
    pub fn of(start: &Start) -> Self {
        let v = &start.vehicle;
        let down = v.sonars.iter().find(|sonar| sonar.looks_down());
        // Thrust goes with the square of the command, which runs from idle to full as the throttle from 1000 to 2000.
        let load = v.body.mass_kg * control::GRAVITY_M_S2 / (4.0 * v.motors.max_thrust_n);
        let idle = v.motors.idle_fraction.clamp(0.0, 0.3);
        let share = (load.clamp(0.02, 0.9).sqrt() - idle) / (1.0 - idle);
        Self {
            radius_m: v.body.radius_m,
            sides: v
                .sonars
                .iter()
                .enumerate()
                .filter(|(_, sonar)| !sonar.looks_down())
                .map(|(index, sonar)| (index, sonar.bearing_rad, Vector::new(sonar.x_m, sonar.y_m)))
                .collect(),
            has_down: down.is_some(),
            // The middle of the cylinder is half its height above the skids.
            rest_m: down.map_or(0.0, |sonar| (0.5 * v.body.height_m + sonar.z_m).clamp(0.0, 0.3)),
            beam_rest_m: 0.5 * v.body.height_m,
            hover_us: 1000.0 + 1000.0 * share,
            cells: v.battery.cells,
            capacity_mah: v.battery.capacity_mah,
            cruise_m_s: v.limits.cruise_m_s,
            max_tilt_rad: v.limits.max_tilt_rad,
        }
    }
}

/// The level that the controller's attitude showed on the ground, averaged.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct GroundLevel {
    pub(crate) tilt: Tilt,
    /// What the accelerometer felt beside gravity, m/s2: what its scale is off by.
    pub(crate) lifted: f32,
    pub(crate) seen: u32,
}

/// What was decided in the last step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Decided {
    pub(crate) arm: bool,
    pub(crate) source: ChannelSource,
    pub(crate) roll_us: f32,
    pub(crate) pitch_us: f32,
    pub(crate) throttle_us: f32,
    pub(crate) yaw_us: f32,
    pub(crate) shield_speed_m_s: f32,
    /// Expiry of the wish that was flown; the far future when it is the pilot's own.
    pub(crate) expiry_ns: u64,
}

impl Decided {
    pub(crate) const NEUTRAL: Self = Self {
        arm: false,
        source: ChannelSource::Neutral,
        roll_us: 1500.0,
        pitch_us: 1500.0,
        throttle_us: 1000.0,
        yaw_us: 1500.0,
        shield_speed_m_s: 0.0,
        expiry_ns: u64::MAX,
    };
}

/// The pilot: messages in, channels and state out. Steps allocate nothing.
#[derive(Debug)]
pub struct PilotCore {
    pub(crate) config: PilotConfig,
    pub(crate) craft: Craft,
    pub(crate) walls: Option<Arc<DistanceField>>,
    /// Distance to the no-fly zones, where there are any.
    pub(crate) zones: Option<Arc<DistanceField>>,
    pub(crate) way_home: Option<WayHome>,
    /// Length of the way home from where the place was known last, metres.
    pub(crate) home_m: Option<f32>,

    pub(crate) attitude: AttitudeSeen,
    pub(crate) pose: PoseSeen,
    pub(crate) flight: FlightSeen,
    pub(crate) setpoint: Option<SetpointSeen>,
    pub(crate) down: DownSeen,
    pub(crate) ground: GroundLevel,
    pub(crate) refused: u64,

    pub(crate) height: HeightEstimator,
    pub(crate) climb: ClimbController,
    pub(crate) motion: Motion,
    pub(crate) velocity: VelocityController,
    pub(crate) below: Below,
    pub(crate) floor: FloorTrail,
    pub(crate) shield: Shield,
    pub(crate) delay: Delay,
    pub(crate) spool: Option<SpoolUp>,
    pub(crate) touch: TouchDown,

    pub(crate) phase: Phase,
    pub(crate) phase_since_ns: u64,
    pub(crate) after_take_off: Phase,
    pub(crate) hold: Option<Vector>,
    pub(crate) hold_heading: Option<f32>,
    pub(crate) looks_from: Option<(u64, f32)>,
    pub(crate) height_wish_m: f32,
    pub(crate) trim: Tilt,
    pub(crate) hover_known: bool,
    pub(crate) resumed: bool,
    pub(crate) operator_land: bool,
    pub(crate) by_hand: ByHand,
    /// When a stop that nobody answers lands the drone.
    pub(crate) stop_lands_ns: Option<u64>,
    /// Whether the automatic may move the drone.
    pub(crate) automatic: bool,
    /// The motors were cut by an order.
    pub(crate) cut_ordered: bool,
    pub(crate) blind_since_ns: Option<u64>,
    pub(crate) aside_s: f32,
    /// Where the floor was seen that a landing goes to first, in the floor trail's frame.
    pub(crate) lands_at: Option<Vector>,
    /// Somebody else flies, or nobody sees the attitude: nothing is learned from what comes of the own channels.
    pub(crate) frozen: bool,

    /// For how long the controller has said that it is disarmed.
    pub(crate) disarmed: Held,
    pub(crate) failsafe: Failsafe,
    /// What the failsafe table said in the last step.
    pub(crate) judged: Judgement,
    pub(crate) decided: Decided,
    pub(crate) last_step_ns: Option<u64>,
    pub(crate) heard: Heard,
    pub(crate) changed: bool,
    pub(crate) text: Text<96>,
}

impl PilotCore {
    /// On the ground, with motors off. `plan` gives the walls that the shield respects; [`Self::forbid`] its no-fly zones.
    #[must_use]
    pub fn new(config: PilotConfig, craft: Craft, plan: Option<(&Plan, Arc<DistanceField>)>) -> Self {
        let way_home = plan.as_ref().map(|(plan, walls)| {
            let origin = Vector::new(plan.origin().0, plan.origin().1);
            let size = Vector::new(plan.width() as f32, plan.height() as f32) * plan.resolution();
            WayHome::new(walls, origin, size, craft.radius_m + 0.05)
        });
        let hover_us = if config.take_off.hover_us > 0.0 { config.take_off.hover_us } else { craft.hover_us };
        let mut velocity = config.velocity;
        velocity.max_tilt_deg = velocity.max_tilt_deg.min(craft.max_tilt_rad.to_degrees());
        Self {
            walls: plan.map(|(_, walls)| walls),
            zones: None,
            way_home,
            home_m: None,
            attitude: AttitudeSeen::default(),
            pose: PoseSeen::default(),
            flight: FlightSeen::default(),
            setpoint: None,
            down: DownSeen::default(),
            ground: GroundLevel::default(),
            refused: 0,
            height: HeightEstimator::new(config.height, craft.rest_m),
            climb: ClimbController::new(config.climb, hover_us),
            motion: Motion::new(config.motion),
            velocity: VelocityController::new(velocity, config.motion.drag_per_s),
            below: Below::new(craft.beam_rest_m),
            floor: FloorTrail::new(craft.radius_m),
            shield: Shield::new(config.shield, craft.radius_m, craft.sides.iter().copied()),
            delay: Delay::default(),
            spool: None,
            touch: TouchDown::default(),
            phase: Phase::Grounded,
            phase_since_ns: 0,
            after_take_off: Phase::Hover,
            hold: None,
            hold_heading: None,
            looks_from: None,
            height_wish_m: config.height_m,
            trim: Tilt::default(),
            hover_known: false,
            resumed: false,
            operator_land: false,
            by_hand: ByHand::default(),
            stop_lands_ns: None,
            automatic: true,
            cut_ordered: false,
            blind_since_ns: None,
            aside_s: 0.0,
            lands_at: None,
            frozen: false,
            disarmed: Held::default(),
            failsafe: Failsafe::default(),
            judged: Judgement::NOTHING,
            decided: Decided::NEUTRAL,
            last_step_ns: None,
            heard: Heard::default(),
            changed: true,
            text: Text::new("on the ground"),
            config,
            craft,
        }
    }

    /// Keeps out of no-fly zones: the distance to them.
    #[must_use]
    pub fn forbid(mut self, zones: Arc<DistanceField>) -> Self {
        if let Some(way) = &mut self.way_home {
            way.close(&zones, self.craft.radius_m);
        }
        self.zones = Some(zones);
        self
    }

    /// Heading on the plan: compass with the localization's offset.
    pub(crate) fn heading(&self) -> f32 {
        wrap_angle(self.attitude.yaw + self.pose.heading_offset)
    }

    /// True tilt as far as it is known: the controller's attitude less its level error. What is old is level.
    pub(crate) fn tilt(&self) -> Tilt {
        let fresh = self.last_step_ns.is_none_or(|now| age_s(self.attitude.at, now) < UNSEEN_S);
        if !fresh || self.attitude.at.is_none() {
            return Tilt::default();
        }
        let (seen, level) = (self.attitude.tilt, self.level());
        Tilt { roll: seen.roll - level.roll, pitch: seen.pitch - level.pitch }
    }

    /// What the controller's attitude reads when the body is level: by the localization, before its first
    /// pose by what it read on the ground.
    pub(crate) fn level(&self) -> Tilt {
        if self.pose.at.is_some() {
            return self.pose.level;
        }
        let most = 0.05;
        Tilt {
            roll: self.ground.tilt.roll.clamp(-most, most),
            pitch: self.ground.tilt.pitch.clamp(-most, most),
        }
    }

    /// Where the drone was a moment ago, plan frame; `None` while its place is not known or it stands on the
    /// ground, where echoes may be the floor's.
    pub(crate) fn place_at(&self, at_ns: u64) -> Option<Vector> {
        let now = self.last_step_ns?;
        let back = age_s(Some(at_ns), now).min(0.3);
        (self.airborne() && self.height.clearance_m() > 0.35 && self.place_known())
            .then(|| self.motion.place() - self.motion.velocity() * back)
    }

    /// Where the drone stands, for the shield.
    pub(crate) fn footing(&self) -> Footing {
        let known = self.pose.at.is_some() && self.place_known();
        Footing {
            place: known.then(|| self.motion.place()),
            sigma_m: self.pose.sigma_m,
            heading: self.heading(),
            velocity: self.motion.velocity(),
            clearance_m: self.height.clearance_m(),
        }
    }

    /// Whether the place may be flown by: tracked, fresh, and within the policy's bounds.
    pub(crate) fn place_known(&self) -> bool {
        let policy = &self.config.failsafe;
        let now = self.last_step_ns.unwrap_or(0);
        self.pose.state == ipc_types::LocalizationState::Tracking
            && !self.pose.searching
            && age_s(self.pose.at, now) <= policy.pose_stale_s
            && self.pose.p_lost <= policy.p_lost
            && self.pose.sigma_m <= policy.sigma_m
    }

    /// Whether localization searches the plan for a drone of which nothing was known.
    pub(crate) fn searching(&self) -> bool {
        let now = self.last_step_ns.unwrap_or(0);
        self.pose.searching && age_s(self.pose.at, now) <= self.config.failsafe.pose_stale_s
    }

    /// The phase of the flight.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Whether the skids are believed to be off the ground.
    #[must_use]
    pub fn airborne(&self) -> bool {
        self.stage().in_the_air()
    }

    /// The phase as the failsafe table sees it.
    pub(crate) fn stage(&self) -> Stage {
        match self.phase {
            Phase::Grounded => Stage::Grounded,
            Phase::Arming | Phase::Cut => Stage::Armed,
            Phase::TakeOff if self.spool.is_some() => Stage::Armed,
            Phase::TakeOff | Phase::Hover | Phase::Landing | Phase::EmergencyLanding => Stage::Airborne,
            Phase::Autonomous => Stage::Autonomous,
            Phase::Manual => Stage::Manual,
        }
    }

    /// Messages that made no sense.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// One sentence for people.
    #[must_use]
    pub fn sentence(&self) -> &str {
        self.text.as_str()
    }

    /// Says something to people.
    pub(crate) fn say(&mut self, sentence: &str) {
        if self.text.as_str() != sentence {
            self.text.set(sentence);
            self.changed = true;
        }
    }

    /// Goes into a phase.
    pub(crate) fn enter(&mut self, now: u64, phase: Phase) {
        if phase != self.phase {
            self.phase = phase;
            self.phase_since_ns = now;
            self.changed = true;
            self.aside_s = 0.0;
        }
    }

    pub(crate) fn phase_s(&self, now: u64) -> f32 {
        age_s(Some(self.phase_since_ns), now)
    }
}
