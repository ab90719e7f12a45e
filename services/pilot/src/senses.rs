//! What has been heard last, checked.

use control::{Axes, GRAVITY_M_S2, StickInput, Tilt, Vector, wrap_angle};
use ipc_types::{
    ArmSwitch, Attitude, FlightState, HEADING_HOLD, HEIGHT_HOLD, Ladder, LinkState, LocalizationState, Pose,
    Power, Setpoint, SetpointKind, Sticks, Text, nanoseconds, seconds_between,
};

/// Seconds from a stamp to now; infinite without one.
pub(crate) fn age_s(stamp: Option<u64>, now: u64) -> f32 {
    stamp.map_or(f32::INFINITY, |stamp| seconds_between(stamp, now).max(0.0) as f32)
}

/// The newest attitude.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AttitudeSeen {
    pub(crate) at: Option<u64>,
    /// When the controller was read.
    pub(crate) sampled: Option<u64>,
    pub(crate) tilt: Tilt,
    pub(crate) yaw: f32,
    /// Vertical acceleration by the accelerometer, up positive, until it is taken; m/s2.
    pub(crate) lifted: Option<f32>,
}

/// An attitude that is older tells nothing of now, seconds: `flight` holds the drone level from then on.
pub(crate) const UNSEEN_S: f32 = 0.3;
/// More is a crash, no flight, m/s2.
const MOST_LIFT_M_S2: f32 = 20.0;

impl AttitudeSeen {
    pub(crate) fn take(&mut self, message: &Attitude) -> bool {
        let sane = [message.roll_rad, message.pitch_rad, message.yaw_rad].iter().all(|a| a.abs() <= 7.0);
        if sane {
            *self = Self {
                at: Some(message.header.stamp_ns),
                sampled: Some(message.sampled_ns),
                tilt: Tilt { roll: message.roll_rad, pitch: message.pitch_rad },
                yaw: message.yaw_rad,
                lifted: lifted(message),
            };
        }
        sane
    }
}

/// What the accelerometer feels along the vertical, less gravity; `None` when it is not told.
fn lifted(message: &Attitude) -> Option<f32> {
    let (roll_sin, roll_cos) = message.roll_rad.sin_cos();
    let (pitch_sin, pitch_cos) = message.pitch_rad.sin_cos();
    // The vertical in the body frame: right side down lifts the left, nose down lowers the front.
    let up = -message.force_x_m_s2 * pitch_sin
        + message.force_y_m_s2 * roll_sin * pitch_cos
        + message.force_z_m_s2 * roll_cos * pitch_cos;
    Some(up - GRAVITY_M_S2).filter(|lifted| lifted.abs() < MOST_LIFT_M_S2)
}

/// The newest pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseSeen {
    pub(crate) at: Option<u64>,
    pub(crate) heading_offset: f32,
    pub(crate) level: Tilt,
    pub(crate) sigma_m: f32,
    pub(crate) velocity_sigma: f32,
    /// Acceleration by what the tilt does not explain, plan frame; zero when nothing is known of it.
    pub(crate) air: Vector,
    pub(crate) p_lost: f32,
    pub(crate) walls: u32,
    /// Since when nothing holds the velocity.
    pub(crate) adrift: Option<u64>,
    pub(crate) state: LocalizationState,
    /// Localization searches the plan: the frame is its own.
    pub(crate) searching: bool,
}

impl Default for PoseSeen {
    fn default() -> Self {
        Self {
            at: None,
            heading_offset: 0.0,
            level: Tilt::default(),
            sigma_m: f32::INFINITY,
            velocity_sigma: f32::INFINITY,
            air: Vector::ZERO,
            p_lost: 1.0,
            walls: 0,
            adrift: None,
            state: LocalizationState::Lost,
            searching: false,
        }
    }
}

/// A level error beyond this is no level error but a broken estimate, radians (4 degrees).
const MOST_LEVEL_RAD: f32 = 0.07;

