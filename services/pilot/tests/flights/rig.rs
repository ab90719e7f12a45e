//! A small aircraft around the pilot's core: tilt and thrust with lags behind a delayed link, a level error, a
//! compass that does not know the plan, sonars in opposite pairs with the down sonar each time, late poses.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use control::{Tilt, Vector, stick};
use floorplan::{DistanceField, Plan};
use ipc_types::{
    Answer, ArmSwitch, COMMAND_LIFE_NS, Channels, Command, HEADING_HOLD, HEIGHT_HOLD, Ladder, LinkState,
    LocalizationState, Phase, PilotState, Pose, Setpoint, SetpointKind, SonarHealth, SonarRanges, Sticks,
    SticksState, Text, Verb,
};
use pilot::{Craft, PilotConfig, PilotCore};
use std::collections::VecDeque;
use std::f32::consts::FRAC_PI_4;
use std::sync::Arc;

pub(crate) const MS: u64 = 1_000_000;
const RADIUS: f32 = 0.225;
pub(crate) const MOUNT: f32 = 0.2;
pub(crate) const REST: f32 = 0.03;
/// Plan heading minus compass yaw.
pub(crate) const COMPASS: f32 = -0.6;

pub(crate) struct Noise(pub(crate) u64);
impl Noise {
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }
    pub(crate) fn normal(&mut self) -> f32 {
        (0..12).map(|_| self.unit()).sum::<f32>() - 6.0
    }
}

/// 8 m x 6 m, 0.1 m a character.
pub(crate) fn room() -> Plan {
    let rows: Vec<String> = (0..60)
        .map(|row| {
            (0..80)
                .map(|column| if row == 0 || row == 59 || column == 0 || column == 79 { '#' } else { '.' })
                .collect()
        })
        .collect();
    Plan::from_ascii(&rows.iter().map(String::as_str).collect::<Vec<_>>(), 0.1)
}

/// The flow sensor sits in the middle of the airframe.
pub(crate) const BEAM_REST: f32 = 0.08;

pub(crate) fn craft() -> Craft {
    Craft {
        radius_m: RADIUS,
        sides: (0..8)
            .map(|k| (k, k as f32 * FRAC_PI_4, Vector::along(k as f32 * FRAC_PI_4) * MOUNT))
            .collect(),
        has_down: true,
        rest_m: REST,
        beam_rest_m: BEAM_REST,
        hover_us: 1480.0,
        cells: 4,
        capacity_mah: 3700.0,
        cruise_m_s: 0.5,
        max_tilt_rad: 10f32.to_radians(),
    }
}

pub(crate) struct Rig {
    pub(crate) plan: Plan,
    pub(crate) walls: Arc<DistanceField>,
    pub(crate) core: PilotCore,
    pub(crate) now: u64,
    pub(crate) noise: Noise,
    pub(crate) place: Vector,
    pub(crate) velocity: Vector,
    pub(crate) height: f32,
    pub(crate) climb: f32,
    pub(crate) heading: f32,
    pub(crate) tilt: Tilt,
    rate: Tilt,
    load: f32,
    link: VecDeque<[f32; 4]>,
    pub(crate) poses: VecDeque<Pose>,
    pub(crate) echoes: VecDeque<(u64, SonarRanges)>,
    pub(crate) armed: bool,
    arm_wanted_ms: u64,
    pub(crate) hover_us: f32,
    pub(crate) level: Tilt,
    pub(crate) gust_rms: f32,
    gust: Vector,
    pub(crate) surface: f32,
    /// Level of an edge that the sonar's cone hears in half of its pings, beside the middle.
    pub(crate) edge: f32,
    /// Whether the flow sensor's beam measures.
    pub(crate) beam: bool,
    pub(crate) down_lost: f32,
    pub(crate) down_health: SonarHealth,
    pub(crate) sides_dead: bool,
    pub(crate) localization_dead: bool,
    pub(crate) level_known: bool,
    pub(crate) pose_state: LocalizationState,
    pub(crate) walls_in_echo: u32,
    /// Since when nothing holds the velocity; zero: flow does.
    pub(crate) adrift_ns: u64,
    pub(crate) link_state: LinkState,
    pub(crate) blocks: u32,
    /// How far `flight` flies by itself, as `flight/state` says, and the throttle that the controller flies instead.
    pub(crate) ladder: Ladder,
    pub(crate) other_us: Option<f32>,
    /// Share of the thrust that is left.
    pub(crate) thrust: f32,
    /// Whether the controller tells its accelerometer; what that feels along the body, m/s2, and one g by its scale.
    pub(crate) tells_force: bool,
    pub(crate) force: f32,
    pub(crate) one_g: f32,
    pub(crate) cell_volts: f32,
    pub(crate) drawn_mah: f32,
    /// Whether the controller tells of its battery.
    pub(crate) power_told: bool,
    pub(crate) will_arm: bool,
    pub(crate) channels: Channels,
    pub(crate) state: PilotState,
    pub(crate) touched_at: f32,
    pub(crate) touch_tilt: f32,
    pub(crate) setpoint: Option<Setpoint>,
    pub(crate) least_clearance: f32,
    pub(crate) steps: u64,
    /// Who holds the sticks, if anybody does.
    pub(crate) hand: Option<HandOn>,
    sequence: u32,
}

