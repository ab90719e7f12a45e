//! From what was heard to what the failsafe table asks.

use crate::core::PilotCore;
use crate::senses::age_s;
use control::{Condition, Flags};
use ipc_types::LinkState;

/// A velocity that is less certain is not known, m/s: a hover drifts through a room in ten seconds.
const DRIFTS_M_S: f32 = 0.25;
/// Share of the capacity that is never counted on: the last tenth is where a pack collapses.
const USABLE: f32 = 0.9;
/// Mean speed of a way home, as a share of cruise: doors, corners and braking.
const HOME_PACE: f32 = 0.6;
/// Current of a hover when the controller does not measure it: the whole pack in ten minutes.
const HOVER_HOURS: f32 = 1.0 / 6.0;
/// Time of a landing, seconds.
const LANDING_S: f32 = 15.0;
/// Time for what happens on the way home, seconds: somebody in a door is waited for, it is shut and there is another, and
/// somebody stands on the pad.
const MEETING_S: f32 = 75.0;

impl PilotCore {
    /// Gathers what is so and judges it.
    pub(crate) fn judge(&mut self, now: u64) {
        let before = self.judged;
        let flags = self.flags(now);
        self.judged = self.failsafe.step(now, &flags, self.stage(), &self.config.failsafe);
        self.changed |= (self.judged.cause, self.judged.action) != (before.cause, before.action);
    }

    /// What is so now.
    fn flags(&mut self, now: u64) -> Flags {
        let uncovered = self.home_uncovered(now);
        let silent_s = self.operator_silent_s(now);
        let policy = &self.config.failsafe;
        let airborne = self.airborne();
        let cell = self.cell_volts(now);
        let (silent, sides) = self.shield.silent(now);
        let place_known = self.place_known();
        let searching = self.searching();
        // Who searches has no place to be held by: it is adrift when its velocity is no longer known.
        let held = searching && self.pose.velocity_sigma < DRIFTS_M_S;
        let adrift = self.pose.adrift.filter(|_| !place_known && !held);
        let adrift_s = adrift.map_or(0.0, |since| age_s(Some(since), now));
        let height_silent_s = if airborne { self.height.silent_s(now) } else { 0.0 };
        let linked = self.flight.link == LinkState::Up && age_s(self.flight.at, now) <= policy.link_stale_s;
        let under = |volts: f32| cell.is_some_and(|cell| cell < volts);
        let mut flags = Flags::default();
        flags.set(Condition::NavigationSilent, self.fresh_setpoint(now).is_none());
        flags.set_lasted(Condition::OperatorSilent, silent_s);
        flags.set(Condition::SideSonarSilent, silent > 0);
        flags.set(Condition::AllSonarsSilent, sides > 0 && silent == sides);
        flags.set(Condition::PoseUncertain, !place_known && !searching);
        flags.set(Condition::Searching, searching && airborne);
        // Walls hold a hover that flow does not.
        flags.set(Condition::FewWalls, adrift.is_some() && self.pose.walls < 2);
        flags.set_lasted(Condition::Adrift, adrift_s);
        flags.set(Condition::HomeUncovered, uncovered == Some(true));
        flags.set(Condition::ChargeUnknown, airborne && (uncovered.is_none() || cell.is_none()));
        flags.set(Condition::CellLow, under(policy.return_volts));
        flags.set(Condition::CellEmpty, under(policy.land_volts));
        flags.set_lasted(Condition::HeightSilent, height_silent_s);
        flags.set(Condition::LinkSilent, !linked);
        flags.set(Condition::TiltedOver, self.tilt().magnitude() > policy.tilt_deg.to_radians());
        // An order holds from the moment it is given.
        let ordered_s = if self.operator_land { f32::INFINITY } else { 0.0 };
        flags.set_lasted(Condition::LandOrdered, ordered_s);
        flags
    }

    /// Volts a cell; `None` when the controller does not say, or last said so long ago that it means nothing now.
    pub(crate) fn cell_volts(&self, now: u64) -> Option<f32> {
        let fresh = age_s(self.flight.power_at, now) <= self.config.failsafe.power_stale_s;
        Some(self.flight.cell_volts).filter(|volts| fresh && volts.is_finite())
    }

    /// Whether the charge left does not cover the way home through the corridors and the reserve; `None` when nobody
    /// can tell. While the place is not known it is as far as it was last.
    fn home_uncovered(&mut self, now: u64) -> Option<bool> {
        if self.place_known() {
            let here = self.motion.place();
            self.home_m = self.way_home.as_ref().and_then(|way| way.length_m(here)).or(self.home_m);
        }
        let drawn = self.flight.drawn_mah;
        let fresh = age_s(self.flight.power_at, now) <= self.config.failsafe.power_stale_s;
        let length = if self.searching() {
            // It may be anywhere.
            self.way_home.as_ref().and_then(control::WayHome::longest_m)
        } else {
            self.home_m
        };
        let length = length.filter(|_| fresh && drawn.is_finite())?;
        let measured = self.flight.amps > 0.5;
        let amps = if measured { self.flight.amps } else { self.craft.capacity_mah * 1e-3 / HOVER_HOURS };
        let seconds = length / (HOME_PACE * self.craft.cruise_m_s).max(0.05) + MEETING_S + LANDING_S;
        let needed = amps * 1000.0 * seconds / 3600.0 * (1.0 + self.config.failsafe.home_reserve);
        Some(USABLE * self.craft.capacity_mah - drawn < needed)
    }
}