impl PoseSeen {
    /// Takes a pose; place and velocity when it makes sense.
    pub(crate) fn take(&mut self, message: &Pose) -> Option<(u64, Vector, Vector)> {
        let state = LocalizationState::from_code((message.state & 0xff) as u8)?;
        let place = Vector::new(message.x_m, message.y_m).known()?;
        let velocity = Vector::new(message.velocity_x_m_s, message.velocity_y_m_s).known()?;
        if !message.heading_offset_rad.is_finite() || place.norm() > 1e5 {
            return None;
        }
        let level = |value: f32| {
            if value.is_finite() { value.clamp(-MOST_LEVEL_RAD, MOST_LEVEL_RAD) } else { 0.0 }
        };
        let unknown = |value: f32, worst: f32| if value.is_finite() { value } else { worst };
        *self = Self {
            at: Some(message.header.stamp_ns),
            heading_offset: wrap_angle(message.heading_offset_rad),
            level: Tilt { roll: level(message.level_roll_rad), pitch: level(message.level_pitch_rad) },
            sigma_m: unknown(message.sigma_m(), f32::INFINITY),
            velocity_sigma: unknown(message.velocity_sigma_m_s, f32::INFINITY),
            air: Vector::new(message.air_x_m_s2, message.air_y_m_s2).known().unwrap_or(Vector::ZERO),
            p_lost: unknown(message.p_lost, 1.0),
            walls: message.walls_in_echo,
            adrift: (message.adrift_ns > 0).then_some(message.adrift_ns),
            state,
            searching: message.searching != 0,
        };
        Some((message.estimated_ns, place, velocity))
    }
}

/// The newest of `flight/state` and `flight/power`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FlightSeen {
    pub(crate) at: Option<u64>,
    pub(crate) armed: bool,
    pub(crate) link: LinkState,
    pub(crate) blocks: u32,
    pub(crate) throttle_us: u16,
    /// The pilot's channels do not fly the drone: `flight` does by itself, or the controller's own failsafe.
    pub(crate) alone: bool,
    pub(crate) reason: Text<128>,
    pub(crate) power_at: Option<u64>,
    pub(crate) cell_volts: f32,
    pub(crate) amps: f32,
    pub(crate) drawn_mah: f32,
}

impl Default for FlightSeen {
    fn default() -> Self {
        Self {
            at: None,
            armed: false,
            link: LinkState::Closed,
            blocks: 0,
            throttle_us: 0,
            alone: false,
            reason: Text::default(),
            power_at: None,
            cell_volts: f32::NAN,
            amps: f32::NAN,
            drawn_mah: f32::NAN,
        }
    }
}

/// FAILSAFE among the mode bits of `flight/state`.
const FAILSAFE_MODE: u32 = 1 << 2;

impl FlightSeen {
    pub(crate) fn take_state(&mut self, message: &FlightState) -> bool {
        let Some(link) = LinkState::from_code(message.link) else { return false };
        self.at = Some(message.header.stamp_ns);
        self.armed = message.armed == 1;
        self.link = link;
        self.blocks = message.arming_blocks;
        self.throttle_us = message.channels_us[2];
        let ladder = Ladder::from_code(message.ladder);
        self.alone = matches!(ladder, Some(Ladder::Level | Ladder::Descend | Ladder::TouchDown))
            || message.modes & FAILSAFE_MODE != 0;
        self.reason = message.reason;
        true
    }

    pub(crate) fn take_power(&mut self, message: &Power, cells: u32) -> bool {
        let cells = if (1..=12).contains(&message.cells) { message.cells } else { cells.max(1) };
        self.power_at = Some(message.header.stamp_ns);
        self.cell_volts = message.volts / cells as f32;
        self.amps = message.amps;
        self.drawn_mah = Some(message.drawn_mah).filter(|drawn| *drawn >= 0.0).unwrap_or(f32::NAN);
        // A controller without a battery sensor says 0: that is "does not say", not "empty".
        if self.cell_volts < 1.0 || self.cell_volts > 6.0 {
            self.cell_volts = f32::NAN;
        }
        true
    }
}