impl Rig {
    pub(crate) fn new(seed: u64) -> Self {
        Self::with(seed, PilotConfig::default())
    }

    /// With another configuration, until a restart.
    pub(crate) fn with(seed: u64, config: PilotConfig) -> Self {
        let plan = room();
        let walls = Arc::new(DistanceField::new(&plan, 2.0));
        let core = PilotCore::new(config, craft(), Some((&plan, Arc::clone(&walls))));
        let (x, y) = plan.origin();
        Self {
            plan,
            walls,
            core,
            now: 5_000 * MS,
            noise: Noise(seed),
            place: Vector::new(x + 3.0, y + 3.0),
            velocity: Vector::ZERO,
            height: 0.0,
            climb: 0.0,
            heading: 0.4,
            tilt: Tilt::default(),
            rate: Tilt::default(),
            load: 0.0,
            link: VecDeque::from(vec![[0.0, 0.0, 1000.0, 0.0]; 30]),
            poses: VecDeque::new(),
            echoes: VecDeque::new(),
            armed: false,
            arm_wanted_ms: 0,
            hover_us: 1500.0,
            level: Tilt::default(),
            gust_rms: 0.0,
            gust: Vector::ZERO,
            surface: 0.0,
            edge: 0.0,
            beam: false,
            down_lost: 0.03,
            down_health: SonarHealth::Good,
            sides_dead: false,
            localization_dead: false,
            level_known: false,
            pose_state: LocalizationState::Tracking,
            walls_in_echo: 4,
            adrift_ns: 0,
            link_state: LinkState::Up,
            blocks: 0,
            ladder: Ladder::Following,
            other_us: None,
            thrust: 1.0,
            tells_force: false,
            force: 9.81,
            one_g: 9.81,
            cell_volts: 4.0,
            drawn_mah: 100.0,
            power_told: true,
            will_arm: true,
            channels: Channels::default(),
            state: PilotState::default(),
            touched_at: 0.0,
            touch_tilt: 0.0,
            setpoint: None,
            least_clearance: f32::INFINITY,
            steps: 0,
            hand: None,
            sequence: 0,
        }
    }

    pub(crate) fn phase(&self) -> Phase {
        self.core.phase()
    }

    pub(crate) fn order(&mut self, verb: Verb) {
        self.sequence += 1;
        let mut command = Command {
            expiry_ns: self.now + COMMAND_LIFE_NS,
            verb: verb.code().into(),
            command_sequence: self.sequence,
            ..Default::default()
        };
        command.header.stamp_ns = self.now;
        self.core.command(self.now, &command);
    }

    /// What navigation says from now on; the expiry is renewed 20 times a second.
    pub(crate) fn navigate(&mut self, kind: SetpointKind, velocity: Vector, hold: Vector) {
        self.setpoint = Some(Setpoint {
            kind: kind.code().into(),
            velocity_x_m_s: velocity.x,
            velocity_y_m_s: velocity.y,
            heading_rad: f32::NAN,
            height_m: 1.2,
            hold_x_m: hold.x,
            hold_y_m: hold.y,
            ..Default::default()
        });
    }

