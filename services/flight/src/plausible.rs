//! Whether an attitude can be the aircraft's, and a reading its battery's.
//!
//! A check byte of eight bits lets one damaged frame in 256 pass, and version 1's XOR every pair of flipped bits that
//! stand at the same place of two bytes: on a bad line that is an attitude of nobody every half a minute.

use msp::messages::{AnalogReply, AttitudeReply};

/// Faster the aircraft does not turn, degrees a second: twice what full sticks ask for at default rates.
const FASTEST: f32 = 400.0;
/// What two attitudes may differ by beside that: noise, and how well their time is known (15 ms of a quick turn).
const MARGIN: f32 = 5.0;
/// An attitude older than this says nothing about the next one, nanoseconds.
const OLD_NS: u64 = 500_000_000;
/// Answers come every 33 ms: after this long two were lost on the way, nanoseconds.
const OVERDUE_NS: u64 = 100_000_000;

/// Compares each attitude with the one before. One that is too far off is held back, and believed when the next one
/// agrees with it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Attitudes {
    believed: Option<(u64, AttitudeReply)>,
    doubted: Option<(u64, AttitudeReply)>,
    /// When the newest that is believed was read.
    sampled_ns: u64,
}

impl Attitudes {
    /// When an attitude was read that came `now`, by all that is known of its way at `read_ns`; `None` for one that is not
    /// believed. The order of the answers is known better than their age.
    pub(crate) fn date(&mut self, now: u64, read_ns: u64, reply: AttitudeReply) -> Option<u64> {
        if !self.judge(now, reply) {
            return None;
        }
        self.sampled_ns = read_ns.max(self.sampled_ns + 1);
        Some(self.sampled_ns)
    }

    /// Whether the last is so old that the next must come: asked for without the accelerometer it is half as long there
    /// and back, and on a line that loses one byte in a hundred it fails half as often.
    pub(crate) fn overdue(&self, now: u64) -> bool {
        self.believed.is_some_and(|(at, _)| now.saturating_sub(at) > OVERDUE_NS)
    }

    /// When the last that is believed came.
    pub(crate) fn seen_ns(&self) -> Option<u64> {
        self.believed.map(|(at, _)| at)
    }

    fn judge(&mut self, now: u64, reply: AttitudeReply) -> bool {
        let possible = reply.roll_decidegrees.unsigned_abs() <= 1800
            && reply.pitch_decidegrees.unsigned_abs() <= 1800
            && (0..=360).contains(&reply.yaw_degrees);
        if !possible {
            return false;
        }
        let recent =
            |known: Option<(u64, AttitudeReply)>| known.filter(|(at, _)| now.saturating_sub(*at) < OLD_NS);
        let follows = |(at, before): (u64, AttitudeReply)| near(now.saturating_sub(at), &before, &reply);
        let believe = recent(self.believed).is_none_or(follows) || recent(self.doubted).is_some_and(follows);
        if believe {
            (self.believed, self.doubted) = (Some((now, reply)), None);
        } else {
            self.doubted = Some((now, reply));
        }
        believe
    }
}

/// What two readings of the battery may differ by, volts, amperes and mAh: full throttle sags a pack by a volt, draws 20 A
/// more than a hover, and 30 mAh in the time of a few answers that are lost.
const SAGS_V: f32 = 1.5;
const DRAWS_CENTIAMPS: u16 = 2_000;
const DRAWS_MAH: u16 = 100;

/// Compares each reading of the battery with the one before: one that is nobody's would send the drone home, and nothing
/// fills a battery in flight. One that is too far off is held back, and believed when the next one agrees with it: a cell
/// that is lost is seen half a second later.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Batteries {
    believed: Option<AnalogReply>,
    doubted: Option<AnalogReply>,
}

