//! The receiver (MSP frames, or a radio with MSP frames beside it), loss of signal, failsafe, modes and arming.

use super::companion::Companion;
use super::personality::{FailsafeSettings, MspOverride, Personality, Procedure};

/// Channels of the firmware.
pub(crate) const CHANNELS: usize = 18;
pub(crate) const ROLL: usize = 0;
pub(crate) const PITCH: usize = 1;
pub(crate) const YAW: usize = 2;
pub(crate) const THROTTLE: usize = 3;
const AUX1: usize = 4;
const AUX2: usize = 5;
const AUX3: usize = 6;
/// Channels of the radio: the sticks and four switches.
pub(crate) const RADIO_CHANNELS: usize = 8;
/// Values that count as a pulse (FACTS 1).
const VALID_US: core::ops::RangeInclusive<u16> = 885..=2115;
const CENTRE_US: u16 = 1500;
const LOWEST_US: u16 = 885;
/// Switched on: the upper third, as installers set ranges.
const SWITCH_US: u16 = 1700;
/// More tilted than this it will not arm (`small_angle`, 25 degrees).
const SMALL_ANGLE_RAD: f64 = 0.436;
/// The gyro is calibrated this long after power-up.
const CALIBRATION_NS: u64 = 1_500_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Failsafe {
    Idle,
    /// Level and at the failsafe throttle until then.
    Landing(u64),
    /// Disarmed by it; `Some` since when frames with the arm switch low have come again.
    Latched(Option<u64>),
}

/// Receiver, failsafe and arming.
#[derive(Clone, Debug)]
pub(crate) struct Receiver {
    /// Firmware order: roll, pitch, yaw, throttle, AUX...
    values: [u16; CHANNELS],
    good_ns: [u64; CHANNELS],
    valid_ns: Option<u64>,
    recovering_ns: Option<u64>,
    lost: bool,
    failsafe: Failsafe,
    armed: bool,
    latched: bool,
    switched_ns: Option<u64>,
    blocks: u32,
    armings: u32,
    /// A frame has ever come.
    known: bool,
    /// MSP frames beside a radio, which is the receiver then.
    companion: Option<Companion>,
    /// The radio's override switch is up.
    overriding: bool,
}

impl Receiver {
    pub(crate) fn new(personality: &Personality) -> Self {
        let flags = personality.flags;
        let mut values = [CENTRE_US; CHANNELS];
        values[THROTTLE] = LOWEST_US;
        Self {
            values,
            good_ns: [0; CHANNELS],
            valid_ns: None,
            recovering_ns: None,
            lost: true,
            failsafe: Failsafe::Idle,
            armed: false,
            latched: false,
            switched_ns: None,
            blocks: 1 << flags.rx_loss | 1 << flags.boot_grace | 1 << flags.calibrating,
            armings: 0,
            known: false,
            companion: None,
            overriding: false,
        }
    }

    /// The receiver is a radio; MSP frames are its companion's.
    pub(crate) fn listen_to_radio(&mut self) {
        self.companion = Some(Companion::new());
    }

    /// An MSP frame in the receiver's order; what is beyond [`CHANNELS`] is not used. What it does not carry reads as 0.
    pub(crate) fn frame(&mut self, now_ns: u64, frame: &[u16], personality: &Personality) {
        let read: [u16; CHANNELS] = std::array::from_fn(|channel| {
            let place = personality.rx_map.get(channel).map_or(channel, |place| usize::from(*place));
            frame.get(place).copied().unwrap_or(0)
        });
        match &mut self.companion {
            Some(companion) => {
                companion.hear(
                    now_ns,
                    [read[ROLL], read[PITCH], read[YAW], read[THROTTLE]],
                    personality.msp_override,
                );
            }
            None => self.take(now_ns, &read, personality),
        }
    }