    /// 20 ms: sense, think, fly.
    pub(crate) fn step(&mut self) {
        self.sense();
        self.send_sticks();
        self.core.step(self.now);
        if self.core.fills_channels() {
            self.core.write_channels(self.now, &mut self.channels);
        }
        self.core.write_state(&mut self.state);
        self.state.header.stamp_ns = self.now;
        self.check();
        self.fly();
    }

    fn check(&self) {
        let c = &self.channels;
        assert!(c.count == 6 || c.count == 0);
        assert!(c.channels_us[..c.count as usize].iter().all(|us| (1000..=2000).contains(us)));
        for k in [0, 1] {
            // Never more than the tilt limit and the trim.
            let angle = stick::angle_of(f32::from(c.channels_us[k].max(1000))).to_degrees();
            assert!(c.count == 0 || angle.abs() < 15.1, "{angle}");
        }
        assert!(self.height < 1.75, "flew away: {}", self.height);
    }

    fn fly(&mut self) {
        let c = &self.channels;
        let armed_wish = c.count > 0 && c.arm == 1;
        self.arm_wanted_ms = if armed_wish { self.arm_wanted_ms + 20 } else { 0 };
        if self.will_arm && self.arm_wanted_ms > 400 && c.channels_us[2] <= 1050 {
            self.armed = true;
        }
        if !armed_wish {
            self.armed = false;
        }
        for _ in 0..20 {
            self.fly_ms();
        }
        let push = Vector::new(self.noise.normal(), self.noise.normal());
        self.gust += self.gust * -0.02 + push * (self.gust_rms * 0.2);
        self.now += 20 * MS;
        self.steps += 1;
        if self.height > 0.2 {
            self.least_clearance =
                self.least_clearance.min(self.walls.distance(self.place.x, self.place.y) - RADIUS);
        }
    }

    fn fly_ms(&mut self) {
        let us = self.channels.channels_us;
        let u = |k: usize| f32::from(us[k].max(1000));
        self.link.push_back([
            stick::angle_of(u(0)) - self.level.roll,
            stick::angle_of(u(1)) - self.level.pitch,
            if self.armed { self.other_us.unwrap_or(u(2)) } else { 1000.0 },
            stick::yaw_rate_of(u(3)),
        ]);
        let [roll, pitch, throttle, turn] = self.link.pop_front().unwrap();
        let wanted = ((throttle - 1000.0) / (self.hover_us - 1000.0)).powi(2);
        self.load += (self.thrust * wanted - self.load) * 0.001 / 0.05;
        let grounded = self.height <= self.surface + 1e-4;
        let (w, z) = (12.0, 0.75);
        if grounded && self.load < 1.0 {
            (self.tilt, self.rate) = (Tilt::default(), Tilt::default());
            self.velocity = Vector::ZERO;
        } else {
            self.rate.roll += (w * w * (roll - self.tilt.roll) - 2.0 * z * w * self.rate.roll) * 0.001;
            self.rate.pitch += (w * w * (pitch - self.tilt.pitch) - 2.0 * z * w * self.rate.pitch) * 0.001;
            self.tilt.roll += self.rate.roll * 0.001;
            self.tilt.pitch += self.rate.pitch * 0.001;
            self.heading = control::wrap_angle(self.heading + turn * 0.001);
            let a = self.tilt.acceleration(self.heading) * self.load + self.gust - self.velocity * 0.3;
            self.velocity += a * 0.001;
            self.place += self.velocity * 0.001;
        }
        let lift = 9.81 * (self.load * self.tilt.magnitude().cos() - 1.0);
        let felt = if grounded { self.one_g } else { self.one_g * self.load };
        // Behind a low-pass of 10 Hz.
        self.force += (felt - self.force) * 0.001 / 0.016;
        self.climb += (lift - 0.1 * self.climb) * 0.001;
        self.height += self.climb * 0.001;
        if self.height <= self.surface {
            if self.climb < -0.05 {
                self.touched_at = self.touched_at.min(self.climb);
                self.touch_tilt = self.touch_tilt.max(self.tilt.magnitude());
            }
            self.height = self.surface;
            self.climb = self.climb.max(0.0);
        }
    }

    pub(crate) fn run(&mut self, seconds: f32) {
        for _ in 0..(seconds * 50.0) as usize {
            self.step();
        }
    }

