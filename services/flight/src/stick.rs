//! Sticks as the controller reads them.
//!
//! The pilot speaks the law of Betaflight from 4.5 on ([`control::stick`]). Other firmwares turn a stick into another
//! tilt: here a roll, pitch or yaw channel becomes the one that asks *their* law for the same. Each law is that of the
//! firmware's default rates, which the installer leaves as they are.

use crate::said::Identity;
use crate::wish::{CENTRE_US, HIGH_US, LOW_US, PITCH, ROLL, YAW};
use control::stick;

/// How far halving is driven: 500 us over 2^14 is a thirtieth of a microsecond.
const HALVINGS: u32 = 14;

/// How a firmware reads its sticks. `x` is (channel - 1500) / 500.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StickLaw {
    /// As the pilot means it: Betaflight from 4.5 on (FACTS 1), and whoever has not said yet who it is.
    Same,
    /// Tilt 55 x degrees; turn rate 200 x / (1 - 0.7 |x|) degrees a second: Betaflight before 4.3
    /// (`level_limit`, rates 1.00 and 0.70; betaflight: src/main/flight/pid.c, src/main/fc/fc_rc.c of 2017).
    Linear,
    /// Tilt 30 degrees, turn rate 200 degrees a second at full stick, by x (1 - e + e x^2) with e = 0.7 for the tilt and
    /// 0.2 for the turn: INAV (src/main/fc/settings.yaml: `max_angle_inclination_rll`, `rc_expo`, `yaw_rate`,
    /// `rc_yaw_expo`).
    Expo,
}

impl StickLaw {
    /// By who the controller says it is.
    #[must_use]
    pub fn of(identity: &Identity) -> Self {
        match (&identity.variant, identity.version) {
            (b"INAV", _) => Self::Expo,
            (b"BTFL", [major, minor, ..]) if (1..4).contains(&major) || major == 4 && minor < 3 => {
                Self::Linear
            }
            _ => Self::Same,
        }
    }

    /// Turns roll, pitch and yaw into what this firmware understands the same way.
    pub(crate) fn translate(self, channels_us: &mut [u16; 18]) {
        if self == Self::Same {
            return;
        }
        for axis in [ROLL, PITCH, YAW] {
            let us = channels_us[axis];
            if us != CENTRE_US {
                channels_us[axis] = if axis == YAW { self.yaw(us) } else { self.tilt(us) };
            }
        }
    }

    fn tilt(self, us: u16) -> u16 {
        let degrees = stick::angle_of(f32::from(us)).to_degrees();
        match self {
            Self::Same => us,
            Self::Linear => channel(degrees / 55.0),
            Self::Expo => channel(unexpo(degrees / 30.0, 0.7)),
        }
    }

    fn yaw(self, us: u16) -> u16 {
        // Clockwise, as the stick turns.
        let degrees_s = -stick::yaw_rate_of(f32::from(us)).to_degrees();
        match self {
            Self::Same => us,
            Self::Linear => channel(degrees_s / (200.0 + 0.7 * degrees_s.abs())),
            Self::Expo => channel(unexpo(degrees_s / 200.0, 0.2)),
        }
    }
}

fn channel(x: f32) -> u16 {
    (f32::from(CENTRE_US) + 500.0 * x).round().clamp(LOW_US.into(), HIGH_US.into()) as u16
}

/// The stick whose x (1 - e + e x^2) is `y`; a full one where `y` is more than that gives.
fn unexpo(y: f32, expo: f32) -> f32 {
    let (mut low, mut high) = (0.0_f32, 1.0_f32);
    for _ in 0..HALVINGS {
        let x = 0.5 * (low + high);
        if x * (1.0 - expo + expo * x * x) < y.abs() {
            low = x;
        } else {
            high = x;
        }
    }
    (0.5 * (low + high)).copysign(y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(variant: [u8; 4], version: [u8; 4]) -> StickLaw {
        StickLaw::of(&Identity { variant, version, api: None })
    }

    #[test]
    fn who_reads_sticks_how() {
        assert_eq!(law([0; 4], [0; 4]), StickLaw::Same);
        for version in [[4, 3, 0, 0], [4, 5, 6, 0], [25, 12, 6, 0], [26, 12, 0, 0]] {
            assert_eq!(law(*b"BTFL", version), StickLaw::Same);
        }
        assert_eq!(law(*b"BTFL", [3, 2, 5, 0]), StickLaw::Linear);
        assert_eq!(law(*b"BTFL", [4, 2, 11, 0]), StickLaw::Linear);
        assert_eq!(law(*b"INAV", [9, 1, 0, 0]), StickLaw::Expo);
    }

    #[test]
    fn the_same_tilt_and_turn_by_every_law() {
        for us in 1000..=2000_u16 {
            let mut old = [us; 18];
            StickLaw::Linear.translate(&mut old);
            let wanted = stick::angle_of(us.into()).to_degrees();
            let x = (f32::from(old[ROLL]) - 1500.0) / 500.0;
            // Half a microsecond is 0.06 degrees.
            assert!((55.0 * x - wanted.clamp(-55.0, 55.0)).abs() < 0.06, "{us}: {wanted}");
            let wanted = -stick::yaw_rate_of(us.into()).to_degrees();
            let x = (f32::from(old[YAW]) - 1500.0) / 500.0;
            let rate = 200.0 * x / (1.0 - 0.7 * x.abs());
            // ... and near the stop 2.2 degrees a second.
            assert!((rate - wanted.clamp(-666.6, 666.6)).abs() < 2.4, "{us}: {wanted}, {rate}");

            let mut inav = [us; 18];
            StickLaw::Expo.translate(&mut inav);
            let wanted = stick::angle_of(us.into()).to_degrees();
            let x = (f32::from(inav[PITCH]) - 1500.0) / 500.0;
            let angle = 30.0 * x * (0.3 + 0.7 * x * x);
            assert!((angle - wanted.clamp(-30.0, 30.0)).abs() < 0.08, "{us}: {wanted}, {angle}");
            assert_eq!((old[2], inav[4]), (us, us), "throttle and switches stay");
        }
        let mut same = [1613; 18];
        StickLaw::Same.translate(&mut same);
        assert_eq!(same, [1613; 18]);
    }
}