/// The newest setpoint of navigation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SetpointSeen {
    pub(crate) expiry_ns: u64,
    pub(crate) kind: SetpointKind,
    pub(crate) velocity: Vector,
    pub(crate) heading: Option<f32>,
    pub(crate) height_m: Option<f32>,
    pub(crate) hold: Option<Vector>,
}

/// A setpoint that claims to hold for longer is cut to this, nanoseconds: navigation decides 20 times a second.
const LONGEST_NS: u64 = 500_000_000;

/// A wish that holds for less is used no more, nanoseconds: channels made from it would expire before the next ones, a
/// tick of 20 ms later and as much late again, have reached the controller.
pub(crate) const LEAST_LEFT_NS: u64 = 40_000_000;

/// Sticks that were older when they were sent are no sticks, milliseconds: the longest lease is half of it.
const OLDEST_MS: f32 = 10_000.0;
/// A message may be this much newer than the step that takes it, nanoseconds: a step reads the clock before its inputs.
const AHEAD_NS: u64 = 100_000_000;

/// Reads sticks; `None` when something in them makes no sense.
pub(crate) fn sticks(now: u64, message: &Sticks) -> Option<StickInput> {
    let axes = Axes::checked(message.forward, message.left, message.up, message.turn)?;
    let sent_ns = message.header.stamp_ns;
    if !(0.0..=OLDEST_MS).contains(&message.age_ms) || sent_ns > now.saturating_add(AHEAD_NS) {
        return None;
    }
    let arm = match u8::try_from(message.arm).ok().and_then(ArmSwitch::from_code)? {
        ArmSwitch::Absent => None,
        ArmSwitch::Off => Some(false),
        ArmSwitch::On => Some(true),
    };
    let held = match message.held {
        0 => false,
        1 => true,
        _ => return None,
    };
    Some(StickInput {
        lease: message.lease,
        sequence: message.input_sequence,
        made_ns: sent_ns.min(now).saturating_sub(nanoseconds(f64::from(message.age_ms) * 1e-3)),
        axes,
        held,
        height_hold: message.switches & HEIGHT_HOLD != 0,
        heading_hold: message.switches & HEADING_HOLD != 0,
        arm,
    })
}

impl SetpointSeen {
    pub(crate) fn read(message: &Setpoint) -> Option<Self> {
        let kind = SetpointKind::from_code(u8::try_from(message.kind).ok()?)?;
        let velocity = Vector::new(message.velocity_x_m_s, message.velocity_y_m_s);
        if kind == SetpointKind::Velocity && (!velocity.is_finite() || velocity.norm() > 5.0) {
            return None;
        }
        Some(Self {
            expiry_ns: message.expiry_ns.min(message.header.stamp_ns.saturating_add(LONGEST_NS)),
            kind,
            velocity: velocity.known().unwrap_or(Vector::ZERO),
            heading: message.heading_rad.is_finite().then(|| wrap_angle(message.heading_rad)),
            height_m: (message.height_m > 0.0 && message.height_m < 5.0).then_some(message.height_m),
            hold: Vector::new(message.hold_x_m, message.hold_y_m).known(),
        })
    }
}

/// The down sonar: its newest ping, and what it reads on the ground.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct DownSeen {
    pub(crate) ping_ns: Option<u64>,
    pub(crate) good: bool,
    pub(crate) range_m: Option<f32>,
    ground: [f32; 9],
    used: usize,
}

/// A standing drone cannot be farther from the floor, metres.
const MOST_REST_M: f32 = 0.25;

impl DownSeen {
    /// Adds a reading on the ground.
    pub(crate) fn stand(&mut self, range_m: f32) {
        if range_m < MOST_REST_M {
            self.ground[self.used % 9] = range_m;
            self.used += 1;
        }
    }

    /// The median of the newest readings on the ground, once there are enough.
    pub(crate) fn rest_m(&self) -> Option<f32> {
        if self.used < 5 {
            return None;
        }
        let count = self.used.min(9);
        let mut sorted = self.ground;
        sorted[..count].sort_unstable_by(f32::total_cmp);
        Some(sorted[count / 2])
    }
}