    /// Sits a second, takes off and reaches a hover.
    pub(crate) fn take_off(&mut self) {
        self.run(1.5);
        self.order(Verb::TakeOff);
        assert_eq!(self.phase(), Phase::Arming, "{}", self.core.sentence());
        for _ in 0..750 {
            self.step();
            if self.phase() == Phase::Hover {
                self.touched_at = 0.0;
                return;
            }
        }
        panic!("no hover: {} {}", self.phase(), self.core.sentence());
    }

    /// Flies on until the motors are off.
    pub(crate) fn until_grounded(&mut self, seconds: f32) -> f32 {
        for step in 0..(seconds * 50.0) as usize {
            self.step();
            if self.phase() == Phase::Grounded {
                let cut_height = self.height - self.surface;
                self.run(0.6);
                assert!(!self.armed);
                // What is left to fall counts as well.
                assert!(cut_height < 0.02, "cut {cut_height} m up");
                return step as f32 * 0.02;
            }
        }
        panic!("not down after {seconds} s: {} at {} m", self.phase(), self.height);
    }

    /// A new core that knows only what the dead one published, `gap` later; its last channels are flown on.
    pub(crate) fn restart(&mut self, gap_ms: u64) {
        let retained = self.state;
        for _ in 0..gap_ms / 20 {
            self.fly();
        }
        self.core =
            PilotCore::new(PilotConfig::default(), craft(), Some((&self.plan, Arc::clone(&self.walls))));
        self.core.resume(self.now, &retained);
    }
}

/// A human's hand: a new input each step, until it freezes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HandOn {
    /// Forward, left, up, counter-clockwise.
    pub(crate) axes: [f32; 4],
    pub(crate) held: bool,
    pub(crate) switches: u32,
    pub(crate) arm: ArmSwitch,
    /// The same input is sent again and again, as if it were new but for its number.
    pub(crate) frozen: bool,
    pub(crate) lease: u64,
    pub(crate) sequence: u64,
}

impl Rig {
    /// A guard with a connection asks for something.
    pub(crate) fn guard(&mut self, verb: Verb, account: &str, socket: u64) -> bool {
        self.sequence += 1;
        let mut command = Command {
            expiry_ns: self.now + COMMAND_LIFE_NS,
            verb: verb.code().into(),
            command_sequence: self.sequence,
            account: Text::new(account),
            certificate: Text::new("desk"),
            socket,
            ..Default::default()
        };
        command.header.stamp_ns = self.now;
        self.core.command(self.now, &command);
        self.core.write_state(&mut self.state);
        self.state.answer == u32::from(Answer::Accepted.code())
    }

    /// Takes the sticks with all of them in the middle and the button held.
    pub(crate) fn take(&mut self) {
        assert!(self.guard(Verb::SticksTake, "ana", 7), "{}", self.state.answer_text);
        self.hand = Some(HandOn {
            axes: [0.0; 4],
            held: true,
            switches: HEIGHT_HOLD | HEADING_HOLD,
            arm: ArmSwitch::Absent,
            frozen: false,
            lease: self.state.lease,
            sequence: 0,
        });
    }

    /// Takes the sticks in the air and waits until they are followed.
    pub(crate) fn follow(&mut self) {
        self.take();
        for _ in 0..250 {
            self.step();
            if self.sticks_state() == SticksState::Following {
                return;
            }
        }
        panic!("not followed: {:?} {}", self.sticks_state(), self.core.sentence());
    }

    pub(crate) fn push(&mut self, axes: [f32; 4]) {
        self.hand.as_mut().unwrap().axes = axes;
    }

    pub(crate) fn sticks_state(&self) -> SticksState {
        SticksState::from_code(self.state.sticks).unwrap()
    }

    pub(crate) fn send_sticks(&mut self) {
        let Some(hand) = &mut self.hand else { return };
        hand.sequence += u64::from(!hand.frozen);
        let [forward, left, up, turn] = hand.axes;
        let mut message = Sticks {
            input_sequence: hand.sequence,
            lease: hand.lease,
            age_ms: 5.0,
            forward,
            left,
            up,
            turn,
            held: hand.held.into(),
            switches: hand.switches,
            arm: hand.arm.code().into(),
            ..Default::default()
        };
        message.header.stamp_ns = self.now;
        self.core.sticks(self.now, &message);
    }
}