    /// A frame of the radio, in the firmware's order; does nothing where MSP is the receiver.
    pub(crate) fn radio(
        &mut self,
        now_ns: u64,
        channels_us: &[u16; RADIO_CHANNELS],
        personality: &Personality,
    ) {
        let Some(companion) = &self.companion else { return };
        let mut read = [0; CHANNELS];
        read[..RADIO_CHANNELS].copy_from_slice(channels_us);
        self.overriding = read[AUX3] >= SWITCH_US && personality.msp_override != MspOverride::Unknown;
        if self.overriding
            && let Some(sticks) = companion.sticks(now_ns, personality.msp_override)
        {
            read[..4].copy_from_slice(&sticks);
        }
        self.take(now_ns, &read, personality);
    }

    fn take(&mut self, now_ns: u64, read: &[u16; CHANNELS], personality: &Personality) {
        self.known = true;
        let mut flight_valid = true;
        for (channel, value) in read.iter().enumerate() {
            if VALID_US.contains(value) {
                self.good_ns[channel] = now_ns;
                self.values[channel] = *value;
            } else if channel < 4 {
                flight_valid = false;
            }
        }
        if flight_valid {
            // A gap may end between two passes: it is a loss all the same.
            self.look_for_loss(now_ns, personality);
            self.valid_ns = Some(now_ns);
        }
    }

    /// The slow pass: loss, failsafe, arming.
    pub(crate) fn pass(
        &mut self,
        now_ns: u64,
        tilt_rad: f64,
        personality: &Personality,
        settings: &FailsafeSettings,
    ) {
        self.look_for_loss(now_ns, personality);
        self.drop_stale_sticks(now_ns, personality, settings);
        self.run_failsafe(now_ns, personality, settings);
        self.run_arming(now_ns, tilt_rad, personality);
    }

    fn look_for_loss(&mut self, now_ns: u64, personality: &Personality) {
        let silent = self.valid_ns.is_none_or(|valid| now_ns - valid > personality.loss_ns);
        if silent {
            self.lost = true;
            self.recovering_ns = None;
        } else if self.lost {
            let since = *self.recovering_ns.get_or_insert(now_ns);
            if now_ns - since >= personality.recovery_ns {
                self.lost = false;
                self.recovering_ns = None;
            }
        }
    }

    /// Stage one: a flight channel without a valid pulse is centred, the throttle goes to the bottom.
    fn drop_stale_sticks(&mut self, now_ns: u64, personality: &Personality, settings: &FailsafeSettings) {
        for channel in [ROLL, PITCH, YAW, THROTTLE] {
            if now_ns - self.good_ns[channel] <= personality.hold_ns {
                continue;
            }
            if channel != THROTTLE {
                self.values[channel] = CENTRE_US;
            } else if !settings.hold_throttle {
                self.values[channel] = LOWEST_US;
            }
        }
    }

    /// Stage two.
    fn run_failsafe(&mut self, now_ns: u64, personality: &Personality, settings: &FailsafeSettings) {
        let silent_ns = now_ns - self.valid_ns.unwrap_or(0);
        match self.failsafe {
            Failsafe::Idle => {
                let delay_ns = personality.failsafe_base_ns + u64::from(settings.delay_ds) * 100_000_000;
                if self.armed && self.lost && silent_ns >= delay_ns {
                    self.failsafe = match settings.procedure {
                        Procedure::Drop => {
                            self.armed = false;
                            Failsafe::Latched(None)
                        }
                        Procedure::AutoLand => {
                            Failsafe::Landing(now_ns + u64::from(settings.landing_s) * 1_000_000_000)
                        }
                    };
                }
            }
            Failsafe::Landing(until_ns) => {
                if !self.lost && self.deflection_us() >= personality.recovery_stick_us {
                    self.failsafe = Failsafe::Idle;
                } else if now_ns >= until_ns || !self.armed {
                    self.armed = false;
                    self.failsafe = Failsafe::Latched(None);
                }
            }
            Failsafe::Latched(since) => {
                let low = self.values[AUX1] < SWITCH_US;
                let quiet = !self.lost && (low || !personality.rearm_low);
                let needed_ns = personality.rearm_ns - personality.recovery_ns;
                self.failsafe = match since {
                    _ if !quiet => Failsafe::Latched(None),
                    None => Failsafe::Latched(Some(now_ns)),
                    Some(since) if low && now_ns - since >= needed_ns => Failsafe::Idle,
                    since => Failsafe::Latched(since),
                };
            }
        }
    }

