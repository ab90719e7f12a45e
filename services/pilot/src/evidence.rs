//! From what was heard to the evidence of the failsafe table.

use crate::core::PilotCore;
use crate::senses::age_s;
use control::{Action, Evidence, judge};
use ipc_types::{LinkState, Phase};

/// What comes and goes with single messages must not restart a clock, seconds.
const CLEAR_S: f32 = 0.5;
/// Volts under load jump; a battery that recovered for so long has recovered, seconds.
const CLEAR_VOLTS_S: f32 = 3.0;
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
    /// Gathers the evidence and judges it.
    pub(crate) fn judge(&mut self, now: u64) {
        let before = (self.judged.cause, self.judged.action);
        let evidence = self.evidence(now);
        self.judged = judge(&evidence, &self.config.failsafe);
        if (self.judged.cause, self.judged.action) != before {
            self.changed = true;
            self.failsafe_since_ns = if self.judged.action == Action::None { 0 } else { now };
        }
    }

    /// For how long what has been so.
    pub(crate) fn evidence(&mut self, now: u64) -> Evidence {
        let policy = self.config.failsafe;
        let fresh_setpoint = self.fresh_setpoint(now).is_some();
        let (silent, sides) = self.shield.silent(now);
        let place_known = self.place_known();
        let searching = self.searching();
        let cell = self.cell_volts(now);
        let uncovered = self.home_uncovered(now);
        let link = age_s(self.flight.at, now) > 1.0 || self.flight.link != LinkState::Up;
        let tilted = self.tilt().magnitude() > policy.tilt_deg.to_radians();
        // Who searches has no place to be held by: it is adrift when its velocity is no longer known.
        let held = searching && self.pose.velocity_sigma < DRIFTS_M_S;
        let adrift = self.pose.adrift.filter(|_| !place_known && !held);
        // Walls hold a hover that flow does not.
        let few_walls = adrift.is_some() && self.pose.walls < 2;
        let airborne = self.airborne();
        let autonomous = self.phase == Phase::Autonomous;
        let t = &mut self.timers;
        Evidence {
            airborne,
            autonomous,
            navigation_silent_s: t.navigation.update(now, autonomous && !fresh_setpoint, 0.0),
            side_sonar_silent_s: t.side.update(now, silent > 0, CLEAR_S),
            all_sonars_silent_s: t.all_sides.update(now, sides > 0 && silent == sides, 0.0),
            pose_uncertain_s: t.pose.update(now, !place_known && !searching, CLEAR_S),
            searching_s: t.searching.update(now, searching && airborne, CLEAR_S),
            few_walls_s: t.walls.update(now, few_walls, CLEAR_S),
            adrift_s: adrift.map_or(0.0, |since| age_s(Some(since), now)),
            home_uncovered_s: t.home.update(now, uncovered == Some(true), CLEAR_VOLTS_S),
            charge_unknown_s: t.charge.update(
                now,
                airborne && (uncovered.is_none() || cell.is_none()),
                CLEAR_S,
            ),
            cell_low_s: t.low.update(now, cell.is_some_and(|v| v < policy.return_volts), CLEAR_VOLTS_S),
            cell_empty_s: t.empty.update(now, cell.is_some_and(|v| v < policy.land_volts), CLEAR_S),
            height_silent_s: if airborne { self.height.silent_s(now) } else { 0.0 },
            link_silent_s: t.link.update(now, link, 0.2),
            tilt_s: t.tilt.update(now, tilted, 0.05),
            operator: self.operator_land.then_some(Action::Land),
        }
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

    /// What would happen if this were lost now.
    pub(crate) fn what_if(&self, change: impl FnOnce(&mut Evidence)) -> Action {
        let mut evidence = Evidence { airborne: self.airborne(), ..Evidence::default() };
        change(&mut evidence);
        judge(&evidence, &self.config.failsafe).action
    }
}
