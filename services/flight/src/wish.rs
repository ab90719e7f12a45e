//! What the pilot last asked for, checked.

use ipc_types::Channels;

/// Channels in a message, in the order roll, pitch, throttle, yaw, AUX1...
pub(crate) const ROLL: usize = 0;
pub(crate) const PITCH: usize = 1;
pub(crate) const THROTTLE: usize = 2;
pub(crate) const YAW: usize = 3;
pub(crate) const AUX_ARM: usize = 4;
pub(crate) const AUX_ANGLE: usize = 5;

/// Stick in the middle.
pub(crate) const CENTRE_US: u16 = 1500;
/// Stick or switch at its low end.
pub(crate) const LOW_US: u16 = msp::messages::CHANNEL_MIN_US;
/// Switch at its high end.
pub(crate) const HIGH_US: u16 = msp::messages::CHANNEL_MAX_US;
/// A throttle up to here means no flying: the controller arms up to 1050 (FACTS 1), pilots idle a little above.
const IDLE_THROTTLE_US: u16 = 1100;
/// A message from the future is from a broken clock; this much is a step that began earlier.
const FUTURE_NS: u64 = 50_000_000;

/// Channels and what is needed to go on without the pilot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// When the pilot made it.
    pub stamp_ns: u64,
    /// Not to be flown from here on.
    pub expiry_ns: u64,
    /// Roll, pitch, throttle, yaw, AUX1...
    pub channels_us: [u16; 18],
    /// Filled channels, 4..=18.
    pub count: usize,
    /// Motors are to run.
    pub arm: bool,
    /// Who moves the drone, an [`ipc_types::ChannelSource`] code.
    pub source: u8,
    /// Roll stick that keeps the body level, microseconds.
    pub level_roll_us: u16,
    /// Pitch stick that keeps the body level, microseconds.
    pub level_pitch_us: u16,
    /// Learned hover throttle, microseconds.
    pub hover_us: Option<f32>,
    /// Height above the floor, metres.
    pub height_m: Option<f32>,
    /// Vertical velocity, up positive, m/s.
    pub climb_m_s: f32,
    /// The skids are on the ground.
    pub on_ground: bool,
    /// A hand has moved or let go.
    pub prompt: bool,
}

/// Sticks in the middle, throttle and arm switch low, angle mode.
#[must_use]
pub fn neutral() -> [u16; 18] {
    let mut channels = [LOW_US; 18];
    for stick in [ROLL, PITCH, YAW] {
        channels[stick] = CENTRE_US;
    }
    channels[AUX_ANGLE] = HIGH_US;
    channels
}

/// A learned level stick; a trim beyond 100 us (more than the 1.5 degrees that a frame is mounted off) is no
/// trim but a mistake.
fn level(us: f32) -> u16 {
    if (f32::from(CENTRE_US) - us).abs() <= 100.0 { us.round() as u16 } else { CENTRE_US }
}

impl Wish {
    /// Checks a message; `None` when it makes no sense.
    #[must_use]
    pub fn read(message: &Channels, now: u64) -> Option<Self> {
        let count = usize::from(message.count);
        let stamp_ns = message.header.stamp_ns;
        let channels = message.channels_us.get(..count)?;
        let sensible = count >= 4
            && channels.iter().all(|us| (LOW_US..=HIGH_US).contains(us))
            && message.arm <= 1
            && stamp_ns <= now + FUTURE_NS;
        if !sensible {
            return None;
        }
        let mut channels_us = neutral();
        channels_us[..count].copy_from_slice(channels);
        let hover = message.hover_throttle_us;
        Some(Self {
            stamp_ns,
            expiry_ns: message.expiry_ns,
            channels_us,
            count: count.max(AUX_ANGLE + 1),
            arm: message.arm == 1,
            source: message.source,
            level_roll_us: level(message.level_roll_us),
            level_pitch_us: level(message.level_pitch_us),
            hover_us: (1050.0..=1900.0).contains(&hover).then_some(hover),
            height_m: message.height_m.is_finite().then_some(message.height_m),
            climb_m_s: if message.climb_m_s.is_finite() { message.climb_m_s.clamp(-2.0, 2.0) } else { 0.0 },
            on_ground: message.on_ground == 1,
            prompt: message.prompt == 1,
        })
    }

    /// For an aircraft that is armed and has no pilot: what it flies now, taken from the controller.
    #[must_use]
    pub fn orphan(now: u64, throttle_us: u16) -> Self {
        let throttle_us = throttle_us.clamp(LOW_US, HIGH_US);
        let mut channels_us = neutral();
        channels_us[THROTTLE] = throttle_us;
        Self {
            stamp_ns: now,
            expiry_ns: now,
            channels_us,
            count: AUX_ANGLE + 1,
            arm: true,
            source: ipc_types::ChannelSource::Failsafe.code(),
            level_roll_us: CENTRE_US,
            level_pitch_us: CENTRE_US,
            hover_us: (throttle_us > IDLE_THROTTLE_US).then_some(f32::from(throttle_us)),
            height_m: None,
            climb_m_s: 0.0,
            on_ground: throttle_us <= IDLE_THROTTLE_US,
            prompt: false,
        }
    }
}