impl Batteries {
    pub(crate) fn judge(&mut self, reply: &AnalogReply) -> bool {
        let follows = |before: &AnalogReply| {
            (before.volts() - reply.volts()).abs() <= SAGS_V
                && before.centiamps.abs_diff(reply.centiamps) <= DRAWS_CENTIAMPS
                && before.drawn_mah.abs_diff(reply.drawn_mah) <= DRAWS_MAH
        };
        let believe =
            self.believed.as_ref().is_none_or(follows) || self.doubted.as_ref().is_some_and(follows);
        if believe {
            (self.believed, self.doubted) = (Some(*reply), None);
        } else {
            self.doubted = Some(*reply);
        }
        believe
    }
}

/// Whether one can become the other in this time.
fn near(passed_ns: u64, from: &AttitudeReply, to: &AttitudeReply) -> bool {
    let most = FASTEST * passed_ns as f32 * 1e-9 + MARGIN;
    let apart = |from: f32, to: f32| {
        let turned = (from - to).abs() % 360.0;
        turned.min(360.0 - turned)
    };
    let tilt = |from: i16, to: i16| apart(f32::from(from) * 0.1, f32::from(to) * 0.1);
    tilt(from.roll_decidegrees, to.roll_decidegrees) <= most
        && tilt(from.pitch_decidegrees, to.pitch_decidegrees) <= most
        && apart(from.yaw_degrees.into(), to.yaw_degrees.into()) <= most
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn reply(roll_decidegrees: i16, pitch_decidegrees: i16, yaw_degrees: i16) -> AttitudeReply {
        AttitudeReply { roll_decidegrees, pitch_decidegrees, yaw_degrees }
    }

    #[test]
    fn a_single_jump_is_held_back_and_a_second_that_agrees_is_not() {
        let mut plausible = Attitudes::default();
        assert!(plausible.judge(0, reply(10, -20, 359)));
        assert!(
            plausible.judge(33 * MS, reply(100, 20, 2)),
            "9 degrees in a thirtieth of a second, and north"
        );
        assert!(!plausible.judge(66 * MS, reply(100, 420, 2)));
        assert!(plausible.judge(99 * MS, reply(110, 20, 3)), "it was nobody's");
        assert!(!plausible.judge(132 * MS, reply(110, 20, 90)));
        assert!(plausible.judge(165 * MS, reply(110, 20, 92)), "it has been turned");
        assert!(plausible.judge(700 * MS, reply(-900, 20, 92)), "nothing is known of where it was");
    }

    #[test]
    fn one_reading_of_nobodys_battery_is_held_back_and_a_lost_cell_is_not() {
        let reading = |decivolts: u8, drawn_mah: u16| AnalogReply {
            decivolts,
            drawn_mah,
            rssi: 0,
            centiamps: 900,
            centivolts: None,
        };
        let mut batteries = Batteries::default();
        assert!(batteries.judge(&reading(162, 400)) && batteries.judge(&reading(150, 404)));
        assert!(!batteries.judge(&reading(150, 33_172)), "a bit that flipped");
        let gushing = AnalogReply { centiamps: 25_860, ..reading(150, 406) };
        assert!(!batteries.judge(&gushing), "and the sign of another");
        assert!(batteries.judge(&reading(151, 408)), "it was nobody's");
        assert!(!batteries.judge(&reading(22, 410)));
        assert!(batteries.judge(&reading(151, 412)));
        assert!(!batteries.judge(&reading(112, 416)));
        assert!(batteries.judge(&reading(111, 420)), "a cell is gone");
        assert!(batteries.judge(&reading(110, 424)));
    }

    #[test]
    fn what_no_controller_says_is_never_believed() {
        let mut plausible = Attitudes::default();
        for bad in [reply(1801, 0, 0), reply(0, i16::MIN, 0), reply(0, 0, 361), reply(0, 0, -1)] {
            for at in 0..5 {
                assert!(!plausible.judge(at * 33 * MS, bad), "{bad:?}");
            }
        }
    }
}