    fn run_arming(&mut self, now_ns: u64, tilt_rad: f64, personality: &Personality) {
        let flags = &personality.flags;
        let mut blocks = 0;
        let mut raise = |wrong: bool, flag: u32| {
            if wrong {
                blocks |= 1 << flag;
            }
        };
        raise(matches!(self.failsafe, Failsafe::Latched(_)), flags.failsafe);
        raise(self.lost, flags.rx_loss);
        raise(self.values[THROTTLE] > personality.low_throttle_us, flags.throttle);
        raise(tilt_rad > SMALL_ANGLE_RAD, flags.angle);
        raise(now_ns < personality.boot_grace_ns, flags.boot_grace);
        raise(now_ns < CALIBRATION_NS, flags.calibrating);

        if self.values[AUX1] < SWITCH_US {
            self.armed = false;
            self.latched = false;
            self.switched_ns = None;
        } else if !self.armed {
            // The switch is up while something stands in the way: it must go down before it counts again.
            if blocks != 0 {
                self.latched = true;
                self.switched_ns = None;
            }
            if !self.latched {
                let since = *self.switched_ns.get_or_insert(now_ns);
                if now_ns - since >= personality.arm_delay_ns {
                    self.armed = true;
                    self.armings += 1;
                }
            }
        }
        if self.latched {
            blocks |= 1 << flags.arm_switch;
        }
        if self.armed {
            // In flight it looks at nothing else any more, but a lost receiver is still told (FACTS 1).
            blocks = u32::from(self.lost) << flags.rx_loss;
        }
        self.blocks = blocks;
    }

    /// How far roll, pitch and yaw are from their centres, together.
    fn deflection_us(&self) -> u16 {
        [ROLL, PITCH, YAW].iter().map(|stick| self.values[*stick].abs_diff(CENTRE_US)).sum()
    }

    /// What the sticks say now, failsafe included: roll, pitch, yaw, throttle.
    pub(crate) fn sticks(&self, settings: &FailsafeSettings) -> [u16; 4] {
        if matches!(self.failsafe, Failsafe::Landing(_)) {
            return [CENTRE_US, CENTRE_US, CENTRE_US, settings.throttle_us];
        }
        [self.values[ROLL], self.values[PITCH], self.values[YAW], self.values[THROTTLE]]
    }

    pub(crate) fn values(&self) -> &[u16; CHANNELS] {
        &self.values
    }
    /// The radio's switch for MSP's sticks is up.
    pub(crate) fn is_overriding(&self) -> bool {
        self.overriding
    }
    /// A radio is the receiver, and not MSP.
    pub(crate) fn is_radio(&self) -> bool {
        self.companion.is_some()
    }
    /// Whether a receiver is known: a frame has come.
    pub(crate) fn is_known(&self) -> bool {
        self.known
    }
    pub(crate) fn is_armed(&self) -> bool {
        self.armed
    }
    pub(crate) fn is_lost(&self) -> bool {
        self.lost
    }
    /// ANGLE is flown by its switch, and by the failsafe's own landing.
    pub(crate) fn is_angle(&self) -> bool {
        self.values[AUX2] >= SWITCH_US || self.is_failsafe()
    }
    pub(crate) fn is_failsafe(&self) -> bool {
        self.failsafe != Failsafe::Idle
    }
    pub(crate) fn blocks(&self) -> u32 {
        self.blocks
    }
    /// How often it was armed.
    pub(crate) fn armings(&self) -> u32 {
        self.armings
    }
}
